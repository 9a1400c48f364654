//! Which module may know of which, read from the sources: knowledge points one way, along the flow of the data.

use std::path::{Path, PathBuf};

/// The picture: a module, and what it may use besides itself. `module::part` allows that part alone.
const ARROWS: &[(&str, &[&str])] = &[
    ("time", &[]),
    ("line", &[]),
    ("section", &[]),
    ("source", &["time", "line", "decode::chunk"]),
    ("capture", &["time", "line", "decode::chunk", "decode::stamp"]),
    ("decode", &["time", "line"]),
    ("device", &["time", "line", "decode", "section"]),
    ("analyze", &["time", "line", "decode", "device", "section"]),
    ("pipeline", &["time", "line", "decode", "device", "analyze"]),
    ("simulate", &["time", "line", "capture::hex_line", "decode::chunk", "decode::frame"]),
    (
        "report",
        &[
            "time",
            "line",
            "capture::hex_line",
            "capture::BUS",
            "capture::hex_bus",
            "capture::hex_lost",
            "capture::hex_silence",
            "decode",
            "device",
            "analyze",
            "pipeline",
        ],
    ),
    ("tui", &["time", "line", "decode", "device", "analyze", "pipeline", "report", "section"]),
    ("cli", &["time", "line", "analyze::verify", "capture", "report", "simulate", "source"]),
    ("config", &["time", "line", "analyze::verify", "cli", "section", "tui"]),
    ("command", EVERYTHING),
    ("main", EVERYTHING),
    ("lib", &[]),
];

const EVERYTHING: &[&str] = &["*"];

/// Modules that take time and bytes as arguments, and what they must not touch.
const PURE: &[&str] = &["decode", "device", "analyze"];
const IMPURE: &[&str] =
    &["std::io", "std::fs", "std::net", "std::thread", "std::env", "Instant", "SystemTime"];

struct Source {
    path: PathBuf,
    /// Module path, such as `decode::framer`; empty for `lib.rs` and `main.rs`.
    module: Vec<String>,
    /// Without comments.
    text: String,
}

impl Source {
    /// Returns the top-level module it belongs to.
    fn top(&self) -> &str {
        self.module.first().map_or("lib", |name| name)
    }
}

#[expect(clippy::disallowed_methods, reason = "sources are files")]
fn read(path: &Path, root: &Path) -> Source {
    let text = std::fs::read_to_string(path).expect("a source is text");
    let within = path.strip_prefix(root).expect("below src").with_extension("");
    let mut module: Vec<String> =
        within.iter().map(|part| part.to_str().expect("a source's name is UTF-8").to_owned()).collect();
    if module.last().is_some_and(|name| matches!(name.as_str(), "mod" | "lib")) {
        module.pop();
    }
    let code = |line: &str| line.split("//").next().unwrap_or_default().to_owned();
    let text = text.lines().map(code).collect::<Vec<_>>().join("\n");
    Source { path: path.to_owned(), module, text }
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut folders = vec![root.clone()];
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().expect("a folder of sources") {
            let path = entry.expect("a source").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                sources.push(read(&path, &root));
            }
        }
    }
    sources
}

/// Returns the paths that stand after each `prefix`, those in braces one by one, whitespace removed.
fn paths_after(text: &str, prefix: &str) -> Vec<String> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let starts =
        text.match_indices(prefix).filter(|(at, _)| !text[..*at].ends_with(|c| is_name(c) || c == ':'));
    starts.flat_map(|(at, _)| expand(&text[at + prefix.len()..])).collect()
}

/// Reads a path that may end in a group, such as `a::{b, c::d}`.
fn expand(text: &str) -> Vec<String> {
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')).unwrap_or(text.len());
    let (head, rest) = text.split_at(end);
    let Some(group) = rest.strip_prefix('{').filter(|_| head.is_empty() || head.ends_with("::")) else {
        return vec![head.trim_end_matches(':').to_owned()];
    };
    members(group).into_iter().flat_map(expand).map(|path| format!("{head}{path}")).collect()
}

/// Splits the inside of a group at its commas, up to the brace that closes it.
fn members(group: &str) -> Vec<&str> {
    let (mut depth, mut from, mut members) = (0, 0, Vec::new());
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => {
                members.push(group[from..at].trim());
                break;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                members.push(group[from..at].trim());
                from = at + 1;
            }
            _ => {}
        }
    }
    members.retain(|member| !member.is_empty());
    members
}

/// Returns the paths from the crate's root that a source names, by `crate::` or by `super::` up to the root.
fn uses(source: &Source) -> Vec<String> {
    let own_crate = if source.top() == "main" { "rtutap::" } else { "crate::" };
    let mut uses = paths_after(&source.text, own_crate);
    let up = "super::".repeat(source.module.len().max(1));
    let is_known = |path: &String| ARROWS.iter().any(|(module, _)| path.split("::").next() == Some(module));
    uses.extend(paths_after(&source.text, &up).into_iter().filter(is_known));
    uses
}

fn may_use(from: &str, path: &str) -> bool {
    let (_, allowed) = ARROWS
        .iter()
        .find(|(module, _)| *module == from)
        .unwrap_or_else(|| panic!("the module '{from}' has no place in the picture: add it to ARROWS"));
    let to = path.split("::").next().unwrap_or_default();
    let within = |part: &&str| path == *part || path.starts_with(&format!("{part}::"));
    to == from || *allowed == EVERYTHING || allowed.iter().any(within)
}

#[test]
fn dependencies_point_along_the_arrows_only() {
    let mut against = Vec::new();
    let mut seen = 0;
    for source in sources() {
        for path in uses(&source) {
            seen += 1;
            if !may_use(source.top(), &path) {
                against.push(format!("{} uses {path}", source.path.display()));
            }
        }
    }
    assert!(seen > 100, "only {seen} paths were found: the sources were not read");
    assert!(against.is_empty(), "against the arrows:\n{}", against.join("\n"));
}

#[test]
fn the_core_is_pure() {
    let mut impure = Vec::new();
    for source in sources().iter().filter(|source| PURE.contains(&source.top())) {
        for word in IMPURE {
            let used = source.text.match_indices(word).any(|(at, _)| {
                let after = source.text[at + word.len()..].chars().next();
                !after.is_some_and(|c| c.is_alphanumeric() || c == '_')
            });
            // `use std::{fs, io}` names them, too.
            let part = word.strip_prefix("std::").unwrap_or_default();
            let grouped =
                paths_after(&source.text, "std::").iter().any(|path| path.split("::").next() == Some(part));
            if used || grouped {
                impure.push(format!("{} uses {word}", source.path.display()));
            }
        }
    }
    assert!(impure.is_empty(), "not pure:\n{}", impure.join("\n"));
}

#[test]
fn arrows_against_the_picture_are_found() {
    let source = |module: &[&str], text: &str| Source {
        path: PathBuf::new(),
        module: module.iter().map(|part| part.to_string()).collect(),
        text: text.to_owned(),
    };
    let grouped = source(&["decode", "framer"], "use crate::{line::{A, B}, device::{self, Devices}};");
    assert_eq!(uses(&grouped), ["line::A", "line::B", "device::self", "device::Devices"]);
    let climbing = source(&["decode", "framer"], "use super::super::report::Json; use super::frame::Frame;");
    assert_eq!(uses(&climbing), ["report::Json"]);
    assert!(may_use("report", "decode::frame::Frame") && !may_use("decode", "report::Json"));
    assert!(may_use("capture", "decode::chunk::Chunk") && !may_use("capture", "decode::frame::Frame"));
    assert!(!may_use("capture", "decode"));
}
