//! The report in a browser: a headless Chromium opens it wide and narrow with its script at work,
//! loads nothing, reports no error, and prints it. Skipped without Chromium, but in CI.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::{demo, skip};

/// Chromium among the programs of this machine.
fn chromium() -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let mut candidates =
        std::env::split_paths(&folders).flat_map(|folder| names.map(|name| folder.join(name)));
    candidates.find(|path| path.is_file())
}

/// Outcome of opening a page: the page after its script, and the messages of the console.
struct Opened {
    page: String,
    console: Vec<String>,
}

/// Opens a file without a network; a browser that does not end within two minutes is ended.
fn open(chromium: &Path, folder: &Path, page: &Path, options: &[&str]) -> Opened {
    let (out, err) = (folder.join("out"), folder.join("err"));
    let file = |path: &Path| Stdio::from(std::fs::File::create(path).unwrap());
    let mut child = Command::new(chromium)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--enable-logging=stderr",
            "--virtual-time-budget=20000",
        ])
        .args([
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--force-prefers-reduced-motion",
        ])
        .arg(format!(
            "--user-data-dir={}",
            folder.join("profile").display()
        ))
        .args(options)
        .arg(format!("file://{}", page.display()))
        .stdout(file(&out))
        .stderr(file(&err))
        .spawn()
        .unwrap();
    let started = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if started.elapsed() > Duration::from_mins(2) {
            child.kill().unwrap();
        }
        assert!(
            started.elapsed() < Duration::from_mins(3),
            "the browser did not come to an end"
        );
        std::thread::sleep(Duration::from_millis(50));
    }
    let said = String::from_utf8_lossy(&std::fs::read(&err).unwrap()).into_owned();
    let console = said
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .map(str::to_owned)
        .collect();
    Opened {
        page: std::fs::read_to_string(&out).unwrap(),
        console,
    }
}

/// Script that checks what is visible on the page and writes the results into its title.
const QUESTIONS: &str = r"
addEventListener('load', function () {
  var all = function (s) { return Array.from(document.querySelectorAll(s)); }, said = [];
  var seen = function (e) { var box = e.getBoundingClientRect(); return box.width !== 0 ? box.height !== 0 : false; };
  said.push('loaded ' + performance.getEntriesByType('resource').length);
  said.push('wide ' + (document.documentElement.scrollWidth > innerWidth));
  var figures = all('svg[role=img]');
  said.push('figures ' + figures.length + ' empty ' + figures.filter(function (f) { return !f.querySelector('path,line'); }).length);
  var first = document.querySelector('.derivative svg'); said.push('drawn ' + seen(first));
  var table = document.querySelector('#maneuvers ~ .scroll table'), head = table.tHead.rows[0].cells[5];
  head.querySelector('button').click(); head.querySelector('button').click();
  var column = Array.from(table.tBodies[0].rows).map(function (r) { return parseFloat(r.cells[5].textContent); });
  said.push('sorted ' + column.every(function (v, i) { return i === 0 ? true : !(v > column[i - 1]); }));
  var box = document.querySelector('#classes input'), own = all('[data-class=' + box.value + ']');
  said.push('before ' + own.every(seen));
  box.click(); said.push('after ' + own.some(seen));
  document.title = said.join('; ');
});
";

#[test]
fn a_browser_shows_the_report_wide_and_narrow_without_errors() {
    let Some(chromium) = chromium() else {
        return skip("no Chromium among the programs of this machine");
    };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("asked.html");
    let asked = demo()
        .report
        .replace("</body>", &format!("<script>{QUESTIONS}</script></body>"));
    std::fs::write(&page, asked).unwrap();
    for size in ["--window-size=1400,1000", "--window-size=500,900"] {
        let seen = open(&chromium, folder.path(), &page, &["--dump-dom", size]);
        assert!(seen.console.is_empty(), "{size}: {:?}", seen.console);
        let title = seen
            .page
            .split_once("<title>")
            .and_then(|(_, rest)| rest.split_once("</title>"))
            .unwrap()
            .0;
        assert!(
            title.starts_with("loaded 0; wide false; figures "),
            "{size}: {title}"
        );
        assert!(
            title.ends_with(" empty 0; drawn true; sorted true; before true; after false"),
            "{size}: {title}"
        );
    }
}

#[test]
fn a_browser_prints_the_report() {
    let Some(chromium) = chromium() else {
        return skip("no Chromium among the programs of this machine");
    };
    let folder = tempfile::tempdir().unwrap();
    let (page, printed) = (
        folder.path().join("report.html"),
        folder.path().join("printed.pdf"),
    );
    std::fs::write(&page, &demo().report).unwrap();
    let option = format!("--print-to-pdf={}", printed.display());
    let seen = open(
        &chromium,
        folder.path(),
        &page,
        &[&option, "--no-pdf-header-footer"],
    );
    assert!(seen.console.is_empty(), "{:?}", seen.console);
    let pages = lopdf::Document::load(&printed).unwrap().get_pages().len();
    let sheets = demo().report.matches("class=\"maneuver new-page\"").count();
    assert!(pages > sheets, "{pages} pages for {sheets} sheets");
}
