//! The requests of a poll cycle come again and again, to the byte: what was beyond doubt once still is.
//!
//! With nothing outstanding, the score of a request depends on its bytes and on what is thought of its unit alone.
//! So the same eight bytes get the same answer until that thought changes.

use crate::decode::framer::reading::Readings;

/// Requests remembered; a power of two.
const PLACES: usize = 1024;

#[derive(Clone, Copy, Debug)]
struct Known {
    bytes: u64,
    epoch: u32,
    score: f32,
    readings: Readings,
}

/// Remembers the requests of eight bytes that were beyond doubt with nothing outstanding.
#[derive(Clone, Debug)]
pub struct Polled {
    /// Empty until the first is remembered.
    places: Vec<Option<Known>>,
}

impl Polled {
    pub fn new() -> Self {
        Polled { places: Vec::new() }
    }

    fn place(bytes: u64) -> usize {
        // Fibonacci hashing: the upper bits of the product are well mixed.
        (bytes.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 54) as usize % PLACES
    }

    /// Returns score and readings of a request seen before, as long as the epoch is the same.
    pub fn recall(&self, bytes: [u8; 8], epoch: u32) -> Option<(f32, &Readings)> {
        let bytes = u64::from_le_bytes(bytes);
        let known = self.places.get(Self::place(bytes))?.as_ref()?;
        (known.bytes == bytes && known.epoch == epoch).then_some((known.score, &known.readings))
    }

    /// Remembers a request.
    pub fn remember(&mut self, bytes: [u8; 8], epoch: u32, score: f32, readings: Readings) {
        let bytes = u64::from_le_bytes(bytes);
        if self.places.is_empty() {
            self.places.resize(PLACES, None);
        }
        self.places[Self::place(bytes)] = Some(Known { bytes, epoch, score, readings });
    }

    /// Gives its memory back; what is asked again is judged anew, and alike.
    pub fn forget(&mut self) {
        self.places = Vec::new();
    }
}
