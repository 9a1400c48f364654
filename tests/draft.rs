//! A profile drafted of a device whose own profile is left out, held against that profile.

mod support;

use rtutap::analyze::draft::Drafter;
use rtutap::decode::frame::Role;
use rtutap::device::{Devices, Environment, Profile, Profiles};
use rtutap::pipeline::{Event, Options, Pipeline};
use rtutap::simulate::{Adapter, Scenario};
use std::sync::Arc;
use support::{Read, feed};

/// Decodes an hour and a half of the three sensors of the manuals without any profile.
fn seen_without_profiles() -> Drafter {
    let scenario = *Scenario::all().iter().find(|it| it.name == "installation").expect("a scenario");
    let line = "9600-8N1".parse().expect("a line setting");
    let reads: Vec<Read> = support::traffic::simulated(scenario, Adapter::Ftdi16, line, 5, 6000);
    let options = Options::new(line, None);
    let profiles = Arc::new(Profiles::default());
    let shapes = profiles.shapes();
    let mut pipeline = Pipeline::new(options, Devices::new(profiles, Environment::default()), shapes);
    let mut drafter = Drafter::default();
    for read in &reads {
        feed(&mut pipeline, read);
        take(&mut pipeline, &mut drafter);
    }
    pipeline.finish();
    take(&mut pipeline, &mut drafter);
    drafter
}

fn take(pipeline: &mut Pipeline, drafter: &mut Drafter) {
    while let Some(event) = pipeline.poll_event() {
        if let Event::Transaction { transaction, meaning, .. } = event {
            drafter.observe("bus0", &transaction, meaning.device(), meaning.candidates());
        }
    }
}

/// Lists what a draft has otherwise than the profile, and which of the profile's fields it does not have.
fn hold(draft: &Profile, profile: &Profile) -> (Vec<String>, Vec<String>) {
    let (mut wrong, mut missing) = (Vec::new(), Vec::new());
    for command in &draft.commands {
        let Some(known) = profile.command(command.function, command.start_register) else {
            wrong.push(format!("{} is no command", command.name));
            continue;
        };
        if !command.quantities.iter().all(|quantity| known.quantities.contains(quantity)) {
            wrong.push(format!("{} reads {:?}", command.name, command.quantities));
        }
        if !command.quirks().all(|quirk| known.quirks().any(|known| known == quirk)) {
            wrong.push(format!("{} has other quirks", command.name));
        }
        for side in [Role::Request, Role::Response] {
            let is_in = |name: &str, place: (usize, _), fields: &[rtutap::device::FieldSpec]| {
                let found = fields.iter().any(|field| (field.offset, field.encoding) == place);
                (!found).then(|| format!("{}: {name}", known.name))
            };
            let place = |field: &rtutap::device::FieldSpec| (field.offset, field.encoding);
            let guesses = command.fields(side);
            wrong.extend(guesses.iter().filter_map(|it| is_in(&it.name, place(it), known.fields(side))));
            let facts = known.fields(side).iter().filter(|field| field.condition.is_none());
            missing.extend(facts.filter_map(|it| is_in(&it.name, place(it), guesses)));
        }
    }
    (wrong, missing)
}

#[test]
fn the_drafts_of_three_known_sensors_agree_with_their_profiles() {
    let drafter = seen_without_profiles();
    let built_in = Profiles::built_in();
    for (address, id, raw) in [
        // A type code and a flag are a byte whose meaning no traffic shows.
        (1, "yosemitech-do", &["get-serial-number: type_byte", "get-measurement: do_mg_l"][..]),
        (2, "yosemitech-conductivity", &["get-serial-number: type_byte", "get-measurement: error_flag"]),
        (3, "yosemitech-sonde", &["get-serial-number: serial_number", "get-error-flag: error_flag"]),
    ] {
        let draft = drafter.draft(Some(address)).expect("a draft");
        let text = &draft.toml;
        let drafted = Profile::from_toml(text, "draft").unwrap_or_else(|error| panic!("{error}\n{text}"));
        let (wrong, missing) = hold(&drafted, built_in.get(id).expect("a built-in profile"));
        assert_eq!(wrong, [""; 0], "{text}");
        let missing: Vec<_> = missing.iter().filter(|it| !raw.contains(&it.as_str())).collect();
        assert_eq!(missing, [""; 0], "{text}");
        // Without its profile, the answer to a stop of the conductivity probe is none: two bytes too long.
        assert!(drafted.commands.len() >= 5, "{text}");
    }
}

#[test]
fn what_changes_is_a_quantity_and_gives_readings() {
    let draft = seen_without_profiles().draft(Some(2)).expect("a draft");
    let profile = Profile::from_toml(&draft.toml, "draft").expect("a profile");
    let measurement = profile.command(3, 0x2600).expect("the measurement");
    assert!(measurement.response.iter().all(|field| field.is_quantity), "{}", draft.toml);
    let calibration = profile.command(3, 0x1100).expect("the calibration");
    assert!(!calibration.response.iter().any(|field| field.is_quantity), "{}", draft.toml);
}
