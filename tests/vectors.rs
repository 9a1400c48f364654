//! Every frame of the manuals, and the real and pitiful ones beside them, decodes to what is written.
//!
//! `tests/vectors/*.json`: `hex` is the frame, `request` what a response answers, `fields` all fields of
//! the frame by name; none where it is absent. `device` is the profile, where a file has several.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtutap::decode::frame::Role;
use rtutap::decode::function::FunctionCode;
use rtutap::decode::transaction::{Outcome, Side, Transaction};
use rtutap::device::{Devices, Environment, Meaning, Profiles, Value};
use serde::Deserialize;

#[derive(Deserialize)]
struct Vector {
    name: String,
    device: Option<String>,
    direction: String,
    hex: String,
    request: Option<String>,
    #[serde(default)]
    fields: BTreeMap<String, serde_json::Value>,
}

const DO: &str = include_str!("vectors/do.json");
const CONDUCTIVITY: &str = include_str!("vectors/conductivity.json");
const SONDE: &str = include_str!("vectors/sonde.json");
const ANY: &str = include_str!("vectors/any.json");
const Y511: &str = include_str!("vectors/y511.json");
const FAMILY: &str = include_str!("vectors/family.json");

fn vectors(text: &str) -> Vec<Vector> {
    serde_json::from_str(text).expect("vectors")
}

fn bytes(hex: &str) -> Vec<u8> {
    hex.split(' ').map(|byte| u8::from_str_radix(byte, 16).expect("hex")).collect()
}

fn crc_is_good(frame: &[u8]) -> bool {
    crc::Crc::<u16>::new(&crc::CRC_16_MODBUS).checksum(frame) == 0
}

/// Is one vector as a transaction: its request, and its response when it is one.
struct Exchange {
    request: Vec<u8>,
    response: Option<Vec<u8>>,
}

impl Exchange {
    fn new(vector: &Vector) -> Self {
        let frame = bytes(&vector.hex);
        assert!(crc_is_good(&frame), "{}", vector.name);
        match (&*vector.direction, &vector.request) {
            ("request", _) => Exchange { request: frame, response: None },
            (_, Some(request)) => Exchange { request: bytes(request), response: Some(frame) },
            (_, None) => panic!("{}: a response without its request", vector.name),
        }
    }

    fn transaction(&self) -> Transaction<'_> {
        let request = &self.request;
        let number = |at: usize| u16::from_be_bytes([request[at], request[at + 1]]);
        let side = |id, bytes| Side { id, bytes, damaged: false, time: None };
        Transaction {
            id: 0,
            address: request[0],
            function: FunctionCode(request[1]),
            start_register: Some(number(2)),
            quantity: Some(number(4)),
            outcome: match (&self.response, request[0]) {
                (Some(_), _) => Outcome::Answered,
                (None, 0) => Outcome::Broadcast,
                (None, _) => Outcome::NoResponse,
            },
            exception_code: None,
            request: Some(side(0, request)),
            response: self.response.as_deref().map(|bytes| side(1, bytes)),
            latency: None,
        }
    }

    /// Returns the side that the vector is about.
    fn side(&self) -> Role {
        if self.response.is_some() { Role::Response } else { Role::Request }
    }
}

fn devices() -> Devices {
    Devices::new(Arc::new(Profiles::built_in()), Environment::default())
}

fn is_same(value: &Value<'_>, expected: &serde_json::Value) -> bool {
    match value {
        Value::Float32(number) => expected.as_f64().is_some_and(|expected| *number == expected as f32),
        Value::Integer(number) => expected.as_i64() == Some(*number),
        Value::Text(text) => expected.as_str() == Some(text),
        Value::Null => expected.is_null(),
        other => panic!("{other:?} comes from no vector"),
    }
}

/// Checks that a meaning has the vector's fields on its side, each once and no other.
fn check(vector: &Vector, exchange: &Exchange, meaning: &Meaning<'_>) {
    let side = exchange.side();
    let found: Vec<_> = meaning.fields().filter(|field| field.side == side).collect();
    let names: Vec<_> = found.iter().map(|field| field.name).collect();
    assert_eq!(found.len(), vector.fields.len(), "{}: {names:?}", vector.name);
    for field in &found {
        let expected = vector.fields.get(field.name).unwrap_or_else(|| panic!("{}: {names:?}", vector.name));
        assert!(is_same(&field.value, expected), "{}: {} is {field}", vector.name, field.name);
    }
    assert!(found.is_sorted_by_key(|field| field.span.start), "{}", vector.name);
}

/// Returns what the manuals call a command, apart from the profiles.
fn command(device: &str, exchange: &Exchange) -> Option<&'static str> {
    let t = exchange.transaction();
    let is_probe = !device.starts_with("yosemitech-sonde");
    Some(match (t.function.0, t.start_register?, device) {
        (3, 0x0700, _) => "get-version",
        (3, 0x0800, "yosemitech-sonde") => "get-error-flag",
        (3, 0x0E00, "yosemitech-ph") => "get-calibration-status",
        (3, 0x1200, "yosemitech-ph") => "get-potential",
        (3, 0x1200, "yosemitech-cod") => "get-turbidity",
        (16, 0x2300, "yosemitech-ph") => "set-calibration-point",
        (3, 0x2400, "yosemitech-ph") => "get-temperature",
        (3, 0x2602, "yosemitech-sonde-v2") => "get-turbidity",
        (3, 0x260F, "yosemitech-sonde-v2") => "get-tds",
        (3, 0x2800, "yosemitech-ph") => "get-ph",
        (3, 0x2800, "yosemitech-ammonium") => "get-concentrations",
        (3, 0x2900, "yosemitech-ph") => "get-coefficients",
        (16, 0x2900, "yosemitech-ph") => "set-coefficients",
        (16, 0x3100, "yosemitech-turb-wiper") => "start-brush",
        (3, 0x3200, "yosemitech-turb-wiper") => "get-brush-interval",
        (16, 0x3200, "yosemitech-turb-wiper") => "set-brush-interval",
        (3, 0x3400, "yosemitech-orp") => "get-orp-calibration",
        (16, 0x3400, "yosemitech-orp") => "set-orp-calibration",
        (3, 0x3400, "yosemitech-ammonium") => "get-nh3n-calibration",
        (16, 0x3400, "yosemitech-ammonium") => "set-nh3n-calibration",
        (3, 0x3600, "yosemitech-ammonium") => "get-nh4-calibration",
        (16, 0x3600, "yosemitech-ammonium") => "set-nh4-calibration",
        (3, 0x3700, "yosemitech-ammonium") => "get-ion-potentials",
        (3, 0x0900, _) if is_probe => "get-serial-number",
        (3, 0x0E00, "yosemitech-sonde") => "get-brush-interval",
        (16, 0x0E00, "yosemitech-sonde") => "set-brush-interval",
        (3, 0x1100, _) if is_probe => "get-calibration",
        (16, 0x1100, _) if is_probe => "set-calibration",
        (3, 0x1300, "yosemitech-sonde") => "get-time",
        (16, 0x1300, "yosemitech-sonde") => "set-time",
        (3, 0x1400, "yosemitech-sonde") => "get-serial-number",
        (16, 0x1C00, "yosemitech-conductivity") => "start-measurement",
        (3, 0x1E00, "yosemitech-sonde") => "get-supply-voltage",
        (3, 0x2500, "yosemitech-do" | "yosemitech-turb-wiper") => "start-measurement",
        (3, 0x2600, _) if is_probe => "get-measurement",
        (3, 0x2601, "yosemitech-sonde") => "get-measurement",
        (3, 0x2602, "yosemitech-conductivity") => "get-conductivity",
        (16, 0x2700, "yosemitech-do") => "set-cap-coefficients",
        (3, 0x2E00, "yosemitech-do" | "yosemitech-conductivity") => "stop-measurement",
        (16, 0x2F00, "yosemitech-sonde") => "start-brush",
        (3, 0x3000, _) => "get-address",
        (16, 0x3000, _) => "set-address",
        _ => return None,
    })
}

fn check_assigned(text: &str, device: &str) {
    vectors(text).iter().for_each(|vector| check_as(vector, device));
}

fn check_as(vector: &Vector, device: &str) {
    let exchange = Exchange::new(vector);
    let t = exchange.transaction();
    let mut devices = devices();
    devices.assign(t.address, device).expect("a built-in profile");
    devices.observe(&t);
    let meaning = devices.meaning(&t);
    assert_eq!(meaning.device(), Some(device), "{}", vector.name);
    assert_eq!(meaning.candidates().count(), 0, "{}", vector.name);
    assert_eq!(meaning.command(), command(device, &exchange), "{}", vector.name);
    check(vector, &exchange, &meaning);
}

#[test]
fn every_frame_of_the_do_manual_decodes() {
    check_assigned(DO, "yosemitech-do");
}

#[test]
fn every_frame_of_the_conductivity_manual_decodes() {
    check_assigned(CONDUCTIVITY, "yosemitech-conductivity");
}

#[test]
fn every_frame_of_the_sonde_manual_decodes() {
    check_assigned(SONDE, "yosemitech-sonde");
}

#[test]
fn mistakes_of_masters_decode_as_what_a_probe_would_take_them_for() {
    check_assigned(ANY, "yosemitech-do");
    check_assigned(ANY, "yosemitech-conductivity");
}

/// Frames that the manual of the ammonium probe prints with a wrong CRC.
const MISPRINTED: &str = "NH4_get_mv_resp_printed";

#[test]
fn every_frame_of_the_family_decodes() {
    for vector in vectors(FAMILY).iter().filter(|vector| vector.name != MISPRINTED) {
        check_as(vector, vector.device.as_deref().expect("a profile"));
    }
    check_assigned(Y511, "yosemitech-turb-wiper");
}

#[test]
fn a_misprinted_frame_is_the_good_one_but_for_its_crc() {
    let frame = |name: &str| {
        let vector = vectors(FAMILY).into_iter().find(|vector| vector.name == name).expect("a vector");
        bytes(&vector.hex)
    };
    let (printed, good) = (frame(MISPRINTED), frame("NH4_get_mv_resp_fixed"));
    assert!(!crc_is_good(&printed) && crc_is_good(&good));
    assert_eq!(printed.split_last_chunk::<2>().map(|it| it.0), good.split_last_chunk::<2>().map(|it| it.0));
}

#[test]
fn a_frame_decodes_without_assignment_where_its_evidence_suffices() {
    // All but these: in a measurement read at 0x2600, some models have the temperature first and some a
    // potential; what the others mean depends on the model, too.
    let contested =
        ["DO_get_values_resp", "COND_get_values_resp", "COND_get_cond_only_resp", "SONDE_get_brush_resp"];
    for vector in [DO, CONDUCTIVITY, SONDE, ANY].into_iter().flat_map(vectors) {
        let exchange = Exchange::new(&vector);
        let t = exchange.transaction();
        let mut devices = devices();
        devices.observe(&t);
        let meaning = devices.meaning(&t);
        if contested.iter().any(|name| vector.name.starts_with(name)) {
            assert_eq!(meaning.fields().count(), 0, "{}", vector.name);
            assert!(meaning.likely().is_some(), "{}", vector.name);
        } else {
            check(&vector, &exchange, &meaning);
        }
    }
}

#[test]
fn the_real_probe_is_known_once_its_serial_number_is_read() {
    let mut devices = devices();
    let mut was_read = false;
    for vector in vectors(Y511) {
        let exchange = Exchange::new(&vector);
        let t = exchange.transaction();
        let identified = devices.observe(&t);
        let meaning = devices.meaning(&t);
        if vector.name == "Y511_resp_sn" {
            let evidence = identified.expect("identified").evidence;
            assert_eq!(evidence, "serial number YL2917050209: type 29, turbidity probe with wiper");
            was_read = true;
        }
        if was_read {
            assert_eq!(meaning.serial_number(), Some("YL2917050209"));
            assert_eq!(meaning.device(), Some("yosemitech-turb-wiper"), "{}", vector.name);
            check(&vector, &exchange, &meaning);
        }
    }
    assert!(was_read);
}
