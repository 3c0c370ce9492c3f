//! The house: modules use only what stands above them in `src/lib.rs`, what the analyst decides is
//! nowhere in the code, and disk and terminal have one place each.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::support::files;

/// A source file: its module at the top level, its path, and its lines that are code and no test.
struct Source {
    module: String,
    path: String,
    code: Vec<(usize, String)>,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All sources but the crate's roots and files of tests alone.
fn sources() -> Vec<Source> {
    let src = root().join("src");
    let mut found = Vec::new();
    for file in files(&src) {
        let path = file
            .strip_prefix(&src)
            .unwrap()
            .to_string_lossy()
            .replace('\\', "/");
        let name = file.file_name().unwrap().to_string_lossy();
        let is_rust = file.extension().is_some_and(|e| e == "rs");
        if !is_rust
            || ["tests.rs", "campaign_fixture.rs"].contains(&&*name)
            || path.contains("/tests/")
            || ["lib.rs", "main.rs", "build.rs"].contains(&&*path)
        {
            continue;
        }
        let module = path.split(['/', '.']).next().unwrap().to_owned();
        found.push(Source {
            module,
            code: code(&fs::read_to_string(&file).unwrap()),
            path,
        });
    }
    found
}

/// The numbered lines of a file without comments, as far as its module of tests.
fn code(text: &str) -> Vec<(usize, String)> {
    let lines: Vec<&str> = text.lines().collect();
    let tests = lines
        .windows(2)
        .position(|w| w[0].trim() == "#[cfg(test)]" && w[1].trim_end().ends_with('{'));
    let code = lines.iter().take(tests.unwrap_or(lines.len())).enumerate();
    code.filter(|(_, line)| !line.trim_start().starts_with("//"))
        .map(|(i, line)| (i + 1, line.split(" // ").next().unwrap().to_owned()))
        .collect()
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c| !is_word(c)).filter(|w| !w.is_empty())
}

/// The top-level modules that follow each `crate::` in a text: one name, or the heads of a braced
/// list.
fn used(text: &str) -> BTreeSet<String> {
    let mut modules = BTreeSet::new();
    for rest in text.split("crate::").skip(1) {
        match rest.strip_prefix('{') {
            Some(list) => {
                let mut depth = 0;
                let mut head = String::new();
                for c in list.chars() {
                    match c {
                        '}' if depth == 0 => break,
                        '{' => depth += 1,
                        '}' => depth -= 1,
                        ',' if depth == 0 => {
                            modules.extend(
                                words(&std::mem::take(&mut head)).next().map(str::to_owned),
                            );
                        }

                        _ => head.push(c),
                    }
                }
                modules.extend(words(&head).next().map(str::to_owned));
            }
            None => modules.extend(words(rest).next().map(str::to_owned)),
        }
    }
    modules
}

#[test]
fn a_list_of_uses_is_read_to_its_heads() {
    let used = used(
        "use crate::{compare, estimate::{Basis, Fit},\n trend};\nuse crate::units::Unit; crate::error::io()",
    );
    assert_eq!(
        used.into_iter().collect::<Vec<_>>(),
        ["compare", "error", "estimate", "trend", "units"]
    );
}

#[test]
fn a_module_uses_only_modules_listed_above_it() {
    let lib = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    let order: Vec<&str> = lib
        .lines()
        .filter_map(|l| l.strip_prefix("pub mod ")?.strip_suffix(';'))
        .collect();
    assert!(order.len() > 10, "{order:?}");
    let rank = |module: &str| order.iter().position(|m| *m == module);
    let mut wrong = Vec::new();
    for source in sources() {
        let own =
            rank(&source.module).unwrap_or_else(|| panic!("lib.rs does not list {}", source.path));
        let text = source
            .code
            .iter()
            .map(|(_, line)| line.as_str())
            .collect::<Vec<_>>()
            .join("\n");
        for module in used(&text) {
            if rank(&module).is_none_or(|other| other > own) {
                wrong.push(format!("{} uses `{module}`", source.path));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// What `key:` says in a YAML file, on every line that has it.
fn said(file: &Path, key: &str) -> Vec<String> {
    let text = fs::read_to_string(file).unwrap();
    let value = |line: &str| {
        let (_, rest) = line.split_once(&format!("{key}: "))?;
        let end = rest.find([',', '}', '#']).unwrap_or(rest.len());
        Some(rest[..end].trim().trim_matches('"').to_owned())
    };
    text.lines()
        .filter(|l| !l.trim_start().starts_with('#'))
        .filter_map(value)
        .collect()
}

#[test]
fn no_name_that_the_analyst_gives_stands_in_the_code() {
    let pipeline = root().join("pipelines/harv");
    let mut names: BTreeSet<String> = said(&pipeline.join("model.yaml"), "name")
        .into_iter()
        .collect();
    assert!(names.len() > 50, "{names:?}");
    for class in files(&pipeline.join("maneuvers")) {
        names.extend(said(&class, "class"));
    }
    names.insert("HARV".to_owned());
    let mut wrong = Vec::new();
    for source in sources() {
        for (number, line) in &source.code {
            wrong.extend(
                words(line)
                    .filter(|w| names.contains(*w))
                    .map(|w| format!("{}:{number}: `{w}`", source.path)),
            );
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn only_the_store_touches_the_disk_and_only_the_command_line_prints() {
    let mut wrong = Vec::new();
    for source in sources() {
        for (number, line) in &source.code {
            let disk = [
                "std::fs",
                "fs::",
                "File::open",
                "File::create",
                "tempfile",
                "std::net",
            ];
            let prints = ["println!", "print!", "dbg!", "io::stdout", "io::stderr"];
            let touches = disk.iter().any(|word| line.contains(word)) && source.module != "store";
            let speaks = prints.iter().any(|word| line.contains(word)) && source.module != "cli";
            if touches || speaks {
                wrong.push(format!("src/{}:{number}: {}", source.path, line.trim()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_file_says_first_what_it_is() {
    for file in files(&root().join("src"))
        .into_iter()
        .chain(files(&root().join("tests")))
    {
        if file.extension().is_some_and(|e| e == "rs") {
            let text = fs::read_to_string(&file).unwrap();
            assert!(text.starts_with("//! "), "{}", file.display());
        }
    }
}
