//! Which types the bytes of all data have: of all that they may have, those that together explain most.

use crate::device::{Encoding, Order};

use super::guess::{Candidate, Ground, candidates};

/// Is the data of one register, and all types that its bytes may have.
#[derive(Debug)]
pub(super) struct Block<'a> {
    pub(super) samples: Vec<&'a [u8]>,
    pub(super) length: usize,
    /// For each offset.
    candidates: Vec<Vec<Candidate>>,
}

impl<'a> Block<'a> {
    /// Takes samples in the order of time.
    pub(super) fn new(samples: Vec<&'a [u8]>) -> Self {
        let length = samples.iter().map(|data| data.len()).max().unwrap_or(0);
        let candidates = (0..length).map(|offset| candidates(&samples, offset, length)).collect();
        Block { samples, length, candidates }
    }

    /// Tells whether bytes are 0 in all samples.
    pub(super) fn is_zero(&self, span: std::ops::Range<usize>) -> bool {
        self.samples.iter().all(|data| data.iter().skip(span.start).take(span.len()).all(|&byte| byte == 0))
    }

    /// Returns the types that explain most under an order, in the order of their places, and how much that is.
    fn best(&self, orders: Orders) -> (Vec<&Candidate>, f64) {
        // From the end: what the rest gives at best, and the type that begins there; none leaves a byte raw.
        let mut best: Vec<(f64, Option<&Candidate>)> = vec![(0.0, None); self.length + 1];
        for offset in (0..self.length).rev() {
            best[offset] = (best[offset + 1].0, None); // `best` has one more than the data
            for candidate in self.candidates[offset].iter().filter(|it| orders.allow(it.encoding)) {
                let Some(rest) = best.get(candidate.end()) else { continue };
                let bits = candidate.bits + rest.0;
                if bits > best[offset].0 {
                    best[offset] = (bits, Some(candidate));
                }
            }
        }
        let (mut chosen, mut offset) = (Vec::new(), 0);
        while let Some((_, found)) = best.get(offset) {
            chosen.extend(*found);
            offset = found.map_or(offset + 1, Candidate::end);
        }
        (chosen, best[0].0)
    }

    /// Returns the fields of the data.
    pub(super) fn fields(&self, orders: Orders) -> Vec<Candidate> {
        let mut fields: Vec<Candidate> = self.best(orders).0.into_iter().cloned().collect();
        let is_float = |field: &Candidate| matches!(field.encoding, Encoding::Float32(_));
        let mut offset = 0;
        let mut company = Vec::new();
        let starts = fields.iter().map(|field| (field.offset, field.end(), is_float(field)));
        let mut after_float = false;
        for (start, end, is_float) in starts.chain([(self.length, self.length, false)]) {
            // Zeros between floats are floats: a quantity that is 0, a coefficient that is not used.
            let gap = start.saturating_sub(offset);
            if (after_float || is_float) && gap >= 4 && gap.is_multiple_of(4) && self.is_zero(offset..start) {
                company.extend((offset..start).step_by(4));
            }
            (offset, after_float) = (end, is_float);
        }
        let encoding = Encoding::Float32(orders.float);
        let zero = |offset| Candidate { offset, encoding, bits: 0.0, ground: Ground::Company };
        fields.extend(company.into_iter().map(zero));
        fields.sort_by_key(|field| field.offset);
        fields
    }
}

/// Is the order of bytes of a device, in its floats and in its whole numbers of one register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Orders {
    pub(super) float: Order,
    pub(super) word: Order,
}

impl Orders {
    /// Finds the orders that explain most of all data: a device sends all its numbers alike.
    pub(super) fn of(blocks: &[&Block<'_>]) -> Self {
        let all = Order::ALL
            .into_iter()
            .flat_map(|float| [Order::Big, Order::Little].map(|word| Orders { float, word }));
        let mut best = (Orders { float: Order::Big, word: Order::Big }, f64::NEG_INFINITY);
        for orders in all {
            let bits = blocks.iter().map(|block| block.best(orders).1).sum();
            if bits > best.1 {
                best = (orders, bits);
            }
        }
        best.0
    }

    fn allow(self, encoding: Encoding) -> bool {
        match encoding {
            Encoding::Float32(order) => order == self.float,
            Encoding::Integer { size: 2, order, .. } => order == self.word,
            _ => true,
        }
    }
}
