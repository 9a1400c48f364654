//! What masters ask and units answer, one exchange at a time.

use crate::simulate::generic::Generic;
use crate::simulate::installation::Installation;
use crate::simulate::script::Scripted;
use crate::time::{MILLISECOND, Timestamp};

/// How long a master waits for an answer to begin, in nanoseconds.
pub(super) const RESPONSE_TIMEOUT: i64 = 500 * MILLISECOND;

/// Is what a master wants to know next, with what the unit will say.
#[derive(Clone, Debug)]
pub(super) struct Exchange {
    /// The master does not begin before this.
    pub(super) start: Timestamp,
    /// The request's ADU.
    pub(super) request: Vec<u8>,
    /// The response's ADU; `None` for a broadcast.
    pub(super) response: Option<Vec<u8>>,
    /// From the request's end to the response's start, in nanoseconds.
    pub(super) latency: i64,
    /// Whether the unit is the one that may be weak (`Scenario::one_weak_unit`).
    pub(super) weak: bool,
}

/// Is a source of exchanges.
pub(super) enum Traffic {
    Generic(Generic),
    Installation(Box<Installation>),
    Scripted(Box<Scripted>),
}

impl Traffic {
    /// Plans the next exchange of a master that is done with the last one now.
    pub(super) fn next(&mut self, now: Timestamp) -> Exchange {
        match self {
            Traffic::Generic(generic) => generic.next(now),
            Traffic::Installation(installation) => installation.next(now),
            Traffic::Scripted(scripted) => scripted.next(now),
        }
    }

    /// Returns when a master asks the same again that has waited in vain until now.
    pub(super) fn again(&mut self, now: Timestamp) -> Timestamp {
        match self {
            Traffic::Generic(generic) => now + generic.pause(),
            Traffic::Installation(installation) => installation.ready(now),
            Traffic::Scripted(scripted) => scripted.ready(now),
        }
    }
}
