//! Masters and a server of others, on a paced bus: what is decoded is what they said.

use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde_json::Value;

use rtutap::capture::Input;
use rtutap::decode::chunk::ReadTime;
use rtutap::line::LineSettings;
use rtutap::simulate::{Adapter, Config, Scenario, Simulation};

use rtutap::time::MILLISECOND;

use crate::bus::{Bus, LAST, Tap, pace, printed};

/// How the tap gets its bytes.
#[derive(Clone, Copy, Debug)]
enum Batches {
    AsTheyCome,
    Of(Duration),
}

/// Is what one side said.
#[derive(Debug)]
struct Said {
    is_request: bool,
    bytes: Vec<u8>,
}

const CHARACTER: Duration = Duration::from_nanos(1_041_667);

/// Hands bytes to the tap when they have been on the wire, in batches.
fn feed(mut bus: Bus, bytes: &Receiver<(u8, Instant)>, batches: Batches) -> Bus {
    let begun = Instant::now();
    let mut ahead = None;
    while let Some((byte, time)) = ahead.take().or_else(|| bytes.recv().ok()) {
        let due = match batches {
            Batches::AsTheyCome => time,
            Batches::Of(tick) => {
                let ticks = time.duration_since(begun).as_nanos() / tick.as_nanos() + 1;
                begun + tick * u32::try_from(ticks).expect("a short test")
            }
        };
        thread::sleep(due.saturating_duration_since(Instant::now()));
        let mut batch = vec![byte];
        while let Ok((byte, time)) = bytes.try_recv() {
            if time > due {
                ahead = Some((byte, time));
                break;
            }
            batch.push(byte);
        }
        bus.say(&batch);
    }
    bus
}

/// Reads what a program says at once, until it pauses; `None` when nothing comes.
fn listen(mut side: &File, patience: Duration) -> Option<Vec<u8>> {
    let mut said = Vec::new();
    let mut wait = patience;
    loop {
        let timeout = Timespec::try_from(wait).expect("a short wait");
        if poll(&mut [PollFd::new(&side, PollFlags::IN)], Some(&timeout)).ok()? == 0 {
            return (!said.is_empty()).then_some(said);
        }
        let mut buffer = [0; 512];
        let count = side.read(&mut buffer).ok()?;
        said.extend_from_slice(&buffer[..count]);
        wait = Duration::from_millis(2);
    }
}

/// Lets a master and a server talk for a while; returns what they said.
fn relay(master: &File, server: &File, tap: &Sender<(u8, Instant)>, duration: Duration) -> Vec<Said> {
    let (begun, mut said) = (Instant::now(), Vec::new());
    let mut free = Instant::now();
    while begun.elapsed() < duration {
        let sides = [(true, master, server), (false, server, master)];
        for (is_request, from, mut to) in sides {
            let Some(bytes) = listen(from, Duration::from_millis(1)) else { continue };
            let start = free.max(Instant::now());
            for (index, byte) in bytes.iter().enumerate() {
                let end = start + CHARACTER * (index as u32 + 1);
                tap.send((*byte, end)).expect("a tap");
            }
            free = start + CHARACTER * bytes.len() as u32;
            thread::sleep(free.saturating_duration_since(Instant::now()));
            to.write_all(&bytes).expect("a program that listens");
            free += CHARACTER * 4;
            said.push(Said { is_request, bytes });
        }
    }
    said
}

fn python(script: &str, args: &[&str]) -> Child {
    let python = std::env::var("RTUTAP_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = format!("{}/tests/live/{script}", env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(python);
    command.arg(script).args(args).stdout(Stdio::null());
    command.spawn().expect("python")
}

fn start_master(name: &str, path: &str) -> Child {
    match name {
        "mbpoll" => {
            let args = ["-m", "rtu", "-b", "9600", "-P", "none", "-a", "1", "-t", "4", "-r", "1", "-c", "9"];
            let mut command = Command::new("mbpoll");
            command.args(args).args(["-l", "100", "-o", "1", path]).stdout(Stdio::null());
            command.spawn().expect("mbpoll")
        }
        name => python("master.py", &[name, path]),
    }
}

/// Returns the offsets at which a read came so late that this machine must have stood still: bytes come within
/// milliseconds here, or after a pause at the end of a frame.
fn late_reads(path: &Path) -> Vec<u64> {
    let mut input = Input::open(path, None).expect("a recording");
    let (mut offset, mut before, mut late) = (0, None, Vec::new());
    while let Some(chunk) = input.next_chunk().expect("a disk that works") {
        let ReadTime::At(time) = chunk.time else { panic!("a live recording has times") };
        if before.is_some_and(|before| time - before > 100 * MILLISECOND) {
            late.push(offset);
        }
        (before, offset) = (Some(time), offset + chunk.bytes.len() as u64);
    }
    late
}

/// Is what was said and how much of it was decoded.
struct Score {
    frames: usize,
    right: usize,
    /// Frames within which the machine stood still: what is decoded then says nothing about the program.
    torn: usize,
    pairs: usize,
    answered: usize,
    wrong: Vec<String>,
}

impl Score {
    fn is_good(&self) -> bool {
        let judged = self.frames - self.torn;
        self.frames >= 20
            && self.torn * 10 <= self.frames
            && self.right as f64 >= 0.9995 * judged as f64
            && self.answered + self.torn >= self.pairs
    }
}

/// Holds the rows of a recording against what was said: bytes, frames with roles, pairs.
fn hold(rows: &str, said: &[Said], late: &[u64], what: &str) -> Score {
    let rows: Vec<Value> = rows.lines().map(|row| serde_json::from_str(row).expect("JSON")).collect();
    let text = |row: &Value, key: &str| row[key].as_str().unwrap_or_default().to_owned();
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let runs = rows.iter().filter(|row| row["stream_offset"].is_u64() && row["type"] != "lost");
    let recorded: String = runs.clone().map(|row| text(row, "bytes")).collect();
    let spoken: String = said.iter().map(|said| hex(&said.bytes)).collect();
    assert_eq!(recorded.strip_suffix(&hex(&LAST)), Some(&*spoken), "{what}: every byte is recorded");
    let found: HashMap<u64, &Value> =
        runs.map(|row| (row["stream_offset"].as_u64().expect("an offset"), row)).collect();
    let mut score = Score { frames: said.len(), right: 0, torn: 0, pairs: 0, answered: 0, wrong: Vec::new() };
    let mut offset = 0;
    for said in said {
        let role = if said.is_request { "request" } else { "response" };
        let end = offset + said.bytes.len() as u64;
        let is_right = found.get(&offset).is_some_and(|row| {
            row["type"] == "frame" && row["role"] == role && text(row, "bytes") == hex(&said.bytes)
        });
        if is_right {
            score.right += 1;
        } else if late.iter().any(|late| offset < *late && *late < end) {
            score.torn += 1;
        } else {
            score.wrong.push(format!("{role} {}: {:?}", hex(&said.bytes), found.get(&offset)));
        }
        offset = end;
    }
    score.pairs = said.windows(2).filter(|pair| pair[0].is_request && !pair[1].is_request).count();
    let answered = rows.iter().filter(|row| {
        row["type"] == "transaction" && matches!(row["outcome"].as_str(), Some("answered" | "exception"))
    });
    score.answered = answered.count();
    let Score { frames, right, torn, pairs, answered, .. } = &score;
    println!(
        "{what}: {right} of {frames} frames and roles right, {torn} torn by this machine, {answered} of {pairs} pairs"
    );
    score
}

/// Lets a tap record what `talk` says, and holds its rows against that.
fn tapped(what: &str, batches: Batches, talk: impl FnOnce(&Sender<(u8, Instant)>) -> Vec<Said>) -> Score {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("a.mcap");
    let name = path.to_str().expect("UTF-8");
    let bus = Bus::new();
    let rows = ["--show", "frames", "--show", "transactions", "--format", "json"];
    let mut tap = Tap::start(&[&["listen", &bus.path, "--record", name], &rows[..]].concat());
    bus.wait_for_listener();
    let (sender, receiver) = channel();
    let feeder = thread::spawn(move || feed(bus, &receiver, batches));
    let said = talk(&sender);
    drop(sender);
    let mut bus = feeder.join().expect("a feeder");
    thread::sleep(Duration::from_millis(50));
    bus.say(&LAST);
    tap.wait_for("f70312340001d42a");
    tap.interrupt();
    let decoded = printed(&[&["decode", name], &rows[..]].concat());
    assert_eq!(tap.printed, decoded);
    hold(&decoded, &said, &late_reads(&path), what)
}

#[test]
#[ignore = "needs pymodbus, minimalmodbus and mbpoll, and takes minutes"]
fn what_third_parties_say_to_each_other_is_what_is_decoded() {
    let seconds = std::env::var("RTUTAP_SECONDS").ok().and_then(|text| text.parse().ok()).unwrap_or(60);
    let mut bad = Vec::new();
    for master in ["pymodbus", "minimalmodbus", "mbpoll"] {
        for batches in [
            Batches::AsTheyCome,
            Batches::Of(Duration::from_millis(1)),
            Batches::Of(Duration::from_millis(16)),
        ] {
            let what = format!("{master}, {batches:?}");
            let score = tapped(&what, batches, |tap| {
                let (to_server, to_master) = (Bus::new(), Bus::new());
                let mut server = python("server.py", &[&to_server.path]);
                to_server.wait_until_open();
                let mut program = start_master(master, &to_master.path);
                to_master.wait_until_open();
                let said =
                    relay(&to_master.into_file(), &to_server.into_file(), tap, Duration::from_secs(seconds));
                for child in [&mut program, &mut server] {
                    child.kill().expect("a program that runs");
                    child.wait().expect("a program");
                }
                said
            });
            if !score.is_good() {
                bad.push((what, score.wrong));
            }
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

#[test]
fn what_is_said_on_a_paced_bus_is_what_is_decoded() {
    let scenario = Scenario::named("installation").expect("a scenario");
    let line = LineSettings::default();
    let config = Config { seed: 3, frames: 30, line, adapter: Adapter::Uart, scenario };
    let score = tapped("a simulation", Batches::Of(Duration::from_millis(16)), |tap| {
        let mut simulation = Simulation::new(config);
        let mut reads = Vec::new();
        reads.extend(simulation.by_ref());
        let bytes: Vec<u8> = reads.iter().flat_map(|read| read.bytes.clone()).collect();
        pace(&reads, |read| {
            read.bytes.iter().for_each(|byte| tap.send((*byte, Instant::now())).expect("a tap"));
        });
        let truth = simulation.take_truth();
        let said = truth.iter().map(|frame| Said {
            is_request: frame.role == rtutap::decode::frame::Role::Request,
            bytes: bytes[frame.start as usize..frame.end as usize].to_vec(),
        });
        said.collect()
    });
    assert!(score.is_good(), "{:#?}", score.wrong);
}
