//! Redacted exports: no serial number is in them, however the traffic was damaged and whatever was named after one.

use std::path::Path;

use rtutap::capture::mcap::{Anchor, BusSettings, Options, Recorder};
use rtutap::capture::{Input, Item};
use rtutap::decode::chunk::{Chunk, ReadTime};
use rtutap::decode::crc;
use rtutap::time::{MILLISECOND, Timestamp};

use crate::export::{arg, temporary};
use crate::rtutap;

/// Numbers that look random and are the same each time (splitmix64, Steele and others 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ (mixed >> 31)) % limit as u64) as usize
    }

    /// Returns a serial number as an oxygen probe may have it, with letters, so that no time looks like a piece of it.
    fn serial_number(&mut self) -> String {
        let mut pair = || [b'G' + self.below(20) as u8, b'0' + self.below(10) as u8];
        let tail: Vec<u8> = [pair(), pair(), pair(), pair()].concat();
        format!("YL01{}", String::from_utf8_lossy(&tail))
    }
}

fn with_crc(mut adu: Vec<u8>) -> Vec<u8> {
    adu.extend_from_slice(&crc::checksum(&adu).to_le_bytes());
    adu
}

/// Returns a request for the serial number and its answer, and what the line makes of them.
fn exchange(serial_number: &str, random: &mut Random) -> [Vec<u8>; 2] {
    let request = with_crc(vec![1, 3, 9, 0, 0, 7]);
    let answer = with_crc([&[1, 3, 14, 1], serial_number.as_bytes(), &[0]].concat());
    [request, answer].map(|mut frame| {
        // Two of three exchanges are damaged somewhere.
        for _ in 0..random.below(3) {
            let at = random.below(frame.len());
            match random.below(4) {
                0 => frame[at] ^= 1 << random.below(8),
                1 => drop(frame.remove(at)),
                2 => frame.insert(at, random.below(256) as u8),
                _ if frame.len() > 8 => frame.truncate(at.max(1)),
                _ => {}
            }
        }
        frame
    })
}

/// Writes a recording of two probes on two buses, named after them as people do.
fn recorded(path: &Path, numbers: &[String; 2], random: &mut Random) {
    let start = Timestamp::from_ns(1_767_225_600_000_000_000);
    let anchor = Anchor { monotonic_ns: 7, realtime: start };
    let toml = format!("# made for {}\nid = \"own\"\nname = \"Own\"\n", numbers[0]).into_bytes();
    let attachments = vec![("profiles/own.toml".to_owned(), "application/toml".to_owned(), toml)];
    let options = Options { anchor: Some(anchor), attachments, ..Options::default() };
    let mut recorder = Recorder::create(path, options).expect("a disk that works");
    let buses = [0, 1].map(|bus| {
        let facts = [
            ("source", format!("/data/{}/a.hex", numbers[bus])),
            ("remark", format!("only what passes: serial == \"{}\"", numbers[1 - bus])),
            ("usb_serial", numbers[bus][4..].to_owned()),
            ("usb_model", format!("UART {}", numbers[bus].to_lowercase())),
        ];
        let facts = facts.map(|(key, fact)| (key.to_owned(), fact)).into();
        let settings = BusSettings { name: numbers[bus].clone(), facts, ..BusSettings::default() };
        recorder.add_bus(settings).expect("a disk that works")
    });
    for poll in 0..120 {
        let bus = poll % 2;
        for (frame, ms) in exchange(&numbers[bus], random).iter().zip([0, 40]) {
            let time = start + (poll as i64 * 250 + ms + 20) * MILLISECOND;
            // In two reads, as adapters hand bytes over.
            let (first, second) = frame.split_at(frame.len() / 2);
            for (bytes, later) in [(first, 0), (second, 1)] {
                let chunk = Chunk { time: ReadTime::At(time + later * MILLISECOND), bytes, line_errors: &[] };
                let ready = Some(time + later * MILLISECOND - 1000);
                recorder.write_chunk(buses[bus], &chunk, ready).expect("a disk that works");
            }
        }
    }
    recorder.finish("finished").expect("a disk that works");
}

/// Returns all that is in a file, taken out of what it is packed in.
fn content(path: &Path) -> Vec<u8> {
    let mut all = std::fs::read(path).expect("a file");
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("mcap") => {
            let file = all.clone();
            for message in mcap::MessageStream::new(&file).expect("MCAP") {
                let message = message.expect("a message");
                all.extend_from_slice(message.channel.topic.as_bytes());
                all.extend_from_slice(&message.data);
            }
        }
        #[cfg(feature = "parquet")]
        Some("parquet") => {
            use parquet::file::reader::{FileReader, SerializedFileReader};
            let reader = SerializedFileReader::new(std::fs::File::open(path).expect("a file"));
            for row in reader.expect("Parquet").get_row_iter(None).expect("rows") {
                all.extend_from_slice(row.expect("a row").to_string().as_bytes());
            }
        }
        _ => {}
    }
    all
}

/// Returns the bytes written as hex digits, with or without spaces: '59 4C' as 'YL'.
fn undigited(text: &[u8]) -> Vec<u8> {
    let digits: Vec<u8> = text.iter().copied().filter(|byte| *byte != b' ').collect();
    let value = |digit: u8| char::from(digit).to_digit(16);
    // From each place on, for bytes may begin anywhere.
    let mut bytes = Vec::new();
    for from in [0, 1] {
        let pairs = digits[from.min(digits.len())..].chunks_exact(2);
        bytes.extend(pairs.map(|pair| match (value(pair[0]), value(pair[1])) {
            (Some(high), Some(low)) => (high << 4 | low) as u8,
            _ => 0,
        }));
    }
    bytes
}

/// Returns the first piece of a serial number, five characters long, that is in a text.
fn piece_in(text: &[u8], numbers: &[String]) -> Option<String> {
    let pieces: std::collections::HashSet<Vec<u8>> =
        numbers.iter().flat_map(|number| number.as_bytes().windows(5).map(<[u8]>::to_vec)).collect();
    let upper = text.to_ascii_uppercase();
    let found = upper.windows(5).find(|window| pieces.contains(*window));
    found.map(|window| String::from_utf8_lossy(window).into_owned())
}

#[test]
fn no_piece_of_a_serial_number_is_left_in_any_format_whatever_the_damage_and_the_names() {
    for seed in 0..6 {
        let mut random = Random(seed);
        let numbers = [random.serial_number(), random.serial_number()];
        let (_directory, path) = temporary();
        let input = path("it.mcap");
        recorded(&input, &numbers, &mut random);
        let formats: &[(&str, &[&str])] = &[
            ("all.mcap", &[]),
            ("raw.mcap", &["--raw-only"]),
            ("all.csv", &["--show=frames"]),
            ("transactions.csv", &["--show=transactions"]),
            ("readings.csv", &[]),
            ("wide.csv", &["--wide"]),
            ("all.jsonl", &["--show=frames", "--show=transactions", "--show=findings"]),
            ("all.pcapng", &[]),
            #[cfg(feature = "parquet")]
            ("all.parquet", &["--show=transactions"]),
        ];
        for (name, args) in formats {
            let output = path(name);
            let plain = [&["export", arg(&input), "-o", arg(&output)], *args].concat();
            rtutap(&plain).assert().success();
            let all = content(&output);
            let is_named = !matches!(*name, "readings.csv" | "wide.csv");
            assert_eq!(piece_in(&all, &numbers).is_some(), is_named, "{name} has them otherwise");
            rtutap(&[&plain[..], &["--redact"]].concat()).assert().success();
            let all = content(&output);
            let found = piece_in(&all, &numbers).or_else(|| piece_in(&undigited(&all), &numbers));
            assert_eq!(found, None, "seed {seed}, {name}, {numbers:?}");
        }
    }
}

/// Returns the reads of a recording: bus, time, when the bytes were there, how many.
fn reads(path: &Path) -> Vec<(String, ReadTime, Option<Timestamp>, usize)> {
    let mut input = Input::open(path, None).expect("a recording");
    let mut reads = Vec::new();
    while let Some(item) = input.next_item().expect("a disk that works") {
        if let Item::Chunk { bus, chunk, ready } = item {
            reads.push((bus.to_owned(), chunk.time, ready, chunk.bytes.len()));
        }
    }
    reads.sort_by_key(|(bus, time, ..)| (bus.clone(), format!("{time:?}")));
    reads
}

#[test]
fn a_redacted_recording_keeps_its_buses_apart_and_the_times_of_all_reads() {
    let (_directory, path) = temporary();
    let (input, output) = (path("it.mcap"), path("out.mcap"));
    let numbers = ["YL0119052307".to_owned(), "YL0118110612".to_owned()];
    recorded(&input, &numbers, &mut Random(1));
    rtutap(&["export", arg(&input), "-o", arg(&output), "--redact"]).assert().success();
    let (before, after) = (reads(&input), reads(&output));
    assert!(before.len() > 400 && before.iter().any(|(_, _, ready, _)| ready.is_some()));
    let of = |reads: &[(String, ReadTime, Option<Timestamp>, usize)], bus: &str| {
        let reads = reads.iter().filter(|(name, ..)| name == bus);
        reads.map(|(_, time, ready, length)| (*time, *ready, *length)).collect::<Vec<_>>()
    };
    assert_eq!(of(&after, "YL01XXXXXXXX"), of(&before, "YL0119052307"));
    assert_eq!(of(&after, "YL01XXXXXXXX-2"), of(&before, "YL0118110612"));
}

#[test]
fn a_number_that_only_a_later_answer_explains_is_blanked_before_it_too() {
    let (_directory, path) = temporary();
    let (input, output) = (path("it.hex"), path("out.hex"));
    // Device 1 answers twice, and says at the end only who it is; what it says before is explained by nothing.
    let words = with_crc([&[1, 3, 12][..], b"QZ4711-08150"].concat());
    let profile = "id = \"own\"\nname = \"Own\"\n\n[[command]]\nname = \"get-serial-number\"\nfunction = 3\n\
                   register = 0x0010\nquantities = [6]\n\
                   response = [{ name = \"serial_number\", offset = 0, type = \"ascii\", length = 12 }]\n";
    std::fs::write(path("own.toml"), profile).expect("a file");
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02X} ")).collect::<String>();
    let ask = hex(&with_crc(vec![1, 3, 0, 0x10, 0, 6]));
    let text = format!("# line 9600-8N1\n1.0 {}\n5.0 {ask}\n5.05 {}\n", hex(&words), hex(&words));
    std::fs::write(&input, text).expect("a file");
    let profile = path("own.toml");
    let args = ["export", arg(&input), "-o", arg(&output), "--redact", "--profile", arg(&profile)];
    rtutap(&args).assert().success();
    let numbers = ["QZ4711-08150".to_owned()];
    assert!(piece_in(&undigited(&content(&input)), &numbers).is_some());
    assert_eq!(piece_in(&undigited(&content(&output)), &numbers), None);
}
