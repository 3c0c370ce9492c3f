//! The program's sources for the house rules: code without comments and tests, the tree of modules,
//! and the file that each path of an import leads to.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::support::files;

/// One source file, without its comments and without what only tests see.
pub struct Source {
    /// Relative to `src/`, with `/`.
    pub path: String,
    /// Path of its module: `["ingest", "settings"]`.
    pub module: Vec<String>,
    /// Code with its strings.
    pub code: String,
    /// Code with the contents of strings blanked.
    pub bare: String,
}

/// Root of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All sources that are part of the program, but for the roots of its crates; read once.
pub fn sources() -> &'static [Source] {
    static SOURCES: OnceLock<Vec<Source>> = OnceLock::new();
    SOURCES.get_or_init(read)
}

fn read() -> Vec<Source> {
    let src = root().join("src");
    let relative = |file: &PathBuf| {
        let path = file.strip_prefix(&src).unwrap();
        path.to_string_lossy().replace('\\', "/")
    };
    let rust: Vec<(String, String)> = files(&src)
        .iter()
        .filter(|file| file.extension().is_some_and(|e| e == "rs"))
        .map(|file| (relative(file), fs::read_to_string(file).unwrap()))
        .collect();
    let of_tests: BTreeSet<Vec<String>> = rust
        .iter()
        .flat_map(|(path, text)| test_modules(&module(path), text))
        .collect();
    rust.into_iter()
        .filter(|(path, _)| !["lib.rs", "main.rs", "build.rs"].contains(&path.as_str()))
        .map(|(path, text)| source(path, &text))
        .filter(|source| {
            let is_test = |end| of_tests.contains(&source.module[..end]);
            !(1..=source.module.len()).any(is_test)
        })
        .collect()
}

/// A source from its text.
pub fn source(path: String, text: &str) -> Source {
    let code = without_comments(text);
    let bare = blanked(&code);
    let tests = test_items(&bare);
    Source {
        module: module(&path),
        path,
        code: without(&code, &tests),
        bare: without(&bare, &tests),
    }
}

/// Module of a file: `ingest/mod.rs` and `ingest.rs` are `["ingest"]`.
fn module(path: &str) -> Vec<String> {
    let path = path.strip_suffix(".rs").unwrap_or(path);
    let path = path.strip_suffix("/mod").unwrap_or(path);
    path.split('/').map(str::to_owned).collect()
}

/// Modules that a file declares for tests alone.
fn test_modules(module: &[String], text: &str) -> Vec<Vec<String>> {
    let bare = blanked(&without_comments(text));
    let items = test_items(&bare);
    let declared = items.into_iter().filter_map(|(from, to)| {
        let words: Vec<&str> = words(&bare[from..to]).collect();
        let at = words.iter().position(|word| *word == "mod")?;
        bare[from..to]
            .trim_end()
            .ends_with(';')
            .then(|| words[at + 1])
    });
    declared
        .map(|name| [module, &[name.to_owned()]].concat())
        .collect()
}

/// Words of a text: identifiers, keywords, numbers.
pub fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .filter(|word| !word.is_empty())
}

/// Ends of the string that begins at the start of a text: of its quotes and of its contents; `None`
/// where no string begins. A character is a string here; a lifetime is none.
fn string(text: &str) -> Option<(usize, usize, usize)> {
    let raw = text.trim_start_matches(['b', 'c']);
    let prefix = text.len() - raw.len();
    if let Some(rest) = raw.strip_prefix('r').filter(|_| prefix <= 1) {
        let hashes = rest.len() - rest.trim_start_matches('#').len();
        let rest = rest[hashes..].strip_prefix('"')?;
        let closing = format!("\"{}", "#".repeat(hashes));
        let begin = prefix + 1 + hashes + 1;
        let end = begin + rest.find(&closing)?;
        return Some((begin, end, end + closing.len()));
    }
    if prefix > 1 {
        return None;
    }
    let quote = raw.chars().next().filter(|c| ['"', '\''].contains(c))?;
    let begin = prefix + 1;
    let mut escaped = false;
    for (at, c) in text[begin..].char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            c if c == quote => return Some((begin, begin + at, begin + at + 1)),
            _ => {}
        }
        // A lifetime has no closing quote after one character.
        if quote == '\'' && !escaped && at > 0 && !text[begin..].starts_with('\\') {
            return None;
        }
    }
    None
}

/// The text with spaces for all characters of a part but its line ends.
fn blank(text: &mut String, part: &str) {
    text.extend(part.chars().flat_map(|c| {
        let spaces = if c == '\n' { 0 } else { c.len_utf8() };
        std::iter::repeat_n(' ', spaces).chain((c == '\n').then_some('\n'))
    }));
}

/// The text with every comment blanked; places stay.
fn without_comments(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    let mut at = 0;
    let mut before = ' ';
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let length = if rest.starts_with("//") {
            let length = rest.find('\n').unwrap_or(rest.len());
            blank(&mut code, &rest[..length]);
            length
        } else if rest.starts_with("/*") {
            let length = rest.find("*/").map_or(rest.len(), |end| end + 2);
            blank(&mut code, &rest[..length]);
            length
        } else if let Some((_, _, end)) = (!is_word(before)).then(|| string(rest)).flatten() {
            code.push_str(&rest[..end]);
            end
        } else {
            code.push(c);
            c.len_utf8()
        };
        before = text[at..at + length].chars().next_back().unwrap_or(' ');
        at += length;
    }
    code
}

/// Code without comments, with the contents of its strings blanked; places stay.
fn blanked(code: &str) -> String {
    let mut bare = String::with_capacity(code.len());
    let mut at = 0;
    let mut before = ' ';
    while let Some(c) = code[at..].chars().next() {
        let is_word = before.is_alphanumeric() || before == '_';
        let found = (!is_word).then(|| string(&code[at..])).flatten();
        let length = if let Some((begin, end, whole)) = found {
            bare.push_str(&code[at..at + begin]);
            blank(&mut bare, &code[at + begin..at + end]);
            bare.push_str(&code[at + end..at + whole]);
            whole
        } else {
            bare.push(c);
            c.len_utf8()
        };
        before = code[at..at + length].chars().next_back().unwrap_or(' ');
        at += length;
    }
    bare
}

/// Places of the items that only tests see, from their attribute to their end.
fn test_items(bare: &str) -> Vec<(usize, usize)> {
    let mut items = Vec::new();
    let mut from = 0;
    while let Some(at) = bare[from..].find("#[cfg(test)]").map(|at| from + at) {
        let end = item_end(bare, at + "#[cfg(test)]".len());
        items.push((at, end));
        from = end;
    }
    items
}

/// End of the item that begins at a place: its `;`, or the `}` of its body.
fn item_end(bare: &str, from: usize) -> usize {
    let mut depth = 0;
    for (at, c) in bare[from..].char_indices() {
        match c {
            '{' | '(' | '[' => depth += 1,
            '}' | ')' | ']' => depth -= 1,
            _ => {}
        }
        if depth == 0 && (c == ';' || c == '}') {
            return from + at + 1;
        }
    }
    bare.len()
}

fn without(text: &str, parts: &[(usize, usize)]) -> String {
    let mut left = String::with_capacity(text.len());
    let mut from = 0;
    for &(begin, end) in parts {
        left.push_str(&text[from..begin]);
        blank(&mut left, &text[begin..end]);
        from = end;
    }
    left.push_str(&text[from..]);
    left
}

/// Tokens of code: words, `::`, and single signs.
fn tokens(bare: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = bare;
    while let Some(c) = rest.chars().next() {
        let length = if c.is_alphanumeric() || c == '_' {
            rest.find(|c: char| !(c.is_alphanumeric() || c == '_'))
                .unwrap_or(rest.len())
        } else if rest.starts_with("::") {
            2
        } else {
            c.len_utf8()
        };
        if !c.is_whitespace() {
            tokens.push(&rest[..length]);
        }
        rest = &rest[length..];
    }
    tokens
}

/// A path of names, and the name that it brings into its file where that differs from the last.
type Import = (Vec<String>, Option<String>);

/// Reads a path, or a tree of paths in braces, that begins at a token. Returns the place after it.
fn paths(tokens: &[&str], mut at: usize, outer: &[String], found: &mut Vec<Import>) -> usize {
    let mut path = outer.to_vec();
    loop {
        match tokens.get(at) {
            Some(&"{") => {
                at += 1;
                while tokens.get(at).is_some_and(|token| *token != "}") {
                    at = paths(tokens, at, &path, found);
                    at += usize::from(tokens.get(at) == Some(&","));
                }
                return at + 1;
            }
            Some(&"*") => path.push("*".to_owned()),
            Some(word) if word.starts_with(|c: char| c.is_alphabetic() || c == '_') => {
                path.push((*word).to_owned());
            }
            _ => break,
        }
        at += 1;
        if tokens.get(at) != Some(&"::") {
            break;
        }
        at += 1;
    }
    let alias = (tokens.get(at) == Some(&"as")).then(|| tokens[at + 1].to_owned());
    at += 2 * usize::from(alias.is_some());
    // `use crate::units::{self, Unit}`
    if path.last().is_some_and(|name| name == "self") && path.len() > 1 {
        path.pop();
    }
    found.push((path, alias));
    at
}

/// The program's modules with the file of each, and what each file imports and defines.
pub struct Tree {
    files: BTreeMap<Vec<String>, Node>,
}

struct Node {
    path: String,
    /// Paths of `use` declarations.
    imports: Vec<Import>,
    /// Paths of two names or more elsewhere in the code.
    used: Vec<Vec<String>>,
    defined: BTreeSet<String>,
}

impl Tree {
    pub fn of(sources: &[Source]) -> Tree {
        let files = sources
            .iter()
            .map(|source| (source.module.clone(), Node::of(source)))
            .collect();
        Tree { files }
    }

    /// For each file the files that it uses, by paths relative to `src/`.
    pub fn uses(&self) -> BTreeMap<&str, BTreeSet<&str>> {
        let of = |(module, node): (&Vec<String>, &Node)| {
            let used = node.used.iter().chain(node.imports.iter().map(|i| &i.0));
            let files = used
                .filter_map(|path| self.file(module, path, 0))
                .filter(|file| *file != node.path)
                .collect();
            (self.files[module].path.as_str(), files)
        };
        self.files.iter().map(of).collect()
    }

    /// File that a path in a module's file leads to: the one that defines the item, also where
    /// others re-export it. `None` for items of other crates, and for a module as a whole.
    fn file(&self, from: &[String], path: &[String], depth: usize) -> Option<&str> {
        let first = path.first()?.as_str();
        let prefixed = ["crate", "self", "super"].contains(&first);
        let mut module: Vec<String> = match first {
            "crate" => Vec::new(),
            "super" => from.split_last()?.1.to_vec(),
            _ => from.to_vec(),
        };
        let mut names = &path[usize::from(prefixed)..];
        while let Some((name, rest)) = names.split_first() {
            let child = [&module[..], std::slice::from_ref(name)].concat();
            if name == "super" {
                module.pop();
            } else if self.files.contains_key(&child) {
                module = child;
            } else {
                let node = self.files.get(&module)?;
                let ours = prefixed || module != from;
                if depth > 8 || node.defined.contains(name) {
                    return Some(&node.path);
                }
                let Some(import) = node.imports.iter().find(|import| brings(import, name)) else {
                    return ours.then_some(&node.path);
                };
                let through = [&import.0[..], rest].concat();
                return self.file(&module, &through, depth + 1);
            }
            names = rest;
        }
        None
    }
}

/// Test for a declaration that brings a name into its file.
fn brings((path, alias): &Import, name: &str) -> bool {
    alias
        .as_ref()
        .or(path.last())
        .is_some_and(|brought| brought == name)
}

impl Node {
    fn of(source: &Source) -> Node {
        let tokens = tokens(&source.bare);
        let before = |at: usize| at.checked_sub(1).map_or("", |at| tokens[at]);
        let mut defined = BTreeSet::new();
        for (at, token) in tokens.iter().enumerate() {
            let Some(next) = tokens.get(at + 1) else {
                break;
            };
            match *token {
                "struct" | "enum" | "trait" | "type" | "const" | "static" | "fn" | "union" => {
                    defined.insert((*next).to_owned())
                }
                "macro_rules" => defined.insert(tokens[at + 2].to_owned()),
                _ => false,
            };
        }
        let (mut imports, mut used) = (Vec::new(), Vec::new());
        let mut at = 0;
        let (mut depth, mut inline_ends) = (0, Vec::new());
        while at < tokens.len() {
            match tokens[at] {
                "{" => depth += 1,
                "}" => {
                    depth -= 1;
                    inline_ends.pop_if(|end| *end == depth);
                }
                "mod" if tokens.get(at + 2) == Some(&"{") => inline_ends.push(depth),
                _ => {}
            }
            // `super` of a module within the file is the file.
            let is_use = usize::from(tokens[at] == "use");
            if !inline_ends.is_empty() && tokens.get(at + is_use) == Some(&"super") {
                at += is_use + 1;
                continue;
            }
            let is_word = tokens[at].starts_with(|c: char| c.is_alphabetic() || c == '_');
            let begins = is_word && tokens.get(at + 1) == Some(&"::") && before(at) != "::";
            if tokens[at] == "use" && !["::", "."].contains(&before(at)) {
                at = paths(&tokens, at + 1, &[], &mut imports);
            } else if begins {
                let mut found = Vec::new();
                at = paths(&tokens, at, &[], &mut found);
                used.extend(found.into_iter().map(|(path, _)| path));
            } else {
                at += 1;
            }
        }
        Node {
            path: source.path.clone(),
            imports,
            used,
            defined,
        }
    }
}

/// Circles of files: each a set in which every file uses every other, directly or not.
pub fn circles<'a>(uses: &BTreeMap<&'a str, BTreeSet<&'a str>>) -> Vec<BTreeSet<&'a str>> {
    let reached = |from: &'a str| {
        let mut reached = BTreeSet::new();
        let mut open = vec![from];
        while let Some(file) = open.pop() {
            let new: Vec<&str> = uses[file]
                .iter()
                .copied()
                .filter(|next| reached.insert(*next))
                .collect();
            open.extend(new);
        }
        reached
    };
    let all: BTreeMap<&str, BTreeSet<&str>> =
        uses.keys().map(|file| (*file, reached(file))).collect();
    let mut circles: Vec<BTreeSet<&str>> = Vec::new();
    for (file, reached) in &all {
        if reached.contains(file) && !circles.iter().any(|circle| circle.contains(file)) {
            let circle = reached
                .iter()
                .copied()
                .filter(|other| all[other].contains(file));
            circles.push(circle.collect());
        }
    }
    circles
}
