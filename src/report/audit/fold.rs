//! Identical findings as one, with their count, the first time and the last.

use std::collections::BTreeMap;

use crate::analyze::verify::{Finding, Party, Severity};

/// How many different findings are kept apart.
const MOST: usize = 2000;

/// Names findings that are alike: the gravest first, then by code, address and subject.
type Key = (std::cmp::Reverse<Severity>, &'static str, usize, Option<u8>, Party, Option<u32>);

/// Folds findings.
#[derive(Debug, Default)]
pub(super) struct Folds {
    buses: Vec<String>,
    folds: BTreeMap<Key, Finding>,
}

impl Folds {
    pub(super) fn add(&mut self, bus: &str, finding: Finding) {
        let known = self.buses.iter().position(|known| known == bus);
        let bus = known.unwrap_or_else(|| {
            self.buses.push(bus.to_owned());
            self.buses.len() - 1
        });
        let Finding { severity, rule, address, party, subject, .. } = finding;
        let severity = std::cmp::Reverse(severity);
        let mut key = (severity, rule.code, bus, address, party, Some(subject));
        if self.folds.len() >= MOST && !self.folds.contains_key(&key) {
            // As many as there are rules, severities, parties and buses at most.
            key = (severity, rule.code, bus, None, party, None);
        }
        match self.folds.get_mut(&key) {
            Some(fold) => {
                fold.count = fold.count.saturating_add(finding.count);
                fold.first = fold.first.into_iter().chain(finding.first).min();
                fold.last = fold.last.into_iter().chain(finding.last).max();
            }
            None => {
                self.folds.insert(key, finding);
            }
        }
    }

    /// Returns all folds with their buses, the gravest first.
    pub(super) fn sorted(&self) -> Vec<(&str, &Finding)> {
        let name = |bus: usize| self.buses.get(bus).map_or("", String::as_str);
        self.folds.iter().map(|(key, finding)| (name(key.2), finding)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analyze::verify::rule;
    use crate::time::Timestamp;

    fn finding(code: &str, address: u8, ns: i64) -> Finding {
        Finding::new(rule(code).expect("a rule"), Some(Timestamp::from_ns(ns)), "seen").at(address)
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
    fn a_million_different_findings_do_not_fill_the_memory() {
        let mut folds = Folds::default();
        for subject in 0..1_000_000_u32 {
            folds.add("bus0", finding("D04", (subject % 247) as u8, 0).about(subject));
        }
        assert!(folds.folds.len() < 2 * MOST);
        assert_eq!(folds.sorted().iter().map(|(_, finding)| finding.count).sum::<u64>(), 1_000_000);
    }
}
