//! Rules of the house: modules use only what stands above them in `src/lib.rs`, files form no
//! circles, what the analyst decides is nowhere in the code, disk and terminal have one place each,
//! and comments read as the style has it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use crate::sources::{Source, Tree, circles, root, source, sources, words};
use crate::support::files;

/// Numbered lines of a text.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().map(|(at, line)| (at + 1, line))
}

/// Files that use each other in a small tree, given by path and text.
fn uses(files: &[(&str, &str)]) -> BTreeMap<String, BTreeSet<String>> {
    let sources: Vec<Source> = files
        .iter()
        .map(|(path, text)| source((*path).to_owned(), text))
        .collect();
    let tree = Tree::of(&sources);
    tree.uses()
        .into_iter()
        .map(|(file, used)| {
            (
                file.to_owned(),
                used.into_iter().map(str::to_owned).collect(),
            )
        })
        .collect()
}

#[test]
fn paths_lead_to_the_file_that_defines_the_item() {
    let used = uses(&[
        (
            "a/mod.rs",
            "mod leaf;\npub use leaf::Leaf;\npub struct Own;\nuse crate::b::{self, Deep as D};",
        ),
        ("a/leaf.rs", "pub struct Leaf; // use super::Own\n"),
        ("b.rs", "use crate::a::{Leaf, Own};\npub struct Deep;"),
        (
            "c.rs",
            "use crate::a;\nfn f() { a::Own; serde::de::x(); \"crate::b::Deep\"; }",
        ),
    ]);
    let of = |file: &str| used[file].iter().map(String::as_str).collect::<Vec<_>>();
    assert_eq!(of("a/mod.rs"), ["a/leaf.rs", "b.rs"]);
    assert!(of("a/leaf.rs").is_empty());
    assert_eq!(of("b.rs"), ["a/leaf.rs", "a/mod.rs"]);
    assert_eq!(of("c.rs"), ["a/mod.rs"]);
}

#[test]
fn a_circle_is_found_with_all_its_files() {
    let used = uses(&[
        (
            "a/mod.rs",
            "mod leaf;\nmod other;\npub struct Shared;\nuse leaf::Leaf;",
        ),
        ("a/leaf.rs", "use super::other::f;\npub struct Leaf;"),
        ("a/other.rs", "fn f() { super::Shared; }"),
        ("b.rs", "use crate::a::Shared;"),
    ]);
    let borrowed = used
        .iter()
        .map(|(file, used)| (file.as_str(), used.iter().map(String::as_str).collect()))
        .collect();
    assert_eq!(
        circles(&borrowed),
        [BTreeSet::from(["a/leaf.rs", "a/mod.rs", "a/other.rs"])]
    );
}

#[test]
fn code_below_a_module_of_tests_is_seen_and_tests_are_not() {
    let text = "fn a() {}\n#[cfg(test)]\nmod tests {\n    fn b() { '{'; \"}\"; }\n}\nfn c<'a>() { /* d */ }\n";
    let source = source("x.rs".to_owned(), text);
    let seen: Vec<&str> = words(&source.bare).collect();
    assert_eq!(seen, ["fn", "a", "fn", "c", "a"]);
}

#[test]
fn files_form_no_circles() {
    let tree = Tree::of(sources());
    let uses = tree.uses();
    assert!(uses.values().map(BTreeSet::len).sum::<usize>() > 300);
    let mut found = String::new();
    for circle in circles(&uses) {
        writeln!(found, "{} files:", circle.len()).unwrap();
        for file in &circle {
            let others: Vec<&str> = uses[file].intersection(&circle).copied().collect();
            writeln!(found, "  {file} uses {}", others.join(", ")).unwrap();
        }
    }
    assert!(found.is_empty(), "\n{found}");
}

#[test]
fn a_module_uses_only_modules_listed_above_it() {
    let lib = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    let order: Vec<&str> = lib
        .lines()
        .filter_map(|l| {
            l.trim_start_matches("pub ")
                .strip_prefix("mod ")?
                .strip_suffix(';')
        })
        .collect();
    assert!(order.len() > 10, "{order:?}");
    let rank = |module: &str| order.iter().position(|m| *m == module);
    let tree = Tree::of(sources());
    let module = |file: &str| file.split(['/', '.']).next().unwrap().to_owned();
    let mut wrong = Vec::new();
    for (file, used) in tree.uses() {
        let own = rank(&module(file)).unwrap_or_else(|| panic!("lib.rs does not list {file}"));
        for other in used {
            if rank(&module(other)).is_none_or(|other| other > own) {
                wrong.push(format!("{file} uses {other}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Largest number of files that hold methods of one type.
const MOST_FILES: usize = 6;

/// Largest number of methods of a type that has them in more than one file.
const MOST_METHODS_OVER_FILES: usize = 35;

/// Name of the type of an `impl` block, from its text after `impl` up to the brace; `None` for a
/// block of a trait.
fn inherent_type(header: &str) -> Option<&str> {
    let header = header.split("where").next()?.trim();
    if words(header).any(|word| word == "for") {
        return None;
    }
    let mut depth = 0;
    let mut before = ' ';
    let is_end = |(at, c): (usize, char)| {
        match c {
            '<' => depth += 1,
            '>' if before != '-' => depth -= 1,
            _ => {}
        }
        before = c;
        (depth == 0).then_some(at)
    };
    let generics = header.starts_with('<');
    let end = header.char_indices().find_map(is_end)?;
    let path = if generics { &header[end + 1..] } else { header };
    words(path.split('<').next()?).last()
}

/// Numbers of methods by file of each type, which its module and name identify.
fn methods(sources: &[Source]) -> BTreeMap<(&str, &str), BTreeMap<&str, usize>> {
    let mut methods: BTreeMap<(&str, &str), BTreeMap<&str, usize>> = BTreeMap::new();
    for source in sources {
        let mut rest = source.bare.as_str();
        while let Some(begin) = rest.find("\nimpl") {
            let block = &rest[begin + "\nimpl".len()..];
            let header = &block[..block.find('{').unwrap_or(block.len())];
            let body = &block[header.len()..];
            let length = if body.starts_with("{}") {
                2
            } else {
                body.find("\n}").unwrap_or(body.len())
            };
            if let Some(name) = inherent_type(header) {
                let count = body[..length].matches(" fn ").count();
                let key = (source.module[0].as_str(), name);
                let of_type = methods.entry(key).or_default();
                *of_type.entry(source.path.as_str()).or_default() += count;
            }
            rest = &body[length..];
        }
    }
    methods
}

#[test]
fn methods_are_counted_by_type_and_file() {
    let files = [
        (
            "a/mod.rs",
            "struct T;\nimpl<F: Fn() -> u8> T<F> {\n    fn a() {}\n    fn b() {}\n}\nimpl Copy for T {}\nimpl Clone for T {\n    fn c() {}\n}\n",
        ),
        (
            "a/b.rs",
            "use super::T;\nimpl super::T<u8>\nwhere\n    u8: Copy,\n{\n    fn d() {}\n}\n",
        ),
    ];
    let sources = files.map(|(path, text)| source(path.to_owned(), text));
    let of_type = BTreeMap::from([("a/b.rs", 1), ("a/mod.rs", 2)]);
    assert_eq!(methods(&sources), BTreeMap::from([(("a", "T"), of_type)]));
}

#[test]
fn no_type_is_spread_over_a_module() {
    let methods = methods(sources());
    assert!(methods.len() > 300, "{}", methods.len());
    let mut wrong = Vec::new();
    for ((module, name), files) in &methods {
        let total: usize = files.values().sum();
        if files.len() > MOST_FILES || (files.len() > 1 && total > MOST_METHODS_OVER_FILES) {
            wrong.push(format!("{module}: {name}: {total} methods: {files:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Values of a key in a YAML file.
fn values(file: &Path, key: &str) -> Vec<String> {
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
    let mut names = BTreeSet::from(["HARV".to_owned(), "NAVION".to_owned()]);
    for pipeline in ["pipelines/harv", "pipelines/navion"].map(|path| root().join(path)) {
        names.extend(values(&pipeline.join("model.yaml"), "name"));
        for class in files(&pipeline.join("maneuvers")) {
            names.extend(values(&class, "class"));
        }
    }
    assert!(
        names.contains("DUTCH_ROLL") && names.len() > 60,
        "{names:?}"
    );
    let mut wrong = Vec::new();
    for source in sources() {
        for (number, line) in lines(&source.code) {
            wrong.extend(
                words(line)
                    .filter(|w| names.contains(*w))
                    .map(|w| format!("{}:{number}: `{w}`", source.path)),
            );
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Spellings of a use of the file system or the network.
const OUTSIDE: [&str; 27] = [
    "std::fs",
    "fs::",
    "File::",
    "OpenOptions",
    "DirBuilder",
    "DirEntry",
    "ReadDir",
    "read_dir(",
    ".exists()",
    ".try_exists()",
    ".is_file()",
    ".is_dir()",
    ".is_symlink()",
    ".metadata()",
    ".symlink_metadata()",
    ".canonicalize()",
    "canonicalize(",
    ".read_link()",
    "current_dir(",
    "temp_dir(",
    "tempfile",
    "std::net",
    "TcpStream",
    "UdpSocket",
    "UnixStream",
    "memmap",
    "std::os::unix",
];

/// Spellings of a use of the terminal.
const TERMINAL: [&str; 8] = [
    "println!",
    "print!",
    "eprintln!",
    "eprint!",
    "dbg!",
    "io::stdout",
    "io::stderr",
    "io::stdin",
];

/// Spellings of a use of the process: its environment, its arguments, its end, other processes.
const PROCESS: [&str; 5] = [
    "std::process",
    "process::",
    "env::var",
    "env::args",
    "env::current_exe",
];

/// Lines of modules outside `homes` that contain one of some spellings as whole words.
fn elsewhere(homes: &[&str], spellings: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    let is_outside = |source: &&Source| !homes.contains(&source.module[0].as_str());
    for source in sources().iter().filter(is_outside) {
        for (number, line) in lines(&source.bare) {
            let has = |spelling: &&str| {
                line.match_indices(*spelling).any(|(at, _)| {
                    let before = line[..at].chars().next_back().unwrap_or(' ');
                    spelling.starts_with('.') || !(before.is_alphanumeric() || before == '_')
                })
            };
            if spellings.iter().any(has) {
                found.push(format!("src/{}:{number}: {}", source.path, line.trim()));
            }
        }
    }
    found
}

#[test]
fn only_the_store_touches_the_disk() {
    let wrong = elsewhere(&["store"], &OUTSIDE);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn only_the_command_line_prints() {
    let wrong = elsewhere(&["cli"], &TERMINAL);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn only_store_and_command_line_depend_on_the_process() {
    let wrong = elsewhere(&["cli", "store"], &PROCESS);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Rust files in folders of the repository.
fn rust_files(folders: &[&str]) -> impl Iterator<Item = PathBuf> {
    let all = folders
        .iter()
        .flat_map(|folder| files(&root().join(folder)));
    all.filter(|file| file.extension().is_some_and(|e| e == "rs"))
}

/// Files of program, tests and benchmarks that name a word, by word.
fn files_by_word(texts: &[String]) -> BTreeMap<&str, usize> {
    let mut files_of = BTreeMap::new();
    for text in texts {
        for word in words(text).collect::<BTreeSet<_>>() {
            *files_of.entry(word).or_default() += 1;
        }
    }
    files_of
}

/// Name of the function or constant that a line makes visible to other files.
fn visible(line: &str) -> Option<&str> {
    let line = line.trim_start();
    let line = ["pub ", "pub(crate) ", "pub(super) "]
        .iter()
        .find_map(|visibility| line.strip_prefix(visibility))?;
    ["const fn ", "fn ", "const ", "static "]
        .iter()
        .find_map(|item| words(line.strip_prefix(item)?).next())
}

/// Is the item called through a module, one inside the file or the one that a macro names?
fn is_reached_by_module(bare: &str, name: &str) -> bool {
    bare.match_indices(&format!("::{name}")).any(|(at, _)| {
        let before = words(&bare[..at]).last();
        before.is_some_and(|word| word.starts_with(char::is_lowercase))
    })
}

#[test]
fn a_function_or_constant_of_one_file_is_private() {
    assert_eq!(visible("    pub const fn f(&self) {}"), Some("f"));
    let texts: Vec<String> = rust_files(&["src", "tests", "benches"])
        .map(|file| fs::read_to_string(file).unwrap())
        .collect();
    let files_of = files_by_word(&texts);
    let mut wrong = Vec::new();
    for source in sources() {
        for (number, name) in lines(&source.bare).filter_map(|(n, line)| Some((n, visible(line)?)))
        {
            if files_of[name] == 1 && !is_reached_by_module(&source.bare, name) {
                wrong.push(format!("src/{}:{number}: {name}", source.path));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Largest number of files side by side in a folder, besides its `mod.rs`.
const MOST_FILES_IN_A_ROOM: usize = 20;

#[test]
fn no_room_is_crowded() {
    let mut files_in: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for file in rust_files(&["src"]).filter(|file| !file.ends_with("mod.rs")) {
        *files_in
            .entry(file.parent().unwrap().to_owned())
            .or_default() += 1;
    }
    files_in.retain(|_, files| *files > MOST_FILES_IN_A_ROOM);
    assert!(files_in.is_empty(), "{files_in:#?}");
}

#[test]
fn every_file_has_a_header() {
    for file in rust_files(&["src", "tests"]) {
        let text = fs::read_to_string(&file).unwrap();
        assert!(text.starts_with("//! "), "{}", file.display());
    }
}

#[test]
fn closures_are_compiled_for_the_processor_by_vectorised_and_always_inlined() {
    for file in rust_files(&["src"]) {
        let text = fs::read_to_string(&file).unwrap();
        let text: String = text.split_whitespace().collect();
        let opens = [
            "dispatch(|",
            "dispatch(move|",
            "dispatch(#",
            "vectorised(|",
            "vectorised(move|",
        ];
        let wrong = opens.iter().find(|open| text.contains(**open));
        assert!(wrong.is_none(), "{}: {wrong:?}", file.display());
    }
}

/// First lines of the doc comments of all sources, with their places.
fn openings() -> Vec<(String, String)> {
    let mut openings = Vec::new();
    for file in rust_files(&["src", "tests", "benches"]) {
        let text = fs::read_to_string(&file).unwrap();
        let mut before = "";
        for (number, line) in lines(&text) {
            let line = line.trim_start();
            let comment = ["/// ", "//! "]
                .iter()
                .find_map(|mark| line.strip_prefix(mark));
            if let Some(comment) = comment.filter(|_| !before.starts_with(&line[..3])) {
                let name = file.strip_prefix(root()).unwrap().display();
                openings.push((format!("{name}:{number}"), comment.to_owned()));
            }
            before = line;
        }
    }
    openings
}

#[test]
fn doc_comments_open_with_a_noun_or_a_verb() {
    const NOT_SO: [&str; 11] = [
        "What", "Whether", "Where", "Of", "How", "That", "So", "Those", "Why", "Who", "Which",
    ];
    let all = openings();
    assert!(all.len() > 1000, "{}", all.len());
    let wrong: Vec<String> = all
        .iter()
        .filter(|(_, comment)| words(comment).next().is_some_and(|w| NOT_SO.contains(&w)))
        .map(|(place, comment)| format!("{place}: {comment}"))
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
