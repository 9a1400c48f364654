//! How the models of the family, which share most registers, are told apart: by evidence only.

use super::*;

#[test]
fn the_type_code_of_a_serial_number_names_each_model() {
    for (code, device) in [
        ("01", DO),
        ("50", DO),
        ("09", CONDUCTIVITY),
        ("10", TURBIDITY),
        ("24", DEPTH),
        ("29", TURBIDITY_WIPER),
        ("36", CHLOROPHYLL),
        ("48", CHLOROPHYLL),
        ("43", PH),
        ("44", ORP),
        ("47", COD),
        ("61", BGA),
        ("62", BGA),
        ("68", AMMONIUM),
    ] {
        let identified = Bus::new().identifies(serial_number(1, 0, &format!("YL{code}19052307")));
        assert_eq!(identified.map(|it| it.device.to_string()).as_deref(), Some(device), "{code}");
        let byte = u8::from_str_radix(code, 16).expect("two digits");
        let identified = Bus::new().identifies(serial_number(1, byte, "190523070000"));
        assert_eq!(identified.map(|it| it.device.to_string()).as_deref(), Some(device), "byte {byte:#04x}");
    }
}

#[test]
fn no_two_profiles_claim_the_same_evidence() {
    let profiles = Profiles::built_in();
    let claims = |profile: &Profile, code: &str| {
        let rule = profile.serial_number.as_ref();
        rule.is_some_and(|rule| rule.type_codes.iter().any(|known| **known == *code))
    };
    for profile in profiles.iter() {
        let others = || profiles.iter().filter(|other| other.id != profile.id);
        for code in profile.serial_number.iter().flat_map(|rule| &rule.type_codes) {
            assert!(!others().any(|other| claims(other, code)), "type {code} of {}", profile.id);
        }
        for command in profile.commands.iter().filter(|command| command.is_fingerprint) {
            let (function, register) = command.key();
            let same = others().filter_map(|other| other.command(function, register));
            let mut shared = same.flat_map(|other| &other.quantities);
            assert!(!shared.any(|it| command.quantities.contains(it)), "{} of {}", command.name, profile.id);
        }
    }
}

#[test]
fn what_only_one_model_accepts_names_it() {
    let floats = |count: usize| "0000803f".repeat(count);
    for (exchange, device) in [
        (answered("01 03 2800 0006", &format!("01 03 0c {}", floats(3))), AMMONIUM),
        (answered("01 03 3700 0004", &format!("01 03 08 {}", floats(2))), AMMONIUM),
        (answered("01 03 3600 0004", &format!("01 03 08 {}", floats(2))), AMMONIUM),
        (answered(&format!("01 10 3600 0004 08 {}", floats(2)), "01 10 3600 0004"), AMMONIUM),
        (answered("01 10 2300 0002 04 00008040", "01 10 2300 0002"), PH),
        (answered("01 03 2606 0002", &format!("01 03 04 {}", floats(1))), SONDE_V2),
    ] {
        let identified = Bus::new().identifies(exchange).expect("identified");
        assert_eq!(&*identified.device, device);
    }
}

#[test]
fn a_short_read_of_an_ammonium_probe_is_also_a_ph() {
    let mut bus = Bus::new();
    let (identified, told) = bus.happens(answered("01 03 2800 0002", "01 03 04 3333f340"));
    assert_eq!((identified, told.device), (None, None));
    assert_eq!(told.candidates, [PH, ORP, AMMONIUM]);
    assert_eq!((told.command, told.fields.len()), (None, 0));
    assert_eq!(told.likely, Some((PH.into(), "get-ph".into())));
}

#[test]
fn probes_without_a_start_agree_on_their_temperature_and_potential() {
    let mut bus = Bus::new();
    let told = bus.tells(answered("01 03 2400 0002", "01 03 04 cdcc7c41"));
    assert_eq!(told.candidates, [PH, ORP, AMMONIUM, DEPTH]);
    assert_eq!(told.readings, ["temperature 15.8 °C"]);
    let told = bus.tells(answered("01 03 1200 0002", "01 03 04 85ebd1c0"));
    assert_eq!(
        told.candidates,
        [PH, ORP],
        "a COD probe has its turbidity there, but no temperature at 0x2400"
    );
    assert_eq!(told.readings, ["potential -6.56 mV"]);
    let told = bus.tells(answered("01 03 2600 0004", "01 03 08 85ebd1c0 3333f340"));
    assert_eq!(told.readings, ["potential -6.56 mV"], "an ORP probe has no pH");
}

#[test]
fn a_contested_register_does_not_choose_between_potential_and_turbidity() {
    let told = Bus::new().tells(answered("01 03 1200 0002", "01 03 04 85ebd1c0"));
    assert_eq!(told.candidates, [COD, PH, ORP]);
    assert_eq!((told.command, told.readings.len()), (None, 0));
}

#[test]
fn error_flags_that_mean_different_things_are_not_agreed_on() {
    let mut bus = Bus::new();
    let read = || answered("01 03 2600 0005", "01 03 0a 00008d41 00008d41 ff00");
    bus.devices.assign(2, CONDUCTIVITY).expect("a built-in profile");
    bus.devices.assign(3, TURBIDITY_WIPER).expect("a built-in profile");
    let at = |address: &str| {
        answered(&format!("{address} 03 2600 0005"), &format!("{address} 03 0a 00008d4100008d41ff00"))
    };
    assert_eq!(bus.tells(at("02")).fields[2], "error_flag range switching error");
    assert_eq!(bus.tells(at("03")).fields[2], "error_flag brush in the wrong position, measurement stopped");
    assert_eq!(bus.tells(read()).fields.len(), 0);
}

#[test]
fn a_model_whose_type_code_nobody_knows_is_said_by_the_user() {
    let mut bus = Bus::new();
    bus.tells(optical_start(4));
    bus.tells(serial_number(4, 0x99, "YL9919052307"));
    assert_eq!(bus.tells(measurement(4, 4)).candidates.len(), 0, "its serial number tells none of the known");
    bus.devices.assign(4, SOLIDS).expect("a built-in profile");
    assert_eq!(bus.tells(measurement(4, 4)).readings, ["temperature 17.625 °C", "suspended_solids 17.625"]);
}

#[test]
fn a_depth_probe_leaves_its_first_bytes_raw() {
    let mut bus = Bus::new();
    bus.identifies(serial_number(1, 0x24, "YL2419052307"));
    let told = bus.tells(answered("01 03 2600 0006", "01 03 0c 11223344 00008d41 0000 0000"));
    assert_eq!(told.fields, ["pressure 17.625 mmH2O"]);
}
