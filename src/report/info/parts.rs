//! What recordings say of themselves; the parts of one session in a few lines.

use std::collections::BTreeMap;
use std::fmt::{self, Write};

use serde::Serialize;

use super::plural;

/// More parts of one session than these are folded into one line, but for those with something to say.
const MOST_PARTS: usize = 3;
/// Parts of a session that have a line of their own for what is missing in them.
const MOST_IN_TROUBLE: usize = 5;

/// Is what a recording says of itself.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Recording {
    /// Its session; the same in all parts.
    pub session_id: Option<String>,
    /// Counts the parts of a session from 1.
    pub part_index: u64,
    /// What wrote it.
    pub tool: String,
    /// What is known of each bus and its adapter.
    pub buses: BTreeMap<String, BTreeMap<String, String>>,
    /// Why it was closed; `None` when it was not.
    pub end: Option<String>,
    /// Whether somebody is writing it now.
    pub is_being_written: bool,
    /// Whether nothing is missing, as far as the file tells.
    pub is_complete: bool,
    /// In how many places the file cannot be read.
    pub damage: u64,
    /// Bytes of the file that cannot be read.
    pub damage_bytes: u64,
    /// Bytes of buses that are lost for it, as far as known.
    pub lost_bytes: u64,
}

impl fmt::Display for Recording {
    /// Says in a line what a recording says of itself.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.session_id {
            Some(id) => write!(f, "{id}, part {}, by {}, ", self.part_index, self.tool)?,
            None => write!(f, "of no session, ")?,
        }
        match &self.end {
            Some(reason) => write!(f, "closed ({reason})")?,
            None if self.is_being_written => write!(f, "being written")?,
            None => write!(f, "not closed")?,
        }
        if self.damage > 0 {
            let (places, bytes) = (plural(self.damage), plural(self.damage_bytes));
            write!(
                f,
                "; cannot be read in {} place{places}, {} byte{bytes}",
                self.damage, self.damage_bytes
            )?;
        }
        if self.lost_bytes > 0 {
            write!(f, "; {} byte{} of the bus lost for it", self.lost_bytes, plural(self.lost_bytes))?;
        }
        Ok(())
    }
}

impl Recording {
    /// Tells whether something about it is worth a line, beside its being a part of many.
    fn is_in_trouble(&self) -> bool {
        (self.end.is_none() && !self.is_being_written) || self.damage > 0 || self.lost_bytes > 0
    }
}

/// Writes a line a recording, or a few for the many parts of one session.
pub(super) fn write(recordings: &[Recording], out: &mut String) -> fmt::Result {
    let sessions = recordings.chunk_by(|a, b| a.session_id.is_some() && a.session_id == b.session_id);
    for parts in sessions {
        match parts {
            [first, .., last] if parts.len() > MOST_PARTS => fold(parts, first, last, out)?,
            parts => parts.iter().try_for_each(|part| writeln!(out, "recording     {part}"))?,
        }
    }
    Ok(())
}

/// Writes what many parts have in common, and a line each for some of those that say something else.
fn fold(parts: &[Recording], first: &Recording, last: &Recording, out: &mut String) -> fmt::Result {
    let id = first.session_id.as_deref().unwrap_or_default();
    let (count, from, to) = (parts.len(), first.part_index, last.part_index);
    write!(out, "recording     {id}, {count} parts, {from} to {to}, by {}, ", first.tool)?;
    let in_trouble: Vec<&Recording> = parts.iter().filter(|part| part.is_in_trouble()).collect();
    match &last.end {
        Some(reason) if in_trouble.is_empty() => return writeln!(out, "all closed ({reason})"),
        None if in_trouble.is_empty() => return writeln!(out, "the last being written"),
        _ => writeln!(out, "{} with something missing:", in_trouble.len())?,
    }
    for part in in_trouble.iter().take(MOST_IN_TROUBLE) {
        writeln!(out, "recording     {part}")?;
    }
    match in_trouble.len().saturating_sub(MOST_IN_TROUBLE) {
        0 => Ok(()),
        more => writeln!(out, "              and {more} more"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(part_index: u64) -> Recording {
        let end = Some(if part_index < 200 { "rotated" } else { "finished" }.to_owned());
        Recording {
            session_id: Some("s".into()),
            part_index,
            tool: "rtutap 1".into(),
            end,
            ..Recording::default()
        }
    }

    fn text(recordings: &[Recording]) -> String {
        let mut text = String::new();
        write(recordings, &mut text).expect("a string");
        text
    }

    #[test]
    fn two_hundred_parts_take_a_line_and_those_with_something_missing_one_each_up_to_five() {
        let mut parts: Vec<_> = (1..=200).map(part).collect();
        assert_eq!(
            text(&parts),
            "recording     s, 200 parts, 1 to 200, by rtutap 1, all closed (finished)\n"
        );
        parts[10].end = None;
        let said = text(&parts);
        assert!(said.contains("200, by rtutap 1, 1 with something missing:\n"), "{said}");
        assert!(said.ends_with("recording     s, part 11, by rtutap 1, not closed\n"), "{said}");
        parts.iter_mut().for_each(|part| part.lost_bytes = 1);
        let said = text(&parts);
        assert!(said.lines().count() == 7 && said.ends_with("and 195 more\n"), "{said}");
        assert_eq!(text(&parts[..2]).lines().count(), 2);
    }
}
