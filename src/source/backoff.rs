//! How long to wait before trying again.

use std::time::Duration;

const FIRST: Duration = Duration::from_millis(250);
const LONGEST: Duration = Duration::from_secs(5);

/// Returns how long to wait before the attempt of this number, from 0, to reach a source that is away.
///
/// 250 ms, then twice as long each time, up to 5 s: an adapter that is plugged in again is back at once for a
/// person, and a server that is away for days is not pestered.
pub fn backoff(attempt: u32) -> Duration {
    FIRST.saturating_mul(1_u32.checked_shl(attempt).unwrap_or(u32::MAX)).min(LONGEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_five_seconds_whatever_the_attempt() {
        let ms: Vec<u128> = (0..7).map(|attempt| backoff(attempt).as_millis()).collect();
        assert_eq!(ms, [250, 500, 1000, 2000, 4000, 5000, 5000]);
        assert_eq!(backoff(u32::MAX), LONGEST);
        assert_eq!(backoff(31), LONGEST);
    }
}
