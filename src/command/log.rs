//! The log file: what was done and said, with times, for a tap that nobody watches.

use std::fs::OpenOptions;
use std::path::Path;
use std::sync::Mutex;

use tracing::Level;
use tracing_subscriber::fmt::time::ChronoUtc;

use super::failure::Failure;

/// Appends what is done from now on to a file; with `verbose` in detail.
pub(super) fn begin(path: &Path, verbose: bool) -> Result<(), Failure> {
    let file = OpenOptions::new().create(true).append(true).open(path);
    let file = file.map_err(|error| Failure::writing(path.display(), &error))?;
    let most = if verbose { Level::DEBUG } else { Level::INFO };
    let subscriber = tracing_subscriber::fmt()
        .with_writer(Mutex::new(file))
        .with_timer(ChronoUtc::new("%Y-%m-%dT%H:%M:%S%.3fZ".to_owned()))
        .with_max_level(most)
        .with_ansi(false)
        .with_target(false)
        .finish();
    // Fails only when there is one already; a command begins one log at most.
    let _ = tracing::subscriber::set_global_default(subscriber);
    let words: Vec<_> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    tracing::info!(version = env!("CARGO_PKG_VERSION"), "begins: {}", words.join(" "));
    Ok(())
}
