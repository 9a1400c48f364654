//! All readings of the undecided bytes at once: a list-Viterbi lattice, kept from byte to byte.
//!
//! A node stands before each undecided byte and after the last. An edge is a frame, with a good CRC and a
//! possible shape, or a byte of junk. A node keeps the best few readings of the bytes before it that differ in
//! what request is outstanding and whether junk precedes. Frames still unfinished count as tails.
//!
//! [`Lattice::step`] takes in one byte; [`Lattice::decided`] names the first frame once every reading within the
//! margin has it; [`Lattice::cut`] hands over a reading up to a node and moves the root there.

use std::collections::VecDeque;

use crate::decode::candidate::{Basis, Candidate, MIN_FRAME, candidates};
use crate::decode::crc;
use crate::decode::frame::{Boundary, MAX_FRAME};
use crate::decode::framer::node::{Edge, Entry, FrameEdge, Kind, NOTHING, Node};
use crate::decode::framer::outstanding::{Fit, Outstanding};
use crate::decode::framer::score;
use crate::decode::framer::weigh::{Context, Start, readings, tail};

/// Is the best reading of all bytes so far.
#[derive(Clone, Copy, Debug)]
struct Best {
    score: f32,
    node: u64,
    slot: usize,
    /// Bytes that its unfinished frame still wants, as far as known.
    missing: u16,
}

/// Holds the nodes of the undecided bytes.
#[derive(Clone, Debug)]
pub struct Lattice {
    /// Offset of the root node.
    root: u64,
    nodes: VecDeque<Node>,
    starts: Vec<Start>,
    requests: Vec<Outstanding>,
    /// Whether any reading may have a frame after the root: without one there is nothing to decide.
    has_frame: bool,
}

impl Lattice {
    /// Makes a lattice whose root stands before the first byte.
    pub fn new() -> Self {
        let mut root = Node::EMPTY;
        root.offer(Entry { alive: true, ..Node::EMPTY.entries[0] });
        let nodes = VecDeque::from([root]);
        Lattice { root: 0, nodes, starts: Vec::new(), requests: Vec::new(), has_frame: false }
    }

    /// Returns the offset of the root: everything before is decided.
    pub fn root(&self) -> u64 {
        self.root
    }

    /// Returns the offset up to which bytes were taken in.
    pub fn end(&self) -> u64 {
        self.root + self.nodes.len() as u64 - 1
    }

    fn node(&self, offset: u64) -> &Node {
        &self.nodes[(offset - self.root) as usize] // only called from the root to the end
    }

    fn outstanding(&self, index: u16) -> Option<&Outstanding> {
        self.requests.get(usize::from(index))
    }

    /// Returns what is outstanding when the root is all there is and only one reading leads there,
    /// with no junk just before.
    pub fn settled(&self) -> Option<Option<&Outstanding>> {
        let mut alive = self.nodes.front()?.alive();
        match (self.nodes.len(), alive.next(), alive.next()) {
            (1, Some((_, entry)), None) if entry.junk == 0 => Some(self.outstanding(entry.outstanding)),
            _ => None,
        }
    }

    /// Returns the request that is outstanding at the root in the best reading.
    pub fn root_outstanding(&self) -> Option<&Outstanding> {
        let best = self.nodes.front()?.alive().max_by(|a, b| a.1.score.total_cmp(&b.1.score))?;
        self.outstanding(best.1.outstanding)
    }

    /// Moves the root past a frame that is beyond doubt; only while [`Lattice::settled`].
    pub fn skip(&mut self, end: u64, outstanding: Option<Outstanding>) {
        self.root = end;
        self.requests.clear();
        self.requests.extend(outstanding);
        self.starts.clear();
        let outstanding = if self.requests.is_empty() { NOTHING } else { 0 };
        self.has_frame = false;
        let root = &mut self.nodes[0]; // there always is a root
        root.entries[0] = Entry { alive: true, outstanding, ..Node::EMPTY.entries[0] };
        root.len = 1;
    }

    /// Takes in the next byte.
    pub fn step(&mut self, context: &Context<'_>) {
        let before = self.end();
        let end = before + 1;
        self.nodes.push_back(Node::EMPTY);
        self.junk_edge(before);
        self.starts.push(Start {
            offset: before,
            candidates: candidates(&[], context.shapes),
            open: 0,
            register: crc::Register::NEW,
        });
        for index in 0..self.starts.len() {
            let mut start = self.starts[index];
            self.advance(&mut start, end, context);
            self.starts[index] = start;
        }
        self.starts.retain(|start| start.open != 0 || start.candidates.undecided);
    }

    fn junk_edge(&mut self, before: u64) {
        let node = *self.node(before);
        let last = self.nodes.len() - 1;
        for (slot, entry) in node.alive() {
            let open = if entry.junk == 0 { score::JUNK_OPEN } else { 0.0 };
            self.nodes[last].offer(Entry {
                score: entry.score + open + score::JUNK_BYTE,
                junk: entry.junk.saturating_add(1),
                edge: Edge::Junk,
                from: slot as u8,
                ..*entry
            });
        }
    }

    /// Follows what may have begun at `start` to the byte before `end`.
    fn advance(&mut self, start: &mut Start, end: u64, context: &Context<'_>) {
        let bytes = context.store.slice(start.offset, end);
        if start.candidates.undecided {
            start.candidates = candidates(bytes, context.shapes);
            start.open = start.candidates.as_slice().iter().enumerate().fold(0, |mask, (i, candidate)| {
                let known = candidate.basis != Basis::AnyLength
                    || self.may_begin_unknown(start.offset, bytes, context);
                let ahead = candidate.length == 0 || usize::from(candidate.length) >= bytes.len();
                mask | (u8::from(known && ahead) << i)
            });
            start.register = crc::Register::NEW.after(bytes);
        } else if start.open().any(|c| c.basis == Basis::AnyLength) {
            start.register = start.register.after(&bytes[bytes.len() - 1..]);
        }
        let mut good = None;
        for (index, candidate) in start.candidates.as_slice().iter().enumerate() {
            if start.open & (1 << index) == 0 {
                continue;
            }
            let ends = if candidate.basis == Basis::AnyLength {
                bytes.len() >= MIN_FRAME && start.register.is_zero()
            } else {
                usize::from(candidate.length) == bytes.len()
            };
            if ends && *good.get_or_insert_with(|| crc::is_good(bytes)) {
                self.frame_edges(start.offset, *candidate, bytes, context);
            }
            if ends && candidate.basis != Basis::AnyLength || bytes.len() >= MAX_FRAME {
                start.open &= !(1 << index);
            }
        }
    }

    /// Tells whether a frame of an unknown function may begin: a known unit, and room for a silence.
    fn may_begin_unknown(&self, offset: u64, bytes: &[u8], context: &Context<'_>) -> bool {
        context.experience.knows_unit(bytes[0]) && context.stamper.gap_possible(offset, context.gap_ns)
    }

    /// Adds the frame from `offset` to the last node, as read from each reading that leads to its start.
    fn frame_edges(&mut self, offset: u64, candidate: Candidate, bytes: &[u8], context: &Context<'_>) {
        let end = offset + bytes.len() as u64;
        let any_length = candidate.basis == Basis::AnyLength;
        if any_length && !context.stamper.gap_possible(end, context.gap_ns) {
            return;
        }
        let mut base = score::frame(candidate, bytes, context.experience);
        if any_length && crc::is_good(&bytes[..bytes.len() - 1]) {
            base += score::ZERO_EXTENSION; // more likely a frame with a stray 00 behind it
        }
        let begin = context.begin(offset);
        let node = *self.node(offset);
        for (slot, entry) in node.alive() {
            if any_length && entry.junk > 0 && !context.experience.trusts_function(bytes[1]) {
                continue;
            }
            let outstanding = self.outstanding(entry.outstanding).copied();
            let readings = readings(outstanding.as_ref(), entry.junk, candidate, bytes, begin, context);
            for (kind, reading) in readings.into_iter().flatten() {
                let edge = FrameEdge {
                    offset,
                    length: bytes.len() as u16,
                    kind,
                    boundary: if any_length { Boundary::Crc } else { Boundary::Length },
                    score: base + reading,
                };
                let outstanding = match kind {
                    Kind::Request => {
                        let end = context.end(end - 1);
                        self.request_index(Outstanding::new(offset, bytes, end, context.shapes))
                    }
                    Kind::Echo => match outstanding {
                        Some(outstanding) => self.request_index(outstanding.after_echo()),
                        None => NOTHING,
                    },
                    Kind::Response(Fit::None) => entry.outstanding,
                    Kind::Response(_) => NOTHING,
                };
                let first = if entry.first.0 == entry.first.1 { (offset, end) } else { entry.first };
                let last = self.nodes.len() - 1;
                self.has_frame = true;
                self.nodes[last].offer(Entry {
                    score: entry.score + edge.score,
                    outstanding,
                    junk: 0,
                    edge: Edge::Frame(edge),
                    from: slot as u8,
                    first,
                    alive: true,
                });
            }
        }
    }

    /// Returns the index of a request, adding it if it is new.
    fn request_index(&mut self, request: Outstanding) -> u16 {
        let same = |known: &Outstanding| (known.offset, known.echoed) == (request.offset, request.echoed);
        if let Some(index) = self.requests.iter().position(same) {
            return index as u16;
        }
        self.requests.push(request);
        (self.requests.len() - 1) as u16
    }

    /// Calls `visit` with the score, node, slot and missing bytes of every reading of all bytes.
    fn terminals(&self, context: &Context<'_>, mut visit: impl FnMut(&Entry, Best)) {
        let end = self.end();
        for (slot, entry) in self.node(end).alive() {
            visit(entry, Best { score: entry.score, node: end, slot, missing: 0 });
        }
        for start in &self.starts {
            let bytes = context.store.slice(start.offset, end);
            let begin = context.begin(start.offset);
            for (slot, entry) in self.node(start.offset).alive() {
                let mut best = Best { score: f32::MIN, node: start.offset, slot, missing: 0 };
                if bytes.len() == 1 {
                    best.score = entry.score + score::LONE_BYTE;
                    visit(entry, best);
                    continue;
                }
                let outstanding = self.outstanding(entry.outstanding);
                for candidate in start.open() {
                    let tail = tail(outstanding, entry.junk, candidate, start, bytes, begin, context);
                    if entry.score + tail > best.score {
                        best.score = entry.score + tail;
                        best.missing = (candidate.length as usize).saturating_sub(bytes.len()) as u16;
                    }
                }
                if best.score > f32::MIN {
                    visit(entry, best);
                }
            }
        }
    }

    fn best(&self, context: &Context<'_>) -> Option<(Best, (u64, u64))> {
        let mut best: Option<(Best, (u64, u64))> = None;
        self.terminals(context, |entry, terminal| {
            if best.is_none_or(|(best, _)| terminal.score > best.score) {
                best = Some((terminal, entry.first));
            }
        });
        best
    }

    /// Returns the bytes that the best reading still waits for.
    pub fn missing(&self, context: &Context<'_>) -> u16 {
        self.best(context).map_or(0, |(best, _)| best.missing)
    }

    /// Returns the end of the first frame, once all readings within the margin agree on it.
    pub fn decided(&self, context: &Context<'_>) -> Option<u64> {
        if !self.has_frame {
            return None; // the common case while bytes trickle in
        }
        let (best, first) = self.best(context)?;
        if first.0 == first.1 {
            return None;
        }
        let mut agreed = true;
        self.terminals(context, |entry, terminal| {
            agreed &= terminal.score < best.score - score::MARGIN || entry.first == first;
        });
        agreed.then_some(first.1)
    }

    /// Hands over the best reading up to the node at `to`, and moves the root there.
    ///
    /// Readings that do not go through that node by the same first frame are dropped; when `to` ends no first
    /// frame, only the best reading's own way through it stays.
    pub fn cut(&mut self, to: u64, context: &Context<'_>, mut hand_over: impl FnMut(Handed)) {
        let Some((node, slot)) = self.best_at(to, context) else { return };
        let mut path = Vec::new();
        let (mut at, mut from) = (node, slot);
        while at > self.root {
            let entry = self.node(at).entries[from];
            let start = match entry.edge {
                Edge::Frame(edge) => edge.offset,
                Edge::Junk => at - 1,
                Edge::Root => break, // only the root node has root entries
            };
            path.push((start, entry.edge));
            (at, from) = (start, usize::from(entry.from));
        }
        for (start, edge) in path.into_iter().rev() {
            hand_over(match edge {
                Edge::Frame(edge) => Handed::Frame(edge),
                _ => Handed::Junk(start),
            });
        }
        self.reroot(node, slot);
    }

    /// Finds the node and slot of the best reading at `to`, or at the last node before it on the best reading's way.
    fn best_at(&self, to: u64, context: &Context<'_>) -> Option<(u64, usize)> {
        if to == self.end() {
            let (slot, _) = self.node(to).alive().max_by(|a, b| a.1.score.total_cmp(&b.1.score))?;
            return Some((to, slot));
        }
        let (best, _) = self.best(context)?;
        let (mut at, mut slot) = (best.node, best.slot);
        while at > to {
            let entry = &self.node(at).entries[slot];
            at = match entry.edge {
                Edge::Frame(edge) => edge.offset,
                Edge::Junk => at - 1,
                Edge::Root => return None,
            };
            slot = usize::from(entry.from);
        }
        Some((at, slot))
    }

    /// Makes the node at `to` the root: `slot` and the readings that share its last frame stay.
    fn reroot(&mut self, to: u64, slot: usize) {
        let kept = self.node(to).entries[slot];
        self.nodes.drain(..(to - self.root) as usize);
        self.root = to;
        self.starts.retain(|start| start.offset >= to);
        let same_frame = |entry: &Entry| match (entry.edge, kept.edge) {
            (Edge::Frame(a), Edge::Frame(b)) => entry.first == kept.first && a.offset == b.offset,
            _ => false,
        };
        let root = &mut self.nodes[0];
        for (index, entry) in root.entries.iter_mut().enumerate().take(usize::from(root.len)) {
            let near = entry.score > kept.score - score::MARGIN;
            entry.alive = entry.alive && near && (index == slot || same_frame(entry));
            entry.edge = Edge::Root;
            entry.first = (to, to);
        }
        self.prune(kept.score);
        self.forget_requests();
    }

    /// Drops the readings that lost their way to the root, and counts scores from there.
    fn prune(&mut self, root_score: f32) {
        let root = self.root;
        self.has_frame = false;
        for index in 0..self.nodes.len() {
            let offset = root + index as u64;
            for slot in 0..usize::from(self.nodes[index].len) {
                let mut entry = self.nodes[index].entries[slot];
                entry.score -= root_score;
                let start = match entry.edge {
                    Edge::Root => None,
                    Edge::Junk => Some(offset - 1),
                    Edge::Frame(edge) => Some(edge.offset),
                };
                if let Some(start) = start {
                    let parent = start
                        .checked_sub(root)
                        .map(|at| self.nodes[at as usize].entries[usize::from(entry.from)]);
                    entry.alive &= parent.is_some_and(|parent| parent.alive);
                    entry.first = match (parent, entry.edge) {
                        (Some(parent), _) if parent.first.0 != parent.first.1 => parent.first,
                        (_, Edge::Frame(edge)) => (edge.offset, edge.end()),
                        _ => (root, root),
                    };
                }
                self.has_frame |= entry.first.0 != entry.first.1;
                self.nodes[index].entries[slot] = entry;
            }
        }
    }

    /// Drops the requests that no reading refers to.
    fn forget_requests(&mut self) {
        let mut used = vec![NOTHING; self.requests.len()];
        let mut kept = Vec::new();
        for node in &mut self.nodes {
            for entry in node.entries[..usize::from(node.len)].iter_mut().filter(|entry| entry.alive) {
                let Some(request) = self.requests.get(usize::from(entry.outstanding)) else { continue };
                let index = &mut used[usize::from(entry.outstanding)];
                if *index == NOTHING {
                    *index = kept.len() as u16;
                    kept.push(*request);
                }
                entry.outstanding = *index;
            }
        }
        self.requests = kept;
    }
}

/// Is a piece of the stream that was decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Handed {
    Frame(FrameEdge),
    /// A byte of junk at this offset.
    Junk(u64),
}
