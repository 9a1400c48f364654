//! What tapping costs: time to a line, processor time.

use std::fs::File;
use std::io::Read;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use rtutap::simulate::Adapter;

use crate::bus::{Bus, LAST, Tap, reads};

/// Appends the CRC of Modbus.
fn with_crc(bytes: &[u8]) -> Vec<u8> {
    let crc = bytes.iter().fold(0xFFFF_u16, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xA001 } else { crc >> 1 })
    });
    [bytes, &crc.to_le_bytes()].concat()
}

/// Is a pty read by a thread that tells another, which tells this one: the way of a line without the program.
struct Bare {
    bus: Bus,
    heard: Receiver<()>,
}

impl Bare {
    fn new() -> Self {
        let bus = Bus::new();
        let mut tty = File::open(&bus.path).expect("a pty of ours");
        let mut raw = tcgetattr(&tty).expect("a terminal");
        raw.make_raw();
        tcsetattr(&tty, OptionalActions::Now, &raw).expect("a terminal");
        let (reader, between) = channel();
        let (teller, heard) = channel();
        std::thread::spawn(move || {
            let mut bytes = [0; 64];
            while tty.read(&mut bytes).is_ok_and(|count| count > 0) && reader.send(()).is_ok() {}
        });
        std::thread::spawn(move || between.iter().try_for_each(|()| teller.send(())));
        Bare { bus, heard }
    }

    /// Returns how long that takes.
    fn latency(&mut self) -> Duration {
        self.heard.try_iter().for_each(drop);
        self.bus.say(&[0; 9]);
        let said = Instant::now();
        self.heard.recv().expect("a thread");
        said.elapsed()
    }
}

/// Returns from a response's last byte to its line, and what the machine takes of it, both sorted.
fn latencies(count: u16) -> (Vec<Duration>, Vec<Duration>) {
    let mut bus = Bus::new();
    let mut bare = Bare::new();
    let mut machine = Vec::new();
    let mut tap = Tap::start(&["listen", &bus.path, "--format", "json"]);
    bus.wait_for_listener();
    let mut latencies = Vec::new();
    for n in 0..count {
        bus.say(&with_crc(&[1, 3, 0, 0, 0, 2]));
        std::thread::sleep(Duration::from_millis(15));
        let [high, low] = n.to_be_bytes();
        bus.say(&with_crc(&[1, 3, 4, 17, 18, high, low]));
        let said = Instant::now();
        tap.wait_for("\"answered\"");
        latencies.push(said.elapsed());
        std::thread::sleep(Duration::from_millis(20));
        machine.push(bare.latency());
    }
    latencies.sort();
    machine.sort();
    (latencies, machine)
}

#[test]
fn a_line_follows_its_frame_without_waiting_for_silence() {
    let (latencies, _) = latencies(10);
    // The median: others may keep this machine busy. Silence would be 120 ms.
    assert!(latencies[5] < Duration::from_millis(60), "{latencies:?}");
}

#[test]
#[ignore = "measures an idle machine"]
fn a_line_follows_its_frame_within_5_ms() {
    let (latencies, machine) = latencies(1000);
    for (what, durations) in [("a line", &latencies), ("the machine alone", &machine)] {
        let [p50, p99, most] = [500, 990, 999].map(|at| durations[at]);
        println!("{what}: p50 {p50:?}, p99 {p99:?}, most {most:?}");
    }
    // An idle machine takes a tenth of a millisecond; what a busy one takes is none of the program's.
    let p99 = latencies[990].saturating_sub(machine[990]);
    assert!(p99 < Duration::from_millis(5), "{p99:?}");
}

/// Returns the processor time of a process so far.
fn processor_time(pid: u32) -> Duration {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).expect("a process");
    let (_, rest) = stat.rsplit_once(')').expect("the name in parentheses");
    let ticks: u64 = rest.split_whitespace().skip(11).take(2).map(|n| n.parse::<u64>().expect("ticks")).sum();
    Duration::from_millis(ticks * 10)
}

/// Returns the share of a core that tapping a busy bus takes, in percent.
fn load(args: &[&str], baud: u32, batch: usize, duration: Duration) -> f64 {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let mut bus = Bus::new();
    let line = format!("{baud}-8N1");
    let mut args: Vec<&str> = args.to_vec();
    args.extend([&*bus.path, "--line", &line]);
    args.extend(match args[0] {
        "record" => ["-o", path.to_str().expect("UTF-8")],
        _ => ["--record", path.to_str().expect("UTF-8")],
    });
    let mut tap = Tap::start(&args);
    bus.wait_for_listener();
    let bytes: Vec<u8> =
        reads("tight", Adapter::Uart, 1, 5000).into_iter().flat_map(|read| read.bytes).collect();
    let (begun, before) = (Instant::now(), processor_time(tap.pid()));
    let mut said = 0_usize;
    for part in bytes.chunks(batch).cycle() {
        let due = Duration::from_secs_f64((said + part.len()) as f64 * 10.0 / f64::from(baud));
        if due > duration {
            break;
        }
        std::thread::sleep(due.saturating_sub(begun.elapsed()));
        bus.say(part);
        said += part.len();
    }
    let share = (processor_time(tap.pid()) - before).as_secs_f64() / begun.elapsed().as_secs_f64() * 100.0;
    bus.say(&LAST);
    tap.interrupt();
    share
}

#[test]
#[ignore = "measures an idle machine"]
fn a_busy_bus_takes_little_of_a_core() {
    let duration = Duration::from_secs(20);
    let mut too_much = Vec::new();
    for (baud, batch, most) in [(9600, 15, 2.0), (115_200, 62, 5.0), (9600, 1, 6.0), (115_200, 1, 30.0)] {
        for args in [&["record", "--min-free", "0"][..], &["listen", "--format", "json"]] {
            let share = load(args, baud, batch, duration);
            println!("{} at {baud} baud, {batch} bytes at once: {share:.2} % of a core", args[0]);
            if share > most {
                too_much.push((args[0], baud, batch, share));
            }
        }
    }
    assert!(too_much.is_empty(), "{too_much:?}");
}
