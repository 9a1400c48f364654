//! What `decode`, `info` and `export` share: from the inputs on the command line to events.

use std::io;
use std::path::Path;
use std::sync::Arc;

use super::failure::Failure;
use super::message;
use super::progress::Progress;
use crate::capture::{Input, InputFormat};
use crate::cli;
use crate::decode::chunk::Chunk;
use crate::device::{Devices, Environment, Profile, Profiles};
use crate::line::LineSettings;
use crate::pipeline::{Event, Options, Pipeline};
use crate::report::redact::Redactor;

/// What the bus of a recording is called that names none.
pub(super) const BUS: &str = "bus0";

/// More bytes than this without a single frame are worth a warning.
const MANY_BYTES: usize = 1000;

/// Receives what comes out of the inputs.
pub(super) trait Sink {
    /// Whether rows are printed as they come.
    const PRINTS: bool;

    /// Begins an input.
    fn begin(&mut self, origin: &Origin);

    /// Takes a read, before what comes of it.
    fn chunk(&mut self, _chunk: &Chunk<'_>) {}

    /// Takes an event.
    fn event(&mut self, event: &Event<'_>);

    /// Comes after each chunk: frames before `settled_frame` have their transaction, or none;
    /// `waits` when the next chunk is not there yet.
    fn pause(&mut self, settled_frame: u64, waits: bool) -> Result<(), Failure>;
}

/// Refuses a command line that contradicts itself, or names inputs that aren't there.
pub(super) fn check(args: &cli::Bus) -> Result<(), Failure> {
    for (index, later) in args.devices.iter().enumerate() {
        let mut earlier = args.devices[..index].iter().filter(|earlier| earlier.address == later.address);
        if let Some(earlier) = earlier.find(|earlier| earlier.device != later.device) {
            let (address, device) = (later.address, &later.device);
            let message =
                format!("--device says that {address} is {} and that it is {device}", earlier.device);
            return Err(Failure::hinted(message, "give one --device for an address"));
        }
    }
    if args.inputs.iter().filter(|path| path.as_os_str() == "-").count() > 1 {
        return Err(Failure::hinted("'-' was given twice", "standard input can be read only once"));
    }
    args.inputs.iter().try_for_each(|path| Ok(Input::check(path)?))
}

/// Says how the bytes of an input were received.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    /// Speed and character format.
    pub(super) line: LineSettings,
    /// Whether nobody said so.
    pub(super) line_is_assumed: bool,
    /// Whether nothing is known of when bytes were read.
    pub(super) is_raw: bool,
    /// The longest time the adapter kept a byte back, where it is known.
    pub(super) adapter_hold_ns: Option<i64>,
}

/// Says what is wanted of the inputs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wanted {
    /// Readings.
    pub(super) readings: bool,
    /// Serial numbers blanked.
    pub(super) redacted: bool,
}

/// Returns the built-in profiles and those given.
pub(super) fn profiles(files: &[impl AsRef<Path>]) -> Result<Arc<Profiles>, Failure> {
    let mut profiles = Profiles::built_in();
    for file in files {
        profiles.add(profile(file.as_ref())?);
    }
    Ok(Arc::new(profiles))
}

/// Reads one profile.
pub(super) fn profile(file: &Path) -> Result<Profile, Failure> {
    let name = file.display().to_string();
    #[expect(clippy::disallowed_methods, reason = "profiles are files")]
    let text = std::fs::read_to_string(file);
    let text = text.map_err(|error| {
        let hint = match error.kind() {
            io::ErrorKind::NotFound => "check the path; 'rtutap profiles' lists the profiles built in",
            io::ErrorKind::IsADirectory => "name a TOML file in it",
            io::ErrorKind::InvalidData => "a profile is a TOML file, which is UTF-8 text",
            _ => "check who may read the file",
        };
        Failure::hinted(format!("cannot read '{name}': {error}"), hint)
    })?;
    Profile::from_toml(&text, &name).map_err(Failure::new)
}

/// Reads all inputs, one after the other; counters run on.
pub(super) fn read(
    args: &cli::Bus,
    profiles: &Arc<Profiles>,
    wanted: Wanted,
    sink: &mut impl Sink,
) -> Result<(), Failure> {
    let mut ids = (0, 0);
    devices(args, profiles)?;
    for path in &args.inputs {
        let mut input = Input::open(path, args.input_format.map(Into::into))?;
        let origin = Origin {
            line: line(args, &input),
            line_is_assumed: args.line.or(input.line()).is_none(),
            is_raw: input.format() == InputFormat::Raw,
            adapter_hold_ns: args.adapter_hold.map(|hold| hold.0).or(input.adapter_hold_ns()),
        };
        input.use_line(origin.line);
        let options = Options {
            line: origin.line,
            adapter_hold_ns: origin.adapter_hold_ns,
            first_frame_id: ids.0,
            first_transaction_id: ids.1,
            readings: wanted.readings,
        };
        let pipeline = |options| -> Result<Pipeline, Failure> {
            Ok(Pipeline::new(options, devices(args, profiles)?, profiles.shapes()))
        };
        let redactor = if wanted.redacted {
            Some(Redactor::new(pipeline(options.clone())?, Arc::clone(profiles)))
        } else {
            None
        };
        let mut pipeline = pipeline(options)?;
        sink.begin(&origin);
        read_input(input, redactor, &mut pipeline, sink)?;
        ids = pipeline.next_ids();
    }
    Ok(())
}

/// Returns devices of which nothing is known but what the command line says.
fn devices(args: &cli::Bus, profiles: &Arc<Profiles>) -> Result<Devices, Failure> {
    let default = Environment::default();
    let environment = Environment {
        salinity: args.salinity.unwrap_or(default.salinity),
        pressure_kpa: args.pressure_kpa.unwrap_or(default.pressure_kpa),
    };
    let mut devices = Devices::new(Arc::clone(profiles), environment);
    for assignment in &args.devices {
        devices.assign(assignment.address, &assignment.device).map_err(|error| {
            Failure::hinted(error, "'rtutap profiles' lists the profiles; --profile adds one")
        })?;
    }
    Ok(devices)
}

/// Says what derived values rest on, where nobody asked for it.
pub(super) fn say_environment(args: &cli::Bus) {
    if args.salinity.is_none() || args.pressure_kpa.is_none() {
        message::note(
            "derived values use a salinity of 0 and 101.325 kPa where not given (--salinity, --pressure-kpa)",
        );
    }
}

/// Chooses the line settings: those asked for, the recording's, or what sensors leave the factory with.
fn line(args: &cli::Bus, input: &Input) -> LineSettings {
    if let Some(error) = input.misread() {
        message::warning(format_args!(
            "'{}' is text, but no hex text ({error}): read as raw bytes",
            input.name()
        ));
        message::hint("--input-format hex to read it as hex text all the same");
    }
    args.line.or(input.line()).unwrap_or_else(|| {
        let line = LineSettings::default();
        message::note(format_args!("'{}' does not name its line settings: {line} assumed", input.name()));
        line
    })
}

fn read_input<S: Sink>(
    mut input: Input,
    mut redactor: Option<Redactor>,
    pipeline: &mut Pipeline,
    sink: &mut S,
) -> Result<(), Failure> {
    let mut progress = Progress::new(S::PRINTS);
    let (mut bytes, mut frames) = (0, 0);
    let trouble = loop {
        match input.next_chunk() {
            Ok(Some(chunk)) => {
                bytes += chunk.bytes.len();
                frames += match &mut redactor {
                    None => take(&chunk, pipeline, sink),
                    Some(redactor) => {
                        redactor.push(&chunk);
                        take_redacted(redactor, pipeline, sink)
                    }
                };
            }
            Ok(None) => break None,
            Err(error) => break Some(error),
        }
        let waits = input.is_drained();
        if waits {
            progress.update(&input);
        }
        sink.pause(pipeline.settled_frame_id(), waits)?;
    };
    if let Some(redactor) = &mut redactor {
        redactor.finish();
        frames += take_redacted(redactor, pipeline, sink);
    }
    pipeline.finish();
    frames += drain(pipeline, sink);
    sink.pause(u64::MAX, true)?;
    progress.finish();
    if frames == 0 && bytes > MANY_BYTES {
        let name = input.name();
        message::warning(format_args!(
            "no frame in {bytes} bytes of '{name}'; is it Modbus RTU, at this speed?"
        ));
        message::hint("check speed and character format (--line)");
    }
    if let Some(back) = input.times_back() {
        let more = match back.count {
            1 => String::new(),
            count => format!(" and {} more", count - 1),
        };
        message::warning(format_args!(
            "'{}': the time goes back in {} {}{more}; the time before is taken instead",
            input.name(),
            back.unit,
            back.first
        ));
    }
    // What was read before the trouble has been shown.
    trouble.map_or(Ok(()), |error| Err(error.into()))
}

fn take(chunk: &Chunk<'_>, pipeline: &mut Pipeline, sink: &mut impl Sink) -> u64 {
    sink.chunk(chunk);
    pipeline.handle_bytes(chunk);
    drain(pipeline, sink)
}

fn take_redacted(redactor: &mut Redactor, pipeline: &mut Pipeline, sink: &mut impl Sink) -> u64 {
    let mut frames = 0;
    while let Some(chunk) = redactor.pop() {
        frames += take(&chunk, pipeline, sink);
    }
    frames
}

/// Hands over all events that are there; returns how many frames were among them.
pub(super) fn drain(pipeline: &mut Pipeline, sink: &mut impl Sink) -> u64 {
    let mut frames = 0;
    while let Some(event) = pipeline.poll_event() {
        frames += u64::from(matches!(event, Event::Frame(_)));
        sink.event(&event);
    }
    frames
}
