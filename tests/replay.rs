//! `rtutap replay` as people run it: the program itself, in a terminal.
#![cfg(unix)]

use std::io::{Read, Write};
use std::num::NonZeroU16;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use assert_cmd::cargo::cargo_bin;
use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, native_pty_system};

/// How long the program may take for anything, on a machine that does other things too.
const PATIENCE: Duration = Duration::from_secs(60);

fn troubled() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("captures/troubled.mcap")
}

/// Is the program in a terminal.
struct Program {
    _master: Box<dyn MasterPty + Send>,
    child: Box<dyn Child + Send + Sync>,
    keys: Box<dyn Write + Send>,
    output: Receiver<Vec<u8>>,
    screen: vt100::Parser,
}

impl Program {
    fn start(arguments: &[&str]) -> Program {
        let (lines, columns) = (NonZeroU16::new(24).expect("lines"), NonZeroU16::new(100).expect("columns"));
        let size = PtySize { rows: lines.get(), cols: columns.get(), pixel_width: 0, pixel_height: 0 };
        let pty = native_pty_system().openpty(size).expect("a pty");
        let mut command = CommandBuilder::new(cargo_bin("rtutap"));
        command.args(arguments);
        command.env("TERM", "xterm-256color");
        command.env("RTUTAP_CONFIG", "/dev/null");
        command.env("TZ", "UTC");
        let child = pty.slave.spawn_command(command).expect("the program");
        let mut reader = pty.master.try_clone_reader().expect("its output");
        let keys = pty.master.take_writer().expect("its input");
        let (sender, output) = channel();
        #[expect(clippy::disallowed_methods, reason = "reading waits, the test does not")]
        std::thread::spawn(move || {
            let mut block = [0; 4096];
            while let Ok(read @ 1..) = reader.read(&mut block) {
                if sender.send(block[..read].to_vec()).is_err() {
                    break;
                }
            }
        });
        Program { _master: pty.master, child, keys, output, screen: vt100::Parser::new(lines, columns, 0) }
    }

    fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).expect("it reads keys");
    }

    /// Waits until the screen is as it should be; returns it.
    #[expect(clippy::disallowed_methods, reason = "a program that hangs fails the test")]
    fn wait(&mut self, what: &str, is_so: impl Fn(&str) -> bool) -> String {
        let begun = Instant::now();
        loop {
            let screen = self.screen.screen().contents();
            if is_so(&screen) {
                return screen;
            }
            let rest = PATIENCE.checked_sub(begun.elapsed());
            let more = rest.and_then(|rest| self.output.recv_timeout(rest).ok());
            let Some(more) = more else { panic!("never {what}:\n{screen}") };
            self.screen.process(&more);
        }
    }
}

#[test]
fn a_recording_is_opened_gone_about_in_and_left() {
    let path = troubled();
    let mut program = Program::start(&["replay", path.to_str().expect("a path"), "--time", "relative"]);
    let first = program.wait("the first rows, and all of it decoded", |screen| {
        screen.contains("get-measurement") && screen.contains("of 0:26:32") && screen.contains("errors")
    });
    assert!(first.contains("‖ ×1") && first.contains("troubled.mcap"), "{first}");
    program.press(")");
    program.wait("the end", |screen| screen.contains("0:26:32 of 0:26:32"));
    program.press(":600\r");
    program.wait("a time", |screen| screen.contains("0:10:00 of 0:26:32"));
    program.press(">>>>>>>>> ");
    program.wait("playing", |screen| screen.contains("▶ ×1000"));
    program.wait("played", |screen| screen.contains("0:26:32 of 0:26:32"));
    program.press("2");
    program.wait("the devices", |screen| screen.contains("conductivity"));
    program.press("q");
    let status = program.child.wait().expect("it ends");
    assert!(status.success(), "{status:?}");
}

#[test]
fn without_a_terminal_it_says_what_to_use_instead() {
    let output = assert_cmd::Command::cargo_bin("rtutap")
        .expect("the program")
        .arg("replay")
        .arg(troubled())
        .output()
        .expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(said.contains("needs a terminal") && said.contains("rtutap decode"), "{said}");
}
