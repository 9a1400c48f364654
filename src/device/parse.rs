//! From the text of a profile to its data, with every problem found on the way.

mod field;

use std::collections::HashSet;

use crate::decode::frame::Role;
use crate::decode::shape::Form;

use super::data::data_start;
use super::derive::Formula;
use super::profile::{Command, Confidence, Derived, Kind, Measuring, Profile, SerialNumberRule, Source};
use crate::section::{self, Located, Problem, Section, nearest};
use crate::time::SECOND;

/// Commands that a profile may have: more is a mistake, not a device.
const MOST_COMMANDS: usize = 1000;

const SOURCES: [(&str, Source); 4] = [
    ("manual", Source::Manual),
    ("capture", Source::Capture),
    ("code", Source::Code),
    ("inference", Source::Inference),
];

const CONFIDENCES: [(&str, Confidence); 3] =
    [("high", Confidence::High), ("medium", Confidence::Medium), ("low", Confidence::Low)];

/// Names of what commands are for.
pub(super) const KINDS: [(&str, Kind); 9] = [
    ("start", Kind::Start),
    ("stop", Kind::Stop),
    ("measurement", Kind::Measurement),
    ("brush", Kind::Brush),
    ("calibration", Kind::Calibration),
    ("setting", Kind::Setting),
    ("address", Kind::Address),
    ("clock", Kind::Clock),
    ("other", Kind::Other),
];

/// What commands are for that have a name which all profiles share, unless they say otherwise.
const USUAL_KINDS: [(&str, Kind); 7] = [
    ("start-measurement", Kind::Start),
    ("stop-measurement", Kind::Stop),
    ("get-measurement", Kind::Measurement),
    ("start-brush", Kind::Brush),
    ("set-brush-interval", Kind::Setting),
    ("set-address", Kind::Address),
    ("set-time", Kind::Clock),
];

/// Names of frame forms outside the specification.
pub(crate) const FORMS: [(&str, Form); 3] = [
    ("zero-quantity", Form::ZeroQuantity),
    ("uncounted-data", Form::UncountedData),
    ("counts-registers", Form::CountsRegisters),
];

/// Reads a profile.
///
/// # Errors
///
/// All problems in the order of the text; those of the TOML syntax hide all others.
pub(super) fn profile(text: &str) -> Result<Profile, Vec<Problem>> {
    section::read(text, read_profile)
}

fn read_profile(section: &Section<'_>) -> Option<Profile> {
    let id = section.required("id", section.string("id"));
    let name = section.required("name", section.string("name"));
    if let Some(id) = id {
        check_name(section, id, '-');
    }
    let source = section.choice("source", &SOURCES).unwrap_or_default();
    let profile = Profile {
        id: id.map_or("", |id| id.value).into(),
        name: name.map_or("", |name| name.value).into(),
        models: texts(section, "models"),
        vendor: section.string("vendor").map(|vendor| vendor.value.into()),
        manual: section.string("manual").map(|manual| manual.value.into()),
        source,
        confidence: section.choice("confidence", &CONFIDENCES),
        service_address: section.integer("service-address", 248..=255).map(|address| address.value as u8),
        serial_number: section.section("serial-number").and_then(|rule| read_serial_number_rule(&rule)),
        measuring: section.section("measuring").map(|rules| read_measuring(&rules)).unwrap_or_default(),
        remarks: texts(section, "remarks"),
        commands: read_commands(section, source),
        derived: Vec::new(),
    };
    let derived = read_all_derived(section, &profile.commands);
    section.finish();
    (id.is_some() && name.is_some()).then_some(Profile { derived, ..profile })
}

/// Reads a list of texts; none when the key is missing.
fn texts(section: &Section<'_>, key: &'static str) -> Vec<Box<str>> {
    section.strings(key).unwrap_or_default().iter().map(|text| text.value.into()).collect()
}

/// Notes a name that is not lower-case words joined by `joint`.
fn check_name(section: &Section<'_>, name: Located<&str>, joint: char) {
    let is_word =
        |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit());
    if name.value.len() > 64 || !name.value.split(joint).all(is_word) {
        let message =
            format!("'{}' is not made of up to 64 lower-case letters, digits and '{joint}'", name.value);
        section.problem(name.at, message);
    }
}

fn read_serial_number_rule(section: &Section<'_>) -> Option<SerialNumberRule> {
    let prefix = section.required("prefix", section.string("prefix"));
    let codes = section.required("type-codes", section.strings("type-codes"));
    section.finish();
    let type_codes = codes?.iter().map(|code| code.value.into()).collect();
    Some(SerialNumberRule { prefix: prefix?.value.into(), type_codes })
}

/// Reads what the device asks of a master that measures, in seconds.
fn read_measuring(section: &Section<'_>) -> Measuring {
    let seconds = |key| {
        let number = section.number(key)?;
        if !(0.0..=86_400.0).contains(&number.value) {
            section.problem(number.at, format_args!("'{key}' is not within 0 to 86400 s"));
        }
        Some((number.value * SECOND as f64) as i64)
    };
    let measuring = Measuring {
        needs_start: section.boolean("needs-start").unwrap_or(false),
        starts_itself_software: section.integer("starts-itself-software", 0..=255).map(|it| it.value as u8),
        starts_itself_quantity: section.integer("starts-itself-quantity", 0..=125).map(|it| it.value as u16),
        warm_up_ns: seconds("warm-up"),
        cycle_ns: seconds("cycle"),
        brush_sweep_ns: seconds("brush-sweep"),
    };
    section.finish();
    measuring
}

/// Returns what a command of a usual name is for.
fn usual_kind(name: &str) -> Kind {
    let usual = USUAL_KINDS.iter().find(|(usual, _)| *usual == name).map(|(_, kind)| *kind);
    let corrects =
        name.starts_with("set-") && (name.contains("calibration") || name.contains("coefficients"));
    usual.unwrap_or(if corrects { Kind::Calibration } else { Kind::Other })
}

fn read_commands(section: &Section<'_>, source: Source) -> Vec<Command> {
    let sections = section.sections("command");
    if sections.is_empty() {
        let hint = "a profile has at least one [[command]]";
        section.problem_with_hint(section.place("command"), "there is no command", hint);
    }
    if let Some(beyond) = sections.get(MOST_COMMANDS) {
        beyond.problem(beyond.at, format_args!("more than {MOST_COMMANDS} commands"));
    }
    let (mut names, mut keys) = (HashSet::new(), HashSet::new());
    let mut commands = Vec::new();
    for section in sections.iter().take(MOST_COMMANDS) {
        let Some(command) = read_command(section, source) else { continue };
        if !names.insert(command.name.clone()) {
            section.problem(section.place("name"), format_args!("a second command '{}'", command.name));
        }
        if !keys.insert(command.key()) {
            let (function, register) = command.key();
            let message = format!("a second command with function {function} at register {register:#06x}");
            let hint = "list all quantities in one command; a field may have a condition ('when', 'unless')";
            section.problem_with_hint(section.place("register"), message, hint);
        }
        commands.push(command);
    }
    commands
}

fn read_command(section: &Section<'_>, source: Source) -> Option<Command> {
    let name = section.required("name", section.string("name"));
    if let Some(name) = name {
        check_name(section, name, '-');
    }
    let function = section.required("function", section.integer("function", 1..=127)).and_then(|function| {
        let known = matches!(function.value, 3 | 4 | 6 | 16);
        if !known {
            let hint = "a command reads with 3 or 4, or writes with 6 or 16";
            section.problem_with_hint(function.at, format_args!("function {}", function.value), hint);
        }
        known.then_some(function.value as u8)
    });
    let register = section.required("register", section.integer("register", 0..=0xFFFF));
    let most = if function == Some(16) { 123 } else { 125 };
    let quantities = section.required("quantities", section.integers("quantities", 0..=most));
    let forms = read_forms(section);
    let quantities = check_quantities(section, &quantities.unwrap_or_default(), &forms);
    let data_bytes = 2 * usize::from(quantities.last().copied().unwrap_or(0));
    let fields = |key, side| {
        let starts = function.and_then(|function| data_start(function, side));
        field::read_all(section, key, starts.map(|_| data_bytes), function)
    };
    let is_fingerprint = section.boolean("fingerprint").unwrap_or(false);
    let is_contested = section.boolean("contested").unwrap_or(false);
    if is_fingerprint && is_contested {
        let message = "a fingerprint, which only one kind has, is not contested";
        section.problem(section.place("contested"), message);
    }
    let command = Command {
        name: name.map_or("", |name| name.value).into(),
        function: function.unwrap_or(0),
        start_register: register.map_or(0, |register| register.value as u16),
        quantities,
        kind: section
            .choice("kind", &KINDS)
            .unwrap_or_else(|| usual_kind(name.map_or("", |name| name.value))),
        forms,
        is_fingerprint,
        is_contested,
        source: section.choice("source", &SOURCES).unwrap_or(source),
        remark: section.string("remark").map(|remark| remark.value.into()),
        request: fields("request", Role::Request),
        response: fields("response", Role::Response),
    };
    section.finish();
    (name.is_some() && function.is_some() && register.is_some()).then_some(command)
}

fn read_forms(section: &Section<'_>) -> Vec<Form> {
    let mut forms = Vec::new();
    for word in section.strings("quirks").unwrap_or_default() {
        match FORMS.iter().find(|(name, _)| *name == word.value) {
            Some((_, form)) if forms.contains(form) => {
                section.problem(word.at, format_args!("a second '{}'", word.value));
            }
            Some(&(_, form)) => forms.push(form),
            None => {
                let names: Vec<_> = FORMS.iter().map(|(name, _)| *name).collect();
                let hint = format!("use one of {}", names.join(", "));
                section.problem_with_hint(word.at, format_args!("'{}' is no quirk", word.value), hint);
            }
        }
    }
    forms
}

/// Returns the quantities in ascending order and notes what is wrong with them.
fn check_quantities(section: &Section<'_>, given: &[Located<i64>], forms: &[Form]) -> Vec<u16> {
    let place = section.place("quantities");
    let mut quantities: Vec<u16> = given.iter().map(|quantity| quantity.value as u16).collect();
    quantities.sort_unstable();
    quantities.dedup();
    if quantities.len() < given.len() {
        section.problem(place, "a quantity is given twice");
    }
    let (zero, declared) = (quantities.first() == Some(&0), forms.contains(&Form::ZeroQuantity));
    if zero && !declared {
        let hint = "declare it: quirks = [\"zero-quantity\"]";
        section.problem_with_hint(place, "the specification knows no quantity 0", hint);
    }
    if declared && !zero && !given.is_empty() {
        let message = "the quirk 'zero-quantity' is declared, but 0 is not among the quantities";
        section.problem(section.place("quirks"), message);
    }
    quantities
}

fn read_all_derived(section: &Section<'_>, commands: &[Command]) -> Vec<Derived> {
    let mut names = HashSet::new();
    let mut all = Vec::new();
    for section in section.sections("derived") {
        let Some(derived) = read_derived(&section, commands) else { continue };
        if !names.insert(derived.name.clone()) {
            section.problem(section.place("name"), format_args!("a second derived '{}'", derived.name));
        }
        all.push(derived);
    }
    all
}

fn read_derived(section: &Section<'_>, commands: &[Command]) -> Option<Derived> {
    let name = section.required("name", section.string("name"));
    if let Some(name) = name {
        check_name(section, name, '_');
    }
    let formulas = Formula::ALL.map(|formula| (formula.name(), formula));
    let formula = section.required("formula", section.choice("formula", &formulas));
    let inputs = section.required("inputs", section.strings("inputs")).unwrap_or_default();
    if let Some(formula) = formula.filter(|formula| formula.inputs().len() != inputs.len()) {
        let message = format!("'{}' takes {}", formula.name(), formula.inputs().join(" and "));
        section.problem(section.place("inputs"), message);
    }
    let numbers: Vec<&str> = commands
        .iter()
        .flat_map(|command| &command.response)
        .filter(|field| field.encoding.is_number())
        .map(|field| &*field.name)
        .collect();
    for input in inputs.iter().filter(|input| !numbers.contains(&input.value)) {
        let hint = match nearest(input.value, numbers.iter().copied()) {
            Some(near) => format!("did you mean '{near}'?"),
            None => "name a number of a response".to_owned(),
        };
        section.problem_with_hint(input.at, format_args!("no response has a number '{}'", input.value), hint);
    }
    let unit = section.string("unit").map(|unit| unit.value.into());
    section.finish();
    let inputs = inputs.iter().map(|input| input.value.into()).collect();
    Some(Derived { name: name?.value.into(), unit, formula: formula?, inputs })
}

#[cfg(test)]
mod tests;
