//! Runs a simulated bus through the pipeline and counts what came out against the truth.

use std::collections::HashMap;
use std::fmt;
use std::iter::Sum;
use std::sync::Arc;

use rtutap::decode::chunk::{Chunk, ReadTime};
use rtutap::decode::frame::Role;
use rtutap::device::{Devices, Environment, Profiles};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Event, Options, Pipeline};
use rtutap::simulate::{Adapter, Config, Scenario, Simulation, TruthFrame};

/// Counts frames of the truth and of the decode.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Frames of the truth that were delivered whole.
    undamaged: u64,
    /// Those found.
    found: u64,
    /// Those found with the right role, echoes marked.
    right: u64,
    /// Frames found that the truth does not have.
    phantoms: u64,
    /// Undamaged responses to undamaged requests.
    answered: u64,
    /// Those paired with their request.
    paired: u64,
    /// Rows of both kinds.
    rows: u64,
}

impl Tally {
    pub fn right(&self) -> f64 {
        self.right as f64 / self.undamaged as f64
    }

    pub fn phantoms_per_thousand(&self) -> f64 {
        1000.0 * self.phantoms as f64 / self.undamaged as f64
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |part: u64, whole: u64| 100.0 * part as f64 / whole.max(1) as f64;
        write!(
            f,
            "{:6} frames: {:7.3} % found, {:7.3} % right, {:5.2} phantoms in 1000, {:7.3} % of {} pairs",
            self.undamaged,
            percent(self.found, self.undamaged),
            percent(self.right, self.undamaged),
            self.phantoms_per_thousand(),
            percent(self.paired, self.answered),
            self.answered,
        )
    }
}

impl Sum for Tally {
    fn sum<I: Iterator<Item = Tally>>(iter: I) -> Tally {
        iter.fold(Tally::default(), |a, b| Tally {
            undamaged: a.undamaged + b.undamaged,
            found: a.found + b.found,
            right: a.right + b.right,
            phantoms: a.phantoms + b.phantoms,
            answered: a.answered + b.answered,
            paired: a.paired + b.paired,
            rows: a.rows + b.rows,
        })
    }
}

struct Found {
    role: Role,
    echo: bool,
    start: u64,
    end: u64,
}

pub fn pipeline(line: LineSettings, adapter_hold_ns: Option<i64>) -> Pipeline {
    let options = Options::new(line, adapter_hold_ns);
    let profiles = Profiles::built_in();
    let shapes = profiles.shapes();
    Pipeline::new(options, Devices::new(Arc::new(profiles), Environment::default()), shapes)
}

/// Decodes one simulated bus, checking on the way that its rows give back every byte in order.
pub fn run(scenario: Scenario, adapter: Adapter, line: LineSettings, seed: u64, frames: u64) -> Tally {
    let mut simulation = Simulation::new(Config { seed, frames, line, adapter, scenario });
    let mut pipeline = pipeline(line, None);
    let mut found: Vec<Found> = Vec::new(); // by id: frames and runs
    let mut pairs: HashMap<u64, u64> = HashMap::new(); // response id to request id
    let mut bytes: Vec<u8> = Vec::new();
    let mut truth: Vec<TruthFrame> = Vec::new();
    let mut given_back = 0;
    let mut drain = |pipeline: &mut Pipeline, bytes: &[u8]| {
        while let Some(event) = pipeline.poll_event() {
            let (place, role, echo) = match &event {
                Event::Frame(frame) => (&frame.place, frame.role, frame.echo),
                Event::Damaged(run) => (&run.place, Role::Unknown, false),
                Event::Transaction { transaction, .. } => {
                    if let (Some(request), Some(response)) = (transaction.request, transaction.response) {
                        pairs.insert(response.id, request.id);
                    }
                    continue;
                }
                _ => continue,
            };
            assert_eq!(place.stream_offset, given_back, "rows leave no byte out");
            assert_eq!(place.bytes, &bytes[given_back as usize..][..place.bytes.len()]);
            assert_eq!(place.id, found.len() as u64);
            given_back += place.bytes.len() as u64;
            let role = if matches!(event, Event::Frame(_)) { role } else { Role::Unknown };
            found.push(Found { role, echo, start: place.stream_offset, end: given_back });
        }
    };
    while let Some(read) = simulation.next() {
        truth.append(&mut simulation.take_truth());
        bytes.extend(&read.bytes);
        let chunk =
            Chunk { time: ReadTime::At(read.time), bytes: &read.bytes, line_errors: &read.line_errors };
        pipeline.handle_bytes(&chunk);
        drain(&mut pipeline, &bytes);
    }
    truth.append(&mut simulation.take_truth());
    pipeline.finish();
    drain(&mut pipeline, &bytes);
    assert_eq!(given_back, bytes.len() as u64, "all bytes come back");
    compare(&truth, &found, &pairs)
}

fn compare(truth: &[TruthFrame], found: &[Found], pairs: &HashMap<u64, u64>) -> Tally {
    let by_span: HashMap<(u64, u64), (usize, &Found)> =
        found.iter().enumerate().map(|(id, f)| ((f.start, f.end), (id, f))).collect();
    let mut tally = Tally { rows: found.len() as u64, ..Tally::default() };
    let mut real = std::collections::HashSet::new();
    for frame in truth {
        let hit = by_span.get(&(frame.start, frame.end)).filter(|(_, f)| f.role != Role::Unknown);
        if let Some((id, _)) = hit {
            real.insert(*id);
        }
        if !frame.clean {
            continue;
        }
        tally.undamaged += 1;
        tally.found += u64::from(hit.is_some());
        tally.right += u64::from(hit.is_some_and(|(_, f)| f.role == frame.role && f.echo == frame.echo));
        let request = frame.request.and_then(|index| truth.get(index as usize)).filter(|r| r.clean);
        if let Some(request) = request {
            tally.answered += 1;
            let asked = by_span.get(&(request.start, request.end)).map(|(id, _)| *id as u64);
            let paired = hit.and_then(|(id, _)| pairs.get(&(*id as u64))).copied();
            tally.paired += u64::from(asked.is_some() && asked == paired);
        }
    }
    let frames = found.iter().enumerate().filter(|(_, f)| f.role != Role::Unknown);
    tally.phantoms = frames.filter(|(id, _)| !real.contains(id)).count() as u64;
    tally
}
