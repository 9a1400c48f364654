//! The nodes of the lattice: a few readings of the bytes before a place.

use crate::decode::frame::Boundary;
use crate::decode::framer::outstanding::Fit;

/// Readings kept a node.
const KEPT: usize = 4;
/// No request is outstanding.
pub const NOTHING: u16 = u16::MAX;

/// Names how a frame is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Request,
    Echo,
    Response(Fit),
}

/// Is a frame edge, as handed out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameEdge {
    pub offset: u64,
    pub length: u16,
    pub kind: Kind,
    pub boundary: Boundary,
    pub score: f32,
}

impl FrameEdge {
    pub fn end(&self) -> u64 {
        self.offset + u64::from(self.length)
    }
}

#[derive(Clone, Copy, Debug)]
pub enum Edge {
    Root,
    Junk,
    Frame(FrameEdge),
}

/// Is one reading of the bytes up to its node.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    pub score: f32,
    /// Index of the outstanding request, or `NOTHING`.
    pub outstanding: u16,
    /// Bytes of junk since the last frame.
    pub junk: u16,
    pub edge: Edge,
    /// Slot of the reading it goes on from, in the node at the edge's start.
    pub from: u8,
    /// Offset and end of the first frame after the root; equal while there is none.
    pub first: (u64, u64),
    pub alive: bool,
}

#[derive(Clone, Copy, Debug)]
pub struct Node {
    pub entries: [Entry; KEPT],
    pub len: u8,
}

impl Node {
    pub const EMPTY: Node = Node {
        entries: [Entry {
            score: 0.0,
            outstanding: NOTHING,
            junk: 0,
            edge: Edge::Root,
            from: 0,
            first: (0, 0),
            alive: false,
        }; KEPT],
        len: 0,
    };

    /// Returns the readings that still lead to the root, with their slots.
    pub fn alive(&self) -> impl Iterator<Item = (usize, &Entry)> {
        self.entries[..usize::from(self.len)].iter().enumerate().filter(|(_, entry)| entry.alive)
    }

    /// Keeps the entry if it is among the best of its kind.
    pub fn offer(&mut self, entry: Entry) {
        let len = usize::from(self.len);
        let same = |e: &Entry| e.outstanding == entry.outstanding && (e.junk > 0) == (entry.junk > 0);
        if let Some(rival) = self.entries[..len].iter_mut().find(|e| same(e)) {
            if entry.score > rival.score {
                *rival = entry;
            }
        } else if len < KEPT {
            self.entries[len] = entry;
            self.len += 1;
        } else if let Some(worst) = self.entries.iter_mut().min_by(|a, b| a.score.total_cmp(&b.score))
            && entry.score > worst.score
        {
            *worst = entry;
        }
    }
}
