//! The names a filter knows, and the words that go with them.

use crate::decode::frame::{Reason, Role};
use crate::decode::transaction::Outcome;

/// Names a number of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberKey {
    Address,
    Function,
    Register,
    Quantity,
    Exception,
}

/// Names a text of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TextKey {
    Outcome,
    Role,
    Reason,
    Device,
    Serial,
    Command,
    Bus,
    Finding,
}

/// Is what a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    Number(NumberKey),
    Text(TextKey),
    Latency,
    Time,
    Crc,
    Bytes,
    Echo,
    Damaged,
}

/// All names; the first of several for a key is the one that is printed.
pub(super) const NAMES: &[(&str, Key)] = &[
    ("addr", Key::Number(NumberKey::Address)),
    ("address", Key::Number(NumberKey::Address)),
    ("fn", Key::Number(NumberKey::Function)),
    ("function", Key::Number(NumberKey::Function)),
    ("reg", Key::Number(NumberKey::Register)),
    ("start_register", Key::Number(NumberKey::Register)),
    ("quantity", Key::Number(NumberKey::Quantity)),
    ("exception", Key::Number(NumberKey::Exception)),
    ("exception_code", Key::Number(NumberKey::Exception)),
    ("outcome", Key::Text(TextKey::Outcome)),
    ("role", Key::Text(TextKey::Role)),
    ("reason", Key::Text(TextKey::Reason)),
    ("device", Key::Text(TextKey::Device)),
    ("serial", Key::Text(TextKey::Serial)),
    ("cmd", Key::Text(TextKey::Command)),
    ("command", Key::Text(TextKey::Command)),
    ("bus", Key::Text(TextKey::Bus)),
    ("finding", Key::Text(TextKey::Finding)),
    ("latency", Key::Latency),
    ("time", Key::Time),
    ("crc", Key::Crc),
    ("bytes", Key::Bytes),
    ("echo", Key::Echo),
    ("damaged", Key::Damaged),
];

/// Words that cannot be names; a field of such a name is written with `field.` before it.
pub(super) const RESERVED: &[&str] = &["and", "or", "not", "in", "contains", "field"];

/// What stands before a field's name where the bare name is taken.
pub(super) const FIELD_PREFIX: &str = "field.";

impl Key {
    /// Finds what a name stands for; `None` for the name of a decoded field.
    pub(super) fn named(name: &str) -> Option<Key> {
        NAMES.iter().find(|(known, _)| *known == name).map(|(_, key)| *key)
    }

    /// Returns the name that is printed.
    pub(super) fn name(self) -> &'static str {
        NAMES.iter().find(|(_, key)| *key == self).map_or("", |(name, _)| name)
    }
}

impl TextKey {
    /// Returns the only texts there are, for a key with a fixed set.
    pub(super) fn choices(self) -> Option<Vec<&'static str>> {
        Some(match self {
            TextKey::Outcome => Outcome::ALL.map(Outcome::name).to_vec(),
            TextKey::Role => [Role::Request, Role::Response, Role::Unknown].map(Role::name).to_vec(),
            TextKey::Reason => {
                [Reason::Crc, Reason::Truncated, Reason::Stray, Reason::Noise].map(Reason::name).to_vec()
            }
            _ => return None,
        })
    }
}

/// Returns the candidate that a mistyped word most likely meant, at most a third of its letters off.
pub(super) fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let allowed = (word.chars().take(60).count() / 3).max(1);
    candidates
        .into_iter()
        .map(|candidate| (strsim::osa_distance(word, candidate), candidate))
        .filter(|(distance, candidate)| *distance <= allowed && *distance < candidate.len())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}
