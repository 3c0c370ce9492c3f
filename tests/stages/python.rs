//! Python: the blocks of docs/python.md on the tables of the demonstration. A block whose packages are missing
//! is skipped; with `CI=true` one at least must run.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::{demo, note_skip, skip};

/// Blocks of Python in a page.
fn blocks(page: &str) -> Vec<&str> {
    let blocks = page.split("```python\n").skip(1);
    blocks.filter_map(|rest| rest.split("```").next()).collect()
}

/// Modules that a block imports.
fn modules(block: &str) -> Vec<&str> {
    let imports = block
        .lines()
        .filter_map(|line| line.strip_prefix("import "));
    imports
        .filter_map(|rest| rest.split_whitespace().next())
        .collect()
}

#[test]
fn the_blocks_of_the_page_run_on_published_tables() {
    let python = std::env::var("HARVEST_PYTHON").unwrap_or_else(|_| "python3".into());
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/python.md");
    let page = fs::read_to_string(page).unwrap();
    let blocks = blocks(&page);
    assert!(blocks.len() >= 5, "{}", blocks.len());
    let folder = tempfile::tempdir().unwrap();
    for (path, bytes) in &demo().bytes {
        let path = folder.path().join(path.file_name().unwrap());
        fs::write(path, bytes).unwrap();
    }
    let mut ran_any = false;
    for block in blocks {
        let import = format!("import {}", modules(block).join(", "));
        match Command::new(&python).args(["-c", &import]).output() {
            Ok(tried) if tried.status.success() => {}
            _ => {
                // Packages of the analyst's choice: no machine must have all of them.
                note_skip(&format!("docs/python.md: {python} cannot `{import}`"));
                continue;
            }
        }
        let ran = Command::new(&python)
            .current_dir(folder.path())
            .args(["-c", block])
            .output()
            .unwrap();
        ran_any = true;
        let error = String::from_utf8_lossy(&ran.stderr);
        assert!(ran.status.success(), "{block}\n{error}");
        let printed = String::from_utf8_lossy(&ran.stdout);
        let drawn = folder.path().join("trend.svg").is_file();
        assert!(
            printed.lines().count() > 5 || drawn,
            "{block}\nprinted {printed}"
        );
    }
    if !ran_any {
        skip(&format!("{python} has the packages of no block"));
    }
}
