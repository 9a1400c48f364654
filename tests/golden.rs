//! Golden files: an input and what the program must print for it, together in one file a person can judge.
//!
//! A file in `tests/golden` begins with what it shows. `=== input` is followed by hex text; each `=== rtutap …` is a
//! command that reads it from standard input, followed by what it prints. After a change that is meant,
//! `UPDATE_GOLDEN=1 cargo test --test golden` writes what the program prints now: read every line of the difference
//! before you commit it, for the files say what is right, not what is so.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use assert_cmd::Command;

/// Is a file taken apart.
struct Golden {
    about: String,
    input: String,
    /// Arguments, and what is printed for them.
    runs: Vec<(String, String)>,
}

impl Golden {
    fn parse(text: &str) -> Golden {
        let mut parts = text.split("\n=== ");
        let about = parts.next().unwrap_or_default().to_owned();
        let mut golden = Golden { about, input: String::new(), runs: Vec::new() };
        for part in parts {
            let (head, body) = part.split_once('\n').unwrap_or((part, ""));
            let body = format!("{}\n", body.trim_end_matches('\n'));
            match head.strip_prefix("rtutap ") {
                Some(arguments) => golden.runs.push((arguments.to_owned(), body)),
                None if head == "input" => golden.input = body,
                None => panic!("'=== {head}' is neither an input nor a command"),
            }
        }
        golden
    }

    fn write(&self) -> String {
        let mut text = format!("{}\n=== input\n{}", self.about, self.input);
        for (arguments, output) in &self.runs {
            write!(text, "\n=== rtutap {arguments}\n{output}").expect("writing to a string cannot fail");
        }
        text
    }

    fn run(&self, arguments: &str) -> String {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rtutap"));
        let arguments = arguments.split(' ').filter(|argument| !argument.is_empty());
        let output = command.args(arguments).env("NO_COLOR", "1").write_stdin(self.input.as_str()).assert();
        let output = output.success().get_output().stdout.clone();
        String::from_utf8(output).expect("the program prints UTF-8")
    }
}

fn files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let entries = folder.read_dir().expect("the folder of golden files");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("a golden file").path()).collect();
    files.sort();
    files
}

#[test]
#[expect(clippy::disallowed_methods, reason = "golden files are files")]
fn the_program_prints_what_the_golden_files_say() {
    let update = std::env::var_os("UPDATE_GOLDEN").is_some();
    let mut wrong = String::new();
    for path in files() {
        let text = std::fs::read_to_string(&path).expect("a golden file is text");
        let mut golden = Golden::parse(&text);
        assert!(!golden.input.is_empty() && !golden.runs.is_empty(), "{} tests nothing", path.display());
        assert!(update || golden.write() == text, "{} has blank lines out of place", path.display());
        let printed: Vec<String> = golden.runs.iter().map(|(arguments, _)| golden.run(arguments)).collect();
        for ((arguments, expected), printed) in golden.runs.iter_mut().zip(printed) {
            if *expected == printed {
                continue;
            }
            let differs = expected.lines().zip(printed.lines()).position(|(a, b)| a != b);
            let at = differs.unwrap_or(expected.lines().count().min(printed.lines().count()));
            let line = |text: &str| text.lines().nth(at).unwrap_or("(nothing)").to_owned();
            let (name, wants, is) = (path.display(), line(expected), line(&printed));
            let _ = writeln!(wrong, "{name}\n  rtutap {arguments}\n  line {}\n  - {wants}\n  + {is}", at + 1);
            *expected = printed;
        }
        if update {
            std::fs::write(&path, golden.write()).expect("the golden file can be written");
        }
    }
    assert!(update || wrong.is_empty(), "\n{wrong}");
}
