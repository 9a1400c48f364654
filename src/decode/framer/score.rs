//! How likely each reading of the bytes is: every score of the framer, in nats relative to "junk".
//!
//! The figures are those the study's prototype was tuned to; they stand in one table so that they can be
//! refitted on recordings of real buses.

use crate::decode::candidate::{Basis, Candidate, Oddity};
use crate::decode::framer::experience::Experience;
use crate::decode::framer::outstanding::{Fit, Outstanding};
use crate::time::MILLISECOND;

/// Readings within this of the best are still open.
pub const MARGIN: f32 = 6.0;
/// A good CRC: 16 bits.
pub const GOOD_CRC: f32 = 11.09;
/// Any frame, besides its CRC.
pub const FRAME: f32 = 1.0;
/// Waiting for one more byte that must be 00: ln 256.
pub const ZERO_EXTENSION: f32 = -5.5;
/// The first byte of a damaged run.
pub const JUNK_OPEN: f32 = -2.5;
/// Each byte of a damaged run.
pub const JUNK_BYTE: f32 = -0.35;
/// A lone byte that may begin anything.
pub const LONE_BYTE: f32 = 0.5;
/// The best an unfinished frame can score, besides a zero extension.
pub const BEST_TAIL: f32 = RESPONSE_FITS;

pub const RESPONSE_FITS: f32 = 5.0;
const SAME_AS_OUTSTANDING: f32 = 5.0;
const UNTIMED_ECHO: f32 = -4.0;
const UNSOLICITED: f32 = -8.0;

/// Scores what is unusual in a candidate's form.
fn form(candidate: Candidate, function: u8, experience: &Experience) -> f32 {
    let oddity = match candidate.oddity {
        Oddity::None => 0.0,
        Oddity::ZeroQuantity | Oddity::ZeroByteCount => -2.0,
        Oddity::UncountedData | Oddity::CoilValue => -4.0,
        Oddity::Exception => -3.0,
    };
    match candidate.basis {
        Basis::Declared(crate::decode::shape::Form::ZeroQuantity) => 0.0,
        Basis::AnyLength if experience.trusts_function(function) => oddity - 5.0,
        Basis::AnyLength => oddity - 8.0,
        _ => oddity,
    }
}

/// Scores a frame by its form and address alone.
pub fn frame(candidate: Candidate, bytes: &[u8], experience: &Experience) -> f32 {
    GOOD_CRC + FRAME + form(candidate, bytes[1], experience) + experience.unit(bytes[0])
}

/// Scores a frame as a request, by what is outstanding and how long since (`None`: not known).
pub fn request(outstanding: Option<&Outstanding>, junk: u16, bytes: &[u8], since: Option<i64>) -> f32 {
    let Some(outstanding) = outstanding.filter(|o| !o.is_broadcast()) else { return 0.0 };
    if junk >= 3 {
        return -1.0; // the answer was damaged
    }
    let since = since.unwrap_or(i64::MAX);
    match (outstanding.same_bytes(bytes), since) {
        (true, ..30_000_000) => -3.0,
        (true, _) => -2.0,
        (false, ..30_000_000) => -5.0,
        (false, ..150_000_000) => -3.0,
        (false, _) => -1.5,
    }
}

/// Scores a frame as the adapter's echo of the outstanding request; `None` when it cannot be.
pub fn echo(
    outstanding: Option<&Outstanding>,
    junk: u16,
    bytes: &[u8],
    since: Option<i64>,
    experience: &Experience,
) -> Option<f32> {
    outstanding.filter(|o| junk == 0 && !o.echoed && o.same_bytes(bytes))?;
    let untimed = match since {
        Some(since) if since >= experience.hold_ns() + 8 * MILLISECOND => return None,
        Some(_) => 0.0,
        None => UNTIMED_ECHO,
    };
    Some(SAME_AS_OUTSTANDING + experience.ln_echo() + untimed)
}

/// Scores a frame as a response, and says how it fits what is outstanding.
pub fn response(
    outstanding: Option<&Outstanding>,
    junk: u16,
    candidate: Candidate,
    bytes: &[u8],
    since: Option<i64>,
    experience: &Experience,
) -> (f32, Fit) {
    // Junk of a request's size may be the request.
    let after_damage = junk >= 6;
    let Some(outstanding) = outstanding else {
        return (if after_damage { 0.0 } else { UNSOLICITED }, Fit::None);
    };
    let fit = outstanding.fit(candidate, bytes);
    if fit == Fit::None {
        return (if after_damage { -2.0 } else { UNSOLICITED }, fit);
    }
    (answer(fit, outstanding, after_damage, bytes, since, experience), fit)
}

/// Scores an answer that fits what is outstanding, fully or by its function only.
#[inline]
pub fn answer(
    fit: Fit,
    outstanding: &Outstanding,
    after_damage: bool,
    bytes: &[u8],
    since: Option<i64>,
    experience: &Experience,
) -> f32 {
    let mut score = if fit == Fit::Full { RESPONSE_FITS } else { -3.0 };
    if let Some(since) = since {
        score += tardiness(since, experience.limit_ns(outstanding.address));
    }
    if after_damage && fit == Fit::Full {
        score = score.max(2.0); // the master may have asked again
    }
    if matches!(bytes[1], 5 | 6 | 8 | 22) {
        score += if outstanding.echoed { 0.0 } else { experience.ln_no_echo() };
    } else if !matches!(bytes[1], 15 | 16 | 20 | 21) && outstanding.starts_with(bytes) {
        score -= 8.0;
    }
    score
}

/// Scores a response that comes later than the unit usually answers.
fn tardiness(since: i64, limit: i64) -> f32 {
    if since <= limit {
        return 0.0;
    }
    let over = (since - limit) as f32 / limit.max(1) as f32;
    -(3.0 + 12.0 * over).min(10.0)
}

/// Scores an unfinished request.
pub fn request_tail(outstanding: Option<&Outstanding>, since: Option<i64>) -> f32 {
    match outstanding.filter(|o| !o.is_broadcast()) {
        None => 1.0,
        Some(_) if since.is_some_and(|since| since < 30 * MILLISECOND) => -4.0,
        Some(_) => -1.5,
    }
}

/// Scores an unfinished response.
pub fn response_tail(outstanding: Option<&Outstanding>, candidate: Candidate, bytes: &[u8]) -> f32 {
    let Some(outstanding) = outstanding else { return -4.0 };
    match outstanding.head_fit(candidate, bytes) {
        (true, Some(true)) => RESPONSE_FITS,
        (true, None) => 3.5,
        (true, Some(false)) => -2.0,
        (false, _) => -6.0,
    }
}

/// Turns a frame's score into a confidence from 0 to 0.99, in steps of 0.01.
pub fn confidence(score: f32) -> f32 {
    let logistic = 1.0 / (1.0 + (-score / 3.0).exp());
    (logistic * 100.0).floor().min(99.0) / 100.0
}
