//! What is believed when evidence contradicts: the later of equal weight, and nothing beyond it.

use super::*;

#[test]
fn another_serial_number_is_another_device() {
    let mut bus = Bus::new();
    bus.identifies(serial_number(1, 0, "YL0114010022"));
    let same_kind = bus.identifies(serial_number(1, 0x01, "YL0116112101")).expect("a new serial number");
    assert_eq!((&*same_kind.device, same_kind.serial_number.as_deref()), (DO, Some("YL0116112101")));
    let other_kind = bus.identifies(serial_number(1, 0x09, "YL0916112101")).expect("another device");
    assert_eq!(&*other_kind.device, CONDUCTIVITY);
}

#[test]
fn a_serial_number_of_no_known_type_takes_the_device_away() {
    let mut bus = Bus::new();
    bus.identifies(serial_number(3, 0, "YL0114010022"));
    let (identified, told) = bus.happens(serial_number(3, 0x99, "YL9917050209"));
    assert_eq!(identified, None);
    assert_eq!(told, Told { serial_number: Some("YL9917050209".into()), ..Told::default() });
    let told = bus.tells(measurement(3, 4));
    assert_eq!((told.candidates.len(), told.fields.len(), told.readings.len()), (0, 0, 0), "shown raw");
    assert_eq!(bus.identifies(sonde_data(3)), None, "not even by a fingerprint");
    assert!(bus.identifies(serial_number(3, 0, "YL0114010022")).is_some(), "until it is swapped");
}

#[test]
fn a_serial_number_of_no_known_type_moves_with_its_device() {
    let mut bus = Bus::new();
    bus.tells(serial_number(5, 0x99, "YL9917022701"));
    bus.tells(set_address(5, 3));
    let told = bus.tells(measurement(3, 5));
    assert_eq!((told.serial_number.as_deref(), told.fields.len()), (Some("YL9917022701"), 0));
    assert_eq!(bus.tells(measurement(5, 5)).candidates, SINGLE_PROBES);
}

#[test]
fn a_serial_number_overrules_registers_and_fingerprints() {
    let mut bus = Bus::new();
    bus.tells(optical_start(1));
    let identified = bus.identifies(serial_number(1, 0x09, "YL0916112101")).expect("identified");
    assert_eq!(&*identified.device, CONDUCTIVITY);
    let start = answered("02 10 1C00 0000 00", "02 10 1C00 0000");
    bus.identifies(start);
    assert_eq!(bus.identifies(serial_number(2, 0, "YL0114010022")).map(|it| it.device), Some(DO.into()));
}

#[test]
fn the_sondes_own_register_outweighs_the_type_in_the_manuals_example() {
    // The sonde manual prints a serial number of type 01, a DO probe's, which has no register 0x1400.
    let text: String = b"YL0114010022".iter().map(|byte| format!("{byte:02x}")).collect();
    let read = answered("01 03 1400 0006", &format!("01 03 0c {text}"));
    let mut bus = Bus::new();
    let identified = bus.identifies(read.clone()).expect("identified");
    assert_eq!((&*identified.device, identified.serial_number.as_deref()), (SONDE, Some("YL0114010022")));
    assert_eq!(
        identified.evidence,
        "its answer to 6 registers at 0x1400, which only yosemitech-sonde has; serial number YL0114010022"
    );
    assert_eq!(bus.identifies(read), None, "said once");
}

#[test]
fn the_fingerprint_of_another_device_means_that_it_was_swapped() {
    let mut bus = Bus::new();
    bus.identifies(serial_number(1, 0, "YL0114010022"));
    let identified = bus.identifies(sonde_data(1)).expect("another device");
    assert_eq!((&*identified.device, identified.serial_number), (SONDE, None));
    let told = bus.tells(measurement(1, 16));
    assert_eq!((told.device.as_deref(), told.fields.len()), (Some(SONDE), 0), "registers swap no device");
}

#[test]
fn registers_that_no_single_profile_has_leave_no_candidate() {
    let mut bus = Bus::new();
    let told = bus.tells(answered("01 03 2602 0002", "01 03 04 00008d41"));
    assert_eq!(told.candidates, [CONDUCTIVITY, SONDE_V2]);
    let told = bus.tells(answered("01 03 1200 0002", "01 03 04 00008d41"));
    assert_eq!(told, Told::default());
    let identified = bus.identifies(sonde_data(1)).expect("a fingerprint outweighs registers");
    assert_eq!(&*identified.device, SONDE);
}

#[test]
fn a_fingerprint_in_another_quantity_or_length_is_none() {
    let mut bus = Bus::new();
    assert_eq!(bus.identifies(answered("01 03 2601 000A", &format!("01 03 14 {}", "00".repeat(20)))), None);
    assert_eq!(bus.identifies(answered("02 03 2601 0010", "02 03 04 00000000")), None);
}

#[test]
fn an_answer_at_a_register_that_no_profile_knows_leaves_no_candidate() {
    let unknown = || answered("03 10 4100 0000 00", "03 10 4100 0000");
    let refused = answered("03 10 4100 0000 00", "03 90 02").with_outcome(Outcome::Exception);
    let mut bus = Bus::new();
    bus.tells(measurement(3, 4));
    for unaccepted in [asked("03 10 4100 0000 00"), refused] {
        let told = bus.tells(unaccepted);
        assert_eq!((told.candidates, told.command), (SINGLE_PROBES.map(String::from).to_vec(), None));
    }
    assert_eq!(bus.tells(unknown()), Told::default());
    assert_eq!(bus.tells(measurement(3, 4)), Told::default(), "shown raw");
    bus.tells(serial_number(3, 0x99, "YL9917050209"));
    assert_eq!(bus.identifies(sonde_data(3)), None, "its serial number is the maker's, of no known kind");
    assert!(bus.identifies(serial_number(3, 0, "YL0114010022")).is_some(), "until it is swapped");
    bus.tells(unknown());
    assert_eq!(bus.tells(measurement(3, 4)).device.as_deref(), Some(DO), "what is known stays so");
    bus.tells(answered("04 10 4100 0000 00", "04 10 4100 0000"));
    assert!(bus.identifies(sonde_data(4)).is_some(), "a fingerprint outweighs registers");
    bus.tells(answered("04 10 4100 0000 00", "04 10 4100 0000"));
    assert_eq!(bus.tells(sonde_data(4)).device.as_deref(), Some(SONDE));
}

#[test]
fn an_unknown_device_moves_over_no_known_one() {
    let mut bus = Bus::new();
    bus.identifies(serial_number(2, 0, "YL0114010022"));
    bus.tells(set_address(9, 2));
    assert_eq!(bus.tells(measurement(2, 4)).device.as_deref(), Some(DO));
}

#[test]
fn text_that_is_no_serial_number_is_not_taken_for_one() {
    let zeros = answered("01 03 0900 0007", &format!("01 03 0e {}", "00".repeat(14)));
    let garbage = answered("01 03 0900 0007", &format!("01 03 0e 09 {}", "ff".repeat(13)));
    let mut bus = Bus::new();
    for exchange in [zeros, garbage] {
        let (identified, told) = bus.happens(exchange);
        assert_eq!((identified, told.serial_number), (None, None));
        assert_eq!(told.candidates, SINGLE_PROBES);
    }
}

#[test]
fn two_profiles_that_claim_a_type_are_told_apart_by_their_registers() {
    let text = "id = \"other-do\"\nname = \"other\"\n\
        serial-number = { prefix = \"YL\", type-codes = [\"01\"] }\n\
        [[command]]\nname = \"get-serial-number\"\nfunction = 3\nregister = 0x0900\nquantities = [7]\n\
        response = [{ name = \"serial_number\", offset = 1, type = \"ascii\", length = 12 }]\n\
        [[command]]\nname = \"get-level\"\nfunction = 3\nregister = 0x7000\nquantities = [1]\n";
    let mut profiles = Profiles::built_in();
    profiles.add(Profile::from_toml(text, "other.toml").expect("a profile"));
    let mut bus = Bus::with_profiles(profiles);
    let (identified, told) = bus.happens(serial_number(1, 0, "YL0114010022"));
    assert_eq!((identified, told.device), (None, None));
    assert_eq!(told.candidates, [DO, "other-do"]);
    assert_eq!(told.fields, ["serial_number YL0114010022"], "both agree on it, not on the byte before");
    let identified = bus.identifies(answered("01 03 7000 0001", "01 03 02 0000")).expect("identified");
    assert_eq!(
        (&*identified.device, identified.serial_number.as_deref()),
        ("other-do", Some("YL0114010022"))
    );
}

#[test]
fn profiles_that_disagree_give_neither_command_nor_field() {
    // A pH probe answers at the sonde's brush interval with the status of its calibration.
    let text = "id = \"ph\"\nname = \"pH probe\"\n\
        [[command]]\nname = \"get-calibration-status\"\nfunction = 3\nregister = 0x0E00\nquantities = [1]\n\
        response = [{ name = \"brush_interval\", offset = 0, type = \"u16-le\", unit = \"h\" }]\n";
    let mut profiles = Profiles::built_in();
    profiles.add(Profile::from_toml(text, "ph.toml").expect("a profile"));
    let mut bus = Bus::with_profiles(profiles);
    let told = bus.tells(answered("01 03 0E00 0001", "01 03 02 1E00"));
    assert_eq!(told.candidates, [SONDE, PH, ORP, "ph"]);
    assert_eq!((told.command, told.fields), (None, vec![]), "names of commands and units of fields differ");
    assert_eq!(told.likely, Some((SONDE.into(), "get-brush-interval".into())));
    assert_eq!(told.likely_fields, ["brush_interval 30 min"]);
}
