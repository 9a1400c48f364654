//! The conformance report: findings folded and judged, and what the master does.

mod activity;
mod fold;
mod hearing;
mod junit;
mod text;

use self::activity::Activity;
use self::fold::Folds;
use self::hearing::Hearing;
use super::{Clock, Format, Json, TimeStyle};
use crate::analyze::plan::{Check, Plan};
use crate::analyze::verify::{Finding, Party, Severity, rule};
use crate::line::LineSettings;
use crate::pipeline::Event;
use crate::time::Timestamp;

pub use text::explain;

/// Says which findings count, and how much.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Judgement {
    /// Codes that are left out.
    pub ignored: Vec<String>,
    /// Codes with a severity other than the catalogue's.
    pub severities: Vec<(String, Severity)>,
    /// The parties that are judged; all when empty.
    pub parties: Vec<Party>,
    /// From which severity on findings fail the run; `None` never does.
    pub fail_on: Option<Severity>,
}

impl Default for Judgement {
    fn default() -> Self {
        let fail_on = Some(Severity::Error);
        Judgement { ignored: Vec::new(), severities: Vec::new(), parties: Vec::new(), fail_on }
    }
}

impl Judgement {
    /// Returns a finding as it counts; `None` when it does not.
    fn of(&self, finding: &Finding) -> Option<Finding> {
        let code = finding.rule.code;
        let is = |given: &String| given.eq_ignore_ascii_case(code);
        if self.ignored.iter().any(is) || !self.judges(finding.party) {
            return None;
        }
        let severity = self.severities.iter().find(|(given, _)| is(given)).map(|(_, severity)| *severity);
        Some(Finding { severity: severity.unwrap_or(finding.severity), ..finding.clone() })
    }

    fn judges(&self, party: Party) -> bool {
        self.parties.is_empty() || self.parties.contains(&party)
    }
}

/// Returns the codes that no rule has.
pub fn unknown_codes<'a>(codes: impl IntoIterator<Item = &'a String>) -> Vec<&'a str> {
    codes.into_iter().filter(|code| rule(code).is_none()).map(String::as_str).collect()
}

/// Gathers what a report says. Memory stays flat: what does not fit any more is folded coarser.
pub struct Audit {
    judgement: Judgement,
    folds: Folds,
    activity: Activity,
    check: Option<(Plan, Vec<(String, Check)>)>,
    buses: Vec<Hearing>,
    frames: u64,
    damaged: u64,
    first: Option<Timestamp>,
    last: Option<Timestamp>,
}

impl Audit {
    /// Begins with nothing seen; `plan` is what the master is expected to do.
    pub fn new(judgement: Judgement, plan: Option<Plan>) -> Self {
        Audit {
            judgement,
            folds: Folds::default(),
            activity: Activity::default(),
            check: plan.map(|plan| (plan, Vec::new())),
            buses: Vec::new(),
            frames: 0,
            damaged: 0,
            first: None,
            last: None,
        }
    }

    /// Begins a bus with these line settings; `is_hold_known` tells whether its adapter is known, and not estimated.
    pub fn begin(&mut self, bus: &str, line: LineSettings, is_hold_known: bool) {
        self.finish_check(bus);
        match self.hearing(bus) {
            Some(known) => known.line = line,
            None => self.buses.push(Hearing::new(bus, line)),
        }
        if let Some((plan, checks)) = &mut self.check {
            checks.retain(|(known, _)| known != bus);
            checks.push((bus.to_owned(), Check::new(plan.clone(), is_hold_known)));
        }
    }

    /// Takes an event.
    pub fn event(&mut self, bus: &str, event: &Event<'_>) {
        match event {
            Event::Finding(finding) => self.finding(bus, finding),
            Event::Frame(frame) => {
                self.frames += 1;
                self.hearing(bus).into_iter().for_each(|hearing| hearing.frame(frame));
                self.note(frame.place.time.map(|time| time.end.midpoint()));
            }
            Event::Damaged(damaged) => {
                self.damaged += 1;
                self.hearing(bus).into_iter().for_each(|hearing| hearing.damaged(damaged));
                self.note(damaged.place.time.map(|time| time.end.midpoint()));
                self.check_of(bus, |check, _| check.damaged());
            }
            Event::Lost(_) => self.check_of(bus, |check, _| check.lost()),
            Event::Identified { identified, .. } => {
                self.activity.identified(bus, identified.address, &identified.device);
            }
            Event::Transaction { transaction, meaning, .. } => {
                self.activity.transaction(bus, transaction, meaning);
                self.check_of(bus, |check, found| check.transaction(transaction, meaning, found));
            }
            Event::Reading { .. } => {}
        }
    }

    fn hearing(&mut self, bus: &str) -> Option<&mut Hearing> {
        self.buses.iter_mut().find(|hearing| hearing.bus == bus)
    }

    fn note(&mut self, time: Option<Timestamp>) {
        let Some(time) = time else { return };
        self.first.get_or_insert(time);
        self.last = Some(self.last.map_or(time, |last| last.max(time)));
    }

    fn finding(&mut self, bus: &str, finding: &Finding) {
        if let Some(finding) = self.judgement.of(finding) {
            self.folds.add(bus, finding);
        }
    }

    /// Lets a bus be checked against the plan.
    fn check_of(&mut self, bus: &str, act: impl FnOnce(&mut Check, &mut Vec<Finding>)) {
        let Some((_, checks)) = &mut self.check else { return };
        let Some((_, check)) = checks.iter_mut().find(|(known, _)| known == bus) else { return };
        let mut found = Vec::new();
        act(check, &mut found);
        found.iter().for_each(|finding| self.finding(bus, finding));
    }

    fn finish_check(&mut self, bus: &str) {
        self.check_of(bus, |check, found| check.finish(found));
    }

    /// Ends: what the plan has and nobody did is known now, and whether anything made sense.
    pub fn finish(&mut self) {
        let ends: Vec<_> = self.buses.iter().map(|it| (it.bus.clone(), it.nonsense())).collect();
        for (bus, nonsense) in ends {
            self.finish_check(&bus);
            nonsense.iter().for_each(|finding| self.finding(&bus, finding));
        }
        if let Some((_, checks)) = &mut self.check {
            checks.clear();
        }
    }

    /// Tells whether not a byte was heard.
    pub fn is_silent(&self) -> bool {
        self.buses.iter().all(Hearing::is_silent)
    }

    /// Returns the buses of which not a byte was heard.
    pub fn silent(&self) -> impl Iterator<Item = &str> {
        self.buses.iter().filter(|hearing| hearing.is_silent()).map(|hearing| &*hearing.bus)
    }

    /// Tells whether findings fail the run.
    pub fn fails(&self) -> bool {
        let severities = self.folds.sorted().into_iter().map(|(_, finding)| finding.severity);
        self.judgement.fail_on.is_some_and(|fail_on| severities.max() >= Some(fail_on))
    }

    /// Returns the report for people.
    pub fn to_text(&self, clock: TimeStyle, colour: bool, verbose: bool) -> String {
        let mut clock = Clock::new(clock);
        if let Some(first) = self.first {
            clock.begin(first);
        }
        text::Report { audit: self, clock, colour, verbose }.to_string()
    }

    /// Returns the findings as JSON lines.
    pub fn to_json(&self) -> Vec<u8> {
        let (mut json, mut out) = (Json::default(), Vec::new());
        for (bus, finding) in self.folds.sorted() {
            json.row(bus, &Event::Finding(finding), &mut out);
        }
        out
    }

    /// Returns the findings as JUnit XML, a test case each, and one for each rule that found nothing.
    pub fn to_junit(&self) -> String {
        let heard = junit::Heard { first: self.first, last: self.last };
        junit::write(&self.folds.sorted(), &self.judgement, heard)
    }
}
