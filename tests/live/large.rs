//! How fast the screen of a large recording answers. Measured, so ignored:
//!
//! ```sh
//! rtutap simulate --seed 1 --frames 9090000 --raw-only -o large.mcap   # 100 MB of bus bytes
//! RTUTAP_BIN=target/release/rtutap RTUTAP_LARGE=large.mcap \
//!     cargo test --test live large -- --ignored --nocapture
//! ```

use std::time::{Duration, Instant};

use crate::terminal::Terminal;

/// How fast a key is to be answered.
const AT_ONCE: Duration = Duration::from_millis(100);
/// How much memory the program may take, in kibibytes.
const MEMORY: u64 = 256 * 1024;
/// The line of the screen that says where the playhead is.
const STATUS: u16 = 22;

/// Is a recording on the screen, with what was measured of it.
struct Large {
    terminal: Terminal,
    begun: Instant,
    /// What was pressed, how long until the screen changed, and how long until it showed what was asked for.
    measured: Vec<(&'static str, Duration, Duration)>,
    /// How many of the first pictures were provisional.
    provisional: u64,
}

fn line(screen: &vt100::Screen, line: u16) -> String {
    screen.rows(0, 100).nth(usize::from(line)).unwrap_or_default()
}

/// Returns what is shown of rows, without what the background changes.
fn shown(screen: &vt100::Screen) -> String {
    screen.rows(0, 100).take(20).collect::<Vec<_>>().join("\n")
}

/// Tells whether the player is where it was sent.
fn has_arrived(screen: &vt100::Screen) -> bool {
    !line(screen, STATUS).contains('→')
}

/// Tells whether it is not known what came before what is shown.
fn is_provisional(screen: &vt100::Screen) -> bool {
    line(screen, 0).contains("PROVISIONAL")
}

/// Returns how much of the recording is decoded, in percent.
fn decoded(screen: &vt100::Screen) -> u64 {
    let line = line(screen, STATUS);
    let share = line.split("decoded ").nth(1).and_then(|rest| rest.split(' ').next()?.parse().ok());
    share.unwrap_or(if has_arrived(screen) { 100 } else { 0 })
}

impl Large {
    fn open(path: &str) -> Self {
        let home = tempfile::tempdir().expect("a directory");
        let begun = Instant::now();
        let mut terminal = Terminal::start(&["replay", path, "--time", "utc"], home.path());
        terminal.wait_for("get-measurement");
        println!("first rows after {:?}", begun.elapsed());
        Large { terminal, begun, measured: Vec::new(), provisional: 0 }
    }

    /// Presses keys, and measures until the screen changes, and until it shows what is asked for.
    fn press(&mut self, what: &'static str, keys: &str) {
        // While the background goes on, the screen is never still.
        if decoded(self.terminal.screen()) == 100 {
            self.terminal.settle();
        }
        let (before, status) = (shown(self.terminal.screen()), line(self.terminal.screen(), STATUS));
        let pressed = Instant::now();
        self.terminal.press(keys);
        let is_other = |screen: &vt100::Screen| shown(screen) != before;
        let has_moved = |screen: &vt100::Screen| line(screen, STATUS) != status;
        self.terminal.wait_until("the key is answered", |screen| is_other(screen) || has_moved(screen));
        let answered = pressed.elapsed();
        // A frame alone may be no row yet; then only the playhead has moved.
        let is_frame = what.starts_with("a frame");
        self.terminal.wait_until("it is there", |screen| {
            // While a time is typed, the rows are elsewhere on the screen.
            let is_typed = !line(screen, 1).contains("TIME") && !line(screen, 2).contains("TIME");
            has_arrived(screen) && !is_typed && (is_other(screen) || is_frame && has_moved(screen))
        });
        self.measured.push((what, answered, pressed.elapsed()));
        self.provisional += u64::from(is_provisional(self.terminal.screen()));
    }

    /// Waits until what is shown lacks nothing that came before; returns how long it took.
    fn settle(&mut self) -> Duration {
        let begun = Instant::now();
        let is_settled = |screen: &vt100::Screen| has_arrived(screen) && !is_provisional(screen);
        self.terminal.wait_until_patiently("all before it is known", is_settled);
        begun.elapsed()
    }

    /// Presses what goes about in a recording.
    fn go_about(&mut self) {
        for time in ["4000000", "500000", "7000000", "6999999", "2000000", "7600000", "1000"] {
            self.press("a time", &format!(":{time}\r"));
        }
        for _ in 0..5 {
            self.press("on by a fiftieth", "}");
        }
        for _ in 0..5 {
            self.press("back by a fiftieth", "{");
        }
        for _ in 0..40 {
            self.press("a page back", "\x1b[5~");
        }
        for _ in 0..20 {
            self.press("a page on", "\x1b[6~");
        }
        for _ in 0..5 {
            self.press("a frame on", ".");
        }
        for _ in 0..5 {
            self.press("a frame back", ",");
        }
    }

    /// Prints what was measured, by what was pressed; returns how long the slowest picture took.
    fn print(&mut self, when: &str) -> Duration {
        let mut slowest = Duration::ZERO;
        let (after, memory) = (self.begun.elapsed(), self.memory() / 1024);
        let provisional = std::mem::take(&mut self.provisional);
        println!("{when}, after {after:?}, most memory {memory} MiB, {provisional} provisional:");
        while let Some((what, ..)) = self.measured.first().copied() {
            let of: Vec<_> = self.measured.extract_if(.., |(known, ..)| *known == what).collect();
            let mut answered: Vec<_> = of.iter().map(|(_, answered, _)| *answered).collect();
            let mut there: Vec<_> = of.iter().map(|(.., there)| *there).collect();
            answered.sort();
            there.sort();
            let (median, last) = (of.len() / 2, of.len() - 1);
            println!(
                "  {what:20} {:3} times  answered: median {:7.1?}, most {:7.1?}  there: median {:7.1?}, most {:7.1?}",
                of.len(),
                answered[median],
                answered[last],
                there[median],
                there[last]
            );
            slowest = slowest.max(there[last]);
        }
        slowest
    }

    /// Returns the most memory it ever took, in kibibytes.
    fn memory(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.terminal.pid()));
        let status = status.expect("a process");
        let line = status.lines().find(|line| line.starts_with("VmHWM")).expect("memory");
        line.split_whitespace().nth(1).and_then(|kib| kib.parse().ok()).expect("a number")
    }
}

#[test]
#[ignore = "takes minutes, and a recording of 100 MB of bus bytes"]
fn a_large_recording_answers_every_key_at_once() {
    let path = std::env::var("RTUTAP_LARGE").expect("RTUTAP_LARGE names a recording");
    let mut large = Large::open(&path);
    for time in ["7000000", "3000000", "400000"] {
        large.press("not decoded yet", &format!(":{time}\r"));
    }
    large.press("on, not decoded", "}");
    large.press("on, not decoded", "}");
    large.press("a page back", "\x1b[5~");
    large.press("not decoded yet", ")");
    large.press("not decoded yet", ":300000\r");
    let early = large.print("while it is decoded");
    println!("all before it known {:?} after that", large.settle());
    large.terminal.wait_until_patiently("all is decoded", |screen| decoded(screen) == 100);
    println!("decoded after {:?}, most memory {} MiB", large.begun.elapsed(), large.memory() / 1024);
    large.go_about();
    let known = large.print("all decoded");
    large.press("a filter", "/addr == 3 && cmd == set-time\r");
    let filtered = large.print("filtered");
    large.terminal.wait_until_patiently("all is looked through", |screen| {
        let status = line(screen, STATUS);
        status.contains(" pass") && !status.contains(" in ")
    });
    println!("filtered after {:?}, most memory {} MiB", large.begun.elapsed(), large.memory() / 1024);
    assert!(large.memory() < MEMORY, "{} KiB", large.memory());
    let slowest = [early, known, filtered].into_iter().max().expect("three");
    assert!(slowest < AT_ONCE, "{slowest:?}");
}
