use super::*;

fn chunks(text: &[u8]) -> Result<Vec<(ReadTime, Vec<u8>)>, String> {
    let mut reader = HexText::new(text);
    let mut chunks = Vec::new();
    loop {
        match reader.advance() {
            Ok(true) => chunks.push((reader.chunk().time, reader.chunk().bytes.to_vec())),
            Ok(false) => return Ok(chunks),
            Err(Failure::Hex(error)) => return Err(error.to_string()),
            Err(other) => return Err(format!("{other:?}")),
        }
    }
}

fn bytes(text: &str) -> Vec<u8> {
    chunks(text.as_bytes()).expect(text).into_iter().flat_map(|(_, bytes)| bytes).collect()
}

fn at(ns: i64) -> ReadTime {
    ReadTime::At(Timestamp::from_ns(ns))
}

#[test]
fn bytes_are_read_whatever_stands_between_them() {
    for text in [
        "01 03 a0",
        "0103A0",
        "01,03,A0",
        "01:03:a0",
        "0x01 0x03 0xa0",
        "0x01,0x03,0XA0",
        "\\x01\\x03\\xA0",
        "010x030xa0",
        "0x 01 , 03 : a0",
        "\t01\t03\ta0\t",
        "01 03 a0 # comment 04 °C",
        "01 03 a0#",
        "> 01 03 a0",
        "rx: 01 03 a0",
        "TX 01 03 a0\r\n",
        "\u{feff}01 03 a0",
        "1.5 01 03 a0",
        "01\n\n# between\n   \n03 a0",
    ] {
        assert_eq!(bytes(text), [1, 3, 0xa0], "{text:?}");
    }
}

#[test]
fn a_line_is_a_chunk_and_without_a_time_silence_stands_before_it() {
    assert_eq!(
        chunks(b"01 03\n04").expect("hex text"),
        [(ReadTime::UnknownAfterSilence, vec![1, 3]), (ReadTime::UnknownAfterSilence, vec![4])]
    );
}

#[test]
fn times_are_read_in_every_form_before_a_direction_mark() {
    for text in [
        "1970-01-01T00:00:01.5Z 0a",
        "[1970-01-01T01:00:01.5+01:00] 0a",
        "[1970-01-01 00:00:01.5Z]0a",
        "1.5 0a",
        "[1.5] 0a",
        "(1.5) 0a",
        "  1.500000000\t>\t0a",
        "1.5> 0a",
        "1.5, rx, 0a",
    ] {
        assert_eq!(chunks(text.as_bytes()).expect(text), [(at(1_500_000_000), vec![0x0a])], "{text}");
    }
    assert_eq!(bytes("1600000000 0a"), [0x16, 0, 0, 0, 0, 0x0a], "without a point it is bytes");
}

#[test]
fn a_time_that_goes_back_is_the_one_before_and_counted() {
    let mut reader = HexText::new(&b"9.0 01\n5.0 # none\n8.0 02\n9.5 03\n1.0 04\n9.5 05\n"[..]);
    let mut times = Vec::new();
    while let Ok(true) = reader.advance() {
        times.push(reader.chunk().time);
    }
    let half = at(9_500_000_000);
    assert_eq!(times, [at(9_000_000_000), at(9_000_000_000), half, half, half]);
    assert_eq!(reader.times_back(), Some(TimesBack { unit: "line", first: 3, count: 2 }));
}

#[test]
fn a_year_ahead_is_legal() {
    let text = b"2026-01-01T00:00:00Z 01\n2027-01-01T00:00:00Z 02\n";
    assert_eq!(chunks(text).expect("hex text").len(), 2);
    let mut reader = HexText::new(&text[..]);
    while let Ok(true) = reader.advance() {}
    assert_eq!(reader.times_back(), None);
}

#[test]
fn what_cannot_be_read_is_named_with_line_and_column() {
    for (text, message) in [
        ("01 3", "line 1, column 4: '3' is half a byte"),
        ("01\n\n 0 1", "line 3, column 2: '0' is half a byte"),
        ("01 0xZZ", "line 1, column 6: 'Z' is not a hex digit"),
        ("01 0x", "line 1, column 6: no byte after '0x' or '\\x'"),
        ("01 0x # nothing", "line 1, column 7: no byte after '0x' or '\\x'"),
        ("01 zz", "line 1, column 4: 'z' is not a hex digit"),
        ("01 \x07", "line 1, column 4: '\\x07' is not a hex digit"),
        ("01 # bell \x07", "line 1, column 11: '\\x07' is not a hex digit"),
        ("01 1.5 02", "line 1, column 4: '1' is half a byte"),
        ("1.5 > > 01", "line 1, column 7: '>' is not a hex digit"),
        ("1.5f 01", "line 1, column 4: no space after the time"),
        ("[1.5 01", "line 1, column 5: no ']' after the time"),
        ("[15] 01", "line 1, column 4: the brackets hold no time; seconds need a decimal point"),
        ("2026-01-01T00:00:00 01", "line 1, column 20: the time has neither 'Z' nor an offset"),
        ("  2026-99-01T00:00:00Z 01", "line 1, column 8: the month is not 01 to 12"),
        ("01\r02", "line 1, column 3: '\\r' is not a hex digit"),
        ("01 °", "line 1, column 4: '\\xc2' is not a hex digit"),
    ] {
        let error = chunks(text.as_bytes()).expect_err(text);
        assert!(error.starts_with(message), "{text:?}: {error}");
    }
}

#[test]
fn a_line_longer_than_the_window_is_read_in_pieces_without_loss() {
    let expected: Vec<u8> = (0..150_000_u32).map(|i| (i % 253) as u8).collect();
    for separator in ["", " ", "0x", "\\x"] {
        let mut text = String::from("7.5 ");
        for byte in &expected {
            text.push_str(separator);
            text.push_str(&format!("{byte:02x}"));
        }
        text.push_str(" # ");
        text.push_str(&"long comment ".repeat(10_000));
        text.push_str("\n8.5 ff\n");
        let read = chunks(text.as_bytes()).expect("hex text");
        let (tail, line) = read.split_last().expect("chunks");
        assert_eq!(*tail, (at(8_500_000_000), vec![0xff]));
        assert!(line.len() > 1 && line.iter().all(|(time, _)| *time == at(7_500_000_000)), "{separator:?}");
        assert!(line.iter().flat_map(|(_, bytes)| bytes).eq(&expected), "{separator:?}");
    }
}

#[test]
fn an_error_far_into_a_long_line_has_its_column() {
    let mut text = "01 ".repeat(50_000);
    text.push('!');
    let error = chunks(text.as_bytes()).expect_err("not hex");
    assert!(error.starts_with("line 1, column 150001: '!'"), "{error}");
}

#[test]
fn line_settings_are_read_from_comments_before_the_first_byte() {
    for (text, line) in [
        ("# a bus\n# line 19200-8E1; a line a byte\n01\n", Some("19200-8E1")),
        ("#line 300-7O2\n01", Some("300-7O2")),
        ("01\n# line 19200-8E1\n", None),
        ("# line noise\n01", None),
        ("# deadline 19200-8E1\n01", None),
        ("01 # line 19200-8E1\n", None),
    ] {
        let mut reader = HexText::new(text.as_bytes());
        while let Ok(true) = reader.advance() {}
        assert_eq!(reader.line().map(|line| line.to_string()).as_deref(), line, "{text:?}");
    }
}
