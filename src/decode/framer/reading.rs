//! A frame read both ways, for pairing to decide between.

use crate::decode::candidate::{Basis, Candidate};
use crate::decode::frame::{Boundary, Role};
use crate::decode::framer::Outstanding;
use crate::decode::shape::Shapes;
use crate::time::Timestamp;

/// Is how a frame can be read; a damaged run cannot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Readings {
    /// As a request.
    pub request: Option<Asked>,
    /// As a response.
    pub response: Option<Candidate>,
}

/// Is a frame read as a request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// The form.
    pub candidate: Candidate,
    /// What an answer must match.
    pub outstanding: Outstanding,
}

impl Readings {
    /// Reads a frame both ways; `list` are the candidates of its bytes, `end` the estimate of its end.
    pub fn new(
        list: &[Candidate],
        bytes: &[u8],
        offset: u64,
        boundary: Boundary,
        end: Option<Timestamp>,
        shapes: &Shapes,
    ) -> Self {
        let of = |role: Role| {
            let fits = |c: &&Candidate| {
                c.role == role
                    && match boundary {
                        Boundary::Length => usize::from(c.length) == bytes.len(),
                        Boundary::Crc => c.basis == Basis::AnyLength,
                    }
            };
            list.iter().find(fits).copied()
        };
        let request = of(Role::Request)
            .map(|candidate| Asked { candidate, outstanding: Outstanding::new(offset, bytes, end, shapes) });
        Readings { request, response: of(Role::Response) }
    }
}
