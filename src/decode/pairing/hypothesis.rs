//! Who sent each frame, decided with hindsight: a few hypotheses, a fixed lag.
//!
//! Most frames have one possible role. Functions 5, 6, 8 and 22 answer with the request's own bytes, an adapter
//! may echo, a master may repeat: then what follows decides.

use crate::decode::framer::score;
use crate::decode::framer::{Experience, Fit, Outstanding};
use crate::decode::pairing::item::{Asked, Item, What};
use crate::time::Timestamp;

/// Hypotheses kept.
const KEPT: usize = 16;
/// Unanswered requests that a late response may still answer.
const EARLIER: usize = 4;
/// A response to a request that was given up, against one to the outstanding request.
const LATE: f32 = -6.0;

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

/// A request with its id.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Open {
    id: u64,
    request: Outstanding,
}

/// Is where a hypothesis has got to.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct State {
    outstanding: Option<Open>,
    earlier: [Option<Open>; EARLIER],
    /// Bytes of damaged runs since the last frame.
    junk: u16,
    /// Whether those were as long as the frame before asks its answer to be, for damaged requests.
    damaged_length: u64,
}

/// Is one way to read an item from a state.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    pub score: f32,
    pub choice: Choice,
    pub next: State,
}

/// Holds what readings depend on besides the state.
pub struct View<'a> {
    pub item: &'a Item,
    pub bytes: &'a [u8],
    pub experience: &'a Experience,
}

impl State {
    /// Lists the readings of an item; a frame has at least one.
    pub fn readings(&self, view: &View<'_>, mut offer: impl FnMut(Reading)) {
        match &view.item.what {
            What::Run(_) => {
                offer(Reading { score: 0.0, choice: Choice::Run, next: self.after_run(view.item.length) })
            }
            What::Frame { request, response, .. } => {
                if let Some(asked) = request {
                    self.as_request(asked, view, &mut offer);
                }
                if let Some(candidate) = response {
                    self.as_response(*candidate, view, &mut offer);
                }
            }
        }
    }

    fn after_run(&self, length: u64) -> State {
        let junk = self.junk.saturating_add(u16::try_from(length).unwrap_or(u16::MAX));
        State { junk, damaged_length: length, ..*self }
    }

    fn since(&self, view: &View<'_>) -> Option<i64> {
        let begin = view.item.time?.start.midpoint();
        Some(begin - self.outstanding?.request.end?)
    }

    fn as_request(&self, asked: &Asked, view: &View<'_>, offer: &mut impl FnMut(Reading)) {
        let base = score::frame(asked.candidate, view.bytes, view.experience);
        let outstanding = self.outstanding.as_ref().map(|open| &open.request);
        let since = self.since(view);
        let mut score = score::request(outstanding, self.junk, view.bytes, since);
        if let (Some(open), Some(since)) = (outstanding, since)
            && self.junk < 3
            && open.same_bytes(view.bytes)
        {
            // A master repeats after its time-out, not sooner.
            let limit = view.experience.limit_ns(open.address);
            score = if since > limit / 10 * 8 { -2.0 } else { -4.0 };
        }
        let open = Open { id: view.item.id, request: asked.outstanding };
        let mut next = State { outstanding: Some(open), junk: 0, damaged_length: 0, ..*self };
        if let Some(given_up) = self.outstanding.filter(|open| !open.request.is_broadcast()) {
            next.earlier.rotate_right(1);
            next.earlier[0] = Some(given_up);
        }
        offer(Reading { score: base + score, choice: Choice::Request, next });
        if let Some(score) = score::echo(outstanding, self.junk, view.bytes, since, view.experience) {
            let echoed = |open: Open| Open { request: open.request.after_echo(), ..open };
            let next = State { outstanding: self.outstanding.map(echoed), ..*self };
            offer(Reading { score: base + score, choice: Choice::Echo, next });
        }
    }

    fn as_response(
        &self,
        candidate: crate::decode::candidate::Candidate,
        view: &View<'_>,
        offer: &mut impl FnMut(Reading),
    ) {
        let base = score::frame(candidate, view.bytes, view.experience);
        let outstanding = self.outstanding.as_ref().map(|open| &open.request);
        let since = self.since(view);
        let (score, fit) =
            score::response(outstanding, self.junk, candidate, view.bytes, since, view.experience);
        let (choice, answered) = match (fit, self.outstanding) {
            (Fit::Full, Some(open)) => (Choice::Response(open.id), None),
            (Fit::Function, Some(open)) => (Choice::Mismatch(open.id), None),
            _ => (Choice::Unsolicited, self.outstanding),
        };
        let repaired = if fit == Fit::None { self.damaged_request_bonus(view) } else { 0.0 };
        let next = State { outstanding: answered, junk: 0, damaged_length: 0, ..*self };
        offer(Reading { score: base + score + repaired, choice, next });
        if fit != Fit::Full {
            self.as_late(candidate, view, base, offer);
        }
    }

    /// A response that repeats its request, after junk of its own length: the request was damaged.
    fn damaged_request_bonus(&self, view: &View<'_>) -> f32 {
        let repeats = matches!(view.bytes[1], 5 | 6 | 8 | 22);
        let alike = self.damaged_length.abs_diff(view.item.length) <= 1;
        if repeats && alike && self.junk > 0 && self.outstanding.is_none() { 1.0 } else { 0.0 }
    }

    /// The answer to a request that the master has given up.
    fn as_late(
        &self,
        candidate: crate::decode::candidate::Candidate,
        view: &View<'_>,
        base: f32,
        offer: &mut impl FnMut(Reading),
    ) {
        for (index, open) in self.earlier.iter().enumerate() {
            let Some(open) = open else { continue };
            if open.request.fit(candidate, view.bytes) == Fit::Full {
                let mut next = State { junk: 0, damaged_length: 0, ..*self };
                next.earlier[index] = None;
                let score = base + score::RESPONSE_FITS + LATE;
                offer(Reading { score, choice: Choice::Response(open.id), next });
                return;
            }
        }
    }

    /// Forgets requests that were decided otherwise.
    pub fn forget(&mut self, closed: impl Fn(u64) -> bool) {
        for open in &mut self.earlier {
            *open = open.filter(|open| !closed(open.id));
        }
        // A broadcast is closed at once, but may still be echoed.
        self.outstanding = self.outstanding.filter(|open| open.request.is_broadcast() || !closed(open.id));
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
}

impl Beam {
    pub fn new() -> Self {
        Beam { hypotheses: vec![Hypothesis::default()], spare: Vec::new() }
    }

    /// Reads an item; returns its choice at once when nothing is open and nothing else comes near.
    pub fn push(&mut self, view: &View<'_>) -> Option<Choice> {
        if let [only] = self.hypotheses.as_mut_slice()
            && only.choices.is_empty()
        {
            let (mut best, mut rival) = (None::<Reading>, f32::MIN);
            only.state.readings(view, |reading| match &best {
                Some(known) if known.score >= reading.score => rival = rival.max(reading.score),
                Some(known) => {
                    rival = rival.max(known.score);
                    best = Some(reading);
                }
                None => best = Some(reading),
            });
            if let Some(best) = best
                && rival < best.score - score::MARGIN
            {
                only.state = best.next;
                only.score = 0.0;
                return Some(best.choice);
            }
        }
        self.branch(view);
        None
    }

    fn branch(&mut self, view: &View<'_>) {
        let mut grown = std::mem::take(&mut self.spare);
        for hypothesis in &self.hypotheses {
            hypothesis.state.readings(view, |reading| {
                let score = hypothesis.score + reading.score;
                let rival = grown.iter_mut().find(|g: &&mut Hypothesis| g.state == reading.next);
                match rival {
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

    /// Forgets requests that are closed.
    pub fn forget(&mut self, closed: impl Fn(u64) -> bool + Copy) {
        for hypothesis in &mut self.hypotheses {
            hypothesis.state.forget(closed);
        }
    }
}

/// Says when an undecided item is decided as it stands.
pub fn lag_ends(item: &Item) -> Timestamp {
    item.at + 1_500_000_000
}
