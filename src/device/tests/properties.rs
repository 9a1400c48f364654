//! What holds for any bytes and any text.

use proptest::prelude::*;

use super::*;
use crate::device::Value;

/// Mostly registers that profiles know, so that the bytes reach the fields.
fn request() -> impl Strategy<Value = Vec<u8>> {
    let register = prop_oneof![
        prop::sample::select(vec![
            0x0700_u16, 0x0800, 0x0900, 0x0E00, 0x1100, 0x1300, 0x1400, 0x1C00, 0x1E00, 0x2500, 0x2600,
            0x2601, 0x2602, 0x2700, 0x2E00, 0x2F00, 0x3000,
        ]),
        any::<u16>(),
    ];
    let function = prop_oneof![Just(3_u8), Just(16), any::<u8>()];
    let address = prop_oneof![Just(1_u8), Just(0xFF), any::<u8>()];
    let tail = prop::collection::vec(any::<u8>(), 0..60);
    (address, function, register, tail).prop_map(|(address, function, register, tail)| {
        let head = [address, function, (register >> 8) as u8, register as u8];
        head.into_iter().chain(tail).collect()
    })
}

fn exchange() -> impl Strategy<Value = Exchange> {
    let response = prop::option::of(prop::collection::vec(any::<u8>(), 0..60));
    let outcome = prop::sample::select(Outcome::ALL.to_vec());
    (request(), response, outcome, any::<bool>(), 0_usize..6).prop_map(
        |(request, response, outcome, request_damaged, cut)| {
            let head = request.get(..2).unwrap_or_default().to_vec();
            let response = response.map(|tail| head.into_iter().chain(tail).collect());
            let kept = if cut == 0 { request.len() / 3 } else { request.len() };
            Exchange { id: 0, request: request[..kept].to_vec(), response, outcome, request_damaged }
        },
    )
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic_and_every_field_lies_within_its_frame(
        exchanges in prop::collection::vec(exchange(), 1..20)
    ) {
        let mut devices = Devices::new(Arc::new(Profiles::built_in()), Environment::default());
        for exchange in &exchanges {
            let t = exchange.transaction();
            let identified = devices.observe(&t);
            prop_assert!(identified.is_none_or(|it| devices.device(it.address) == Some(&*it.device)));
            let meaning = devices.meaning(&t);
            prop_assert!(meaning.device().is_none() || meaning.candidates().next().is_none());
            prop_assert!(meaning.device().is_none() || meaning.likely().is_none());
            for field in meaning.fields().chain(meaning.likely_fields()) {
                let side = if field.side == crate::decode::frame::Role::Request { t.request } else { t.response };
                let length = side.map_or(0, |side| side.bytes.len());
                prop_assert!(field.span.start < field.span.end && field.span.end + 2 <= length);
                prop_assert!(!field.to_string().chars().any(char::is_control), "{field}");
            }
            for reading in meaning.readings() {
                let finite = reading.value.as_f64().is_none_or(f64::is_finite);
                prop_assert!(finite && !reading.to_string().is_empty());
            }
        }
    }

    #[test]
    fn a_float_reads_back_to_the_same_bits(bits in any::<u32>()) {
        let number = f32::from_bits(bits);
        prop_assume!(number.is_finite());
        let text = Value::Float32(number).to_string();
        prop_assert_eq!(text.parse::<f32>().map(f32::to_bits), Ok(bits), "{}", text);
    }

    #[test]
    fn no_text_makes_the_profile_reader_panic(text in "[\\[\\]a-z=\"0-9 \n{}#x.,-]{0,200}") {
        let _ = Profile::from_toml(&text, "any");
    }
}
