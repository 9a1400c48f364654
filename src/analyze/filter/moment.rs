//! Points in time as a filter names them: a local time of day, or an instant.

use std::fmt;

use chrono::DateTime;

use crate::time::SECOND;

/// Nanoseconds in a minute.
const MINUTE: i64 = 60 * SECOND;

/// Is a point in time, and the stretch it stands for when equality is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Moment {
    pub(super) since: Since,
    /// Nanoseconds since then.
    pub(super) ns: i64,
    /// Nanoseconds of the smallest unit written: a minute, a second, or a tenth … a billionth of one.
    pub(super) width: i64,
}

/// Says what a moment counts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Since {
    /// Local midnight: it comes every day.
    Midnight,
    /// The Unix epoch.
    Epoch,
}

impl Moment {
    /// Reads `H:MM`, `H:MM:SS` with a fraction or without, or RFC 3339 with zone; `None` for anything else.
    pub(super) fn read(word: &str) -> Option<Moment> {
        let (clock, fraction) = match word.split_once('.') {
            Some((clock, rest)) => {
                let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
                (clock, rest.get(..digits)?)
            }
            None => (word, ""),
        };
        let digits = u32::try_from(fraction.len()).ok().filter(|digits| *digits <= 9)?;
        let unit = SECOND / 10_i64.pow(digits); // at most nine digits
        if word.contains(['T', 't']) {
            let ns = DateTime::parse_from_rfc3339(word).ok()?.timestamp_nanos_opt()?;
            return Some(Moment { since: Since::Epoch, ns, width: unit });
        }
        if word.contains('.') && (fraction.is_empty() || word.len() != clock.len() + 1 + fraction.len()) {
            return None;
        }
        let mut parts = clock.split(':');
        let mut next = |limit: i64, shortest: usize| -> Option<i64> {
            let part = parts.next()?;
            let plain = (shortest..=2).contains(&part.len()) && part.bytes().all(|b| b.is_ascii_digit());
            part.parse().ok().filter(|number| plain && *number < limit)
        };
        let minutes = next(24, 1)? * 60 + next(60, 2)?;
        let (seconds, width) = match clock.matches(':').count() {
            1 if fraction.is_empty() => (0, MINUTE),
            2 => (next(60, 2)?, unit),
            _ => return None,
        };
        let parts_of_second = if fraction.is_empty() { 0 } else { fraction.parse::<i64>().ok()? * unit };
        let ns = minutes * MINUTE + seconds * SECOND + parts_of_second;
        Some(Moment { since: Since::Midnight, ns, width })
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.ns.div_euclid(SECOND);
        match self.since {
            Since::Midnight => write!(f, "{:02}:{:02}", seconds / 3600, seconds / 60 % 60)?,
            Since::Epoch => {
                write!(f, "{}", DateTime::from_timestamp_nanos(self.ns).format("%Y-%m-%dT%H:%M"))?
            }
        }
        if self.width < MINUTE {
            write!(f, ":{:02}", seconds.rem_euclid(60))?;
        }
        if self.width < SECOND {
            let digits = (SECOND / self.width.max(1)).ilog10() as usize; // at most nine
            write!(f, ".{:0digits$}", self.ns.rem_euclid(SECOND) / self.width.max(1))?;
        }
        f.write_str(if self.since == Since::Epoch { "Z" } else { "" })
    }
}
