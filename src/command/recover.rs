//! `rtutap recover`: rewrites a damaged or unfinished recording.

use std::fs::File;
use std::path::Path;

use super::failure::Failure;
use super::output::check_mcap;
use super::{bus, message};
use crate::capture::mcap::{RECOVERING, RecoverError, recover};
use crate::cli;

/// Runs the command.
pub(super) fn run(args: &cli::Recover) -> Result<(), Failure> {
    let (input, output) = (args.input.display(), args.output.display());
    if is_same(&args.input, &args.output) {
        let hint = "name another file with -o; the damaged one is kept as it is";
        return Err(Failure::hinted(format!("'{output}' is the input itself"), hint));
    }
    let mut on_the_way = args.output.clone().into_os_string();
    on_the_way.push(RECOVERING);
    if is_same(&args.input, Path::new(&on_the_way)) {
        let hint = "name another file with -o; the damaged one is kept as it is";
        let problem = format!("'{input}' is what '{output}' is called until it is whole");
        return Err(Failure::hinted(problem, hint));
    }
    check_mcap(&args.output, "recover")?;
    if args.output.is_file() {
        let hint = "name another file with -o; a recording is not written over";
        return Err(Failure::hinted(format!("'{output}' exists already"), hint));
    }
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    let file = File::open(&args.input);
    let file = file.map_err(|error| {
        Failure::hinted(
            format!("cannot read '{input}': {error}"),
            "check the path; a file is needed, not a pipe",
        )
    })?;
    if !file.metadata().is_ok_and(|metadata| metadata.is_file()) {
        let hint = "write what comes from elsewhere to a file first";
        return Err(Failure::hinted(format!("'{input}' is no file"), hint));
    }
    let recovered = recover(file, &args.output).map_err(|error| match error {
        RecoverError::Write(error) => Failure::writing(args.output.display(), &error),
        RecoverError::Read(error) => Failure::new(format!("cannot read '{input}': {error}")),
        RecoverError::Nothing => {
            let hint = "check that it is a recording in MCAP; other formats need no recovering";
            Failure::hinted(format!("cannot recover '{input}': {error}"), hint)
        }
        RecoverError::Foreign => {
            let hint = "'mcap recover', of the tool that MCAP's makers have, mends files of other programs";
            Failure::hinted(format!("cannot recover '{input}': {error}"), hint)
        }
        RecoverError::Silent => {
            let hint = "nothing was received while it was made, or what was is lost";
            Failure::hinted(format!("cannot recover '{input}': {error}"), hint)
        }
    })?;
    bus::say_damage(&input.to_string(), &recovered.facts);
    message::note(format_args!(
        "'{output}' holds {} bytes of the bus in {} messages",
        recovered.bytes, recovered.messages
    ));
    Ok(())
}

/// Tells whether two paths lead to the same file.
fn is_same(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}
