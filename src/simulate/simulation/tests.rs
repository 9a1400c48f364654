use super::*;
use crate::capture::hex_line;
use crate::decode::frame::Role;
use crate::simulate::Pace;
use crate::simulate::adu::checksum;
use crate::time::MILLISECOND;

/// What the listener needs to wake, at most, without a stall.
const WAKE: i64 = 300_000;

fn config(scenario: Scenario, adapter: Adapter, frames: u64) -> Config {
    Config { seed: 7, frames, line: LineSettings::default(), adapter, scenario }
}

fn named(name: &str) -> Scenario {
    Scenario::named(name).unwrap()
}

/// Is a whole run: all reads, the stream they make, and the truth.
struct Run {
    reads: Vec<Read>,
    stream: Vec<u8>,
    truth: Vec<TruthFrame>,
}

fn run(config: Config) -> Run {
    let mut simulation = Simulation::new(config);
    let mut run = Run { reads: Vec::new(), stream: Vec::new(), truth: Vec::new() };
    while let Some(read) = simulation.next() {
        run.stream.extend(&read.bytes);
        run.reads.push(read);
        run.truth.extend(simulation.take_truth());
        assert!(simulation.reader.packets.tap.truth.len() < 200, "memory stays flat");
    }
    assert!(simulation.reader.packets.tap.truth.is_empty(), "all truth is told in the end");
    run
}

impl Run {
    /// Returns when the byte before an offset in the stream was read.
    fn read_time(&self, offset: u64) -> Timestamp {
        let mut end = 0;
        let read = self.reads.iter().find(|read| {
            end += read.bytes.len() as u64;
            end >= offset
        });
        read.unwrap().time
    }

    /// Counts the bytes that are not as they were sent, in frames of which all came.
    fn altered(&self) -> usize {
        let whole = self.truth.iter().filter(|frame| frame.end - frame.start == frame.bytes.len() as u64);
        whole
            .flat_map(|frame| frame.bytes.iter().zip(&self.stream[frame.start as usize..]))
            .filter(|(sent, received)| sent != received)
            .count()
    }
}

/// Asserts that a share is what a probability makes of so many trials, give or take four standard deviations.
fn assert_rate(hits: usize, trials: usize, probability: f64) {
    let (hits, trials) = (hits as f64, trials as f64);
    let deviation = (trials * probability * (1.0 - probability)).sqrt();
    assert!((hits - trials * probability).abs() < 4.0 * deviation, "{hits} of {trials}, not {probability}");
}

#[test]
fn the_same_seed_gives_the_same_run_and_another_seed_another() {
    let first = config(named("everything-bad"), Adapter::Ftdi16, 500);
    let (a, b) = (run(first), run(first));
    assert_eq!((a.reads, a.truth), (b.reads, b.truth));
    assert_ne!(a.stream, run(Config { seed: 8, ..first }).stream);
}

#[test]
fn the_adapter_changes_when_bytes_are_read_but_never_which() {
    for scenario in Scenario::all() {
        let uart = run(config(*scenario, Adapter::Uart, 300));
        for adapter in [Adapter::Usb1, Adapter::Ftdi16, Adapter::Idle64] {
            let other = run(config(*scenario, adapter, 300));
            assert_eq!(uart.stream, other.stream, "{} {adapter}", scenario.name);
            assert_eq!(uart.truth, other.truth, "{} {adapter}", scenario.name);
            assert_ne!(uart.reads, other.reads, "{} {adapter}", scenario.name);
        }
    }
}

#[test]
fn clean_frames_are_in_the_stream_where_the_truth_says() {
    for scenario in Scenario::all() {
        for adapter in Adapter::ALL {
            let run = run(config(*scenario, adapter, 600));
            let mut end = 0;
            for frame in &run.truth {
                assert!(end <= frame.start && frame.start <= frame.end, "in order and disjoint");
                end = frame.end;
                let received = &run.stream[frame.start as usize..frame.end as usize];
                assert_eq!(frame.clean, received == frame.bytes, "{} {adapter}", scenario.name);
                // A master that leaves the byte count out of a write is one of the mistakes.
                let is_good = checksum(&frame.bytes) == 0 || scenario.name == "mistaken-master";
                assert!(is_good, "what is sent has a good CRC");
                assert_eq!([frame.address, frame.function], frame.bytes[..2]);
            }
            assert!(run.truth.len() >= 600 && run.truth.len() <= 610);
            assert!(run.truth.iter().filter(|frame| frame.clean).count() > 400, "{}", scenario.name);
        }
    }
}

#[test]
fn reads_come_in_order_and_never_before_their_bytes() {
    for scenario in Scenario::all() {
        for adapter in Adapter::ALL {
            let run = run(config(*scenario, adapter, 200));
            assert!(run.reads.windows(2).all(|pair| pair[0].time < pair[1].time));
            assert!(run.reads.iter().all(|read| !read.bytes.is_empty()));
            for frame in run.truth.iter().filter(|frame| frame.clean) {
                assert!(run.read_time(frame.end) >= frame.end_time, "{} {adapter}", scenario.name);
            }
        }
    }
}

#[test]
fn without_stalls_no_byte_is_kept_longer_than_the_adapters_hold() {
    for text in ["9600-8N1", "115200-8N1", "1200-8E1"] {
        let line: LineSettings = text.parse().unwrap();
        for name in ["clean", "tight", "sloppy", "two-masters", "installation"] {
            for adapter in Adapter::ALL {
                let run = run(Config { line, ..config(named(name), adapter, 300) });
                let longest = run
                    .truth
                    .iter()
                    .filter(|frame| frame.clean)
                    .map(|frame| run.read_time(frame.end) - frame.end_time)
                    .max();
                assert!(longest.unwrap() <= adapter.hold_ns(line) + WAKE, "{text} {name} {adapter}");
            }
        }
    }
}

#[test]
fn an_ftdi_packet_has_62_bytes_at_most_and_none_waits_past_the_tick() {
    for (adapter, tick) in [(Adapter::Usb1, MILLISECOND), (Adapter::Ftdi16, 16 * MILLISECOND)] {
        let fast = "115200-8N1".parse().unwrap();
        let mut packets = packets(Config { line: fast, ..config(named("tight"), adapter, 3000) });
        let mut packet = Vec::new();
        let mut longest = 0;
        while let Some(arrival) = packets.next(&mut packet) {
            longest = longest.max(packet.len());
            let (first, last) = (packet[0].end, packet[packet.len() - 1].end);
            assert!(last - first <= tick && arrival >= last && arrival - first <= tick + MILLISECOND);
        }
        let room = (tick / 86_806 + 1) as usize; // 86.8 µs a character
        assert_eq!(longest, room.min(62));
    }
}

#[test]
fn talkers_keep_t3_5_and_overlap_only_in_collisions() {
    let t3_5 = LineSettings::default().t3_5_ns();
    for scenario in Scenario::all() {
        let run = run(config(*scenario, Adapter::Uart, 2000));
        let collides = scenario.second_master || scenario.two_answers > 0.0 || scenario.late > 0.0;
        let mut overlaps = 0;
        for pair in run.truth.windows(2) {
            let gap = pair[1].start_time - pair[0].end_time;
            let close = pair[1].echo || scenario.pace == Pace::Sloppy;
            overlaps += usize::from(gap < 0);
            assert!(gap >= t3_5 || close && gap > 0 || collides, "{} {gap}", scenario.name);
        }
        // An installation leaves much silence, and its late answers hit a request rarely.
        let sure = collides && scenario.equipment == Equipment::Generic;
        assert!((overlaps > 0) >= sure, "{}", scenario.name);
    }
}

#[test]
fn responses_name_the_request_they_answer() {
    for scenario in Scenario::all() {
        let run = run(config(*scenario, Adapter::Uart, 1000));
        for (index, frame) in run.truth.iter().enumerate() {
            assert_eq!(frame.request.is_some(), frame.role == Role::Response);
            let Some(request) = frame.request else { continue };
            let asked = &run.truth[request as usize];
            assert!(request < index as u64 && asked.role == Role::Request && !asked.echo);
            assert_eq!((asked.address, asked.function), (frame.address, frame.function & 0x7F));
        }
    }
}

#[test]
fn faults_strike_as_often_as_the_scenario_says() {
    let count = |name| run(config(named(name), Adapter::Uart, 10_000));
    for (name, rate) in [("corrupt-0.01", 0.0001), ("corrupt-0.1", 0.001), ("corrupt-1", 0.01)] {
        let run = count(name);
        assert_rate(run.altered(), run.stream.len(), rate);
    }
    let drops = count("drops");
    let sent: usize = drops.truth.iter().map(|frame| frame.bytes.len()).sum();
    assert_rate(sent - drops.stream.len(), sent, 0.001);
    let glitches = count("glitch");
    let sent: usize = glitches.truth.iter().map(|frame| frame.bytes.len()).sum();
    assert_rate(glitches.stream.len() - sent, glitches.truth.len(), 0.1);
    let noise = count("noise");
    let after = noise.truth.windows(2).filter(|pair| pair[0].end < pair[1].start).count();
    assert_rate(after, noise.truth.len(), 0.1);
}

#[test]
fn units_are_silent_and_late_as_often_as_the_scenario_says() {
    let count = |name| run(config(named(name), Adapter::Uart, 10_000)).truth;
    for (name, rate) in [("clean", 0.02), ("no-response", 0.2)] {
        let truth = count(name);
        let asked = truth.iter().filter(|frame| frame.role == Role::Request && frame.address != 0).count();
        let answered = truth.iter().filter(|frame| frame.role == Role::Response).count();
        assert_rate(asked - answered, asked, rate);
    }
    let truth = count("late");
    let late = |frame: &&TruthFrame| {
        let asked = frame.request.map(|request| &truth[request as usize]);
        asked.is_some_and(|asked| frame.start_time - asked.end_time > 500 * MILLISECOND)
    };
    let late: Vec<_> = truth.iter().filter(late).collect();
    assert!(late.len() > 200, "{} late answers", late.len());
    let overtaken = late.iter().filter(|frame| {
        let request = frame.request.unwrap() as usize;
        truth[request + 1..].iter().take_while(|other| other.start_time < frame.start_time).count() > 0
    });
    assert!(overtaken.count() > 100, "the master has often gone on before");
}

#[test]
fn an_echo_follows_every_request() {
    let truth = run(config(named("echo"), Adapter::Uart, 1000)).truth;
    for pair in truth.windows(2).filter(|pair| pair[0].role == Role::Request && !pair[0].echo) {
        assert!(pair[1].echo && pair[1].bytes == pair[0].bytes);
    }
    assert!(truth.iter().filter(|frame| frame.echo).count() > 300);
}

#[test]
fn a_parity_bit_shows_a_wrong_bit_where_the_adapter_tells() {
    let line = "9600-8E1".parse().unwrap();
    for (adapter, told) in [(Adapter::Uart, true), (Adapter::Idle64, false)] {
        let run = run(Config { line, ..config(named("corrupt-1"), adapter, 2000) });
        let errors: usize = run.reads.iter().map(|read| read.line_errors.len()).sum();
        assert_eq!(errors, if told { run.altered() } else { 0 });
    }
}

#[test]
fn the_installation_asks_the_oxygen_probe_as_its_manual_prints() {
    let truth = run(config(named("installation"), Adapter::Ftdi16, 200)).truth;
    assert!(truth.iter().all(|frame| frame.clean));
    let printed = [
        "FF 03 30 00 00 01 9E D4", // get the address, of the conductivity probe
        "01 03 09 00 00 07 07 94",
        "01 03 07 00 00 02 C5 7F",
        "01 03 04 02 00 05 07 B9 19",
        "01 03 11 00 00 04 41 35",
        "01 03 08 00 00 80 3F 00 00 00 00 9E 12",
        "01 03 25 00 00 00 4E C6",
        "01 03 00 20 F0",
        "01 03 26 00 00 04 4F 41",
        "01 03 2E 00 00 00 4C E2",
    ];
    for hex in printed {
        let bytes: Vec<u8> = hex.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
        assert!(truth.iter().any(|frame| frame.bytes == bytes), "{hex}");
    }
}

#[test]
fn the_demo_shows_all_sensors_and_its_faults_within_ten_seconds() {
    for seed in 0..5 {
        let Run { truth, .. } = run(Config { seed, ..config(named("demo"), Adapter::Ftdi16, 200) });
        let early = || truth.iter().filter(|frame| frame.start_time - EPOCH < 10 * SECOND);
        for (address, register) in [(1, 0x00), (2, 0x00), (3, 0x01)] {
            let measured = early().any(|frame| {
                let asked = frame.request.map(|request| &truth[request as usize].bytes[..4]);
                asked == Some(&[address, 3, 0x26, register])
            });
            assert!(measured, "seed {seed}: address {address}");
        }
        let asked = early().filter(|frame| frame.role == Role::Request).count();
        assert!(early().filter(|frame| frame.role == Role::Response).count() < asked, "seed {seed}: silence");
        let glitch = early().zip(early().skip(1)).any(|(frame, next)| frame.end < next.start);
        assert!(glitch || early().any(|frame| !frame.clean), "seed {seed}: bytes that should not be");
    }
}

#[test]
fn the_listener_stalls_as_often_as_the_scenario_says() {
    let stalls = config(named("stalls"), Adapter::Uart, 4000);
    let mut packets = packets(stalls);
    let mut packet = Vec::new();
    let (mut stalled, mut reads) = (0, 0);
    for read in Simulation::new(stalls) {
        let mut ends = read.bytes.iter().filter_map(|_| packets.next(&mut packet));
        let first = ends.next().unwrap(); // a UART hands over byte by byte
        assert_eq!(ends.count() + 1, read.bytes.len());
        stalled += usize::from(read.time - first > WAKE);
        reads += 1;
    }
    assert_rate(stalled, reads, 0.02);
}

#[test]
fn a_busy_usb_host_keeps_packets_in_order_but_up_to_50_ms_back() {
    let mut packets = packets(config(named("host-stalls"), Adapter::Ftdi16, 4000));
    let mut packet = Vec::new();
    let (mut late, mut count, mut last) = (0, 0, Timestamp::MIN);
    while let Some(arrival) = packets.next(&mut packet) {
        assert!(arrival >= last);
        last = arrival;
        let kept = arrival - packet[0].end;
        assert!(kept <= 67 * MILLISECOND);
        late += usize::from(kept > 17 * MILLISECOND);
        count += 1;
    }
    // Nearly every stall shows, and holds up to three packets more.
    assert!(late * 200 > count && late * 25 < count, "{late} of {count}");
}

#[test]
fn samples_stay_the_same_for_ever() {
    let mut sums = Vec::new();
    for name in ["installation", "demo", "everything-bad", "two-masters"] {
        let text: String = Simulation::new(config(named(name), Adapter::Ftdi16, 1000))
            .map(|read| hex_line(&read.chunk()) + "\n")
            .collect();
        sums.push(checksum(text.as_bytes()));
    }
    assert_eq!(sums, [15219, 3804, 60137, 31506]);
}

#[test]
fn absurd_settings_do_no_harm() {
    let worst = Scenario {
        exceptions: 1.0,
        no_response: 0.5,
        late: 0.5,
        echo: true,
        second_master: true,
        two_answers: 1.0,
        corrupt: 1.0,
        drop: 0.5,
        stray: 1.0,
        glitch: 1.0,
        stall: 1.0,
        host_stall: 1.0,
        ..named("sloppy")
    };
    let slowest = LineSettings { baud: 0, ..LineSettings::default() };
    let fastest = LineSettings { baud: u32::MAX, ..LineSettings::default() };
    for line in [slowest, fastest] {
        for adapter in Adapter::ALL {
            for seed in [0, u64::MAX] {
                let absurd = Config { seed, line, ..config(worst, adapter, 500) };
                assert!(run(absurd).truth.len() >= 500);
            }
        }
    }
    let lost = Scenario { drop: 1.0, ..named("clean") };
    assert_eq!(Simulation::new(config(lost, Adapter::Uart, 100)).count(), 0, "nothing gets through");
    assert_eq!(Simulation::new(config(named("clean"), Adapter::Uart, 0)).count(), 0, "nothing is asked");
}
