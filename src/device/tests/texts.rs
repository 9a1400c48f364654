//! How fields and readings read, and what the manuals' errata come to.

use super::*;
use crate::device::Value;

fn assigned(device: &str, exchange: Exchange) -> Told {
    let mut bus = Bus::new();
    bus.devices.assign(1, device).expect("a built-in profile");
    bus.tells(exchange)
}

/// Returns a DO probe's answer of 20 °C and a saturation.
fn saturation(value: f32) -> Exchange {
    let bytes: String = [20_f32, value]
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .map(|byte| format!("{byte:02x}"))
        .collect();
    answered("01 03 2600 0004", &format!("01 03 08 {bytes}"))
}

#[test]
fn saturation_is_a_fraction_shown_in_percent() {
    let told = assigned(DO, saturation(0.952));
    assert_eq!(told.fields, ["temperature 20 °C", "do_saturation 95.2 %"]);
    assert_eq!(told.readings[2], "do_mg_l 8.632 mg/L (salinity 0, 101.325 kPa)");
}

#[test]
fn saturation_that_looks_like_percent_is_flagged_and_not_rescaled() {
    let exchange = saturation(95.2);
    let told = assigned(DO, exchange.clone());
    assert_eq!(told.fields[1], "do_saturation 9520 % (looks like percent, not a fraction)");
    let mut bus = Bus::new();
    bus.devices.assign(1, DO).expect("a built-in profile");
    let t = exchange.transaction();
    let reading = bus.devices.meaning(&t).readings().nth(1).expect("a reading");
    assert_eq!((reading.value.clone(), reading.unit), (Value::Float32(95.2), Some("1")));
    assert!(reading.is_implausible());
}

#[test]
fn what_follows_from_an_implausible_value_carries_the_doubt() {
    let told = assigned(DO, saturation(100.0));
    assert_eq!(
        told.readings[2],
        "do_mg_l 906.745 mg/L (salinity 0, 101.325 kPa; implausible: from do_saturation)"
    );
    let conductivity = answered("01 03 2602 0002", "01 03 04 00007a44");
    let mut bus = Bus::new();
    bus.devices.assign(1, CONDUCTIVITY).expect("a built-in profile");
    let t = conductivity.transaction();
    let reading = bus.devices.meaning(&t).readings().last().expect("a derived value");
    assert!(reading.derived && reading.is_implausible());
    assert_eq!(reading.to_string(), "640000 mg/L (implausible: from conductivity)");
}

#[test]
fn readings_name_device_and_serial_number_and_what_is_derived() {
    let mut bus = Bus::new();
    bus.identifies(serial_number(1, 0, "YL0114010022"));
    let exchange = saturation(1.0);
    let t = exchange.transaction();
    let meaning = bus.devices.meaning(&t);
    let readings: Vec<_> = meaning.readings().collect();
    let quantities: Vec<_> = readings.iter().map(|reading| (reading.quantity, reading.derived)).collect();
    assert_eq!(quantities, [("temperature", false), ("do_saturation", false), ("do_mg_l", true)]);
    for reading in &readings {
        assert_eq!((reading.device, reading.serial_number), (Some(DO), Some("YL0114010022")));
    }
    let Value::Float64(oxygen) = readings[2].value else { panic!("{:?}", readings[2]) };
    assert!((oxygen / 9.0674 - 1.0).abs() < 0.0001, "{oxygen}");
}

#[test]
fn salinity_and_pressure_reach_the_formula_and_its_text() {
    let environment = Environment { salinity: 35.0, pressure_kpa: 95.0 };
    let mut devices = Devices::new(Arc::new(Profiles::built_in()), environment);
    devices.assign(1, DO).expect("a built-in profile");
    let bytes = "01 03 08 0000c841 3333733f"; // 25 °C, 0.95
    let exchange = answered("01 03 2600 0004", bytes);
    let t = exchange.transaction();
    let oxygen = devices.meaning(&t).readings().last().expect("a derived value").to_string();
    assert_eq!(oxygen, "5.997 mg/L (salinity 35, 95 kPa)");
}

#[test]
fn a_value_of_null_is_a_reading_from_which_nothing_follows() {
    for (bytes, text) in
        [("0000c07f", "not a number"), ("0000807f", "infinite"), ("000080ff", "minus infinity")]
    {
        let told = assigned(DO, answered("01 03 2600 0004", &format!("01 03 08 00008d41 {bytes}")));
        assert_eq!(told.readings, ["temperature 17.625 °C".into(), format!("do_saturation {text}")]);
    }
}

#[test]
fn dissolved_solids_follow_conductivity_unless_it_is_negative() {
    let told = assigned(CONDUCTIVITY, measurement(1, 5));
    assert_eq!(told.fields[2], "error_flag none");
    assert_eq!(told.readings.last().map(String::as_str), Some("tds 11280 mg/L"));
    let negative = answered("01 03 2602 0002", "01 03 04 0AD723BC");
    assert_eq!(assigned(CONDUCTIVITY, negative).readings, ["conductivity -0.01 mS/cm (or salinity in ppt)"]);
}

#[test]
fn the_six_register_reply_brings_the_probes_own_oxygen_beside_the_derived() {
    let reply = answered("01 03 2600 0006", "01 03 0c 0000a041 0000803f 1f851141"); // 20 °C, 1, 9.095
    let told = assigned(DO, reply);
    assert_eq!(told.readings[2], "do_mg_l 9.095 mg/L");
    assert!(told.readings[3].starts_with("do_mg_l 9.067 mg/L (salinity"), "{}", told.readings[3]);
}

#[test]
fn zero_of_a_sonde_may_mean_not_fitted() {
    let told = assigned(SONDE, sonde_data(1));
    assert_eq!(told.fields[0], "do_mg_l 7.9 mg/L");
    assert_eq!(told.fields[1], "turbidity 0 NTU (0 or not fitted)");
    assert_eq!(told.fields[7], "bga 0 cells/mL or µg/L (0 or not fitted)");
    assert_eq!(told.readings.len(), 8, "zeros are readings all the same");
}

#[test]
fn flags_read_by_name_and_unknown_ones_by_number() {
    let flags = |mask: &str| {
        assigned(SONDE, answered("01 03 0800 0001", &format!("01 03 02 {mask}00"))).fields.swap_remove(0)
    };
    assert_eq!(flags("00"), "error_flag none");
    assert_eq!(flags("05"), "error_flag brush, 12 V supply");
    assert_eq!(flags("10"), "error_flag in water (as the manual names it)");
    assert_eq!(flags("0A"), "error_flag humidity communication, undefined 0x08");
    let code = |value: &str| {
        let data = format!("01 03 0a {} {value}00", "00008d41".repeat(2));
        assigned(CONDUCTIVITY, answered("01 03 2600 0005", &data)).fields.swap_remove(2)
    };
    assert_eq!(code("FF"), "error_flag range switching error");
    assert_eq!(code("01"), "error_flag undefined 0x01");
}

#[test]
fn clocks_versions_and_implausible_settings_read_as_such() {
    let time =
        |bytes: &str| assigned(SONDE, answered("01 03 1300 0004", &format!("01 03 08 {bytes}"))).fields;
    assert_eq!(time("1705132604001600"), ["time 2016-04-26T13:05:17"]);
    assert_eq!(time("5a05132604001600"), ["time not a date: 5a 05 13 26 04 00 16 00"]);
    let version = answered("01 03 0700 0002", "01 03 04 01030201");
    assert_eq!(assigned(DO, version).fields, ["hardware_version 1.3", "software_version 2.1"]);
    let write = asked("01 10 1100 0004 08 00000000 00000000");
    assert_eq!(assigned(DO, write).fields, ["k 0 (implausible: not within 0.2 to 5)", "b 0"]);
    let address = asked("01 10 3000 0001 02 F800");
    assert_eq!(assigned(DO, address).fields, ["new_address 248 (implausible: not within 1 to 247)"]);
}

#[test]
fn fields_that_lie_within_the_data_are_read_whatever_the_quantity() {
    assert_eq!(
        assigned(CONDUCTIVITY, measurement(1, 4)).fields.len(),
        2,
        "the flag is beyond four registers"
    );
    let short = answered("01 03 2601 000A", &format!("01 03 14 {}", "0000803f".repeat(5)));
    assert_eq!(assigned(SONDE, short).fields.len(), 5);
    let half = asked("01 10 1100 0002 04 0000803f");
    assert_eq!(assigned(DO, half).fields, ["k 1"]);
}

#[test]
fn spans_count_from_the_address_byte() {
    let mut bus = Bus::new();
    bus.devices.assign(1, DO).expect("a built-in profile");
    let exchange = measurement(1, 4);
    let t = exchange.transaction();
    let spans: Vec<_> = bus.devices.meaning(&t).fields().map(|field| field.span).collect();
    assert_eq!(spans, [3..7, 7..11]);
    let write = asked("01 10 1100 0004 08 0000803f 00000000");
    let t = write.transaction();
    let spans: Vec<_> = bus.devices.meaning(&t).fields().map(|field| field.span).collect();
    assert_eq!(spans, [7..11, 11..15]);
}

#[test]
fn acks_and_meaningless_bytes_give_no_fields() {
    for (device, request, response) in [
        (DO, "01 03 2500 0000", "01 03 00"),
        (DO, "01 03 2E00 0001", "01 03 00 0000"),
        (CONDUCTIVITY, "01 03 2E00 0001", "01 03 02 0000"),
        (CONDUCTIVITY, "01 10 1C00 0000 00", "01 10 1C00 0000"),
    ] {
        let told = assigned(device, answered(request, response));
        assert!(told.command.is_some() && told.fields.is_empty() && told.readings.is_empty(), "{told:?}");
    }
}

#[test]
fn exceptions_and_damaged_sides_give_no_fields() {
    let refused =
        answered("01 10 1100 0004 08 0000803f 00000000", "01 90 02").with_outcome(Outcome::Exception);
    let told = assigned(DO, refused);
    assert_eq!((told.command.as_deref(), told.fields.len()), (Some("set-calibration"), 0));
    let damaged = Exchange { request_damaged: true, ..measurement(1, 4).with_outcome(Outcome::Damaged) };
    assert_eq!(assigned(DO, damaged).fields.len(), 0, "nothing says what a response without request answers");
    let unsolicited = measurement(1, 4);
    let t = Transaction {
        request: None,
        start_register: None,
        quantity: None,
        outcome: Outcome::Unsolicited,
        ..unsolicited.transaction()
    };
    let mut bus = Bus::new();
    bus.devices.assign(1, DO).expect("a built-in profile");
    let told = Told::new(&bus.devices.meaning(&t));
    assert_eq!((told.device.as_deref(), told.command, told.fields.len()), (Some(DO), None, 0));
}

#[test]
fn the_likeliest_reading_goes_by_values_then_by_quantity() {
    let mut bus = Bus::new();
    let told = bus.tells(saturation(0.9));
    assert_eq!(told.likely, Some((DO.into(), "get-measurement".into())));
    assert_eq!(told.likely_fields, ["temperature 20 °C", "do_saturation 90 %"]);
    let told = bus.tells(saturation(17.625));
    assert_eq!(told.likely, Some((TURBIDITY.into(), "get-measurement".into())), "no fraction");
    assert_eq!(bus.tells(measurement(1, 5)).likely_fields.len(), 3, "temperature, conductivity and its flag");
    bus.identifies(serial_number(1, 0, "YL0114010022"));
    let told = bus.tells(saturation(0.9));
    assert_eq!((told.likely, told.likely_fields.len()), (None, 0), "the device is known");
}
