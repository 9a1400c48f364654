//! A terminal that the program has, and what stands on it.

use std::io::{Read, Write};
use std::num::NonZero;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use portable_pty::{Child, CommandBuilder, ExitStatus, MasterPty, PtySize, native_pty_system};
use rustix::process::{Pid, Signal, kill_process};

use crate::bus::LONG;

fn some(count: u16) -> NonZero<u16> {
    NonZero::new(count).expect("a terminal has lines and columns")
}

fn program() -> String {
    std::env::var("RTUTAP_BIN").unwrap_or_else(|_| env!("CARGO_BIN_EXE_rtutap").to_owned())
}

/// Is a terminal with the program in it.
pub struct Terminal {
    master: Box<dyn MasterPty + Send>,
    child: Box<dyn Child + Send + Sync>,
    keys: Box<dyn Write + Send>,
    output: Receiver<Vec<u8>>,
    parser: vt100::Parser,
    has_ended: bool,
}

impl Terminal {
    /// Runs the program with these arguments; what it keeps is kept below `home`.
    pub fn start(args: &[&str], home: &Path) -> Self {
        let mut command = CommandBuilder::new(program());
        command.args(args);
        Terminal::start_at(home, command)
    }

    /// Runs the program as a job of a shell, which goes on with `afterwards` whenever the job stops or ends.
    pub fn start_in_shell(args: &[&str], afterwards: &str, home: &Path) -> Self {
        let mut command = CommandBuilder::new("sh");
        command.args(["-m", "-c", &format!("'{}' {}; {afterwards}", program(), args.join(" "))]);
        command.cwd(env!("CARGO_MANIFEST_DIR"));
        Terminal::start_at(home, command)
    }

    fn start_at(home: &Path, mut command: CommandBuilder) -> Self {
        command.env("TERM", "xterm-256color");
        command.env("TZ", "UTC");
        command.env("XDG_STATE_HOME", home);
        command.env("XDG_CONFIG_HOME", home);
        for name in ["NO_COLOR", "RTUTAP_LINE", "RTUTAP_FORMAT"] {
            command.env_remove(name);
        }
        Terminal::run(command)
    }

    /// Runs a program.
    pub fn run(command: CommandBuilder) -> Self {
        let size = PtySize { rows: 24, cols: 100, pixel_width: 0, pixel_height: 0 };
        let pair = native_pty_system().openpty(size).expect("a pty");
        let child = pair.slave.spawn_command(command).expect("a program that starts");
        drop(pair.slave);
        let mut reader = pair.master.try_clone_reader().expect("the pty's other side");
        let keys = pair.master.take_writer().expect("the pty's other side");
        let (sender, output) = channel();
        std::thread::spawn(move || {
            let mut buffer = [0; 65_536];
            while let Ok(count) = reader.read(&mut buffer) {
                if count == 0 || sender.send(buffer[..count].to_vec()).is_err() {
                    break;
                }
            }
        });
        let parser = vt100::Parser::new(some(24), some(100), 1000);
        Terminal { master: pair.master, child, keys, output, parser, has_ended: false }
    }

    /// Presses keys.
    pub fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).expect("a terminal that is there");
        self.keys.flush().expect("a terminal that is there");
    }

    pub fn resize(&mut self, rows: u16, cols: u16) {
        self.master.resize(PtySize { rows, cols, pixel_width: 0, pixel_height: 0 }).expect("a pty");
        self.parser.screen_mut().set_size(some(rows), some(cols));
    }

    pub fn signal(&self, signal: Signal) {
        let pid = self.child.process_id().and_then(|pid| Pid::from_raw(i32::try_from(pid).expect("small")));
        kill_process(pid.expect("a process"), signal).expect("a program that runs");
    }

    /// Signals the program that was started by a shell.
    pub fn signal_child(&self, signal: Signal) {
        let path = format!("/proc/{0}/task/{0}/children", self.pid());
        let children = std::fs::read_to_string(path).expect("a shell that runs");
        let pid = children.split_whitespace().next().and_then(|pid| Pid::from_raw(pid.parse().ok()?));
        kill_process(pid.expect("a job"), signal).expect("a program that runs");
    }

    pub fn pid(&self) -> u32 {
        self.child.process_id().expect("a process")
    }

    pub fn screen(&self) -> &vt100::Screen {
        self.parser.screen()
    }

    pub fn contents(&self) -> String {
        self.screen().contents()
    }

    /// Waits until something holds of the screen; returns how long that took.
    pub fn wait_until(&mut self, what: &str, is_so: impl Fn(&vt100::Screen) -> bool) -> Duration {
        let begun = Instant::now();
        while !is_so(self.parser.screen()) {
            let rest = LONG.saturating_sub(begun.elapsed());
            match self.output.recv_timeout(rest) {
                Ok(bytes) => self.parser.process(&bytes),
                Err(RecvTimeoutError::Disconnected) if !self.has_ended => self.has_ended = true,
                Err(_) => panic!("waited in vain until {what}; on the screen is\n{}", self.contents()),
            }
        }
        begun.elapsed()
    }

    /// Waits until a text is on the screen.
    pub fn wait_for(&mut self, text: &str) -> Duration {
        self.wait_until(&format!("'{text}' is on the screen"), |screen| screen.contents().contains(text))
    }

    /// Waits for the program to end; what it said last is on the screen then.
    pub fn wait(&mut self) -> ExitStatus {
        while let Ok(bytes) = self.output.recv_timeout(LONG) {
            self.parser.process(&bytes);
        }
        self.child.wait().expect("a program")
    }

    /// Fails unless the terminal is as it was before.
    pub fn assert_restored(&self) {
        let screen = self.screen();
        assert!(!screen.alternate_screen(), "the screen of before is back");
        assert!(!screen.hide_cursor(), "the cursor is seen");
        assert!(!screen.bracketed_paste());
        assert_eq!(screen.mouse_protocol_mode(), vt100::MouseProtocolMode::None);
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It may have ended long ago.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
