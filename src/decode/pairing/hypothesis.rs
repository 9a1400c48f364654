//! Who sent each frame, decided with hindsight: a few hypotheses, a fixed lag.
//!
//! Most frames have one possible role. Functions 5, 6, 8 and 22 answer with the request's own bytes, an adapter
//! may echo, a master may repeat: then what follows decides.

use crate::decode::candidate::Candidate;
use crate::decode::framer::score;
use crate::decode::framer::{Asked, Experience, Fit, Outstanding, Readings};
use crate::decode::pairing::item::Item;
use crate::time::{SECOND, Timestamp};

/// Nanoseconds after which an undecided item is decided as it stands.
pub const LAG_NS: i64 = 3 * SECOND / 2;
/// Hypotheses kept.
const KEPT: usize = 16;
/// Given up requests that a late response may still answer, the latest first.
const EARLIER: usize = 4;
/// A response to a request that was given up, against one to the outstanding request.
const LATE: f32 = -5.0;

/// Says what a frame is, and by its id what it answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// A request.
    Request,
    /// The echo of the request before.
    Echo,
    /// The response to the request with this id.
    Response(u64),
    /// A response that fits the function of the request with this id, but not what was asked.
    Mismatch(u64),
    /// A response nobody asked for.
    Unsolicited,
    /// A damaged run.
    Run,
}

/// Is where a hypothesis has got to.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
struct State {
    /// Id of the request that waits for its answer.
    outstanding: Option<u64>,
    /// Whether its echo has come.
    echoed: bool,
    /// Bytes of damaged runs since the last frame.
    junk: u16,
    /// Bytes of the last of them.
    damaged_length: u32,
    /// The request answered last, and its unit: a unit answers in order, so its earlier requests are past.
    answered: Option<(u8, u64)>,
}

/// Is one way to read an item from a state.
#[derive(Clone, Copy, Debug)]
struct Reading {
    score: f32,
    choice: Choice,
    next: State,
}

/// Keeps what an answer must match, of the requests that may still be answered; few, in order.
#[derive(Clone, Debug, Default)]
struct Requests(Vec<(u64, Outstanding)>);

impl Requests {
    fn get(&self, id: u64) -> Option<&Outstanding> {
        self.0.iter().rev().find(|(known, _)| *known == id).map(|(_, request)| request)
    }
}

/// Holds what readings depend on besides the state.
pub struct View<'a> {
    /// The frame or run.
    pub item: &'a Item,
    /// How it can be read; not at all if it is a run.
    pub readings: &'a Readings,
    /// Its bytes.
    pub bytes: &'a [u8],
    /// What the bus has taught.
    pub experience: &'a Experience,
}

/// Reads an item from a state.
struct Reader<'a> {
    view: &'a View<'a>,
    requests: &'a Requests,
    state: State,
    outstanding: Option<Outstanding>,
    /// Nanoseconds from the outstanding request's end to the item's start.
    since: Option<i64>,
}

impl<'a> Reader<'a> {
    fn new(state: State, requests: &'a Requests, view: &'a View<'a>) -> Self {
        let known = state.outstanding.and_then(|id| requests.get(id)).copied();
        let outstanding = if state.echoed { known.map(Outstanding::after_echo) } else { known };
        let begin = view.item.time.map(|time| time.start.midpoint());
        let since = begin.zip(outstanding.and_then(|o| o.end)).map(|(begin, end)| begin - end);
        Reader { view, requests, state, outstanding, since }
    }

    /// Lists the readings; a frame has at least one.
    fn read(&self, mut offer: impl FnMut(Reading)) {
        let Readings { request, response } = self.view.readings;
        if request.is_none() && response.is_none() {
            let length = self.view.item.length;
            let junk = self.state.junk.saturating_add(u16::try_from(length).unwrap_or(u16::MAX));
            let next = State { junk, damaged_length: length, ..self.state };
            return offer(Reading { score: 0.0, choice: Choice::Run, next });
        }
        if let Some(asked) = request {
            self.as_request(asked, &mut offer);
        }
        if let Some(candidate) = response {
            self.as_response(*candidate, &mut offer);
        }
    }

    /// Returns the one way to read a frame, where there is no other to weigh it against.
    fn only(&self) -> Option<(Choice, State)> {
        match (&self.view.readings.request, self.view.readings.response) {
            (Some(_), None) if self.outstanding.as_ref().is_none_or(|o| !o.same_bytes(self.view.bytes)) => {
                Some((Choice::Request, self.after_request()))
            }
            (None, Some(candidate)) => {
                let (outstanding, id) = (self.outstanding.as_ref()?, self.state.outstanding?);
                let full = outstanding.fit(candidate, self.view.bytes) == Fit::Full;
                let only = full && self.given_up(candidate).is_none();
                only.then(|| (Choice::Response(id), self.after_answer(id)))
            }
            _ => None,
        }
    }

    fn as_request(&self, asked: &Asked, offer: &mut impl FnMut(Reading)) {
        let (view, junk) = (self.view, self.state.junk);
        let base = score::frame(asked.candidate, view.bytes, view.experience);
        let outstanding = self.outstanding.as_ref();
        let mut score = score::request(outstanding, junk, view.bytes, self.since);
        if let (Some(open), Some(since)) = (outstanding, self.since)
            && junk < 3
            && !open.is_broadcast()
            && open.same_bytes(view.bytes)
        {
            // A master repeats after its time-out, not sooner.
            let limit = view.experience.limit_ns(open.address);
            score = if since > limit / 10 * 8 { -2.0 } else { -4.0 };
        }
        offer(Reading { score: base + score, choice: Choice::Request, next: self.after_request() });
        if let Some(score) = score::echo(outstanding, junk, view.bytes, self.since, view.experience) {
            let next = State { echoed: true, ..self.state };
            offer(Reading { score: base + score, choice: Choice::Echo, next });
        }
    }

    fn as_response(&self, candidate: Candidate, offer: &mut impl FnMut(Reading)) {
        let (view, junk) = (self.view, self.state.junk);
        let base = score::frame(candidate, view.bytes, view.experience);
        let outstanding = self.outstanding.as_ref();
        let (score, fit) =
            score::response(outstanding, junk, candidate, view.bytes, self.since, view.experience);
        let still = State { junk: 0, damaged_length: 0, ..self.state };
        let (choice, next) = match (fit, self.state.outstanding) {
            (Fit::Full, Some(id)) => (Choice::Response(id), self.after_answer(id)),
            (Fit::Function, Some(id)) => (Choice::Mismatch(id), self.after_answer(id)),
            _ => (Choice::Unsolicited, still),
        };
        let repaired = if fit == Fit::None { self.damaged_request_bonus() } else { 0.0 };
        offer(Reading { score: base + score + repaired, choice, next });
        if let Some(id) = self.given_up(candidate) {
            let score = base + score::RESPONSE_FITS + LATE;
            let next = State { answered: Some((view.bytes[0], id)), ..still };
            offer(Reading { score, choice: Choice::Response(id), next });
        }
    }

    fn after_request(&self) -> State {
        State { outstanding: Some(self.view.item.id), answered: self.state.answered, ..State::default() }
    }

    fn after_answer(&self, id: u64) -> State {
        State { answered: Some((self.view.bytes[0], id)), ..State::default() }
    }

    /// A response that repeats its request, after junk of its own length: the request was damaged.
    fn damaged_request_bonus(&self) -> f32 {
        let repeats = matches!(self.view.bytes[1], 5 | 6 | 8 | 22);
        let alike = self.state.damaged_length.abs_diff(self.view.item.length) <= 1;
        if repeats && alike && self.state.junk > 0 && self.outstanding.is_none() { 1.0 } else { 0.0 }
    }

    /// Finds the latest request that the master has given up and that this response answers.
    fn given_up(&self, candidate: Candidate) -> Option<u64> {
        let past = |id: u64| {
            let same_unit = |(unit, answered): (u8, u64)| unit == self.view.bytes[0] && id <= answered;
            self.state.answered.is_some_and(same_unit)
        };
        let waits = |id: u64| Some(id) != self.state.outstanding && !past(id);
        let others = self.requests.0.iter().rev().filter(|(id, _)| waits(*id));
        let fits = |request: &Outstanding| request.fit(candidate, self.view.bytes) == Fit::Full;
        others.take(EARLIER).find(|(_, request)| fits(request)).map(|(id, _)| *id)
    }
}

/// Is a state with the choices for the items that are not decided yet.
#[derive(Clone, Debug, Default)]
struct Hypothesis {
    score: f32,
    state: State,
    choices: Vec<Choice>,
}

/// Weighs hypotheses over the items that are not decided yet.
#[derive(Clone, Debug)]
pub struct Beam {
    hypotheses: Vec<Hypothesis>,
    spare: Vec<Hypothesis>,
    requests: Requests,
}

impl Default for Beam {
    fn default() -> Self {
        Beam { hypotheses: vec![Hypothesis::default()], spare: Vec::new(), requests: Requests::default() }
    }
}

impl Beam {
    /// Reads an item; returns its choice at once when nothing is open and nothing else comes near.
    pub fn push(&mut self, view: &View<'_>) -> Option<Choice> {
        let choice = self.at_once(view);
        if choice.is_none() {
            self.branch(view);
        }
        if let Some(asked) = &view.readings.request
            && matches!(choice, None | Some(Choice::Request))
        {
            self.requests.0.push((view.item.id, asked.outstanding));
        }
        choice
    }

    /// Tells whether nothing is open and no request can be answered any more.
    pub fn is_idle(&self) -> bool {
        self.requests.0.is_empty() && matches!(self.hypotheses.as_slice(), [only] if only.choices.is_empty())
    }

    /// Notes the answer to a request, as reading both would while nothing is open.
    pub fn exchanged(&mut self, request: u64, address: u8) {
        if let [only] = self.hypotheses.as_mut_slice() {
            only.state = State { answered: Some((address, request)), ..State::default() };
        }
    }

    fn at_once(&mut self, view: &View<'_>) -> Option<Choice> {
        let [only] = self.hypotheses.as_mut_slice() else { return None };
        if !only.choices.is_empty() {
            return None;
        }
        let reader = Reader::new(only.state, &self.requests, view);
        if let Some((choice, next)) = reader.only() {
            only.state = next;
            return Some(choice);
        }
        let (mut best, mut rival) = (None::<Reading>, f32::MIN);
        reader.read(|reading| match &best {
            Some(known) if known.score >= reading.score => rival = rival.max(reading.score),
            Some(known) => {
                rival = rival.max(known.score);
                best = Some(reading);
            }
            None => best = Some(reading),
        });
        let best = best.filter(|best| rival < best.score - score::MARGIN)?;
        only.state = best.next;
        only.score = 0.0;
        Some(best.choice)
    }

    fn branch(&mut self, view: &View<'_>) {
        let mut grown = std::mem::take(&mut self.spare);
        for hypothesis in &self.hypotheses {
            Reader::new(hypothesis.state, &self.requests, view).read(|reading| {
                let score = hypothesis.score + reading.score;
                match grown.iter_mut().find(|g: &&mut Hypothesis| g.state == reading.next) {
                    // What comes later will tell them apart no better.
                    Some(rival) if rival.score >= score => {}
                    Some(rival) => {
                        rival.score = score;
                        rival.choices.clone_from(&hypothesis.choices);
                        rival.choices.push(reading.choice);
                    }
                    None => {
                        let mut choices = hypothesis.choices.clone();
                        choices.push(reading.choice);
                        grown.push(Hypothesis { score, state: reading.next, choices });
                    }
                }
            });
        }
        grown.sort_by(|a, b| b.score.total_cmp(&a.score));
        grown.truncate(KEPT);
        let top = grown.first().map_or(0.0, |best| best.score);
        grown.iter_mut().for_each(|hypothesis| hypothesis.score -= top);
        self.spare = std::mem::replace(&mut self.hypotheses, grown);
        self.spare.clear();
    }

    /// Returns the oldest open item's choice once all near hypotheses agree, or when `forced`.
    pub fn settle(&mut self, forced: bool) -> Option<Choice> {
        let best = self.hypotheses.first()?;
        let choice = *best.choices.first()?;
        let near = |h: &Hypothesis| h.score >= best.score - score::MARGIN;
        let agreed = self.hypotheses.iter().all(|h| !near(h) || h.choices.first() == Some(&choice));
        if !agreed && !forced {
            return None;
        }
        self.hypotheses.retain(|h| h.choices.first() == Some(&choice));
        for hypothesis in &mut self.hypotheses {
            hypothesis.choices.remove(0);
        }
        // Nothing open: only what may matter later stays.
        if self.hypotheses[0].choices.is_empty() {
            let near = self.hypotheses.iter().take_while(|h| h.score >= -score::MARGIN).count();
            self.hypotheses.truncate(near.max(1));
        }
        Some(choice)
    }

    /// Forgets requests that nothing can answer or echo any more.
    pub fn forget(&mut self, closed: impl Fn(u64) -> bool) {
        let (hypotheses, requests) = (&mut self.hypotheses, &mut self.requests.0);
        if let ([(id, request)], [only]) = (requests.as_slice(), hypotheses.as_mut_slice())
            && only.state.outstanding.is_none()
            && closed(*id)
            && !request.is_broadcast()
        {
            return requests.clear(); // nearly always: the request just answered
        }
        requests.retain(|(id, request)| {
            // A broadcast is closed at once, but may still be echoed.
            let waits = hypotheses.iter().any(|h| h.state.outstanding == Some(*id));
            !closed(*id) || waits && request.is_broadcast()
        });
        for hypothesis in hypotheses {
            let known = |id: &u64| requests.iter().any(|(known, _)| known == id);
            hypothesis.state.outstanding = hypothesis.state.outstanding.filter(known);
        }
    }
}

/// Says when an undecided item is decided as it stands.
pub fn lag_ends(item: &Item) -> Timestamp {
    item.at + LAG_NS
}
