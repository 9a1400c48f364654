//! Which types bytes may have, and how much speaks for each, in bits: the odds against random bytes looking so.

use crate::device::{Encoding, Order, Value};

use super::series::Series;

/// Floats outside these bounds, and not 0, are what a wrong order of bytes looks like, not what is measured.
const PLAUSIBLE: std::ops::Range<f64> = 1e-4..1e7;
/// One random float in eight is plausible: its exponent is one of 37 in 256.
const BITS_A_PLAUSIBLE_FLOAT: f64 = 3.0;
/// More values than this tell no more: they may share what makes the first plausible.
const TELLING_VALUES: usize = 8;
/// Significant decimal digits of what was rounded or set by people; random floats have 7 to 9.
const SHORT_DIGITS: usize = 5;
/// What counts against a float that does not begin where a block of floats has one: the end of one and the begin of the
/// next also look like a float, with bytes in another order.
const BITS_OF_PLACE: f64 = 5.0;
/// Characters from which on a text is no chance.
const LEAST_TEXT: usize = 6;

/// Is a type that the bytes at one place may have.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// In bytes from the data's start.
    pub(super) offset: usize,
    pub(super) encoding: Encoding,
    /// How much speaks for it.
    pub(super) bits: f64,
    pub(super) ground: Ground,
}

impl Candidate {
    pub(super) fn end(&self) -> usize {
        self.offset + self.encoding.size() // both at most 250
    }
}

/// Is what speaks for a type.
#[derive(Clone, Debug)]
pub(super) enum Ground {
    /// Numbers: how they look, which part of them is plausible, and which part short.
    Numbers { series: Series, plausible: f64, short: f64 },
    /// Readable characters, the same in all samples or not.
    Text { example: String, is_constant: bool },
    /// A date in each sample; the first and the last.
    Clock { first: String, last: String },
    /// Two pairs of small bytes that never change.
    Version,
    /// Zero, beside numbers of this type.
    Company,
}

/// Lists what the bytes from `offset` on may be; `samples` are the data of one register, in the order of time.
pub(super) fn candidates(samples: &[&[u8]], offset: usize, length: usize) -> Vec<Candidate> {
    let mut found = Vec::new();
    found.extend(text(samples, offset));
    if !offset.is_multiple_of(2) {
        return found; // numbers begin with a register
    }
    found.extend(clock(samples, offset));
    found.extend(version(samples, offset, length));
    for order in Order::ALL {
        found.extend(float(samples, offset, order));
        found.extend(long(samples, offset, order));
    }
    for order in [Order::Big, Order::Little] {
        found.extend(word(samples, offset, order));
    }
    found
}

/// Reads one type at one place of all samples that reach so far.
fn read<'a>(samples: &[&'a [u8]], offset: usize, encoding: Encoding) -> Vec<Value<'a>> {
    let bytes = |data: &&'a [u8]| data.get(offset..offset.checked_add(encoding.size())?);
    samples.iter().filter_map(bytes).map(|bytes| encoding.read(bytes)).collect()
}

/// Returns the numbers that a type gives, without those that are none.
fn numbers(samples: &[&[u8]], offset: usize, encoding: Encoding) -> Vec<f64> {
    read(samples, offset, encoding).iter().filter_map(Value::as_f64).collect()
}

/// Says which part of the floats at a place is plausible in an order, and what the first is; `None` where all are 0.
pub(super) fn plausible_floats(samples: &[&[u8]], offset: usize, order: Order) -> Option<(f64, String)> {
    let values = read(samples, offset, Encoding::Float32(order));
    let other_than_zero: Vec<_> = values.iter().filter(|value| value.as_f64() != Some(0.0)).collect();
    let first = other_than_zero.first()?;
    let is_plausible = |value: f64| PLAUSIBLE.contains(&value.abs());
    let count = other_than_zero.iter().filter(|value| value.as_f64().is_some_and(is_plausible)).count();
    Some((count as f64 / other_than_zero.len() as f64, first.to_string()))
}

fn float(samples: &[&[u8]], offset: usize, order: Order) -> Option<Candidate> {
    let encoding = Encoding::Float32(order);
    let (plausible, _) = plausible_floats(samples, offset, order)?;
    let values = read(samples, offset, encoding);
    let numbers: Vec<f64> = values.iter().filter_map(Value::as_f64).collect();
    let series = Series::new(&numbers)?;
    if plausible < 0.9 {
        return None;
    }
    let nonzero = values.iter().filter(|value| value.as_f64() != Some(0.0));
    let short = share(nonzero, |value| digits(value) <= SHORT_DIGITS);
    let telling = series.distinct.min(TELLING_VALUES) as f64;
    let course = if series.is_smooth() || series.is_narrow() { 6.0 } else { 0.0 };
    let rounded = if short > 0.5 { 6.0 } else { 0.0 };
    let place = if offset.is_multiple_of(4) { 0.0 } else { BITS_OF_PLACE };
    let bits = BITS_A_PLAUSIBLE_FLOAT * telling + course + rounded - place;
    Some(Candidate { offset, encoding, bits, ground: Ground::Numbers { series, plausible, short } })
}

/// Returns which part of values fulfils a condition; 0 of none.
fn share<'a>(values: impl Iterator<Item = &'a Value<'a>>, holds: impl Fn(&Value<'_>) -> bool) -> f64 {
    let (mut all, mut fit) = (0_usize, 0_usize);
    for value in values {
        all += 1;
        fit += usize::from(holds(value));
    }
    if all == 0 { 0.0 } else { fit as f64 / all as f64 }
}

/// Counts the significant decimal digits of a number as it is written.
fn digits(value: &Value<'_>) -> usize {
    let text = value.to_string();
    let mantissa = text.split('e').next().unwrap_or_default();
    let all: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    all.trim_matches('0').len()
}

/// Guesses at a whole number of one register.
fn word(samples: &[&[u8]], offset: usize, order: Order) -> Option<Candidate> {
    let encoding = |signed| Encoding::Integer { size: 2, signed, order };
    let unsigned = Series::new(&numbers(samples, offset, encoding(false)))?;
    let signed = Series::new(&numbers(samples, offset, encoding(true)))?;
    if unsigned.high == 0.0 {
        return None;
    }
    // Numbers about zero leap from one end to the other when their sign is overlooked.
    let is_signed = signed.high - signed.low < unsigned.high - unsigned.low;
    let series = if is_signed { signed } else { unsigned };
    let mut bits = 0.5;
    if series.low.abs().max(series.high.abs()) < 256.0 {
        bits += 2.0; // its upper byte is empty
    } else if series.distinct > 1 && (series.high / 256.0).floor() - (series.low / 256.0).floor() <= 1.0 {
        bits += 2.0; // its upper byte hardly changes
    }
    if series.is_smooth() {
        bits += 6.0;
    }
    let ground = Ground::Numbers { series, plausible: 1.0, short: 0.0 };
    Some(Candidate { offset, encoding: encoding(is_signed), bits, ground })
}

/// Guesses at a whole number of two registers: only where the lower one makes no course of its own, and both make one.
fn long(samples: &[&[u8]], offset: usize, order: Order) -> Option<Candidate> {
    let encoding = |signed| Encoding::Integer { size: 4, signed, order };
    let values = numbers(samples, offset, encoding(false));
    let unsigned = Series::new(&values)?;
    let signed = Series::new(&numbers(samples, offset, encoding(true)))?;
    let is_signed = signed.high - signed.low < unsigned.high - unsigned.low;
    let series = if is_signed { signed } else { unsigned };
    if !carries(&values) {
        return None;
    }
    let upper_changes = (series.high / 65536.0).floor() > (series.low / 65536.0).floor();
    let is_one = (series.grows && series.distinct >= 4) || series.is_smooth();
    // What fills all 32 bits is a float or text.
    if !upper_changes || !is_one || series.high - series.low > f64::from(1_u32 << 28) {
        return None;
    }
    let ground = Ground::Numbers { series, plausible: 1.0, short: 0.0 };
    Some(Candidate { offset, encoding: encoding(is_signed), bits: 14.0, ground })
}

/// Tells whether the lower registers of numbers leap, mostly, where the upper ones change: they are one number.
fn carries(values: &[f64]) -> bool {
    let (upper, lower) = (|value: f64| (value / 65536.0).floor(), |value: f64| value.rem_euclid(65536.0));
    let changes = values.windows(2).filter(|pair| upper(pair[0]) != upper(pair[1])); // windows of two
    let leaps = |pair: &&[f64]| (lower(pair[0]) - lower(pair[1])).abs() > 16384.0;
    let (mut all, mut leaping) = (0_usize, 0_usize);
    for pair in changes {
        all += 1;
        leaping += usize::from(leaps(&pair));
    }
    all > 0 && 2 * leaping >= all
}

/// Guesses at the longest text that begins at a place.
fn text(samples: &[&[u8]], offset: usize) -> Option<Candidate> {
    let is_text = |byte: u8| byte.is_ascii_alphanumeric() || b"-_./: ".contains(&byte);
    let column = |at: usize| {
        let mut bytes = samples.iter().filter_map(|data| data.get(at)).peekable();
        bytes.peek().is_some() && bytes.all(|&byte| is_text(byte))
    };
    if offset.checked_sub(1).is_some_and(column) {
        return None; // it begins before
    }
    let example = samples.iter().find_map(|data| data.get(offset..).filter(|rest| !rest.is_empty()))?;
    let run = (offset..offset.saturating_add(example.len())).take_while(|&at| column(at)).count();
    let example = example.get(..run)?;
    let length = example.iter().rposition(|&byte| byte != b' ').map_or(0, |last| last + 1);
    let letters = example.iter().filter(|byte| byte.is_ascii_alphanumeric()).count();
    if length < LEAST_TEXT || 2 * letters < length {
        return None;
    }
    let same =
        |data: &&[u8]| data.get(offset..).is_none_or(|rest| rest.get(..length) == example.get(..length));
    let is_constant = samples.iter().all(same);
    let example = String::from_utf8_lossy(example.get(..length)?).into_owned();
    let ground = Ground::Text { example, is_constant };
    let encoding = Encoding::Ascii { length };
    Some(Candidate { offset, encoding, bits: 2.0 * length as f64, ground })
}

fn clock(samples: &[&[u8]], offset: usize) -> Option<Candidate> {
    let values = read(samples, offset, Encoding::BcdTime);
    let dates: Option<Vec<String>> = values
        .iter()
        .map(|value| match value {
            Value::Text(date) => Some(date.to_string()),
            _ => None,
        })
        .collect();
    let (first, last) = (dates.as_ref()?.first()?.clone(), dates?.last()?.clone());
    let (encoding, ground) = (Encoding::BcdTime, Ground::Clock { first, last });
    Some(Candidate { offset, encoding, bits: 25.0, ground })
}

/// Guesses at versions: four small bytes that never change, and nothing else is read with them.
fn version(samples: &[&[u8]], offset: usize, length: usize) -> Option<Candidate> {
    let &first = samples.first()?;
    let is_small = first.iter().all(|&byte| byte < 32) && first.iter().step_by(2).any(|&major| major > 0);
    let is_version = length == 4 && first.len() == 4 && is_small && samples.iter().all(|&data| data == first);
    let candidate = Candidate { offset, encoding: Encoding::Version, bits: 4.0, ground: Ground::Version };
    is_version.then_some(candidate).filter(|candidate| candidate.end() <= length)
}
