//! Pages: every relative link in the repository's Markdown leads to a file and a heading that exist.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::files;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Markdown files of the repository; generated folders are left out.
fn pages() -> Vec<PathBuf> {
    let folders = [
        "docs",
        "data/demo",
        "data/navion",
        "data/simulation",
        "pipelines",
    ]
    .map(|f| root().join(f));
    let is_page = |path: &PathBuf| path.extension().is_some_and(|e| e == "md");
    let mut pages: Vec<PathBuf> = folders
        .iter()
        .flat_map(|folder| files(folder))
        .filter(is_page)
        .collect();
    pages.extend(
        [
            "README.md",
            "ARCHITECTURE.md",
            "CHANGELOG.md",
            "reports/README.md",
        ]
        .map(|p| root().join(p)),
    );
    pages
}

/// Targets of the inline links of a page, outside of code blocks.
fn links(text: &str) -> Vec<String> {
    let mut links = Vec::new();
    for (k, prose) in text.split("\n```").enumerate() {
        if k % 2 == 0 {
            let targets = prose.split("](").skip(1);
            links.extend(targets.filter_map(|rest| Some(rest.split_once(')')?.0.to_owned())));
        }
    }
    links
}

/// Anchor of a heading as GitHub makes it.
fn anchor(heading: &str) -> String {
    heading
        .trim()
        .to_lowercase()
        .chars()
        .filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

fn anchors(text: &str) -> Vec<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    headings
        .map(|line| anchor(line.trim_start_matches('#')))
        .collect()
}

#[test]
fn every_link_between_pages_leads_somewhere() {
    let pages = pages();
    assert!(pages.len() > 10, "{pages:?}");
    let mut dead = Vec::new();
    for page in &pages {
        let text = fs::read_to_string(page).unwrap();
        for link in links(&text) {
            if link.starts_with("http") {
                continue;
            }
            let (path, heading) = link.split_once('#').unwrap_or((&link, ""));
            let target = if path.is_empty() {
                page.clone()
            } else {
                page.parent().unwrap().join(path)
            };
            let leads = target.exists()
                && (heading.is_empty()
                    || anchors(&fs::read_to_string(&target).unwrap())
                        .iter()
                        .any(|a| a == heading));
            if !leads {
                dead.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(dead.is_empty(), "{dead:#?}");
}

#[test]
fn links_and_anchors_are_read_as_github_reads_them() {
    let text = "See [a](x.md#one) and [b](y.md).\n```\n[c](no.md)\n```\n[d](z.md)";
    assert_eq!(links(text), ["x.md#one", "y.md", "z.md"]);
    assert_eq!(
        anchor(" Intervals with `hold: evidence`"),
        "intervals-with-hold-evidence"
    );
}
