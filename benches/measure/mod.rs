//! Times a run on the processor, the best of three.

use std::time::{Duration, Instant};

const RUNS: usize = 3;

/// Returns the shortest time that `run` takes.
pub fn best(mut run: impl FnMut()) -> Duration {
    let once = |_| {
        #[expect(clippy::disallowed_methods, reason = "a benchmark reads the clock")]
        let (start, busy) = (Instant::now(), processor_time());
        run();
        let passed = start.elapsed();
        // On a busy machine only the time on the processor tells.
        processor_time().zip(busy).map_or(passed, |(now, before)| now.saturating_sub(before))
    };
    (0..RUNS).map(once).min().unwrap_or_default()
}

/// Returns how long this process has had a processor, where Linux tells it.
fn processor_time() -> Option<Duration> {
    #[expect(clippy::disallowed_methods, reason = "the system tells it in a file")]
    let statistics = std::fs::read_to_string("/proc/self/schedstat").ok()?;
    statistics.split(' ').next()?.parse().ok().map(Duration::from_nanos)
}
