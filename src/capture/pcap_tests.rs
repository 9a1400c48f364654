use proptest::prelude::*;

use super::*;

const FRAME: &[u8] = b"\x01\x03\x26\x00\x00\x04\x4f\x41";

/// A chunk: its time, bytes and line errors.
type Packet = (ReadTime, Vec<u8>, Vec<LineErrorKind>);

/// Reads a file as far as it goes: times, bytes and line errors, and how it ended.
fn read(file: &[u8]) -> (Vec<Packet>, Result<(), String>) {
    let mut reader = Pcap::new(file);
    let mut chunks = Vec::new();
    loop {
        match reader.advance() {
            Ok(true) => {
                let chunk = reader.chunk();
                assert!(chunk.line_errors.iter().all(|error| error.offset == 0));
                let errors = chunk.line_errors.iter().map(|error| error.kind).collect();
                chunks.push((chunk.time, chunk.bytes.to_vec(), errors));
            }
            Ok(false) => return (chunks, Ok(())),
            Err(Failure::Malformed(error)) => return (chunks, Err(error.to_string())),
            Err(other) => return (chunks, Err(format!("{other:?}"))),
        }
    }
}

fn at(ns: i64) -> ReadTime {
    ReadTime::At(Timestamp::from_ns(ns))
}

/// Writes numbers in the order of bytes that is tested.
#[derive(Clone, Copy)]
struct Writer {
    big: bool,
}

const LITTLE: Writer = Writer { big: false };

impl Writer {
    fn u16(self, number: u16) -> [u8; 2] {
        if self.big { number.to_be_bytes() } else { number.to_le_bytes() }
    }

    fn u32(self, number: u32) -> [u8; 4] {
        if self.big { number.to_be_bytes() } else { number.to_le_bytes() }
    }

    fn block(self, kind: u32, body: &[u8]) -> Vec<u8> {
        let padded = body.len().next_multiple_of(4);
        let length = self.u32(padded as u32 + 12);
        let mut block = [self.u32(kind), length].concat();
        block.extend_from_slice(body);
        block.resize(8 + padded, 0);
        block.extend_from_slice(&length);
        block
    }

    fn section(self) -> Vec<u8> {
        let body = [&self.u32(0x1A2B_3C4D)[..], &self.u16(1), &self.u16(0), &[0xFF; 8]].concat();
        self.block(0x0A0D_0D0A, &body)
    }

    fn interface(self, link_type: u16, resolution: Option<u8>, offset: Option<i64>) -> Vec<u8> {
        let mut body = [&self.u16(link_type)[..], &self.u16(0), &self.u32(0)].concat();
        if let Some(resolution) = resolution {
            body.extend([&self.u16(9)[..], &self.u16(1), &[resolution, 0, 0, 0]].concat());
        }
        if let Some(offset) = offset {
            let offset = if self.big { offset.to_be_bytes() } else { offset.to_le_bytes() };
            body.extend([&self.u16(14)[..], &self.u16(8), &offset].concat());
        }
        body.extend([0; 4]);
        self.block(1, &body)
    }

    /// Writes an interface with a name and a description, where they are not empty.
    fn named(self, name: &str, description: &str) -> Vec<u8> {
        let mut body = [&self.u16(147)[..], &self.u16(0), &self.u32(0)].concat();
        for (code, text) in [(2, name), (3, description)].into_iter().filter(|(_, text)| !text.is_empty()) {
            body.extend([&self.u16(code)[..], &self.u16(text.len() as u16), text.as_bytes()].concat());
            body.resize(body.len().next_multiple_of(4), 0);
        }
        body.extend([0; 4]);
        self.block(1, &body)
    }

    fn packet(self, interface: u32, units: u64, data: &[u8], length: usize) -> Vec<u8> {
        let numbers = [interface, (units >> 32) as u32, units as u32, data.len() as u32, length as u32];
        let mut body: Vec<u8> = numbers.iter().flat_map(|&number| self.u32(number)).collect();
        body.extend_from_slice(data);
        self.block(6, &body)
    }

    fn legacy(self, magic: u32, link_type: u32, packets: &[(u32, u32, &[u8])]) -> Vec<u8> {
        let mut file = [self.u32(magic), self.u32(0x0004_0002), self.u32(0), self.u32(0)].concat();
        if self.big {
            file[4..8].copy_from_slice(&[0, 2, 0, 4]);
        }
        file.extend([self.u32(65535), self.u32(link_type)].concat());
        for (seconds, fraction, data) in packets {
            let length = data.len() as u32;
            let header = [*seconds, *fraction, length, length].map(|number| self.u32(number));
            file.extend(header.concat());
            file.extend_from_slice(data);
        }
        file
    }
}

fn rtac(event: u8, data: &[u8]) -> Vec<u8> {
    [&[0; 8][..], &[event, 0, 0, 0], data].concat()
}

#[test]
fn pcapng_in_either_byte_order_gives_frames_with_their_times_to_the_nanosecond() {
    for big in [false, true] {
        let write = Writer { big };
        let ns = 1_767_225_600_123_456_789;
        let file = [
            write.section(),
            write.interface(147, Some(9), None),
            write.packet(0, ns, FRAME, 8),
            write.block(5, &[0; 12]), // interface statistics
            write.packet(0, ns + 1, &FRAME[..5], 5),
        ]
        .concat();
        let (chunks, end) = read(&file);
        assert_eq!(end, Ok(()), "{big}");
        let ns = ns as i64;
        let expected = [(at(ns), FRAME.to_vec(), vec![]), (at(ns + 1), FRAME[..5].to_vec(), vec![])];
        assert_eq!(chunks, expected, "{big}");
    }
}

#[test]
fn times_count_in_what_the_interface_says_and_from_its_offset() {
    for big in [false, true] {
        let write = Writer { big };
        for (resolution, offset, units, ns) in [
            (None, None, 1_600_000_000_123_456, 1_600_000_000_123_456_000),
            (Some(0), None, 1_600_000_000, 1_600_000_000_000_000_000),
            (Some(3), Some(1_600_000_000), 1_001, 1_600_000_001_001_000_000),
            (Some(6), Some(-5), 10_000_001, 5_000_001_000),
            (Some(12), None, 1_999_999, 1_999),
            (Some(127), None, u64::MAX, 0),
            (Some(0x80 | 32), None, 3 << 31, 1_500_000_000),
            (Some(0x80 | 127), None, u64::MAX, 0),
        ] {
            let file =
                [write.section(), write.interface(147, resolution, offset), write.packet(0, units, FRAME, 8)]
                    .concat();
            let (chunks, end) = read(&file);
            assert_eq!((chunks[0].0, end), (at(ns), Ok(())), "{resolution:?} {offset:?} {big}");
        }
        for (offset, seconds) in [(None, u64::MAX), (None, 4_611_686_019), (Some(-2_305_843_010), 0)] {
            let file =
                [write.section(), write.interface(147, Some(0), offset), write.packet(0, seconds, FRAME, 8)];
            let error = read(&file.concat()).1.expect_err("a time that nobody believes");
            assert!(error.contains("packet 1: the time is not between the years 1896 and 2116"), "{error}");
        }
    }
}

#[test]
fn pcap_is_read_with_every_magic() {
    for (magic, big, ns) in [
        (0xA1B2_C3D4, false, 7_000_002_000),
        (0xA1B2_C3D4, true, 7_000_002_000),
        (0xA1B2_3C4D, false, 7_000_000_002),
        (0xA1B2_3C4D, true, 7_000_000_002),
    ] {
        let file = Writer { big }.legacy(magic, 147, &[(7, 2, FRAME)]);
        assert!(is_pcap(&file));
        assert_eq!(read(&file), (vec![(at(ns), FRAME.to_vec(), vec![])], Ok(())), "{magic:x} {big}");
    }
}

#[test]
fn a_packet_without_a_time_follows_a_silence_of_unknown_length() {
    let body = [&LITTLE.u32(8)[..], FRAME].concat();
    let file = [LITTLE.section(), LITTLE.interface(147, None, None), LITTLE.block(3, &body)].concat();
    let expected = vec![(ReadTime::UnknownAfterSilence, FRAME.to_vec(), vec![])];
    assert_eq!(read(&file), (expected, Ok(())));
}

#[test]
fn the_rtac_header_goes_and_its_errors_mark_the_byte_they_come_with_or_the_next() {
    let (tx, rx, parity, lost, status) = (1, 2, 8, 5, 0);
    let packets = [
        rtac(tx, FRAME),
        rtac(status, b""),
        rtac(lost, b""),
        rtac(rx, b"\x01"),
        rtac(parity, b"\x03"),
        rtac(rx, b"\x08"),
    ];
    let packets: Vec<(u32, u32, &[u8])> = packets.iter().map(|data| (7, 2, &data[..])).collect();
    let (chunks, end) = read(&LITTLE.legacy(0xA1B2_C3D4, 250, &packets));
    assert_eq!(end, Ok(()));
    let found: Vec<_> = chunks.into_iter().map(|(_, bytes, errors)| (bytes, errors)).collect();
    let expected = [
        (FRAME.to_vec(), vec![]),
        (vec![1], vec![LineErrorKind::Overrun]),
        (vec![3], vec![LineErrorKind::ParityOrFraming]),
        (vec![8], vec![]),
    ];
    assert_eq!(found, expected);
}

#[test]
fn what_a_capture_left_out_of_a_packet_is_marked_at_the_next_byte() {
    let file = [
        LITTLE.section(),
        LITTLE.interface(147, None, None),
        LITTLE.packet(0, 1, &FRAME[..6], 8),
        LITTLE.packet(0, 2, FRAME, 8),
    ]
    .concat();
    let errors: Vec<_> = read(&file).0.into_iter().map(|chunk| chunk.2).collect();
    assert_eq!(errors, [vec![], vec![LineErrorKind::Overrun]]);
}

#[test]
fn times_that_go_back_are_taken_as_the_one_before_and_counted() {
    let file = LITTLE.legacy(0xA1B2_3C4D, 147, &[(7, 5, FRAME), (7, 4, FRAME), (7, 6, FRAME)]);
    let mut reader = Pcap::new(&file[..]);
    let mut times = Vec::new();
    while reader.advance().expect("good") {
        times.push(reader.chunk().time);
    }
    assert_eq!(times, [at(7_000_000_005), at(7_000_000_005), at(7_000_000_006)]);
    assert_eq!(reader.times_back(), Some(TimesBack { unit: "packet", first: 2, count: 1 }));
}

#[test]
fn what_cannot_be_understood_is_named_with_its_place() {
    let section = LITTLE.section();
    let good = [&section[..], &LITTLE.interface(147, None, None), &LITTLE.packet(0, 1, FRAME, 8)].concat();
    let place = good.len();
    let then = |block: Vec<u8>| [&good[..], &block].concat();
    let with = |link_type, data: &[u8]| {
        [&section[..], &LITTLE.interface(link_type, None, None), &LITTLE.packet(0, 1, data, data.len())]
            .concat()
    };
    let mut huge = LITTLE.packet(0, 1, FRAME, 8);
    huge[4..8].copy_from_slice(&LITTLE.u32(0x7FFF_FFF0));
    huge.resize(2 << 20, 0);
    let mut unequal = LITTLE.packet(0, 1, FRAME, 8);
    *unequal.last_mut().expect("not empty") = 9;
    for (file, chunks, part) in [
        (b"\x01\x03\x26\x00".to_vec(), 0, "byte 0: neither pcapng nor pcap".to_owned()),
        (good[..place - 1].to_vec(), 0, "the file ends within a block".to_owned()),
        (then(unequal), 1, format!("byte {place}: a block that is none")),
        (then(huge), 1, format!("byte {place}: a block of more than a MiB")),
        (
            then(LITTLE.packet(1, 1, FRAME, 8)),
            1,
            format!("byte {place}: packet 2: it is of interface 1, which"),
        ),
        (with(1, FRAME), 0, "packet 1: link type 1 is no serial line".to_owned()),
        (with(250, &[0; 11]), 0, "packet 1: 11 bytes hold no RTAC header".to_owned()),
        (LITTLE.legacy(0xA1B2_C3D4, 1, &[(1, 1, FRAME)]), 0, "link type 1".to_owned()),
    ] {
        let (read, end) = read(&file);
        let error = end.expect_err(&part);
        assert!(error.contains(&part), "{error}");
        assert_eq!(read.len(), chunks, "{part}: what came before is read");
    }
}

#[test]
fn a_capture_cut_after_its_first_packet_has_a_last_one_and_says_where_it_was_cut() {
    let good = [LITTLE.section(), LITTLE.interface(147, None, None), LITTLE.packet(0, 1, FRAME, 8)].concat();
    let file = [&good[..], &[6, 0]].concat();
    let mut reader = Pcap::new(&file[..]);
    assert!(reader.advance().expect("a packet"));
    assert_eq!(reader.cut(), None);
    assert!(!reader.advance().expect("the end"));
    let cut = reader.cut().expect("it was cut");
    assert_eq!(cut.to_string(), format!("byte {}: the file ends within a block", good.len()));
}

#[test]
fn a_second_section_goes_on_with_its_own_byte_order_and_interfaces() {
    let part = |write: Writer, link_type, units| {
        [write.section(), write.interface(link_type, None, None), write.packet(0, units, FRAME, 8)].concat()
    };
    let file = [part(LITTLE, 147, 1), part(Writer { big: true }, 148, 2)].concat();
    let (chunks, end) = read(&file);
    assert_eq!(end, Ok(()));
    assert_eq!(chunks.iter().map(|chunk| chunk.0).collect::<Vec<_>>(), [at(1000), at(2000)]);
}

proptest! {
    #[test]
    fn no_damage_to_a_file_makes_it_panic(
        big: bool, ng: bool, place: prop::sample::Index, byte: u8, cut: prop::sample::Index
    ) {
        let write = Writer { big };
        let mut file = if ng {
            let simple = write.block(3, &[&write.u32(8)[..], FRAME].concat());
            [
                write.section(),
                write.interface(147, Some(9), Some(3)),
                write.packet(0, 1, FRAME, 8),
                simple,
                write.block(4, &[0; 20]),
                write.block(5, &[0; 12]),
                write.block(10, &[0; 20]),
                write.block(0xBAD, &[0; 20]),
            ]
            .concat()
        } else {
            write.legacy(0xA1B2_C3D4, 250, &[(7, 2, &rtac(1, FRAME)), (7, 3, &rtac(5, b""))])
        };
        let place = place.index(file.len());
        file[place] = byte;
        file.truncate(cut.index(file.len()) + 1);
        let (chunks, _) = read(&file);
        prop_assert!(chunks.len() <= 2);
    }
}

#[test]
fn interfaces_without_a_name_are_numbered_buses_each_with_times_of_its_own() {
    let interface = LITTLE.interface(147, None, None);
    let packets =
        [LITTLE.packet(1, 5, FRAME, 8), LITTLE.packet(0, 3, FRAME, 8), LITTLE.packet(1, 4, FRAME, 8)];
    let file = [LITTLE.section(), interface.clone(), interface, packets.concat()].concat();
    let mut reader = Pcap::new(&file[..]);
    let mut found = Vec::new();
    while reader.advance().expect("a capture") {
        found.push((reader.bus().to_owned(), reader.chunk().time));
    }
    let expected = [("bus1", 5_000), ("bus0", 3_000), ("bus1", 5_000)];
    assert_eq!(found, expected.map(|(bus, ns)| (bus.to_owned(), at(ns))));
    assert_eq!(reader.times_back().map(|back| (back.first, back.count)), Some((3, 1)));
}

/// Returns of which bus each packet is.
fn buses(file: &[u8]) -> Vec<String> {
    let mut reader = Pcap::new(file);
    let mut buses = Vec::new();
    while reader.advance().expect("a capture") {
        buses.push(reader.bus().to_owned());
    }
    buses
}

/// Writes a section of interfaces with these names, and a packet of each.
fn section_of(names: &[&str]) -> Vec<u8> {
    let interfaces = names.iter().map(|name| LITTLE.named(name, ""));
    let packets = (0..names.len()).map(|index| LITTLE.packet(index as u32, 1, FRAME, 8));
    std::iter::once(LITTLE.section()).chain(interfaces).chain(packets).flatten().collect()
}

#[test]
fn two_interfaces_are_never_one_bus() {
    assert_eq!(buses(&section_of(&["/dev/left/bus", "/dev/right/bus"])), ["bus", "bus-2"]);
    assert_eq!(buses(&section_of(&["", "bus0"])), ["bus0", "bus0-2"]);
    assert_eq!(buses(&section_of(&["bus1", ""])), ["bus1", "bus1-2"]);
}

#[test]
fn what_a_later_section_calls_the_same_is_the_same_bus() {
    let parts =
        [section_of(&["/dev/left/bus", "/dev/right/bus", ""]), section_of(&["/dev/right/bus", "", ""])];
    assert_eq!(buses(&parts.concat()), ["bus", "bus-2", "bus2", "bus-2", "bus1", "bus2"]);
}

#[test]
fn a_name_given_again_in_a_section_is_the_bus_with_other_settings() {
    let file = [
        LITTLE.section(),
        LITTLE.named("pump", "9600-8N1"),
        LITTLE.packet(0, 1, FRAME, 8),
        LITTLE.named("pump", "19200-8E1"),
        LITTLE.packet(1, 2, FRAME, 8),
    ]
    .concat();
    let mut reader = Pcap::new(&file[..]);
    let mut lines = Vec::new();
    while reader.advance().expect("a capture") {
        assert_eq!(reader.bus(), "pump");
        lines.extend(reader.settings().map(|settings| settings.line.to_string()));
    }
    assert_eq!(lines, ["9600-8N1", "19200-8E1"]);
}

#[test]
fn more_buses_than_anybody_has_are_refused() {
    let part = |first: usize| {
        let names: Vec<_> = (first..first + 600).map(|number| number.to_string()).collect();
        section_of(&names.iter().map(String::as_str).collect::<Vec<_>>())
    };
    assert_eq!(read(&[part(0), part(0)].concat()).1, Ok(()));
    let error = read(&[part(0), part(600)].concat()).1.expect_err("1200 buses");
    assert!(error.contains("more than 1000 buses"), "{error}");
}
