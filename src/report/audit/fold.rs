//! Identical findings as one, with their count, the first time and the last.
//!
//! Findings are identical when their messages differ in nothing but lengths of time and how often something was
//! repeated. What else there is of a code and a unit than is kept apart is counted as others.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hasher};

use crate::analyze::verify::{Finding, Party, Severity};

/// How many different findings are kept apart.
const MOST: usize = 2000;
/// How many different findings of a code, unit and party are kept apart.
const MOST_OF_UNIT: usize = 24;
/// How many different findings about the same are kept apart where chance makes them: damage and wild values.
const MOST_BY_CHANCE: usize = 3;

/// Names findings of one kind: the gravest first, then by code, bus, address and party.
type Key = (Reverse<Severity>, &'static str, usize, Option<u8>, Party);

/// Is findings of one kind.
#[derive(Debug, Default)]
struct Group {
    /// What was seen apart from times, and its findings, in the order in which they first came.
    folds: Vec<(u64, Finding)>,
    /// Those for which there was no place, and the message of the first.
    others: Option<(String, Finding)>,
}

/// Folds findings.
#[derive(Debug, Default)]
pub(super) struct Folds {
    buses: Vec<String>,
    groups: BTreeMap<Key, Group>,
    count: usize,
}

impl Folds {
    pub(super) fn add(&mut self, bus: &str, finding: Finding) {
        let known = self.buses.iter().position(|known| known == bus);
        let bus = known.unwrap_or_else(|| {
            self.buses.push(bus.to_owned());
            self.buses.len() - 1
        });
        let Finding { severity, rule, address, party, .. } = finding;
        let mut key = (Reverse(severity), rule.code, bus, address, party);
        let is_full = self.count >= MOST;
        if is_full && !self.groups.contains_key(&key) {
            key.3 = None; // as many as there are rules, severities, parties and buses at most
        }
        self.count += usize::from(self.groups.entry(key).or_default().add(finding, is_full));
    }

    /// Returns all folds with their buses, the gravest first.
    pub(super) fn sorted(&self) -> Vec<(&str, &Finding)> {
        let name = |bus: usize| self.buses.get(bus).map_or("", String::as_str);
        let all = self.groups.iter().flat_map(|(key, group)| {
            let others = group.others.iter().map(|(_, finding)| finding);
            group.folds.iter().map(|(_, finding)| finding).chain(others).map(|it| (name(key.2), it))
        });
        all.collect()
    }
}

impl Group {
    /// Adds a finding; tells whether it is kept apart from all before.
    fn add(&mut self, finding: Finding, is_full: bool) -> bool {
        let like = likeness(&finding);
        if let Some((_, fold)) = self.folds.iter_mut().find(|(other, _)| *other == like) {
            count(fold, &finding);
            return false;
        }
        let about_same = self.folds.iter().filter(|(_, fold)| fold.subject == finding.subject).count();
        let is_chance = matches!(finding.rule.code.as_bytes(), [b'L' | b'F', ..] | b"T08" | b"V02");
        let most = if is_chance { MOST_BY_CHANCE } else { MOST_OF_UNIT };
        if !is_full && about_same < most && self.folds.len() < MOST_OF_UNIT {
            self.folds.push((like, finding));
            return true;
        }
        match &mut self.others {
            Some((_, others)) => count(others, &finding),
            None => self.others = Some((finding.message.clone(), finding)),
        }
        if let Some((first, others)) = &mut self.others {
            let plural = if others.count == 1 { "other" } else { "others" };
            others.message = format!("and {} {plural}, such as: {first}", others.count);
        }
        false
    }
}

/// Counts a finding to those that are like it.
fn count(fold: &mut Finding, finding: &Finding) {
    fold.count = fold.count.saturating_add(finding.count);
    fold.first = fold.first.into_iter().chain(finding.first).min();
    fold.last = fold.last.into_iter().chain(finding.last).max();
}

/// Says what a finding is, apart from lengths of time, how often something was repeated, and where it is pointed at.
fn likeness(finding: &Finding) -> u64 {
    /// What stands behind a number that says how long or how often, and before one that points at a frame.
    const AFTER: [&str; 7] = ["s", "ms", "µs", "times", "reads", "requests", "bytes lost"];
    const BEFORE: [&str; 2] = ["frame ", "before byte "];
    let mut hasher = DefaultHasher::new();
    hasher.write_u32(finding.subject);
    let mut rest = finding.message.as_str();
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
        let (text, number) = rest.split_at(at);
        let end = number.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(number.len());
        let (number, behind) = number.split_at(end);
        let unit = behind.strip_prefix(' ').filter(|behind| {
            let is_whole = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '/');
            AFTER.iter().any(|unit| behind.strip_prefix(unit).is_some_and(is_whole))
        });
        if unit.is_some() || BEFORE.iter().any(|what| text.ends_with(what)) {
            hasher.write(text.trim_end_matches(['-', '±']).as_bytes());
        } else {
            hasher.write(text.as_bytes());
            hasher.write(number.as_bytes());
        }
        rest = behind;
    }
    hasher.write(rest.as_bytes());
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analyze::verify::rule;
    use crate::time::Timestamp;

    fn finding(code: &str, address: u8, ns: i64) -> Finding {
        Finding::new(rule(code).expect("a rule"), Some(Timestamp::from_ns(ns)), "seen").at(address)
    }

    /// Folds messages of one code and unit; returns them with their counts.
    fn folded(code: &str, messages: &[&str]) -> Vec<(String, u64)> {
        let mut folds = Folds::default();
        for message in messages {
            folds.add("bus0", Finding { message: (*message).to_owned(), ..finding(code, 1, 0) });
        }
        folds.sorted().iter().map(|(_, fold)| (fold.message.clone(), fold.count)).collect()
    }

    #[test]
    fn what_is_alike_is_one_with_its_count_and_times_and_the_gravest_come_first() {
        let mut folds = Folds::default();
        for (code, address, ns) in [("D06", 1, 5), ("D03", 1, 7), ("D06", 1, 3), ("D06", 2, 4), ("D06", 1, 9)]
        {
            folds.add("bus0", finding(code, address, ns));
        }
        let sorted = folds.sorted();
        let told: Vec<_> = sorted.iter().map(|(_, f)| (f.rule.code, f.address, f.count)).collect();
        assert_eq!(told, [("D03", Some(1), 1), ("D06", Some(1), 3), ("D06", Some(2), 1)]);
        let times = (sorted[1].1.first, sorted[1].1.last, sorted[1].1.time);
        let at = |ns| Some(Timestamp::from_ns(ns));
        assert_eq!(times, (at(3), at(9), at(5)), "the first that came is the evidence");
    }

    #[test]
    fn what_differs_in_more_than_time_stays_apart() {
        let one = |code, messages: &[&str]| assert_eq!(folded(code, messages).len(), 1, "{messages:?}");
        one("D06", &["read at most 0.52 s after the start", "read at most 11.5 s after the start"]);
        one("L01", &["2.10 ms ±0.30 ms of silence before byte 4", "12 ms ±1.55 ms of silence before byte 4"]);
        one("T06", &["FC03 0x0900 was sent 3 times in a row", "FC03 0x0900 was sent 4 times in a row"]);
        one(
            "D10",
            &["wrote k 1; k 2 was known before (frame 3)", "wrote k 1; k 2 was known before (frame 13)"],
        );
        for (code, one, other) in [
            ("D10", "set-calibration wrote k 1, b 0", "set-calibration wrote k 1.5, b 0"),
            ("D11", "wrote k 0", "wrote k -0"),
            ("D18", "not a date: 11 05 0d 1d", "not a date: 11 05 0d 1e"),
            ("F01", "it fits when bit 4 of byte 7 is flipped", "it fits when byte 4 came twice"),
            ("F04", "a request lost its tail", "a response lost its tail"),
            ("V02", "temperature 80 °C", "temperature 81 °C"),
            ("V02", "speed 8 m/s", "speed 9 m/s"),
            ("T01", "FC03 0x0700 ×2 was not answered", "FC03 0x0700 ×4 was not answered"),
        ] {
            assert_eq!(folded(code, &[one, other, one]), [(one.to_owned(), 2), (other.to_owned(), 1)]);
        }
    }

    #[test]
    fn too_many_that_differ_are_counted_as_others() {
        let messages: Vec<String> = (0..10).map(|byte| format!("bit 1 of byte {byte} is flipped")).collect();
        let messages: Vec<&str> = messages.iter().map(String::as_str).collect();
        let told = folded("F01", &messages);
        assert_eq!(told.len(), 4);
        assert_eq!(told[3], ("and 7 others, such as: bit 1 of byte 3 is flipped".to_owned(), 7));
        assert_eq!(folded("D10", &messages).len(), 10, "each write matters");
    }

    #[test]
    fn a_million_different_findings_do_not_fill_the_memory() {
        let mut folds = Folds::default();
        for subject in 0..1_000_000_u32 {
            folds.add("bus0", finding("D04", (subject % 247) as u8, 0).about(subject));
        }
        assert!(folds.sorted().len() < 2 * MOST);
        assert_eq!(folds.sorted().iter().map(|(_, finding)| finding.count).sum::<u64>(), 1_000_000);
    }
}
