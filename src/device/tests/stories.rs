//! How devices become known: what names one, what does not, and what follows it about.

use super::*;

#[test]
fn a_serial_number_names_the_device_within_its_own_transaction() {
    let mut bus = Bus::new();
    let (identified, told) = bus.happens(serial_number(1, 0, "YL0114010022"));
    assert_eq!(
        identified,
        Some(Identified {
            moved_from: None,
            address: 1,
            device: DO.into(),
            serial_number: Some("YL0114010022".into()),
            evidence: "serial number YL0114010022: type 01, optical dissolved oxygen probe".into(),
            frames: vec![0, 1],
        })
    );
    assert_eq!(told.device.as_deref(), Some(DO));
    assert_eq!(told.fields, ["type_byte 0x00", "serial_number YL0114010022"]);
    assert_eq!(bus.identifies(serial_number(1, 0, "YL0114010022")), None, "said once");
    assert_eq!(bus.tells(measurement(1, 4)).serial_number.as_deref(), Some("YL0114010022"));
}

#[test]
fn the_byte_before_a_serial_number_names_the_device_where_its_text_does_not() {
    let mut bus = Bus::new();
    let identified = bus.identifies(serial_number(1, 0x09, "161121010000")).expect("identified");
    assert_eq!(&*identified.device, CONDUCTIVITY);
    assert_eq!(bus.identifies(serial_number(2, 0x00, "161121010000")), None);
    assert_eq!(bus.tells(measurement(2, 4)).candidates, SINGLE_PROBES);
}

#[test]
fn an_accepted_exchange_that_only_one_device_has_names_it() {
    let mut bus = Bus::new();
    let identified = bus.identifies(sonde_data(5)).expect("identified");
    assert_eq!((identified.address, &*identified.device), (5, SONDE));
    assert_eq!(identified.evidence, "its answer to 16 registers at 0x2601, which only yosemitech-sonde has");
    assert_eq!(identified.serial_number, None);
    assert_eq!(bus.identifies(sonde_data(5)), None, "said once");
    let start = answered("06 10 1C00 0000 00", "06 10 1C00 0000");
    let identified = bus.identifies(start).expect("identified");
    assert_eq!(&*identified.device, CONDUCTIVITY);
    assert!(
        identified.evidence.starts_with("its acknowledgement of 0 registers at 0x1C00, which"),
        "{}",
        identified.evidence
    );
    let cap = answered(&format!("07 10 2700 0010 20 {}", "00".repeat(32)), "07 10 2700 0010");
    assert_eq!(bus.identifies(cap).map(|identified| identified.device), Some(DO.into()));
}

#[test]
fn a_serial_number_read_later_is_told_with_the_device() {
    let mut bus = Bus::new();
    bus.identifies(sonde_data(5));
    let text: String = b"YL3818041901".iter().map(|byte| format!("{byte:02x}")).collect();
    let read = answered("05 03 1400 0007", &format!("05 03 0e 38{text}00"));
    let identified = bus.identifies(read).expect("identified");
    assert_eq!(identified.serial_number.as_deref(), Some("YL3818041901"));
    assert_eq!(identified.evidence, "serial number YL3818041901: type 38, multi-parameter sonde");
}

#[test]
fn a_request_alone_proves_only_what_the_master_believes() {
    let mut bus = Bus::new();
    let unanswered = sonde_data(5).with_outcome(Outcome::NoResponse);
    let unanswered = Exchange { response: None, ..unanswered };
    assert_eq!(bus.identifies(unanswered), None);
    let refused = answered("05 03 2601 0010", "05 83 02").with_outcome(Outcome::Exception);
    assert_eq!(bus.identifies(refused), None);
    let damaged = Exchange { request_damaged: true, ..sonde_data(5).with_outcome(Outcome::Damaged) };
    assert_eq!(bus.identifies(damaged), None);
    assert_eq!(bus.tells(asked("05 03 2600 0004")).candidates, SINGLE_PROBES, "nothing was learnt");
    assert!(bus.identifies(sonde_data(5).with_outcome(Outcome::Late)).is_some(), "late is accepted");
}

#[test]
fn registers_narrow_the_candidates_but_name_no_device() {
    let mut bus = Bus::new();
    let told = bus.tells(measurement(1, 4));
    assert_eq!(told.candidates, SINGLE_PROBES);
    assert_eq!(told.command.as_deref(), Some("get-measurement"));
    assert_eq!(told.fields.len(), 0, "pH and ORP probes have a potential where others have the temperature");
    let (identified, told) = bus.happens(optical_start(1));
    assert_eq!((identified, told.device), (None, None), "turbidity probes start so too");
    assert_eq!(told.candidates, OPTICAL_PROBES);
    assert_eq!(told.command.as_deref(), Some("start-measurement"));
    let told = bus.tells(measurement(1, 4));
    assert_eq!(told.fields, ["temperature 17.625 °C"], "on which all optical probes agree");
    assert_eq!(told.readings, told.fields, "nothing is derived either");
    assert_eq!(told.likely, Some((TURBIDITY.into(), "get-measurement".into())));
    assert_eq!(told.likely_fields, ["turbidity 17.625 NTU"], "no plausible saturation");
}

#[test]
fn a_contested_register_is_read_as_likely_only() {
    let mut bus = Bus::new();
    let (identified, told) = bus.happens(answered("01 03 0E00 0001", "01 03 02 1E00"));
    assert_eq!((identified, told.device), (None, None), "a pH probe answers with its calibration status");
    assert_eq!(told.candidates, [SONDE, PH, ORP]);
    assert_eq!((told.command, told.fields.len()), (None, 0));
    assert_eq!(told.likely, Some((SONDE.into(), "get-brush-interval".into())));
    assert_eq!(told.likely_fields, ["brush_interval 30 min"]);
    bus.identifies(sonde_data(1));
    let told = bus.tells(answered("01 03 0E00 0001", "01 03 02 1E00"));
    assert_eq!((told.command.as_deref(), told.likely), (Some("get-brush-interval"), None));
    assert_eq!(told.fields, ["brush_interval 30 min"]);
    // A later sonde has its turbidity where the conductivity probe has its value.
    let told = bus.tells(answered("02 03 2602 0002", "02 03 04 00008d41"));
    assert_eq!((told.device, told.candidates), (None, vec![CONDUCTIVITY.into(), SONDE_V2.into()]));
    assert_eq!((told.command, told.fields.len(), told.readings.len()), (None, 0, 0));
    assert_eq!(told.likely, Some((CONDUCTIVITY.into(), "get-conductivity".into())));
}

#[test]
fn a_turbidity_probe_without_its_serial_number_is_read_as_no_other() {
    // Frames of a real Y511.
    let mut bus = Bus::new();
    let values = || answered("03 03 2600 0004", "03 03 08 0000C341 9C60B5C0");
    assert_eq!(bus.tells(optical_start(3)).candidates, OPTICAL_PROBES);
    let told = bus.tells(values());
    assert_eq!((told.device.as_deref(), &*told.candidates), (None, &OPTICAL_PROBES.map(String::from)[..]));
    assert_eq!(told.readings, ["temperature 24.375 °C"]);
    let told = bus.tells(answered("03 10 3100 0000 00", "03 10 3100 0000"));
    assert_eq!(told.candidates, [TURBIDITY_WIPER, CHLOROPHYLL, BGA, COD], "those with a wiper");
    assert_eq!(told.command.as_deref(), Some("start-brush"));
    let told = bus.tells(answered("03 03 3200 0001", "03 03 02 1E00"));
    assert_eq!(told.fields, ["brush_interval 30 min"]);
    let told = bus.tells(values());
    assert_eq!((told.device, &*told.readings), (None, &["temperature 24.375 °C".to_owned()][..]));
    assert_eq!(told.likely, Some((TURBIDITY_WIPER.into(), "get-measurement".into())));
    let named = bus.identifies(serial_number(3, 0x29, "YL2917050209")).expect("identified");
    assert_eq!(&*named.device, TURBIDITY_WIPER);
    assert_eq!(bus.tells(values()).fields, ["temperature 24.375 °C", "turbidity -5.668043 NTU"]);
}

#[test]
fn the_quantity_of_a_read_rules_out_no_profile() {
    // A conductivity probe answers 4 registers, a Y511 4, a Y510 5, an old DO probe 6, against their manuals.
    for quantity in [2, 4, 5, 6] {
        let mut bus = Bus::new();
        assert_eq!(bus.tells(measurement(1, quantity)).candidates, SINGLE_PROBES, "{quantity}");
        bus.tells(optical_start(1));
        let told = bus.tells(measurement(1, quantity));
        assert_eq!(told.candidates, OPTICAL_PROBES, "{quantity}");
        assert_eq!(told.fields, ["temperature 17.625 °C"], "{quantity}");
    }
}

#[test]
fn a_device_is_followed_to_its_new_address() {
    let mut bus = Bus::new();
    bus.identifies(serial_number(1, 0, "YL0114010022"));
    let (identified, told) = bus.happens(set_address(1, 0x14));
    assert_eq!(told.device.as_deref(), Some(DO), "the old address acknowledges");
    assert_eq!(
        (told.command.as_deref(), &*told.fields),
        (Some("set-address"), &["new_address 20".into()][..])
    );
    let identified = identified.expect("the device of address 20 has become known");
    assert_eq!((identified.address, &*identified.device), (20, DO));
    assert_eq!(identified.serial_number.as_deref(), Some("YL0114010022"));
    assert!(identified.evidence.starts_with("its move from address 1 (there by serial number YL"));
    assert_eq!(bus.tells(measurement(20, 4)).device.as_deref(), Some(DO));
    let further = bus.identifies(set_address(20, 3)).expect("it moved again");
    assert_eq!(further.evidence.matches("its move").count(), 1, "{}", further.evidence);
    assert_eq!(bus.tells(measurement(1, 4)).device, None, "nothing is known of the old address");
}

#[test]
fn an_address_change_that_nobody_acknowledged_moves_nothing() {
    let mut bus = Bus::new();
    bus.identifies(serial_number(1, 0, "YL0114010022"));
    let unacknowledged = Exchange { response: None, ..set_address(1, 20).with_outcome(Outcome::NoResponse) };
    assert_eq!(bus.identifies(unacknowledged), None);
    assert_eq!(bus.tells(measurement(1, 4)).device.as_deref(), Some(DO));
    // In the wrong byte order it asks for address 0; 248 is no address of a device either.
    for bytes in ["0014", "F800"] {
        let wrong = answered(&format!("01 10 3000 0001 02 {bytes}"), "01 10 3000 0001");
        assert_eq!(bus.identifies(wrong), None);
    }
    assert_eq!(bus.tells(measurement(1, 4)).device.as_deref(), Some(DO));
}

#[test]
fn what_is_known_of_candidates_moves_too() {
    let mut bus = Bus::new();
    bus.tells(optical_start(1));
    assert_eq!(bus.tells(set_address(1, 2)).candidates, OPTICAL_PROBES);
    assert_eq!(bus.tells(measurement(2, 4)).candidates, OPTICAL_PROBES);
}

#[test]
fn the_service_address_is_no_device() {
    let mut bus = Bus::new();
    let (identified, told) = bus.happens(answered("FF 03 3000 0001", "FF 03 02 0300"));
    assert_eq!((identified, told.device), (None, None));
    assert_eq!(told.candidates.len(), Profiles::built_in().iter().count(), "all have it");
    assert_eq!(told.command.as_deref(), Some("get-address"));
    assert_eq!(told.fields, ["current_address 3"]);
    assert_eq!(bus.identifies(serial_number(0xFF, 0, "YL0114010022")), None);
    assert_eq!(bus.tells(measurement(0xFF, 4)).candidates, SINGLE_PROBES, "nothing was learnt");
}

#[test]
fn a_broadcast_teaches_nothing_and_keeps_its_fields() {
    let mut bus = Bus::new();
    let told = bus.tells(asked("00 10 3000 0001 02 1400").with_outcome(Outcome::Broadcast));
    assert_eq!(
        (told.command.as_deref(), &*told.fields),
        (Some("set-address"), &["new_address 20".into()][..])
    );
}

#[test]
fn an_assignment_overrides_all_evidence() {
    let mut bus = Bus::new();
    bus.devices.assign(1, CONDUCTIVITY).expect("a built-in profile");
    let identified = bus.identifies(serial_number(1, 0, "YL0114010022")).expect("its serial number is new");
    assert_eq!(&*identified.device, CONDUCTIVITY);
    assert_eq!(identified.evidence, "assignment; serial number YL0114010022");
    bus.identifies(sonde_data(1));
    let told = bus.tells(measurement(1, 5));
    assert_eq!(told.device.as_deref(), Some(CONDUCTIVITY));
    assert_eq!(told.fields[1], "conductivity 17.625 mS/cm (or salinity in ppt)");
    assert_eq!(bus.devices.device(1), Some(CONDUCTIVITY));
}

#[test]
fn an_assignment_to_an_unknown_profile_names_the_nearest() {
    let mut bus = Bus::new();
    let error = bus.devices.assign(1, "yosemitech-sond").expect_err("no such profile").to_string();
    assert_eq!(error, "no profile is called 'yosemitech-sond'; did you mean 'yosemitech-sonde'?");
    let error = bus.devices.assign(1, "x").expect_err("no such profile").to_string();
    assert!(error.contains(CONDUCTIVITY), "{error}");
}

#[test]
fn an_assignment_goes_along_and_the_new_addresses_own_stays() {
    let mut bus = Bus::new();
    bus.devices.assign(1, DO).expect("a built-in profile");
    bus.devices.assign(3, SONDE).expect("a built-in profile");
    assert_eq!(bus.tells(set_address(1, 2)).device.as_deref(), Some(DO));
    assert_eq!(bus.tells(measurement(2, 4)).device.as_deref(), Some(DO));
    assert_eq!(bus.tells(set_address(2, 3)).device.as_deref(), Some(DO), "said by the one that leaves");
    assert_eq!(bus.tells(sonde_data(3)).device.as_deref(), Some(SONDE));
}

#[test]
fn an_assignment_goes_along_whatever_else_was_answered() {
    let mut bus = Bus::new();
    bus.devices.assign(1, DO).expect("a built-in profile");
    bus.tells(answered("01 03 4000 0001", "01 03 02 0000"));
    assert_eq!(bus.tells(measurement(1, 4)).fields.len(), 2, "the maker's tool may ask what no manual has");
    bus.tells(set_address(1, 2));
    assert_eq!(bus.tells(measurement(2, 4)).device.as_deref(), Some(DO));
}
