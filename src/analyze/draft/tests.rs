use proptest::collection::vec;
use proptest::prelude::*;

use super::*;
use crate::decode::frame::Role;
use crate::decode::function::FunctionCode;
use crate::decode::transaction::Side;
use crate::device::{Command, Encoding, Order, Profile};

/// Is an exchange with its own bytes; CRCs are zero, as nothing here looks at them.
#[derive(Clone, Debug)]
struct Exchange {
    request: Vec<u8>,
    response: Option<Vec<u8>>,
}

impl Exchange {
    fn read(address: u8, register: u16, data: &[u8]) -> Self {
        let [high, low] = register.to_be_bytes();
        let quantity = (data.len() / 2) as u8;
        let response = [&[address, 3, data.len() as u8], data, &[0, 0]].concat();
        Exchange { request: vec![address, 3, high, low, 0, quantity, 0, 0], response: Some(response) }
    }

    fn write(address: u8, register: u16, data: &[u8]) -> Self {
        let [high, low] = register.to_be_bytes();
        let head = [address, 16, high, low, 0, (data.len() / 2) as u8];
        let response = [&head[..], &[0, 0]].concat();
        Exchange {
            request: [&head[..], &[data.len() as u8], data, &[0, 0]].concat(),
            response: Some(response),
        }
    }

    fn refused(address: u8, register: u16) -> Self {
        let read = Exchange::read(address, register, &[0, 0]);
        Exchange { response: Some(vec![address, 0x83, 2, 0, 0]), ..read }
    }

    fn unanswered(self) -> Self {
        Exchange { response: None, ..self }
    }

    fn observed_by(&self, drafter: &mut Drafter, device: Option<&str>) {
        let number =
            |at: usize| Some(u16::from_be_bytes([*self.request.get(at)?, *self.request.get(at + 1)?]));
        let side = |id, bytes| Side { id, bytes, damaged: false, time: None };
        let is_refusal =
            self.response.as_ref().is_some_and(|bytes| bytes.get(1).is_some_and(|&it| it > 0x80));
        let t = Transaction {
            id: 0,
            address: self.request.first().copied().unwrap_or(0),
            function: FunctionCode(self.request.get(1).copied().unwrap_or(0)),
            start_register: number(2),
            quantity: number(4),
            outcome: match self.response {
                Some(_) if is_refusal => Outcome::Exception,
                Some(_) => Outcome::Answered,
                None => Outcome::NoResponse,
            },
            exception_code: None,
            request: Some(side(0, &self.request)),
            response: self.response.as_deref().map(|bytes| side(1, bytes)),
            latency: None,
        };
        drafter.observe("bus0", &t, device, std::iter::empty());
    }
}

fn drafter(exchanges: &[Exchange]) -> Drafter {
    let mut drafter = Drafter::default();
    exchanges.iter().for_each(|exchange| exchange.observed_by(&mut drafter, None));
    drafter
}

fn profile(exchanges: &[Exchange]) -> Profile {
    let draft = drafter(exchanges).draft(None).expect("a draft");
    Profile::from_toml(&draft.toml, "draft").unwrap_or_else(|error| panic!("{error}\n{}", draft.toml))
}

/// Returns offset, type and whether it is a quantity, of all fields of a command.
fn fields(command: &Command, side: Role) -> Vec<(usize, String, bool)> {
    let field =
        |field: &crate::device::FieldSpec| (field.offset, field.encoding.to_string(), field.is_quantity);
    command.fields(side).iter().map(field).collect()
}

/// Returns what the fields of a polled register are taken for.
fn guessed(polls: impl Iterator<Item = Vec<u8>>) -> Vec<(usize, String, bool)> {
    let exchanges: Vec<_> = polls.map(|data| Exchange::read(5, 0x10, &data)).collect();
    fields(profile(&exchanges).command(3, 0x10).expect("a command"), Role::Response)
}

fn in_order(value: f32, order: Order) -> [u8; 4] {
    let [a, b, c, d] = value.to_be_bytes();
    match order {
        Order::Big => [a, b, c, d],
        Order::Little => [d, c, b, a],
        Order::BigSwapped => [c, d, a, b],
        Order::LittleSwapped => [b, a, d, c],
    }
}

fn field(offset: usize, encoding: &str, is_quantity: bool) -> (usize, String, bool) {
    (offset, encoding.to_owned(), is_quantity)
}

#[test]
fn floats_are_found_in_any_order_of_their_bytes() {
    for order in Order::ALL {
        let encoding = Encoding::Float32(order).to_string();
        let polls = (0..40_u8).map(|at| {
            let slow = (f32::from(at) / 7.0).sin();
            [in_order(230.0 + slow, order), in_order(-0.37 * slow, order), in_order(0.0, order)].concat()
        });
        let expected = [field(0, &encoding, true), field(4, &encoding, true), field(8, &encoding, false)];
        assert_eq!(guessed(polls), expected, "{order:?}");
    }
}

#[test]
fn whole_numbers_have_their_order_and_sign() {
    let words = |order: fn(u16) -> [u8; 2]| {
        move |at: u16| [order(215 + at % 9), order(at.wrapping_sub(20)), order(1013)].concat()
    };
    let expected = |it: &str| [field(0, &format!("u16-{it}"), true), field(2, &format!("i16-{it}"), true)];
    assert_eq!(guessed((0..40).map(words(u16::to_be_bytes)))[..2], expected("be"));
    assert_eq!(guessed((0..40).map(words(u16::to_le_bytes)))[..2], expected("le"));
}

#[test]
fn a_counter_over_two_registers_is_one_number() {
    let counter = |at: u32| (65_000 + 97 * at).to_be_bytes().to_vec();
    assert_eq!(guessed((0..40).map(counter)), [field(0, "u32-be", true)]);
}

#[test]
fn text_stands_beside_bytes_that_are_none() {
    let exchanges = [Exchange::read(3, 0x0900, b"\x29YL2917050209\0")];
    let profile = profile(&exchanges);
    let command = profile.command(3, 0x0900).expect("a command");
    let [field] = &command.response[..] else { panic!("{command:?}") };
    assert_eq!((&*field.name, field.offset), ("serial_number", 1));
    assert_eq!(field.encoding, Encoding::Ascii { length: 12 });
}

#[test]
fn bytes_that_tell_nothing_stay_raw() {
    assert_eq!(guessed((0..20_u8).map(|_| vec![0, 0])), []);
    let draft = drafter(&[Exchange::read(5, 0x10, &[0, 0])]).draft(None).expect("a draft");
    assert!(draft.toml.contains("# data 0-1, raw: always 00 00 (1 sample)"), "{}", draft.toml);
}

#[test]
fn what_is_written_to_a_register_has_the_type_of_what_is_read_there() {
    let polls =
        (0..20_u8).map(|at| Exchange::read(5, 0x1100, &in_order(1.0 + f32::from(at) / 8.0, Order::Little)));
    let write = Exchange::write(5, 0x1100, &in_order(0.987_654_3, Order::Little));
    let profile = profile(&polls.chain([write]).collect::<Vec<_>>());
    let write = profile.command(16, 0x1100).expect("the write");
    assert_eq!(fields(write, Role::Request), [field(0, "f32-le", false)]);
}

#[test]
fn forms_outside_the_specification_become_quirks() {
    let start = Exchange::read(5, 0x2500, &[]);
    let mut stop = Exchange::read(5, 0x2E00, &[0, 0]);
    stop.response = Some(vec![5, 3, 0, 0, 0, 0, 0]); // count 0, two bytes
    let mut coefficients = Exchange::read(5, 0x2900, &[1; 24]);
    coefficients.response.as_mut().expect("a response")[2] = 12;
    let profile = profile(&[start, stop, coefficients]);
    let quirks = |register| profile.command(3, register).expect("a command").quirks().collect::<Vec<_>>();
    assert_eq!(quirks(0x2500), ["zero-quantity"]);
    assert_eq!(quirks(0x2E00), ["uncounted-data"]);
    assert_eq!(quirks(0x2900), ["counts-registers"]);
}

#[test]
fn what_was_not_accepted_is_told_but_not_drafted() {
    let exchanges = [
        Exchange::read(5, 0x10, &[0, 1]),
        Exchange::read(5, 0x20, &[0, 1]).unanswered(),
        Exchange::refused(5, 0x30),
    ];
    let draft = drafter(&exchanges).draft(None).expect("a draft");
    let profile = Profile::from_toml(&draft.toml, "draft").expect("a profile");
    assert_eq!((&*profile.id, profile.commands.len()), ("unknown-5", 1));
    assert!(draft.toml.contains("# function 3 at 0x0020, asked once, never answered"), "{}", draft.toml);
    assert!(draft.toml.contains("# function 3 at 0x0030, asked once, refused once"), "{}", draft.toml);
}

#[test]
fn it_says_why_there_is_nothing_to_draft() {
    let of = |exchanges: &[(Exchange, Option<&str>)], address| {
        let mut drafter = Drafter::default();
        exchanges.iter().for_each(|(exchange, device)| exchange.observed_by(&mut drafter, *device));
        drafter.draft(address).map(|draft| draft.address).map_err(|error| error.to_string())
    };
    let read = |address| Exchange::read(address, 0x10, &[0, 1]);
    let known = Some("yosemitech-do");
    assert_eq!(of(&[(read(3).unanswered(), None)], None), Err("no device accepted a request".into()));
    assert_eq!(of(&[(read(0xFF), None), (read(0), None)], None), Err("no device accepted a request".into()));
    let all = Err("every device that answered is known: 3 (yosemitech-do)".into());
    assert_eq!(of(&[(read(3), known)], None), all);
    assert_eq!(of(&[(read(3), known)], Some(3)), Ok(3), "asked for, it is drafted all the same");
    assert_eq!(of(&[(read(3), known), (read(7), None)], None), Ok(7));
    let several = Err("more than one device is unknown: 3, 7".into());
    assert_eq!(of(&[(read(3), None), (read(7), None)], None), several);
    let elsewhere = Err("no device answered at address 9; those at 3 did".into());
    assert_eq!(of(&[(read(3), None)], Some(9)), elsewhere);
    let mut moved = drafter(&[read(20)]);
    moved.leave("bus0", 20);
    let left = moved.draft(None).map_err(|error| error.to_string());
    assert_eq!(left, Err("every device that answered is known: 20 (left for another address)".into()));
    read(20).observed_by(&mut moved, None);
    assert_eq!(moved.draft(None).map(|draft| draft.address), Ok(20), "another one answers there");
    let coils = Exchange { request: vec![3, 1, 0, 0, 0, 1, 0, 0], response: Some(vec![3, 1, 1, 1, 0, 0]) };
    let no_registers = of(&[(coils, None)], None).expect_err("no registers");
    assert!(no_registers.starts_with("the device at address 3 accepted no read"), "{no_registers}");
}

#[test]
fn a_long_recording_keeps_few_samples_from_all_over_it() {
    let mut samples = traffic::Samples::default();
    (0..100_000_u32).for_each(|at| samples.push(&at.to_be_bytes()));
    let kept: Vec<u32> =
        samples.iter().map(|data| u32::from_be_bytes(data.try_into().expect("four"))).collect();
    assert!((64..=128).contains(&kept.len()), "{}", kept.len());
    assert!(kept[0] == 0 && kept[kept.len() - 1] > 99_000 && kept.is_sorted(), "{kept:?}");
}

prop_compose! {
    fn any_exchange()(
        function in prop_oneof![3 => Just(3_u8), 2 => Just(16), 1 => Just(4), 1 => Just(6), 1 => any::<u8>()],
        start in prop_oneof![Just(0_u16), Just(0x2600), Just(0xFFFF), any::<u16>()],
        quantity in prop_oneof![0_u16..6, any::<u16>()],
        rest in vec(any::<u8>(), 0..40),
        response in vec(any::<u8>(), 0..260),
        counts in any::<bool>(),
    ) -> Exchange {
        let [high, low] = start.to_be_bytes();
        let [many, few] = quantity.to_be_bytes();
        let request = [&[9, function, high, low, many, few], &rest[..]].concat();
        let count = if counts { response.len().saturating_sub(2) as u8 } else { 0 };
        Exchange { request, response: Some([&[9, function, count], &response[..]].concat()) }
    }
}

proptest! {
    #[test]
    fn whatever_was_on_the_bus_the_draft_is_a_profile(exchanges in vec(any_exchange(), 1..12)) {
        if let Ok(draft) = drafter(&exchanges).draft(None) {
            let profile = Profile::from_toml(&draft.toml, "draft");
            prop_assert!(profile.is_ok(), "{}\n{}", profile.expect_err("no profile"), draft.toml);
        }
    }
}
