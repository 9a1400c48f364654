//! The serial numbers that are to be blanked, and where they or pieces of them stand.

use std::collections::HashSet;
use std::ops::Range;

use super::BLANK;
use crate::device::Profiles;

/// Letters and digits in a row that are a piece of a serial number, wherever they stand.
pub(super) const PIECE: usize = 5;
/// Letters and digits after a maker's prefix that make a serial number.
const LEAST_AFTER_PREFIX: usize = 4;
/// How many pieces are kept at most, against recordings made of nothing but serial numbers: about 3 MB.
const MOST_PIECES: usize = 1 << 16;

/// Holds the serial numbers known so far, by their pieces of five characters.
#[derive(Clone, Debug, Default)]
pub struct Secrets {
    pieces: HashSet<[u8; PIECE]>,
}

impl Secrets {
    /// Takes note of a serial number; one of fewer than five characters is blanked only where it is known to lie.
    pub fn note(&mut self, serial_number: &[u8]) {
        for (_, piece) in pieces(serial_number) {
            if self.pieces.len() < MOST_PIECES {
                self.pieces.insert(piece);
            }
        }
    }

    /// Returns where pieces of known serial numbers stand, in capitals or not.
    pub(super) fn known_in(&self, bytes: &[u8]) -> Vec<Range<usize>> {
        if self.pieces.is_empty() {
            return Vec::new();
        }
        let known = pieces(bytes).filter(|(_, piece)| self.pieces.contains(piece));
        known.map(|(at, _)| at..at + PIECE).collect()
    }

    /// Blanks serial numbers in a name, path or remark: known ones, and what begins as a maker's do.
    pub fn blank(&self, text: &str, profiles: &Profiles) -> String {
        let mut bytes = text.as_bytes().to_vec();
        self.blank_bytes(&mut bytes, profiles);
        // Only letters, digits and signs of ASCII were replaced: it is still UTF-8.
        String::from_utf8(bytes).unwrap_or_default()
    }

    /// Blanks serial numbers in a text of unknown encoding, as [`Secrets::blank`] does.
    pub fn blank_bytes(&self, text: &mut [u8], profiles: &Profiles) {
        let mut spans = self.known_in(text);
        // Words may have the prefix in them, too, but no digit behind it.
        let numbers = prefixed(text, profiles)
            .filter(|(prefix, span)| text.get(span.start + prefix).is_some_and(u8::is_ascii_digit));
        spans.extend(numbers.map(|(_, span)| span));
        for span in merged(&spans) {
            blank_number(text.get_mut(span).unwrap_or_default(), profiles);
        }
    }
}

/// Returns the pieces of a text in capitals, and where they begin; blanked ones are none.
fn pieces(bytes: &[u8]) -> impl Iterator<Item = (usize, [u8; PIECE])> {
    bytes.windows(PIECE).enumerate().filter_map(|(at, window)| {
        let piece = <[u8; PIECE]>::try_from(window).ok()?.map(|byte| byte.to_ascii_uppercase());
        (piece.iter().all(u8::is_ascii_graphic) && piece != [BLANK; PIECE]).then_some((at, piece))
    })
}

/// Returns what begins as the serial numbers of a maker: the length of the prefix, and where all of it stands.
pub(super) fn prefixed(bytes: &[u8], profiles: &Profiles) -> impl Iterator<Item = (usize, Range<usize>)> {
    profiles.serial_number_prefixes().map(str::as_bytes).flat_map(move |prefix| {
        let windows = bytes.windows(prefix.len()).enumerate();
        windows.filter(move |(_, window)| *window == prefix).filter_map(move |(at, _)| {
            let end = alphanumeric_from(bytes, at + prefix.len());
            (end >= at + prefix.len() + LEAST_AFTER_PREFIX).then_some((prefix.len(), at..end))
        })
    })
}

/// Returns where the letters and digits end that begin at `at`.
pub(super) fn alphanumeric_from(bytes: &[u8], at: usize) -> usize {
    let rest = bytes.get(at..).unwrap_or_default();
    at + rest.iter().take_while(|byte| byte.is_ascii_alphanumeric()).count()
}

/// Blanks a serial number, but for what tells the maker and the kind of device.
pub(super) fn blank_number(serial_number: &mut [u8], profiles: &Profiles) {
    let told = |at: usize| profiles.telling_part(serial_number.get(at..).unwrap_or_default());
    let told = (0..serial_number.len()).map(|at| at..at + told(at)).find(|told| !told.is_empty());
    let told = told.unwrap_or_default();
    let rest = serial_number.iter_mut().enumerate().filter(|(at, byte)| !told.contains(at) && **byte != 0);
    rest.for_each(|(_, byte)| *byte = BLANK);
}

/// Joins spans that overlap: profiles that see the serial number at different places, and its pieces.
pub(super) fn merged(spans: &[Range<usize>]) -> Vec<Range<usize>> {
    let mut spans = spans.to_vec();
    spans.sort_by_key(|span| span.start);
    let mut merged: Vec<Range<usize>> = Vec::new();
    for span in spans {
        match merged.last_mut() {
            Some(last) if span.start < last.end => last.end = last.end.max(span.end),
            _ => merged.push(span),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_paths_lose_known_numbers_and_those_of_makers_and_nothing_else() {
        let profiles = Profiles::built_in();
        let mut secrets = Secrets::default();
        secrets.note(b"SN-4711-77");
        for (text, blank) in [
            ("/data/YL0119052307.mcap", "/data/YL01XXXXXXXX.mcap"),
            ("pump-sn-4711-77-left", "pump-XXXXXXXXXX-left"),
            ("behind 4711-7, é", "behind XXXXXX, é"),
            ("NYLONROPE 0403:6001 YL01 4711", "NYLONROPE 0403:6001 YL01 4711"),
        ] {
            assert_eq!(secrets.blank(text, &profiles), blank);
        }
    }

    #[test]
    fn memory_is_bounded_whatever_is_noted() {
        let mut secrets = Secrets::default();
        (0..100_000_u32).for_each(|number| secrets.note(format!("{number:05}").as_bytes()));
        assert_eq!(secrets.pieces.len(), MOST_PIECES);
    }
}
