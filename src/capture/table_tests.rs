use proptest::prelude::*;

use super::*;

/// A chunk of the table: nanoseconds, byte, line error.
type Read = (i64, u8, Option<LineErrorKind>);

fn read_as(text: &str, line: Option<&str>) -> (Vec<Read>, Result<(), String>) {
    let mut reader = Table::new(text.as_bytes());
    if let Some(line) = line {
        reader.use_line(line.parse().expect("line settings of this test"));
    }
    let mut chunks = Vec::new();
    loop {
        match reader.advance() {
            Ok(true) => {
                let chunk = reader.chunk();
                let (ReadTime::At(time), [byte]) = (chunk.time, chunk.bytes) else { panic!("{chunk:?}") };
                let error = chunk.line_errors.first();
                assert_eq!(error.map_or(0, |error| error.offset), 0);
                chunks.push((time.as_ns(), *byte, error.map(|error| error.kind)));
            }
            Ok(false) => return (chunks, Ok(())),
            Err(Failure::Malformed(error)) => return (chunks, Err(error.to_string())),
            Err(other) => return (chunks, Err(format!("{other:?}"))),
        }
    }
}

fn read(text: &str) -> Vec<Read> {
    assert!(is_table(text.as_bytes()), "{text}");
    let (chunks, end) = read_as(text, None);
    assert_eq!(end, Ok(()), "{text}");
    chunks
}

/// 2000-01-01 in nanoseconds.
const ORIGIN_NS: i64 = 946_684_800_000_000_000;
const WRONG: Option<LineErrorKind> = Some(LineErrorKind::ParityOrFraming);

#[test]
fn a_byte_of_logic_2_ends_after_its_duration() {
    let text = "name,type,start_time,duration,data,error\r\n\
        \"Async Serial\",\"data\",0.0006025,2.375e-05,0xC8,\r\n\
        \"Async Serial\",\"data\",1.5,0.00104,0x01,parity\r\n\
        \"Modbus\",\"frame\",1.6,0.00104,,\r\n\
        \"Async Serial\",\"data\",2,0.0000000005,0xfF,\"framing\"\r\n";
    let expected = [(626_250, 0xC8, None), (1_501_040_000, 1, WRONG), (2_000_000_000, 0xFF, WRONG)]
        .map(|(ns, byte, error)| (ORIGIN_NS + ns, byte, error));
    assert_eq!(read(text), expected);
}

#[test]
fn a_byte_of_logic_1_ends_a_character_after_its_start() {
    let text = "Time [s],Value,Parity Error,Framing Error\n\
        -0.000000001,0x01,,\n\
        0.042980320000000,0xD4,,Error\n";
    let (chunks, end) = read_as(text, Some("19200-8E1"));
    let character = 572_917;
    let expected = [(character - 1, 1, None), (42_980_320 + character, 0xD4, WRONG)];
    assert_eq!(end, Ok(()));
    assert_eq!(chunks, expected.map(|(ns, byte, error)| (ORIGIN_NS + ns, byte, error)));
}

#[test]
fn a_uart_of_dsview_gives_its_bytes_and_errors() {
    let text = "Id,Time[ns],1:UART: RX/TX\n\
        0,54414000.00000000000000000000,[FF]\n\
        1,54500000.00,Start bit\n\
        2,54500000.00,0D\n\
        3,54600000.00,Parity error\n\
        4,54700000.00,Stop bit\n\
        5,54800000.00,a1\n\
        6,54900000.00,Break condition\n";
    let start = ORIGIN_NS + LineSettings::default().character_ns();
    let expected =
        [(54_414_000, 0xFF, None), (54_500_000, 0x0D, WRONG), (54_800_000, 0xA1, Some(LineErrorKind::Break))];
    assert_eq!(read(text), expected.map(|(ns, byte, error)| (start + ns, byte, error)));
}

#[test]
fn any_table_with_times_and_bytes_is_read_in_its_unit_and_with_its_separator() {
    for text in [
        "time,data,duration\n0.25,4f,0",
        "TIME [ms];Data;Duration [us]\n250;0x4F;0",
        "\u{feff}# made by hand\n\nStart (us)\tbyte\tduration\n250000\t[4F]\t0\n",
        "data,x,timestamp [ns],duration\n\" 4F\" ,\"a,b\",250000000,0\n",
    ] {
        assert_eq!(read(text), [(ORIGIN_NS + 250_000_000, 0x4F, None)], "{text}");
    }
}

#[test]
fn absolute_times_are_those_of_their_calendar_or_of_the_unix_epoch() {
    let ns = 1_767_225_600_123_456_789;
    for time in
        ["2026-01-01T00:00:00.123456789Z", "2026-01-01T01:00:00.123456789+01:00", "1767225600.123456789"]
    {
        assert_eq!(read(&format!("time,data,duration\n{time},01,0\n")), [(ns, 1, None)], "{time}");
    }
}

#[test]
fn a_time_that_goes_back_is_the_one_before_and_counted() {
    let mut reader = Table::new(&b"time,data,duration\n2,01,0\n1,02,0\n3,03,0\n"[..]);
    let mut times = Vec::new();
    while reader.advance().ok() == Some(true) {
        times.push(reader.chunk().time);
    }
    let at = |seconds: i64| ReadTime::At(Timestamp::from_ns(ORIGIN_NS + seconds * 1_000_000_000));
    assert_eq!(times, [at(2), at(2), at(3)]);
    assert_eq!(reader.times_back(), Some(TimesBack { unit: "line", first: 3, count: 1 }));
}

#[test]
fn what_cannot_be_read_is_named_with_line_and_column() {
    let head = "Time [s],Value\n0.1,0x01\n";
    let long = "x".repeat(70_000);
    for (rows, part) in [
        ("0.2,1", "line 3, column 'Value': '1' is not a byte"),
        ("0.2,o", "line 3, column 'Value': 'o' is not a byte"),
        ("0.2,0x1FF", "'0x1FF' is not a byte"),
        ("0.2,0xG0", "'0xG0' is not a byte"),
        ("\n,0x02", "line 4, column 'Time [s]': '' is no time"),
        ("later,0x02", "'later' is no time"),
        ("1e30,0x02", "'1e30' is no time"),
        ("1e12,0x02", "the time is not between"),
        ("4e9,0x02", "column 'Time [s]': the time is not between the years 1896 and 2116"),
        ("2200-01-01T00:00:00Z,0x02", "column 'Time [s]': the time is not between the years 1896 and 2116"),
        ("2026-13-01T00:00:00Z,0x02", "the month is not 01 to 12"),
        ("2026-01-01T00:00:00Z5,0x02", "is no time"),
        (&long[..], "line 3: more than 65536 bytes"),
    ] {
        let (chunks, end) = read_as(&format!("{head}{rows}\n"), None);
        let error = end.expect_err(rows);
        assert!(error.contains(part), "{error}");
        assert_eq!(chunks.len(), 1, "what came before is read");
    }
    let error = read_as("start_time,duration,data\n1,-1,01\n", None).1.expect_err("negative");
    assert!(error.contains("column 'duration': '-1' is no duration"), "{error}");
    let error = read_as("0.1,0x01\n", None).1.expect_err("no header");
    assert!(error.contains("line 1: no header with a column of times"), "{error}");
}

#[test]
fn a_table_is_known_by_its_header() {
    for text in ["Time [s],Channel 0\n0.1,1", "a,b\n", "time [h],data\n", "01 03 26\n", "# time,data\n", ""] {
        assert!(!is_table(text.as_bytes()), "{text}");
    }
}

proptest! {
    #[test]
    fn no_table_makes_it_panic(
        rows in "([-+0-9.eE]{0,12}|[-0-9T:Z]{0,22}),(0x)?[0-9a-f]{0,3},[a-z0-9.\"-]{0,5}\n?"
    ) {
        let (chunks, _) = read_as(&format!("time,data,duration\n{rows}\n{rows}"), None);
        prop_assert!(chunks.len() <= 2);
    }
}
