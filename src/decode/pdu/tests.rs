//! The examples printed in the Modbus application protocol V1.1b3, and what happens to them when damaged.

use proptest::prelude::*;

use super::*;

/// Sets a PDU in hex between address 17 and its CRC.
fn frame(pdu: &str) -> Vec<u8> {
    let mut bytes = hex(&format!("11 {pdu}"));
    bytes.extend(crate::decode::crc::checksum(&bytes).to_le_bytes());
    bytes
}

fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

/// Renders what lies between the address and the CRC.
fn said(bytes: &[u8], role: Role) -> String {
    let dissection = dissect(bytes, role);
    let fields = dissection.fields.iter().filter(|field| !matches!(field.name, "address" | "CRC"));
    let mut parts: Vec<String> = fields.map(ToString::to_string).collect();
    parts.extend(dissection.stopped.map(|stop| stop.to_string()));
    parts.join(", ")
}

/// Requests and responses printed in section 6, with what they say.
const EXAMPLES: &[(&str, Role, &str)] = &[
    ("01 00 13 00 13", Role::Request, "function 1 read coils, start address 0x0013, quantity 19"),
    (
        "01 03 CD 6B 05",
        Role::Response,
        "function 1 read coils, byte count 3, bits 10110011 11010110 10100000",
    ),
    ("02 00 C4 00 16", Role::Request, "function 2 read discrete inputs, start address 0x00c4, quantity 22"),
    (
        "02 03 AC DB 35",
        Role::Response,
        "function 2 read discrete inputs, byte count 3, bits 00110101 11011011 10101100",
    ),
    ("03 00 6B 00 03", Role::Request, "function 3 read holding registers, start register 0x006b, quantity 3"),
    (
        "03 06 02 2B 00 00 00 64",
        Role::Response,
        "function 3 read holding registers, byte count 6, registers 0x022b 0x0000 0x0064",
    ),
    ("04 00 08 00 01", Role::Request, "function 4 read input registers, start register 0x0008, quantity 1"),
    ("04 02 00 0A", Role::Response, "function 4 read input registers, byte count 2, registers 0x000a"),
    (
        "05 00 AC FF 00",
        Role::Request,
        "function 5 write single coil, output address 0x00ac, output value 0xff00 on",
    ),
    (
        "06 00 01 00 03",
        Role::Response,
        "function 6 write single register, register 0x0001, register value 0x0003",
    ),
    ("07", Role::Request, "function 7 read exception status"),
    ("07 6D", Role::Response, "function 7 read exception status, exception status 10110110"),
    (
        "08 00 00 A5 37",
        Role::Request,
        "function 8 diagnostics, sub-function 0 return query data, data 0xa537",
    ),
    ("0B", Role::Request, "function 11 get comm event counter"),
    (
        "0B FF FF 01 08",
        Role::Response,
        "function 11 get comm event counter, status 0xffff busy, event count 264",
    ),
    ("0C", Role::Request, "function 12 get comm event log"),
    (
        "0C 08 00 00 01 08 01 21 20 00",
        Role::Response,
        "function 12 get comm event log, byte count 8, status 0 ready, event count 264, message count 289, events 20 00",
    ),
    (
        "0F 00 13 00 0A 02 CD 01",
        Role::Request,
        "function 15 write multiple coils, start address 0x0013, quantity 10, byte count 2, bits 10110011 10",
    ),
    ("0F 00 13 00 0A", Role::Response, "function 15 write multiple coils, start address 0x0013, quantity 10"),
    (
        "10 00 01 00 02 04 00 0A 01 02",
        Role::Request,
        "function 16 write multiple registers, start register 0x0001, quantity 2, byte count 4, registers 0x000a 0x0102",
    ),
    (
        "10 00 01 00 02",
        Role::Response,
        "function 16 write multiple registers, start register 0x0001, quantity 2",
    ),
    ("11", Role::Request, "function 17 report server ID"),
    (
        "11 04 09 FF 31 32",
        Role::Response,
        "function 17 report server ID, byte count 4, server ID 09 (taken to be one byte), run indicator 255 on, additional data 31 32",
    ),
    (
        "14 0E 06 00 04 00 01 00 02 06 00 03 00 09 00 02",
        Role::Request,
        "function 20 read file record, byte count 14, [1] reference type 6, [1] file number 4, [1] record number 1, [1] record length 2, [2] reference type 6, [2] file number 3, [2] record number 9, [2] record length 2",
    ),
    (
        "14 0C 05 06 0D FE 00 20 05 06 33 CD 00 40",
        Role::Response,
        "function 20 read file record, byte count 12, [1] file response length 5, [1] reference type 6, [1] record data 0x0dfe 0x0020, [2] file response length 5, [2] reference type 6, [2] record data 0x33cd 0x0040",
    ),
    (
        "15 0D 06 00 04 00 07 00 03 06 AF 04 BE 10 0D",
        Role::Request,
        "function 21 write file record, byte count 13, [1] reference type 6, [1] file number 4, [1] record number 7, [1] record length 3, [1] record data 0x06af 0x04be 0x100d",
    ),
    (
        "16 00 04 00 F2 00 25",
        Role::Request,
        "function 22 mask write register, register 0x0004, AND mask 0x00f2, OR mask 0x0025",
    ),
    (
        "17 00 03 00 06 00 0E 00 03 06 00 FF 00 FF 00 FF",
        Role::Request,
        "function 23 read/write multiple registers, read start register 0x0003, read quantity 6, write start register 0x000e, write quantity 3, byte count 6, registers 0x00ff 0x00ff 0x00ff",
    ),
    (
        "17 0C 00 FE 0A CD 00 01 00 03 00 0D 00 FF",
        Role::Response,
        "function 23 read/write multiple registers, byte count 12, registers 0x00fe 0x0acd 0x0001 0x0003 0x000d 0x00ff",
    ),
    ("18 04 DE", Role::Request, "function 24 read FIFO queue, FIFO pointer address 0x04de"),
    (
        "18 00 06 00 02 01 B8 12 84",
        Role::Response,
        "function 24 read FIFO queue, byte count 6, FIFO count 2, FIFO values 0x01b8 0x1284",
    ),
    (
        "2B 0E 01 00",
        Role::Request,
        "function 43 encapsulated interface transport, MEI type 14 read device identification, read device ID code 1 basic, object ID 0 vendor name",
    ),
    (
        "2B 0E 01 01 00 00 02 00 07 43 6F 6D 70 61 6E 79 02 05 56 32 2E 31 31",
        Role::Response,
        "function 43 encapsulated interface transport, MEI type 14 read device identification, read device ID code 1 basic, conformity level 1 basic, stream only, more follows 0 no, next object ID 0, number of objects 2, [1] object ID 0 vendor name, [1] object length 7, [1] object value \"Company\", [2] object ID 2 major minor revision, [2] object length 5, [2] object value \"V2.11\"",
    ),
    ("81 02", Role::Response, "function 129 exception of read coils, exception code 2 illegal data address"),
    ("41 01 02 03", Role::Request, "function 65, data 01 02 03"),
];

#[test]
fn examples_of_the_specification_are_read_whole() {
    for (pdu, role, expected) in EXAMPLES {
        let bytes = frame(pdu);
        let dissection = dissect(&bytes, *role);
        assert_eq!(said(&bytes, *role), *expected);
        assert!(dissection.is_whole() && dissection.crc.unwrap().is_good(), "{dissection}");
        assert!(
            dissection.fields.iter().all(|f| f.remark.is_none() || f.name == "server ID"),
            "{dissection}"
        );
    }
}

#[test]
fn the_unit_address_and_the_crc_are_fields_too() {
    let bytes = hex("01 03 26 00 00 04 4F 41");
    assert_eq!(
        dissect(&bytes, Role::Request).to_string(),
        "address 1, function 3 read holding registers, start register 0x2600, quantity 4, CRC 0x414f"
    );
    let spans: Vec<_> =
        dissect(&bytes, Role::Request).fields.iter().map(|f| (f.name, f.span.clone())).collect();
    let expected =
        [("address", 0..1), ("function", 1..2), ("start register", 2..4), ("quantity", 4..6), ("CRC", 6..8)];
    assert_eq!(spans, expected);
    assert_eq!(dissect(&bytes, Role::Request).field_at(3).unwrap().name, "start register");
}

/// Checks what must hold of any bytes: the fields cover them end to end.
fn assert_covered(bytes: &[u8], role: Role) {
    let dissection = dissect(bytes, role);
    let mut end = 0;
    for field in &dissection.fields {
        assert!(field.span.start == end && field.span.end > end, "{dissection:?}");
        end = field.span.end;
    }
    assert_eq!(end, bytes.len(), "{dissection:?}");
    assert!(dissection.stopped.is_none_or(|stop| stop.offset <= bytes.len()), "{dissection:?}");
    assert!(dissection.fields.iter().all(|f| dissection.field_at(f.span.start) == Some(f)));
    assert!(!dissection.is_whole() || bytes.len() >= 4);
    let _ = dissection.to_string();
}

#[test]
fn a_frame_cut_anywhere_is_read_as_far_as_it_goes_and_says_so() {
    for (pdu, role, _) in EXAMPLES {
        let bytes = frame(pdu);
        for len in 0..bytes.len() {
            let cut = &bytes[..len];
            assert_covered(cut, *role);
            assert_covered(cut, Role::Unknown);
            // Functions without a length of their own cannot tell.
            let lengthless = matches!(bytes[1], 65) || (bytes[1] == 8 && len > 6);
            if !lengthless {
                assert!(dissect(cut, *role).stopped.is_some(), "{} of {pdu}", len);
            }
        }
    }
}

#[test]
fn a_stop_names_field_place_and_what_is_missing() {
    let short = frame("03 0A 01 02 03 04 05 06 07");
    assert_eq!(
        said(&short, Role::Response),
        "function 3 read holding registers, byte count 10, registers 0x0102 0x0304 0x0506 0x07, \
         stopped at byte 3: registers needs 10 bytes, 7 follow, 3 missing"
    );
    assert_eq!(
        dissect(&short, Role::Response).stopped,
        Some(Stop { offset: 3, field: "registers", reason: StopReason::Missing { needed: 10, present: 7 } })
    );
    // Its CRC is good, so it is not taken for data.
    assert_eq!(dissect(&short, Role::Response).fields.last().unwrap().name, "CRC");
    assert_eq!(
        said(&hex("11 03 26"), Role::Request),
        "function 3 read holding registers, bytes 26 (not read), \
         stopped at byte 2: start register needs 2 bytes, 1 follow, 1 missing"
    );
    assert_eq!(said(&hex("11"), Role::Request), "stopped at byte 1: function is missing (1 byte)");
    assert_eq!(said(&[], Role::Unknown), "stopped at byte 0: address is missing (1 byte)");
    assert_eq!(
        said(&frame("0C 04 00 00 01 08"), Role::Response),
        "function 12 get comm event log, byte count 4, bytes 00 00 01 08 (not read), \
         stopped at byte 2: byte count is 4, and needs at least 6"
    );
}

#[test]
fn a_bad_crc_is_shown_beside_the_right_one_and_ends_the_form() {
    let mut bytes = hex("01 03 26 00 00 04 4F 40");
    let dissection = dissect(&bytes, Role::Request);
    assert_eq!(dissection.crc, Some(Crc { given: 0x404F, computed: 0x414F }));
    assert_eq!(dissection.fields.last().unwrap().to_string(), "CRC 0x404f (bad, computed 0x414f)");
    assert!(dissection.is_whole(), "only the CRC is wrong");
    bytes.pop();
    assert_eq!(
        dissect(&bytes, Role::Request).stopped.unwrap().to_string(),
        "stopped at byte 6: CRC needs 2 bytes, 1 follow, 1 missing"
    );
    bytes.extend([1, 2, 3]);
    let dissection = dissect(&bytes, Role::Request);
    assert_eq!(dissection.fields[4].to_string(), "bytes 4f 01 (not part of the function's form)");
    assert!(!dissection.is_whole());
}

#[test]
fn values_outside_the_specification_are_remarked_on_and_read() {
    for (pdu, role, remark) in [
        ("01 00 00 07 D1", Role::Request, "quantity 2001 (outside 1 to 2000)"),
        ("03 00 00 00 7E", Role::Request, "quantity 126 (outside 1 to 125)"),
        ("05 00 00 12 34", Role::Request, "output value 0x1234 (neither 0x0000 nor 0xff00)"),
        ("0F 00 00 00 0A 01 FF", Role::Request, "byte count 1 (expected 2)"),
        ("10 00 00 00 02 02 00 01", Role::Request, "byte count 2 (expected 4)"),
        ("10 00 00 00 7C", Role::Response, "quantity 124 (outside 1 to 123)"),
        ("08 00 0B 00 01", Role::Request, "data 0x0001 (expected 0)"),
        ("18 00 04 00 02 00 01", Role::Response, "FIFO count 2 (expected 1)"),
        ("14 07 07 00 04 00 01 00 02", Role::Request, "[1] reference type 7 (expected 6)"),
        ("2B 0E 05 00", Role::Request, "read device ID code 5 (outside 1 to 4)"),
        ("03 03 01 02 03", Role::Response, "byte count 3 (odd)"),
    ] {
        let bytes = frame(pdu);
        let text = said(&bytes, role);
        assert!(text.contains(remark), "{text}");
        assert!(dissect(&bytes, role).is_whole(), "{text}");
    }
    let broadcast = dissect(&hex("00 05"), Role::Request).fields[0].to_string();
    assert_eq!(broadcast, "address 0 (broadcast)");
    let reserved = dissect(&hex("FF 05"), Role::Request).fields[0].to_string();
    assert_eq!(reserved, "address 255 (reserved address)");
}

#[test]
fn forms_that_the_sensors_use_outside_the_specification_keep_every_byte() {
    // Frames of the manuals: start with quantity 0 and its answer, start of the conductivity probe.
    let start = hex("01 03 25 00 00 00 4E C6");
    assert!(said(&start, Role::Request).ends_with("quantity 0 (outside 1 to 125)"));
    assert_eq!(
        said(&hex("01 03 00 20 F0"), Role::Response),
        "function 3 read holding registers, byte count 0"
    );
    let brush = hex("01 10 1C 00 00 00 00 D8 92");
    assert!(dissect(&brush, Role::Request).is_whole());
    assert_eq!(
        said(&frame("03 00 12 34"), Role::Response),
        "function 3 read holding registers, byte count 0 (yet 2 bytes follow), \
         bytes 12 34 (not part of the function's form)"
    );
    let counted = said(&frame("03 02 01 02 03 04"), Role::Response);
    assert_eq!(
        counted,
        "function 3 read holding registers, byte count 2 (counts registers: twice as many bytes follow), \
         registers 0x0102, bytes 03 04 (not part of the function's form)"
    );
    // A write that forgot its byte count.
    let forgot = dissect(&hex("01 10 1C 00 00 00 C7 99"), Role::Request).stopped.unwrap();
    assert_eq!((forgot.offset, forgot.field), (6, "byte count"));
}

#[test]
fn an_unknown_direction_is_settled_by_the_form_or_said() {
    assert_eq!(dissect(&hex("01 03 26 00 00 04 4F 41"), Role::Unknown).role, Role::Request);
    assert_eq!(dissect(&frame("03 02 00 01"), Role::Unknown).role, Role::Response);
    assert_eq!(dissect(&frame("06 00 01 00 03"), Role::Unknown).role, Role::Unknown);
    assert_eq!(
        dissect(&frame("01 03 CD 6B 05"), Role::Unknown).role,
        Role::Response,
        "27397 coils are too many"
    );
    let (uncounted, counted) = (frame("03 00 12 34"), frame("03 04 01 02 03 04 05 06 07 08"));
    assert_eq!(dissect(&uncounted, Role::Unknown).role, Role::Response, "two bytes beside the form");
    assert_eq!(dissect(&counted, Role::Unknown).role, Role::Response, "a request would leave more over");
    assert_eq!(dissect(&frame("10 1C 00 00 00"), Role::Unknown).role, Role::Response, "whole as that only");
    // A request for five coils from 0x0300 and a response of three bytes look alike.
    let bytes = frame("01 03 00 00 05");
    let either = dissect(&bytes, Role::Unknown);
    assert_eq!(either.role, Role::Request);
    assert!(either.to_string().contains("direction unknown, read as a request"));
}

#[test]
fn pairing_gets_start_and_quantity_where_a_frame_names_them() {
    use Role::{Request, Response, Unknown};
    for (pdu, role, start, count) in [
        ("01 00 13 00 12", Request, Some(0x13), Some(0x12)),
        ("03 00 6B 00 03", Request, Some(0x6B), Some(3)),
        ("03 00 6B 00 03", Unknown, None, None),
        ("03 06 02 2B 00 00 00 64", Response, None, None),
        ("05 00 AC FF 00", Request, Some(0xAC), None),
        ("06 00 01 00 03", Response, Some(1), None),
        ("0F 00 13 00 0A", Response, Some(0x13), Some(10)),
        ("10 00 01 00 02 04 00 0A 01 02", Request, Some(1), Some(2)),
        ("10 00 01 00 02", Unknown, Some(1), Some(2)),
        ("16 00 04 00 F2 00 25", Response, Some(4), None),
        ("17 00 03 00 06 00 0E 00 03 06 00 FF 00 FF 00 FF", Request, Some(3), Some(6)),
        ("17 0C 00 FE 0A CD 00 01 00 03 00 0D 00 FF", Response, None, None),
        ("18 04 DE", Request, Some(0x4DE), None),
        ("18 00 06 00 02 01 B8 12 84", Response, None, None),
        ("83 02", Response, None, None),
        ("08 00 00 A5 37", Request, None, None),
    ] {
        let bytes = frame(pdu);
        assert_eq!((start_register(&bytes, role), quantity(&bytes, role)), (start, count), "{pdu}");
    }
    assert_eq!(quantity(&hex("11 03 00 6B 00 03"), Request), None, "the last two bytes are the CRC");
    assert_eq!(exception_code(&frame("83 02")).unwrap().0, 2);
    assert_eq!(exception_code(&frame("03 02 00 01")), None);
    assert_eq!(exception_code(&hex("11 83 02")), None);
}

fn role() -> impl Strategy<Value = Role> {
    prop_oneof![Just(Role::Request), Just(Role::Response), Just(Role::Unknown)]
}

proptest! {
    #[test]
    fn any_bytes_are_covered_end_to_end(bytes in proptest::collection::vec(any::<u8>(), 0..300), role in role()) {
        assert_covered(&bytes, role);
        let _ = (start_register(&bytes, role), quantity(&bytes, role), exception_code(&bytes));
    }

    #[test]
    fn so_are_frames_of_every_function_with_and_without_a_good_crc(
        function in prop_oneof![0_u8..=48, any::<u8>()],
        data in proptest::collection::vec(prop_oneof![0_u8..=12, any::<u8>()], 0..40),
        role in role(),
        damage in any::<bool>(),
    ) {
        let mut bytes = vec![1, function];
        bytes.extend(data);
        bytes.extend(crate::decode::crc::checksum(&bytes).to_le_bytes());
        if damage {
            *bytes.last_mut().unwrap() ^= 1;
        }
        assert_covered(&bytes, role);
        prop_assert_eq!(dissect(&bytes, role).crc.unwrap().is_good(), !damage);
    }
}
