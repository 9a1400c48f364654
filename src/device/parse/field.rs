//! Reads the fields of a command.

use crate::device::encoding::{Encoding, TYPE_NAMES};
use crate::device::profile::{Condition, FieldSpec, Note, NoteAt, Show};

use super::check_name;
use crate::section::{Located, Section, nearest};

/// Fields that one side of a command may have: data has 250 bytes at most.
const MOST_FIELDS: usize = 250;

const SHOWS: [(&str, Show); 3] = [("plain", Show::Plain), ("percent", Show::Percent), ("hex", Show::Hex)];

/// Reads the fields under a key; `data_bytes` is how much data there can be, `None` when there is none.
pub(super) fn read_all(
    command: &Section<'_>,
    key: &'static str,
    data_bytes: Option<usize>,
    function: Option<u8>,
) -> Vec<FieldSpec> {
    let sections = command.sections(key);
    let (Some(first), Some(function)) = (sections.first(), function) else {
        return Vec::new();
    };
    let Some(data_bytes) = data_bytes else {
        let message = format!("a {key} of function {function} has no data for fields");
        command.problem(first.at, message);
        return Vec::new();
    };
    if let Some(beyond) = sections.get(MOST_FIELDS) {
        beyond.problem(beyond.at, format_args!("more than {MOST_FIELDS} fields"));
    }
    let mut fields: Vec<FieldSpec> = Vec::new();
    for section in sections.iter().take(MOST_FIELDS) {
        let Some(field) = read(section, data_bytes) else { continue };
        check_neighbours(section, &field, &fields);
        fields.push(field);
    }
    fields.sort_by_key(|field| (field.offset, field.span().end)); // fields come in span order
    fields
}

/// Notes when a field repeats or overlaps one before, unless only one of the two can be there.
fn check_neighbours(section: &Section<'_>, field: &FieldSpec, others: &[FieldSpec]) {
    for other in others.iter().filter(|other| !exclude_each_other(field, other)) {
        if field.name == other.name {
            section.problem(section.place("name"), format_args!("a second field '{}'", field.name));
        }
        let (a, b) = (field.span(), other.span());
        if a.start < b.end && b.start < a.end {
            let message =
                format!("'{}' overlaps '{}' ({} to {})", field.name, other.name, b.start, b.end - 1);
            section.problem(section.place("offset"), message);
        }
    }
}

/// Tells whether the conditions of two fields are opposites.
fn exclude_each_other(a: &FieldSpec, b: &FieldSpec) -> bool {
    match (&a.condition, &b.condition) {
        (Some(a), Some(b)) => a.offset == b.offset && a.text == b.text && a.present != b.present,
        _ => false,
    }
}

fn read(section: &Section<'_>, data_bytes: usize) -> Option<FieldSpec> {
    let name = section.required("name", section.string("name"));
    if let Some(name) = name {
        check_name(section, name, '_');
    }
    let offset = section.required("offset", section.integer("offset", 0..=249));
    let encoding = read_encoding(section);
    if let (Some(offset), Some(encoding)) = (offset, encoding) {
        let end = offset.value as usize + encoding.size();
        if end > data_bytes {
            let message = format!("the field ends after {end} bytes, the largest quantity has {data_bytes}");
            section.problem(offset.at, message);
        }
    }
    let field = FieldSpec {
        name: name.map_or("", |name| name.value).into(),
        offset: offset.map_or(0, |offset| offset.value as usize),
        encoding: encoding.unwrap_or(Encoding::Version),
        unit: section.string("unit").map(|unit| unit.value.into()),
        scale: section.number("scale").map_or(1.0, |scale| check_scale(section, scale)),
        is_quantity: section.boolean("quantity").unwrap_or(false),
        is_contested: section.boolean("contested").unwrap_or(false),
        range: read_range(section),
        default: section.number("default").map(|number| number.value),
        show: section.choice("show", &SHOWS).unwrap_or_default(),
        bits: read_meanings(section, "bits", "mask", 1..=0xFFFF_FFFF)
            .map(|(mask, text)| (mask as u32, text))
            .collect(),
        values: read_meanings(section, "values", "value", i64::from(i32::MIN)..=0xFFFF_FFFF).collect(),
        notes: read_notes(section),
        condition: read_condition(section),
        remark: section.string("remark").map(|remark| remark.value.into()),
    };
    section.finish();
    if let Some(encoding) = encoding {
        check_against_type(section, &field, encoding);
    }
    (name.is_some() && offset.is_some() && encoding.is_some()).then_some(field)
}

fn read_encoding(section: &Section<'_>) -> Option<Encoding> {
    let name = section.required("type", section.string("type"));
    let length = section.integer("length", 1..=250);
    let name = name?;
    let has_length = matches!(name.value, "ascii" | "flags");
    match (name.value, length) {
        ("ascii", None) => {
            section.problem_with_hint(name.at, "'ascii' needs a length", "length = 12, say");
            return None;
        }
        ("flags", Some(length)) if !matches!(length.value, 1 | 2 | 4) => {
            section.problem(length.at, "'flags' has a length of 1, 2 or 4 bytes");
            return None;
        }
        (_, Some(length)) if !has_length => {
            section.problem(length.at, format_args!("the type '{}' has a length of its own", name.value));
        }
        _ => {}
    }
    let encoding = Encoding::from_name(name.value, length.map_or(1, |length| length.value as usize));
    if encoding.is_none() {
        let names = TYPE_NAMES.iter().copied().chain(["ascii", "flags"]);
        let hint = match nearest(name.value, names.clone()) {
            Some(near) => format!("did you mean '{near}'?"),
            None => format!("use one of {}", names.collect::<Vec<_>>().join(", ")),
        };
        section.problem_with_hint(name.at, format_args!("'{}' is no type", name.value), hint);
    }
    encoding
}

fn check_scale(section: &Section<'_>, scale: Located<f64>) -> f64 {
    if scale.value == 0.0 {
        section.problem(scale.at, "a scale of 0 leaves nothing of a value");
    }
    scale.value
}

/// Notes what a field of this type cannot have.
fn check_against_type(section: &Section<'_>, field: &FieldSpec, encoding: Encoding) {
    let is_flags = matches!(encoding, Encoding::Flags { .. });
    let is_whole = matches!(encoding, Encoding::Integer { .. });
    let compares = field.notes.iter().any(|note| note.at != NoteAt::Always);
    let misplaced = [
        ("bits", !field.bits.is_empty() && !is_flags, "a field of type 'flags'"),
        ("values", !field.values.is_empty() && !is_whole, "a whole number"),
        ("scale", field.scale != 1.0 && !encoding.is_number(), "a number"),
        ("range", field.range.is_some() && !encoding.is_number(), "a number"),
        ("quantity", field.is_quantity && !encoding.is_number(), "a number"),
        ("notes", compares && !encoding.is_number(), "a number"),
        ("show", field.show == Show::Percent && !encoding.is_number(), "a number"),
        ("show", field.show == Show::Hex && !is_whole, "a whole number"),
    ];
    for (key, is_misplaced, what) in misplaced {
        if is_misplaced {
            section.problem(section.place(key), format_args!("'{key}' is for {what} only"));
        }
    }
}

fn read_range(section: &Section<'_>) -> Option<(f64, f64)> {
    let range = section.numbers("range")?;
    match range.value[..] {
        [low, high] if low <= high => Some((low, high)),
        _ => {
            section.problem(range.at, "'range' is not the lowest and the highest plausible value");
            None
        }
    }
}

/// Reads a list of `{ mask = 1, text = "…" }` or `{ value = 1, text = "…" }`.
fn read_meanings(
    section: &Section<'_>,
    key: &'static str,
    number_key: &'static str,
    range: std::ops::RangeInclusive<i64>,
) -> impl Iterator<Item = (i64, Box<str>)> {
    let mut meanings: Vec<(i64, Box<str>)> = Vec::new();
    for meaning in section.sections(key) {
        let number = meaning.required(number_key, meaning.integer(number_key, range.clone()));
        let text = meaning.required("text", meaning.string("text"));
        meaning.finish();
        if let (Some(number), Some(text)) = (number, text) {
            if meanings.iter().any(|(other, _)| *other == number.value) {
                meaning.problem(number.at, format_args!("a second text for {number_key} {}", number.value));
            }
            meanings.push((number.value, text.value.into()));
        }
    }
    meanings.into_iter()
}

/// Reads the list of notes, and `note`, which is for all values.
fn read_notes(section: &Section<'_>) -> Vec<Note> {
    let always = section.string("note").map(|text| Note { at: NoteAt::Always, text: text.value.into() });
    let mut notes: Vec<Note> = always.into_iter().collect();
    for note in section.sections("notes") {
        let equals = note.number("equals").map(|number| NoteAt::Equals(number.value));
        let above = note.number("above").map(|number| NoteAt::Above(number.value));
        let below = note.number("below").map(|number| NoteAt::Below(number.value));
        let text = note.required("text", note.string("text"));
        note.finish();
        match (equals, above, below) {
            (Some(at), None, None) | (None, Some(at), None) | (None, None, Some(at)) => {
                notes.extend(text.map(|text| Note { at, text: text.value.into() }));
            }
            _ => {
                let hint = "for all values, use 'note'";
                note.problem_with_hint(note.at, "a note has one of 'equals', 'above', 'below'", hint);
            }
        }
    }
    notes
}

fn read_condition(section: &Section<'_>) -> Option<Condition> {
    let (when, unless) = (section.section("when"), section.section("unless"));
    if let (Some(_), Some(unless)) = (&when, &unless) {
        unless.problem(unless.at, "a field has 'when' or 'unless', not both");
    }
    let present = when.is_some();
    let condition = when.or(unless)?;
    let offset = condition.required("offset", condition.integer("offset", 0..=249));
    let text = condition.required("text", condition.string("text"));
    condition.finish();
    Some(Condition { offset: offset?.value as usize, text: text?.value.into(), present })
}
