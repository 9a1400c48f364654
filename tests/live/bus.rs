//! Ptys that stand for buses, and the program that taps them.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{InputModes, LocalModes, Termios, tcgetattr};

use rtutap::line::LineSettings;
use rtutap::simulate::{Adapter, Config, Read as SimulatedRead, Scenario, Simulation};

/// Longer than anything takes on a machine that works.
pub const LONG: Duration = Duration::from_secs(30);

/// A request that no simulation makes: heard, it shows that all before it was.
pub const LAST: [u8; 8] = [0xF7, 0x03, 0x12, 0x34, 0x00, 0x01, 0xD4, 0x2A];

/// Is the side of a pty on which the bus speaks.
pub struct Bus {
    file: File,
    /// The other side.
    pub path: String,
}

impl Bus {
    pub fn new() -> Self {
        let bus = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).expect("a pty");
        grantpt(&bus).expect("a pty of ours");
        unlockpt(&bus).expect("a pty of ours");
        let path = ptsname(&bus, Vec::new()).expect("a name").into_string().expect("a plain name");
        Bus { file: File::from(bus), path }
    }

    /// Waits until rtutap listens: has thrown away what came before, and asked for damage to be marked.
    pub fn wait_for_listener(&self) {
        wait_until("rtutap listens", || self.termios().input_modes.contains(InputModes::PARMRK));
    }

    /// Waits until somebody has opened it as a bus; until then a pty says back what it hears.
    pub fn wait_until_open(&self) {
        wait_until("the port is opened", || !self.termios().local_modes.contains(LocalModes::ECHO));
    }

    fn termios(&self) -> Termios {
        tcgetattr(&self.file).expect("a terminal")
    }

    pub fn say(&mut self, bytes: &[u8]) {
        self.file.write_all(bytes).expect("room in the pty");
    }

    pub fn into_file(self) -> File {
        self.file
    }

    /// Tells whether the kernel holds as much for the other side as it ever does; also where it may not be asked.
    pub fn is_full(&self) -> bool {
        use rustix::fs::{Mode, OFlags, open};
        let flags = OFlags::RDONLY | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let Ok(other) = open(&*self.path, flags, Mode::empty()) else { return true };
        rustix::io::ioctl_fionread(&other).expect("a terminal") >= 4000
    }

    /// Says as much as there is room for; returns how much that was.
    pub fn say_some(&mut self, bytes: &[u8]) -> usize {
        rustix::io::ioctl_fionbio(&self.file, true).expect("a file");
        let said = self.file.write(bytes).unwrap_or(0);
        rustix::io::ioctl_fionbio(&self.file, false).expect("a file");
        said
    }
}

/// Looks again and again whether something has come about.
pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !is_so() {
        assert!(begun.elapsed() < LONG, "waited in vain until {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Returns the program; with `RTUTAP_BIN`, another build of it.
fn program() -> Command {
    let program = std::env::var_os("RTUTAP_BIN");
    Command::new(program.unwrap_or_else(|| env!("CARGO_BIN_EXE_rtutap").into()))
}

/// Is the program, tapping.
pub struct Tap {
    child: Child,
    lines: Receiver<String>,
    pub printed: String,
}

impl Tap {
    pub fn start(args: &[&str]) -> Self {
        let mut command = program();
        command.args(args).env("TZ", "UTC").env("XDG_CONFIG_HOME", "nowhere").env_remove("RTUTAP_LINE");
        let mut child =
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("a program that starts");
        let output = BufReader::new(child.stdout.take().expect("a pipe"));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            output.lines().map_while(Result::ok).try_for_each(|line| sender.send(line))
        });
        Tap { child, lines, printed: String::new() }
    }

    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Waits for a line with this in it.
    pub fn wait_for(&mut self, part: &str) -> String {
        loop {
            let line = self.lines.recv_timeout(LONG).unwrap_or_else(|_| {
                panic!("no line with {part} in\n{}", self.printed);
            });
            self.printed += &line;
            self.printed.push('\n');
            if line.contains(part) {
                return line;
            }
        }
    }

    pub fn signal(&self, signal: Signal) {
        let pid = Pid::from_child(&self.child);
        kill_process(pid, signal).expect("a program that runs");
    }

    /// Waits for the program to end; returns its status and what it said on standard error.
    pub fn wait(&mut self) -> (ExitStatus, String) {
        let mut said = String::new();
        let mut stderr = self.child.stderr.take().expect("not waited for before");
        stderr.read_to_string(&mut said).expect("UTF-8");
        let status = self.child.wait().expect("a program");
        for line in &self.lines {
            self.printed += &line;
            self.printed.push('\n');
        }
        (status, said)
    }

    /// Ends the program as Ctrl-C does; returns what it said on standard error.
    pub fn interrupt(&mut self) -> String {
        self.signal(Signal::INT);
        let (status, said) = self.wait();
        assert!(status.success(), "{status}: {said}");
        said
    }
}

impl Drop for Tap {
    fn drop(&mut self) {
        // It may have ended long ago.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Runs the program to its end; returns what it printed.
pub fn printed(args: &[&str]) -> String {
    let mut tap = Tap::start(args);
    let (status, said) = tap.wait();
    assert!(status.success(), "{args:?}: {said}");
    std::mem::take(&mut tap.printed)
}

/// Returns how many bytes of buses are in files; 0 while they cannot be read or have none.
pub fn bytes_in(files: &[&Path]) -> u64 {
    let output = program().args(["info", "--format", "json"]).args(files).output().expect("a program");
    let info: Option<serde_json::Value> = serde_json::from_slice(&output.stdout).ok();
    info.and_then(|info| info["bytes"].as_u64()).unwrap_or(0)
}

/// Returns what a recording says of itself.
pub fn info(files: &[&Path]) -> serde_json::Value {
    let mut args = vec!["info", "--format", "json"];
    args.extend(files.iter().map(|file| file.to_str().expect("UTF-8")));
    serde_json::from_str(&printed(&args)).expect("JSON")
}

/// Returns what an adapter reads of a simulated bus.
pub fn reads(scenario: &str, adapter: Adapter, seed: u64, frames: u64) -> Vec<SimulatedRead> {
    let scenario = Scenario::named(scenario).expect("a scenario");
    let line = LineSettings::default();
    Simulation::new(Config { seed, frames, line, adapter, scenario }).collect()
}

/// Calls `act` with each read at its time, the first at once; returns when all were.
pub fn pace(reads: &[SimulatedRead], mut act: impl FnMut(&SimulatedRead)) {
    let begun = Instant::now();
    for read in reads {
        let due = Duration::from_nanos((read.time - reads[0].time) as u64);
        std::thread::sleep(due.saturating_sub(begun.elapsed()));
        act(read);
    }
}
