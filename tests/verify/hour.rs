//! An hour of a master that does as the manuals ask, heard through a coarse adapter with damaged bytes; then with one
//! mistake at a time, as the field has seen them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtutap::analyze::verify::{Finding, Party};
use rtutap::decode::chunk::{Chunk, LineError, LineErrorKind};
use rtutap::device::{Devices, Environment, Profiles};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Event, Options, Pipeline};
use rtutap::simulate::{
    Adapter, Ask, Config, Equipment, Fault, GOOD_CONDUCTIVITY, GOOD_MASTER, GOOD_OXYGEN, GOOD_SONDE, Read,
    Scenario, Script, Simulation, Step, TruthFrame,
};
use rtutap::time::{SECOND, Timestamp};

/// Is what was heard in an hour.
struct Hour {
    findings: Vec<Finding>,
    /// Stream offset and length of each frame and run, by its id.
    places: Vec<(u64, u64)>,
    truth: Vec<TruthFrame>,
}

/// Listens to a script for an hour, with 0.1 % of the bytes damaged.
fn hour(script: &'static Script, scenario: Scenario, seed: u64, spoil: impl Fn(&mut Read)) -> Hour {
    let scenario = Scenario { equipment: Equipment::Script(script), corrupt: 0.001, ..scenario };
    let config =
        Config { seed, frames: 1_000_000, line: LineSettings::default(), adapter: Adapter::Ftdi16, scenario };
    let profiles = Arc::new(Profiles::built_in());
    let options =
        Options { findings: true, ..Options::new(config.line, Some(config.adapter.hold_ns(config.line))) };
    let shapes = profiles.shapes();
    let mut pipeline = Pipeline::new(options, Devices::new(profiles, Environment::default()), shapes);
    let mut hour = Hour { findings: Vec::new(), places: Vec::new(), truth: Vec::new() };
    let mut simulation = Simulation::new(config);
    let mut until: Option<Timestamp> = None;
    while let Some(mut read) = simulation.next() {
        if read.time > *until.get_or_insert(read.time + 3600 * SECOND) {
            break;
        }
        spoil(&mut read);
        let chunk: Chunk<'_> = read.chunk();
        pipeline.handle_bytes(&chunk);
        hour.take(&mut pipeline);
        hour.truth.extend(simulation.take_truth());
    }
    pipeline.finish();
    hour.take(&mut pipeline);
    hour
}

impl Hour {
    fn take(&mut self, pipeline: &mut Pipeline) {
        while let Some(event) = pipeline.poll_event() {
            let place = match &event {
                Event::Frame(frame) => &frame.place,
                Event::Damaged(damaged) => &damaged.place,
                Event::Finding(finding) => {
                    self.findings.push((*finding).clone());
                    continue;
                }
                _ => continue,
            };
            assert_eq!(place.id, self.places.len() as u64);
            self.places.push((place.stream_offset, place.bytes.len() as u64));
        }
    }

    /// Counts the findings by code, without what is noted of quirks and adapter.
    fn codes(&self) -> BTreeMap<&'static str, usize> {
        let mut codes = BTreeMap::new();
        for finding in self.findings.iter().filter(|finding| !matches!(finding.rule.code, "Q01" | "L03")) {
            *codes.entry(finding.rule.code).or_default() += 1;
        }
        codes
    }

    /// Tells whether a damaged byte lies in or beside the frames of a finding.
    fn is_at_damage(&self, finding: &Finding) -> bool {
        finding.frames.iter().any(|id| {
            let (start, length) = self.places[*id as usize];
            let beside = |truth: &&TruthFrame| truth.end + 16 > start && truth.start < start + length + 16;
            self.truth.iter().filter(beside).any(|truth| !truth.clean)
        })
    }
}

fn plain() -> Scenario {
    Scenario { stall: 0.02, ..Scenario::named("good-master").expect("a scenario") }
}

#[test]
fn a_correct_master_is_never_blamed_whatever_is_damaged() {
    for (script, seed) in
        [(&GOOD_OXYGEN, 1), (&GOOD_CONDUCTIVITY, 2), (&GOOD_SONDE, 3), (&GOOD_MASTER, 4), (&GOOD_OXYGEN, 5)]
    {
        let heard = hour(script, plain(), seed, |_| {});
        for finding in &heard.findings {
            let code = finding.rule.code;
            assert!(
                !code.starts_with('D') && !code.starts_with('M') && !matches!(code, "L01" | "L02"),
                "{finding:#?}"
            );
            if code.starts_with('F') || code.starts_with('T') {
                assert!(heard.is_at_damage(finding) && finding.party != Party::Master, "{finding:#?}");
            }
        }
        let damaged = heard.truth.iter().filter(|truth| !truth.clean).count();
        let named =
            heard.findings.iter().filter(|it| it.rule.code.starts_with('F') || it.rule.code == "L05").count();
        assert!(damaged > 3 && named * 10 >= damaged * 9, "{named} of {damaged} damaged frames are named");
        assert!(heard.findings.iter().any(|finding| finding.rule.code == "Q01"), "quirks are noted");
    }
}

/// Is a mistake put into the hour of a good master.
struct Mistake {
    /// Its row in the list of mistakes seen in the field.
    row: &'static str,
    master: &'static Script,
    once: Vec<Step>,
    cycle: Vec<Step>,
    /// Steps of the good master that are left out.
    without: fn(&Step) -> bool,
    fault: Fault,
    code: &'static str,
    /// What else follows from it, directly.
    consequences: &'static [&'static str],
}

const O: u8 = 1;
const C: u8 = 2;
const S: u8 = 3;

fn read(address: u8, register: u16, quantity: u16) -> Step {
    Step { ask: Ask::Read(address, register, quantity), next_ms: 700 }
}

fn write(address: u8, register: u16, quantity: u16, data: &'static [u8]) -> Step {
    Step { ask: Ask::Write(address, register, quantity, data), next_ms: 700 }
}

fn after(step: Step, next_ms: i64) -> Step {
    Step { next_ms, ..step }
}

fn mistake(row: &'static str, master: &'static Script, code: &'static str) -> Mistake {
    Mistake {
        row,
        master,
        once: Vec::new(),
        cycle: Vec::new(),
        without: |_| false,
        fault: Fault::None,
        code,
        consequences: &[],
    }
}

impl Mistake {
    fn once(self, steps: impl IntoIterator<Item = Step>) -> Self {
        Mistake { once: steps.into_iter().collect(), ..self }
    }

    fn cycle(self, steps: impl IntoIterator<Item = Step>) -> Self {
        Mistake { cycle: steps.into_iter().collect(), ..self }
    }

    fn without(self, without: fn(&Step) -> bool) -> Self {
        Mistake { without, ..self }
    }

    fn with(self, fault: Fault) -> Self {
        Mistake { fault, ..self }
    }

    fn then(self, consequences: &'static [&'static str]) -> Self {
        Mistake { consequences, ..self }
    }

    fn script(&self) -> &'static Script {
        let kept =
            |steps: &[Step]| steps.iter().copied().filter(|step| !(self.without)(step)).collect::<Vec<_>>();
        let once = [kept(self.master.once), self.once.clone()].concat();
        let cycle = [kept(self.master.cycle), self.cycle.clone()].concat();
        let mut sensors = self.master.sensors.to_vec();
        sensors.iter_mut().for_each(|sensor| sensor.fault = self.fault);
        Box::leak(Box::new(Script { sensors: sensors.leak(), once: once.leak(), cycle: cycle.leak() }))
    }

    /// Listens; fails unless it is found. Returns what is found beyond its consequences and those of the damage.
    #[must_use]
    fn beyond(&self, scenario: Scenario, spoil: impl Fn(&mut Read)) -> Vec<String> {
        let heard = hour(self.script(), scenario, 7, spoil);
        let row = self.row;
        let mut wrong = Vec::new();
        let codes = heard.codes();
        if !codes.contains_key(self.code) {
            wrong.push(format!("{row}: no {} in {codes:?}", self.code));
        }
        for finding in &heard.findings {
            let code = finding.rule.code;
            let is_known =
                code == self.code || self.consequences.contains(&code) || matches!(code, "Q01" | "L03");
            let is_damage = matches!(code.as_bytes()[0], b'F' | b'T' | b'L') && heard.is_at_damage(finding);
            if !is_known && !is_damage {
                wrong.push(format!("{row}: {code} {} {:?}", finding.message, finding.frames));
            }
        }
        wrong
    }
}

fn is_read_of(step: &Step, register: u16) -> bool {
    matches!(step.ask, Ask::Read(_, start, _) if start == register)
}

fn mistakes() -> Vec<Mistake> {
    let unanswered: &[&str] = &["T01"];
    vec![
        mistake("W1", &GOOD_OXYGEN, "D13")
            .once([write(O, 0x1100, 4, &[0x3F, 0x80, 0, 0, 0, 0, 0, 0])])
            .then(&["D10"]),
        mistake("W2", &GOOD_SONDE, "D13").once([write(S, 0x0E00, 1, &[0, 30])]).then(&["V04"]),
        mistake("W3", &GOOD_OXYGEN, "D13").once([write(O, 0x3000, 1, &[0, 5])]).then(unanswered),
        mistake("W4", &GOOD_SONDE, "D01")
            .cycle([Step { ask: Ask::Any(S, 6, &[0x2F, 0, 0, 1]), next_ms: 700 }])
            .then(unanswered),
        mistake("W5", &GOOD_OXYGEN, "D01")
            .cycle([Step { ask: Ask::Any(O, 4, &[0x26, 0, 0, 4]), next_ms: 700 }])
            .then(unanswered),
        mistake("W6", &GOOD_SONDE, "D02").cycle([read(S, 0x2600, 16)]).then(unanswered),
        mistake("W6 (DO)", &GOOD_OXYGEN, "D02").cycle([read(O, 0x25FF, 4)]).then(unanswered),
        mistake("W7", &GOOD_CONDUCTIVITY, "D03")
            .cycle([after(read(C, 0x1C00, 0), 700), read(C, 0x1100, 2)])
            .then(&["T01", "D04", "D01", "M01"]),
        mistake("W8", &GOOD_OXYGEN, "D05")
            .without(|step| is_read_of(step, 0x2500) || is_read_of(step, 0x2E00)),
        mistake("W9", &GOOD_CONDUCTIVITY, "D19")
            .cycle([Step { ask: Ask::Bytes(&[2, 16, 0x1C, 0, 0, 0, 0xEB, 0x92]), next_ms: 700 }])
            .then(&["L05", "T03"]),
        mistake("W10", &GOOD_OXYGEN, "F02")
            .cycle([Step { ask: Ask::Bytes(&[5, 3, 9, 0, 0, 7, 0x07, 0x94]), next_ms: 700 }])
            .then(&["F01", "F04", "L05"]),
        mistake("W11", &GOOD_OXYGEN, "D05")
            .once([after(read(O, 0x2600, 4), 1100)])
            .without(|step| is_read_of(step, 0x2500) || is_read_of(step, 0x2E00)),
        mistake("W12", &GOOD_OXYGEN, "D06")
            .cycle([after(read(O, 0x2500, 0), 300), after(read(O, 0x2600, 4), 2000)]),
        mistake("W12 (conductivity)", &GOOD_CONDUCTIVITY, "D06")
            .cycle([after(write(C, 0x1C00, 0, &[]), 4000), after(read(C, 0x2600, 5), 4000)]),
        mistake("W13", &GOOD_SONDE, "D17").without(|step| step.next_ms == 41_000).cycle([
            after(read(S, 0x0800, 1), 41_000),
            after(write(S, 0x2F00, 0, &[]), 5000),
            after(read(S, 0x2601, 16), 61_000),
        ]),
        mistake("W14", &GOOD_SONDE, "D07")
            .cycle([after(read(S, 0x2601, 16), 3000), after(read(S, 0x2601, 16), 61_000)]),
        mistake("W16", &GOOD_OXYGEN, "D08").cycle([after(read(O, 0x2600, 4), 1500)]),
        mistake("W17", &GOOD_SONDE, "D09").cycle([read(S, 0x2500, 0)]).then(unanswered),
        mistake("W18", &GOOD_CONDUCTIVITY, "D09").cycle([read(C, 0x2500, 0)]).then(unanswered),
        mistake("W18 (DO)", &GOOD_OXYGEN, "D09").cycle([write(O, 0x1C00, 0, &[])]).then(unanswered),
        mistake("W19", &GOOD_OXYGEN, "D12").once([write(O, 0x1102, 2, &[0, 0, 0, 0])]).then(unanswered),
        mistake("W19 (K)", &GOOD_OXYGEN, "D12")
            .once([write(O, 0x1100, 2, &[0, 0, 0x80, 0x3F])])
            .then(&["T01", "D10"]),
        mistake("W20", &GOOD_OXYGEN, "D10").once([write(O, 0x1100, 4, &[0, 0, 0x80, 0x3F, 0, 0, 0, 0])]),
        mistake("W20 (K of 0)", &GOOD_OXYGEN, "D11").once([write(O, 0x1100, 4, &[0; 8])]).then(&["D10"]),
        mistake("W20 (rewritten)", &GOOD_SONDE, "D20").cycle([write(S, 0x0E00, 1, &[60, 0])]),
        mistake("W21", &GOOD_MASTER, "D16").cycle([read(0xFF, 0x3000, 1)]).then(&["T01", "T06"]),
        mistake("W22", &GOOD_OXYGEN, "T01").cycle([read(0xFF, 0x3000, 1)]),
        mistake("W23", &GOOD_CONDUCTIVITY, "D21").cycle([read(0xFF, 0x3000, 1); 4]),
        mistake("W24", &GOOD_OXYGEN, "D15").once([write(O, 0x3000, 1, &[0x14, 0])]).then(&["T01", "T06"]),
        mistake("W25", &GOOD_OXYGEN, "D14").once([write(O, 0x3000, 1, &[250, 0])]).then(unanswered),
        mistake("W25 (to all)", &GOOD_SONDE, "D22").cycle([write(0, 0x2F00, 0, &[])]),
        mistake("W28", &GOOD_SONDE, "V04")
            .with(Fault::WeakSupply)
            .cycle([after(read(S, 0x0800, 1), 30_000)])
            .without(|step| step.next_ms == 41_000)
            .cycle([after(write(S, 0x2F00, 0, &[]), 5000), after(read(S, 0x0800, 1), 61_000)])
            .then(unanswered),
        mistake("W29", &GOOD_OXYGEN, "F04").with(Fault::LateDriver).then(&["F01", "L05"]),
        mistake("W29 (tail)", &GOOD_OXYGEN, "F04")
            .cycle([Step { ask: Ask::Bytes(&[1, 3, 0x07, 0, 0, 2]), next_ms: 2000 }]),
        mistake("W30", &GOOD_SONDE, "T06").cycle([read(S, 0x4000, 2); 4]).then(&["T01", "D04"]),
        mistake("W33", &GOOD_CONDUCTIVITY, "V02").with(Fault::Infinite),
        mistake("W35", &GOOD_SONDE, "D04").cycle([read(S, 0x0900, 7)]).then(unanswered),
    ]
}

#[test]
fn every_mistake_of_the_field_is_found_by_its_code_and_nothing_beyond_its_consequences() {
    let wrong: Vec<String> = mistakes().iter().flat_map(|mistake| mistake.beyond(plain(), |_| {})).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn two_sensors_at_one_address_are_told_by_their_collisions() {
    // W26: every tenth answer is given by two.
    let mistake =
        mistake("W26", &GOOD_OXYGEN, "T08").then(&["F01", "F04", "L04", "L05", "T03", "T07", "T01", "D07"]);
    assert_eq!(mistake.beyond(Scenario { two_answers: 0.1, ..plain() }, |_| {}), [""; 0]);
}

#[test]
fn another_parity_is_told_by_the_errors_of_the_line() {
    // W27: what the UART says of bytes whose parity it takes for a stop bit.
    let spoil = |read: &mut Read| {
        let wrong = read.bytes.iter().enumerate().filter(|(_, byte)| byte.count_ones() % 2 == 0);
        let kind = LineErrorKind::ParityOrFraming;
        read.line_errors = wrong.map(|(at, _)| LineError { offset: at as u32, kind }).collect();
    };
    assert_eq!(mistake("W27", &GOOD_OXYGEN, "L04").beyond(plain(), spoil), [""; 0]);
}

#[test]
fn the_list_of_mistakes_is_whole() {
    // Rows without a code, or told on the line: W15, W26, W27, W31, W32, W34.
    let rows: BTreeSet<u8> =
        mistakes().iter().filter_map(|it| it.row[1..].split(' ').next()?.parse().ok()).collect();
    let without = [15, 26, 27, 31, 32, 34];
    let expected: BTreeSet<u8> = (1..=35).filter(|row| !without.contains(row)).collect();
    assert_eq!(rows, expected);
}
