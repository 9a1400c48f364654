//! What was seen of a bus, as far as more than one family of rules asks for it.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::decode::frame::{Damaged, Frame, Reason, Role, WireTime};
use crate::decode::shape::{Form, Shapes};
use crate::decode::transaction::{Outcome, Side, Transaction};
use crate::device::{Command, Kind, Meaning, Profile, Profiles};
use crate::time::MILLISECOND;

/// The field of the software's version, the same in every profile.
const SOFTWARE_VERSION: &str = "software_version";
/// Requests remembered: more than can be undecided at a time.
const MOST_REQUESTS: usize = 64;
/// Damaged runs remembered.
const MOST_DAMAGE: usize = 64;
/// Nanoseconds within which an answer usually begins.
const SOON_NS: i64 = 100 * MILLISECOND;
/// Kinds of requests counted: address, function and register; a bus that sends more is out of its mind.
const MOST_KEYS: usize = 4096;

/// Is a frame that matters later: its id, and when it was on the wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mark {
    pub(super) id: u64,
    pub(super) time: Option<WireTime>,
}

impl Mark {
    pub(super) fn of(side: &Side<'_>) -> Mark {
        Mark { id: side.id, time: side.time }
    }
}

/// Is what was seen of a unit.
#[derive(Clone, Debug, Default)]
pub(super) struct Unit {
    /// How many requests it answered.
    pub(super) answered: u64,
    /// How many it left unanswered since its last answer.
    pub(super) silent: u64,
    pub(super) last_answer: Option<Mark>,
    /// Whether it measures without a start: later probes do.
    pub(super) starts_itself: bool,
    pub(super) start: Option<Mark>,
    pub(super) stop: Option<Mark>,
    pub(super) brush: Option<Mark>,
    /// The last measurement that was answered: register, request, and how often its data have been the same.
    pub(super) measured: Option<Measured>,
    /// What was last read or written at registers that can be written: register, and the fields as text.
    pub(super) kept: Vec<Kept>,
    /// The longest latency that its answers have had, in nanoseconds, as long as they came in time.
    pub(super) slowest_ns: i64,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    pub(super) register: u16,
    /// The first attempt, when it was retried.
    pub(super) request: Mark,
    /// The attempt that was answered.
    pub(super) answered: u64,
    pub(super) checksum: u16,
    /// How many reads before had the same data, and from when on.
    pub(super) same: u32,
    pub(super) same_since: Option<WireTime>,
    /// How many reads in a row had nothing but zeros and a temperature.
    pub(super) zeros: u32,
    /// How long its answer took at least, in nanoseconds.
    pub(super) latency_ns: i64,
    /// Whether its first attempt may be damaged.
    pub(super) is_doubtful: bool,
}

/// Is what a register that can be written was last known to hold.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    pub(super) register: u16,
    pub(super) text: String,
    /// The frame that showed it.
    pub(super) mark: Mark,
    /// How often in a row the same was written.
    pub(super) writes: u32,
}

/// Is an address that a device gave up for another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved {
    pub(super) from: u8,
    pub(super) to: u8,
    /// The acknowledgement.
    pub(super) mark: Mark,
}

/// Counts answers to one kind of request.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    pub(super) answered: u32,
    pub(super) unanswered: u32,
}

/// Is a request as it was sent.
#[derive(Clone, Debug)]
pub(super) struct Asked {
    pub(super) id: u64,
    pub(super) time: Option<WireTime>,
    pub(super) bytes: Vec<u8>,
}

/// Is an answer that came right behind a repetition of its request, too soon to be the answer to that.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossed {
    /// The request that was answered late.
    pub(super) request: u64,
    pub(super) response: u64,
}

/// Holds what was seen of a bus.
#[derive(Clone, Debug)]
pub(super) struct Bus {
    pub(super) profiles: Arc<Profiles>,
    pub(super) shapes: Arc<Shapes>,
    /// One for each address; a copy of the bus shares those that it has not seen change.
    units: Vec<Arc<Unit>>,
    /// Good frames by the address in them.
    pub(super) frames_at: Vec<u64>,
    /// The latest requests, in order.
    pub(super) requests: VecDeque<Asked>,
    /// The latest runs and holes that may hide a request, by the id of the run or of the frame after.
    hidden: VecDeque<u64>,
    /// The latest damaged runs of any kind.
    damage: VecDeque<u64>,
    tallies: BTreeMap<(u8, u8, u16), Tally>,
    /// The latest change of address.
    pub(super) moved: Option<Moved>,
    /// The latest answer that crossed a repetition of its request.
    pub(super) crossed: Option<Crossed>,
    /// Whether a device has answered that one of the profiles fits, or somebody said that there is one.
    pub(super) has_family: bool,
    /// Id after the last frame or run.
    pub(super) next_id: u64,
}

impl Bus {
    pub(super) fn new(profiles: Arc<Profiles>) -> Self {
        Bus {
            shapes: Arc::new(profiles.shapes()),
            profiles,
            units: vec![Arc::default(); 256],
            frames_at: vec![0; 256],
            requests: VecDeque::new(),
            hidden: VecDeque::new(),
            damage: VecDeque::new(),
            tallies: BTreeMap::new(),
            moved: None,
            crossed: None,
            has_family: false,
            next_id: 0,
        }
    }

    /// Returns what was seen of a unit.
    pub(super) fn unit(&self, address: u8) -> &Unit {
        &self.units[usize::from(address)] // one for each address
    }

    pub(super) fn unit_mut(&mut self, address: u8) -> &mut Unit {
        Arc::make_mut(&mut self.units[usize::from(address)]) // one for each address
    }

    /// Counts the units that have answered at an address of their own, where they still are.
    pub(super) fn present(&self) -> usize {
        self.units[1..=247].iter().filter(|unit| unit.answered > 0).count()
    }

    /// Tells how often a kind of request was answered.
    pub(super) fn tally(&self, t: &Transaction<'_>) -> Tally {
        self.tallies.get(&key(t)).copied().unwrap_or_default()
    }

    /// Tells whether damage or a hole after one frame and before another may hide a request.
    pub(super) fn may_hide(&self, after: u64, before: u64) -> bool {
        // What has been forgotten may have been there.
        let forgotten = self.hidden.len() == MOST_DAMAGE && self.hidden.front().is_some_and(|id| *id > after);
        forgotten || self.hidden.iter().any(|id| (after..=before).contains(id))
    }

    /// Tells whether a damaged run lies between two frames.
    pub(super) fn is_damaged_between(&self, after: u64, before: u64) -> bool {
        self.damage.iter().any(|damage| (after..=before).contains(damage))
    }

    /// Tells whether a damaged run follows a request, with one item between at most.
    pub(super) fn is_damaged_after(&self, id: u64) -> bool {
        self.damage.iter().any(|damage| *damage > id && *damage <= id.saturating_add(2))
    }

    /// Tells whether anything good came between two requests.
    pub(super) fn requests_between(&self, after: u64, before: u64) -> bool {
        self.requests.iter().any(|asked| asked.id > after && asked.id < before)
    }

    /// Returns commands of all profiles, with their profiles.
    pub(super) fn commands(&self) -> impl Iterator<Item = (&Profile, &Command)> {
        self.profiles
            .iter()
            .flat_map(|profile| profile.commands.iter().map(move |command| (profile, command)))
    }

    /// Tells whether the profiles declare a form for a request.
    pub(super) fn declares(&self, function: u8, register: u16, form: Form) -> bool {
        self.shapes.declares(function, register, form)
    }

    pub(super) fn frame(&mut self, frame: &Frame<'_>) {
        self.next_id = frame.place.id + 1;
        if let Some(count) = self.frames_at.get_mut(usize::from(frame.address())) {
            *count += 1;
        }
        if frame.role == Role::Request && !frame.echo {
            let mut bytes = Vec::new();
            if self.requests.len() == MOST_REQUESTS
                && let Some(oldest) = self.requests.pop_front()
            {
                bytes = oldest.bytes;
            }
            bytes.clear();
            bytes.extend_from_slice(frame.place.bytes);
            self.requests.push_back(Asked { id: frame.place.id, time: frame.place.time, bytes });
        }
    }

    pub(super) fn damaged(&mut self, damaged: &Damaged<'_>) {
        let id = damaged.place.id;
        self.next_id = id + 1;
        push(&mut self.damage, id);
        // What comes right behind a request is its answer, and hides no other request.
        let is_soon = damaged.place.gap_before.is_some_and(|gap| gap.midpoint() < SOON_NS);
        let is_answer = damaged.role == Role::Response && is_soon;
        if damaged.reason != Reason::Stray && !is_answer {
            push(&mut self.hidden, id);
        }
    }

    pub(super) fn lost(&mut self) {
        push(&mut self.hidden, self.next_id);
    }

    /// Looks whether a device that one of the profiles fits is on the bus: others are not held against manuals.
    pub(super) fn look_for_family(&mut self, t: &Transaction<'_>, meaning: &Meaning<'_>) -> bool {
        let is_answered = matches!(t.outcome, Outcome::Answered | Outcome::Late);
        self.has_family = self.has_family
            || meaning.profile().is_some()
            || is_answered && meaning.candidates().next().is_some();
        self.has_family
    }

    /// Remembers a transaction that was judged.
    pub(super) fn transaction(&mut self, t: &Transaction<'_>, meaning: &Meaning<'_>) {
        if let (Outcome::Unsolicited, Some(response)) = (t.outcome, &t.response) {
            push(&mut self.damage, response.id);
        }
        let Some(request) = t.request.filter(|side| !side.damaged) else { return };
        let is_answered = matches!(t.outcome, Outcome::Answered | Outcome::Late | Outcome::Exception);
        self.count(t, is_answered);
        let mark = Mark::of(&request);
        let answer = t.response.filter(|side| !side.damaged).map(|side| Mark::of(&side));
        let kind = kind(meaning);
        let unit = self.unit_mut(t.address);
        if is_answered {
            unit.answered += 1;
            unit.silent = 0;
            unit.last_answer = answer;
            if t.outcome == Outcome::Answered {
                let latency = t.latency.map_or(0, |latency| latency.least);
                unit.slowest_ns = unit.slowest_ns.max(latency);
            }
        } else if t.outcome == Outcome::NoResponse {
            unit.silent += 1;
        }
        if t.outcome == Outcome::Answered && !unit.starts_itself {
            unit.starts_itself = starts_itself(t, meaning, kind);
        }
        // A damaged acknowledgement is one all the same.
        if matches!(t.outcome, Outcome::Answered | Outcome::Late | Outcome::Damaged) {
            let mark = answer.unwrap_or(mark);
            match kind {
                Kind::Start => unit.start = Some(mark),
                Kind::Stop => unit.stop = Some(mark),
                Kind::Brush => unit.brush = Some(mark),
                _ => {}
            }
        }
        if kind == Kind::Address && is_answered {
            self.moves(t, meaning);
        }
    }

    fn count(&mut self, t: &Transaction<'_>, is_answered: bool) {
        let key = key(t);
        if self.tallies.len() >= MOST_KEYS && !self.tallies.contains_key(&key) {
            return;
        }
        let tally = self.tallies.entry(key).or_default();
        match (is_answered, t.outcome) {
            (true, _) => tally.answered = tally.answered.saturating_add(1),
            (false, Outcome::NoResponse) => tally.unanswered = tally.unanswered.saturating_add(1),
            _ => {}
        }
    }

    /// Takes what was seen of a unit along to its new address.
    fn moves(&mut self, t: &Transaction<'_>, meaning: &Meaning<'_>) {
        let Some(to) = super::setting::new_address(meaning).filter(|to| *to != t.address) else { return };
        let Some(mark) = t.response.map(|side| Mark::of(&side)) else { return };
        let unit = std::mem::take(self.unit_mut(t.address));
        *self.unit_mut(to) = unit;
        self.moved = Some(Moved { from: t.address, to, mark });
    }
}

/// Names a kind of request; one without a register counts as 0.
fn key(t: &Transaction<'_>) -> (u8, u8, u16) {
    (t.address, t.function.0, t.start_register.unwrap_or(0))
}

fn push(ids: &mut VecDeque<u64>, id: u64) {
    if ids.len() == MOST_DAMAGE {
        ids.pop_front();
    }
    ids.push_back(id);
}

/// Tells whether an answer shows a device that measures without a start.
fn starts_itself(t: &Transaction<'_>, meaning: &Meaning<'_>, kind: Kind) -> bool {
    let Some(measuring) = meaning.profile().map(|profile| profile.measuring) else { return false };
    if kind == Kind::Measurement {
        return t.quantity.is_some() && measuring.starts_itself_quantity == t.quantity;
    }
    let Some(from) = measuring.starts_itself_software.filter(|_| kind == Kind::Other) else { return false };
    let mut fields = meaning.fields().filter(|field| field.name == SOFTWARE_VERSION);
    let text = fields.next().map(|field| field.value.to_string());
    let major = text.as_deref().and_then(|text| text.split('.').next()?.parse::<u8>().ok());
    major.is_some_and(|major| major >= from)
}

/// Returns what a request is for, as far as the profiles that fit agree.
pub(super) fn kind(meaning: &Meaning<'_>) -> Kind {
    meaning.agreed_command().map_or(Kind::Other, |command| command.kind)
}
