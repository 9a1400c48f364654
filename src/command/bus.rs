//! What `decode`, `info` and others share: from the inputs on the command line to a session's events.

use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use super::ahead::{self, Reads, Stretch};
use super::being_written::is_being_written;
use super::failure::Failure;
use super::message;
use super::progress::Progress;
use super::session::{Origin, Session, Setup, Sink};
use crate::capture::mcap::{Anchor, BusSettings, Facts, Preface, part_path};
use crate::capture::{BUS, Input, InputFormat, Item};
use crate::cli;
use crate::device::{Devices, Environment, Profile, Profiles};
use crate::line::LineSettings;
use crate::report::redact::Secrets;

/// How long to wait for a recording to grow before looking again.
const PATIENCE: Duration = Duration::from_millis(100);

/// What the names of profiles that are kept in a recording begin with.
const ATTACHED_PROFILES: &str = "profiles/";

/// After how many items that are there already rows are written.
const PAUSE_AFTER: usize = 64;

/// After how many items the bar moves on.
const PROGRESS_AFTER: usize = 64 * PAUSE_AFTER;

/// More bytes than this without a single frame are worth a warning.
const MANY_BYTES: usize = 1000;

/// Refuses a command line that contradicts itself, or names inputs that aren't there.
pub(super) fn check(args: &cli::Bus) -> Result<(), Failure> {
    check_devices(&args.equipment)?;
    if args.inputs.iter().filter(|path| path.as_os_str() == "-").count() > 1 {
        return Err(Failure::hinted("'-' was given twice", "standard input can be read only once"));
    }
    args.inputs.iter().try_for_each(|path| Ok(Input::check(path)?))
}

/// Refuses to be told two things about an address.
pub(super) fn check_devices(args: &cli::Equipment) -> Result<(), Failure> {
    for (index, later) in args.devices.iter().enumerate() {
        let mut earlier = args.devices[..index].iter().filter(|earlier| earlier.address == later.address);
        if let Some(earlier) = earlier.find(|earlier| earlier.device != later.device) {
            let (address, device) = (later.address, &later.device);
            let message =
                format!("--device says that {address} is {} and that it is {device}", earlier.device);
            return Err(Failure::hinted(message, "give one --device for an address"));
        }
    }
    Ok(())
}

/// Returns the profiles kept in recordings, over them the built-in ones, and over those the ones given.
pub(super) fn profiles(
    files: &[impl AsRef<Path>],
    inputs: &[impl AsRef<Path>],
) -> Result<Arc<Profiles>, Failure> {
    let mut profiles = Profiles::built_in();
    for path in inputs {
        let attached = preface(path.as_ref()).attachments;
        let texts = attached.iter().filter(|(name, _)| name.starts_with(ATTACHED_PROFILES));
        for (name, text) in texts {
            let name = format!("{} of '{}'", name, path.as_ref().display());
            match Profile::from_toml(&String::from_utf8_lossy(text), &name) {
                Ok(profile) if profiles.get(&profile.id).is_none() => profiles.add(profile),
                Ok(_) => {}
                Err(error) => message::warning(error),
            }
        }
    }
    for file in files {
        profiles.add(profile(file.as_ref())?);
    }
    Ok(Arc::new(profiles))
}

/// Returns what a recording says before its first bytes; nothing for what is none.
fn preface(path: &Path) -> Preface {
    // A pipe can be opened once only.
    if !path.is_file() {
        return Preface::default();
    }
    #[expect(clippy::disallowed_methods, reason = "recordings are files")]
    let file = File::open(path);
    file.and_then(Preface::read).unwrap_or_default() // what is wrong with the file is said when it is read
}

/// Returns what ties the times of the inputs to a monotonic clock, where they say it.
pub(super) fn anchor(inputs: &[PathBuf]) -> Option<Anchor> {
    in_order(inputs).front().and_then(|path| preface(path).anchor)
}

/// Returns the profiles kept in the inputs and those given, as files to keep in a recording: name, type, content.
pub(super) fn attachments(args: &cli::Bus) -> Result<Vec<(String, String, Vec<u8>)>, Failure> {
    let kept = args.inputs.iter().flat_map(|path| preface(path).attachments);
    let mut files: BTreeMap<String, Vec<u8>> =
        kept.filter(|(name, _)| name.starts_with(ATTACHED_PROFILES)).collect();
    files.extend(given_profiles(&args.equipment)?);
    Ok(as_attachments(files))
}

/// Returns the profiles given, as [`attachments`] does.
pub(super) fn given_attachments(args: &cli::Equipment) -> Result<Vec<(String, String, Vec<u8>)>, Failure> {
    Ok(as_attachments(given_profiles(args)?))
}

fn as_attachments(files: BTreeMap<String, Vec<u8>>) -> Vec<(String, String, Vec<u8>)> {
    files.into_iter().map(|(name, text)| (name, "application/toml".to_owned(), text)).collect()
}

fn given_profiles(args: &cli::Equipment) -> Result<BTreeMap<String, Vec<u8>>, Failure> {
    let mut files = BTreeMap::new();
    for path in &args.profiles {
        let id = profile(path)?.id;
        #[expect(clippy::disallowed_methods, reason = "profiles are files")]
        let text = std::fs::read(path).map_err(|error| Failure::reading(path, &error))?;
        files.insert(format!("{ATTACHED_PROFILES}{id}.toml"), text);
    }
    Ok(files)
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

/// Says what is wanted of the inputs.
#[derive(Clone, Debug, Default)]
pub(super) struct Wanted {
    pub(super) readings: bool,
    pub(super) findings: bool,
    /// Whether rows are printed as they come.
    pub(super) prints: bool,
    /// Whether to wait for recordings to grow.
    pub(super) follow: bool,
    /// Whether the bytes are not decoded.
    pub(super) raw_only: bool,
    /// The serial numbers to blank, beside those found on the way; `None` to blank none.
    pub(super) secrets: Option<Arc<Secrets>>,
}

impl Wanted {
    fn decodes(&self) -> bool {
        !self.raw_only
    }
}

/// Reads all inputs, one after the other; counters run on. Parts of one session are one stream.
///
/// Hands to `done` what each recording says of itself, once it was read, and whether somebody is writing it.
pub(super) fn read(
    args: &cli::Bus,
    profiles: &Arc<Profiles>,
    wanted: Wanted,
    sink: &mut impl Sink,
    mut done: impl FnMut(&Facts, bool),
) -> Result<(), Failure> {
    let setup = Setup {
        line: args.line.and_then(cli::Line::settings),
        adapter_hold_ns: args.adapter_hold.map(|hold| hold.0),
        devices: devices(&args.equipment, profiles)?,
        profiles: Arc::clone(profiles),
        readings: wanted.readings,
        findings: wanted.findings,
        decodes: wanted.decodes(),
        secrets: wanted.secrets.clone(),
    };
    let mut session = Session::new(&setup);
    let mut paths = in_order(&args.inputs);
    let mut before: Option<Input> = None;
    while let Some(path) = paths.pop_front() {
        // It may be finished while it is read.
        let is_being_written = is_being_written(&path);
        let mut input = Input::open(&path, args.input_format.map(Into::into))?;
        if wanted.follow && !input.follow() {
            let hint = "only recordings in MCAP say where they end; pipe what grows into 'rtutap decode -'";
            return Err(Failure::hinted(format!("cannot follow '{}'", input.name()), hint));
        }
        let continues = before.as_ref().is_some_and(|before| input.continue_after(before));
        if !continues {
            session.finish(sink)?;
        }
        let result = read_input(&mut input, &mut session, &wanted, sink);
        if result.is_err() {
            session.finish(sink)?; // what was read before the trouble is shown
        }
        result?;
        if let Some(mut facts) = input.facts().cloned() {
            if is_being_written {
                facts.forget_cut();
            }
            report(input.name(), &facts, is_being_written, wanted.follow);
            done(&facts, is_being_written);
        }
        if wanted.follow && paths.is_empty() {
            paths.extend(input.facts().and_then(|facts| next_part(&path, facts)));
        }
        before = Some(input);
    }
    session.finish(sink)
}

/// Brings the parts of each session into order, where they stand side by side.
pub(super) fn in_order(inputs: &[PathBuf]) -> VecDeque<PathBuf> {
    let mut ordered: Vec<_> =
        inputs.iter().map(|path| (preface(path).session.unwrap_or_default(), path)).collect();
    for parts in ordered.chunk_by_mut(|(a, _), (b, _)| a.id == b.id && !a.id.is_empty()) {
        parts.sort_by_key(|(session, _)| session.part_index);
    }
    ordered.into_iter().map(|(_, path)| path.clone()).collect()
}

/// Tells whether all inputs are parts of one session.
pub(super) fn is_one_session(inputs: &[PathBuf]) -> bool {
    let mut ids = inputs.iter().map(|path| preface(path).session.map(|session| session.id));
    let first = ids.next().flatten();
    first.is_some() && ids.all(|id| id == first)
}

/// Returns the part that follows one that was rotated, once it is there.
pub(super) fn next_part(path: &Path, facts: &Facts) -> Option<PathBuf> {
    let index = facts.session.as_ref().filter(|_| facts.end.as_deref() == Some("rotated"))?.part_index;
    let path = Path::new(path.to_str()?.trim_end_matches(".part")).to_owned();
    let suffix = format!("-{index:04}");
    let stem = path.file_stem()?.to_str()?;
    let first = path.with_file_name(format!("{}.mcap", stem.strip_suffix(&suffix).unwrap_or(stem)));
    let next = part_path(&first, index + 1);
    let mut unfinished = next.clone().into_os_string();
    unfinished.push(".part");
    let unfinished = PathBuf::from(unfinished);
    // It is there within moments; a recording whose disk failed has none.
    for _ in 0..50 {
        if let Some(found) = [&next, &unfinished].into_iter().find(|path| path.exists()) {
            return Some(found.clone());
        }
        wait();
    }
    None
}

pub(super) fn wait() {
    #[expect(clippy::disallowed_methods, reason = "a file does not tell when it grows")]
    std::thread::sleep(PATIENCE);
}

/// Returns devices of which nothing is known but what the command line says.
pub(super) fn devices(args: &cli::Equipment, profiles: &Arc<Profiles>) -> Result<Devices, Failure> {
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
pub(super) fn say_environment(args: &cli::Equipment) {
    if args.salinity.is_none() || args.pressure_kpa.is_none() {
        message::note(
            "derived values use a salinity of 0 and 101.325 kPa where not given (--salinity, --pressure-kpa)",
        );
    }
}

/// Says how an input is to be taken where it does not say it in time.
struct About {
    name: String,
    line: Option<LineSettings>,
    adapter_hold_ns: Option<i64>,
    is_raw: bool,
    /// Why it was taken for raw bytes though it is text.
    misread: Option<String>,
}

impl About {
    fn of(input: &Input) -> About {
        About {
            name: input.name().to_owned(),
            line: input.line(),
            adapter_hold_ns: input.adapter_hold_ns(),
            is_raw: input.format() == InputFormat::Raw,
            misread: input.misread().map(ToString::to_string),
        }
    }

    /// Begins a bus of which nothing was said so far; returns the line settings it is decoded with.
    ///
    /// They are the input's own, or what sensors leave the factory with.
    fn begin(
        &self,
        bus: &str,
        session: &mut Session<'_>,
        sink: &mut impl Sink,
    ) -> Result<LineSettings, Failure> {
        let name = &self.name;
        if let Some(error) = &self.misread {
            message::warning(format_args!("'{name}' is text, but no hex text ({error}): read as raw bytes"));
            message::hint("--input-format hex to read it as hex text all the same");
        }
        let said = session.line().or(self.line);
        let line = said.unwrap_or_else(|| {
            let line = LineSettings::default();
            // The first bus is all of most files.
            match session.is_empty() {
                true => {
                    message::note(format_args!("'{name}' does not name its line settings: {line} assumed"))
                }
                false => message::note(format_args!(
                    "'{name}' does not name the line settings of bus '{bus}': {line} assumed"
                )),
            }
            line
        });
        let adapter_hold_ns = self.adapter_hold_ns;
        let settings = BusSettings { name: bus.to_owned(), line, adapter_hold_ns, ..BusSettings::default() };
        session.begin(Origin { settings, line_is_assumed: said.is_none(), is_raw: self.is_raw }, sink)?;
        Ok(line)
    }
}

/// Takes the items of an input into a session.
struct Intake<'a, 's, S> {
    about: About,
    session: &'a mut Session<'s>,
    sink: &'a mut S,
    progress: Progress,
    bytes: usize,
    items: usize,
}

impl<S: Sink> Intake<'_, '_, S> {
    /// Takes an item, `position` bytes into the file; `waits` when the next one is not there yet.
    #[inline]
    fn take(&mut self, item: &Item<'_>, position: u64, waits: bool) -> Result<(), Failure> {
        if let Item::Chunk { chunk, .. } = item {
            self.bytes += chunk.bytes.len();
        }
        if !self.session.take(item, self.sink)? {
            self.begin(item)?;
        }
        self.count(1, position, waits)
    }

    /// Takes what was read ahead.
    fn take_stretch(&mut self, stretch: Stretch<'_>, position: u64) -> Result<(), Failure> {
        match stretch {
            Stretch::Item(item) => self.take(&item, position, false),
            Stretch::Reads(bus, reads) => self.take_reads(bus, reads, position),
        }
    }

    fn take_reads(&mut self, bus: &str, reads: Reads<'_>, position: u64) -> Result<(), Failure> {
        if self.session.take_reads(bus, reads.clone(), self.sink)? {
            self.bytes += reads.bytes();
            return self.count(reads.len(), position, false);
        }
        for (chunk, ready) in reads {
            self.take(&Item::Chunk { bus, chunk, ready }, position, false)?;
        }
        Ok(())
    }

    /// Counts items; writes rows and moves the bar now and then.
    #[inline]
    fn count(&mut self, items: usize, position: u64, waits: bool) -> Result<(), Failure> {
        let before = self.items;
        self.items += items;
        let passes = |step: usize| waits || before / step != self.items / step;
        if passes(PROGRESS_AFTER) {
            self.progress.update(position);
        }
        if passes(PAUSE_AFTER) { self.pause(waits) } else { Ok(()) }
    }

    /// Begins the bus of an item, and takes it.
    #[cold]
    fn begin(&mut self, item: &Item<'_>) -> Result<(), Failure> {
        let Some(bus) = item.bus() else { return Ok(()) };
        self.about.begin(bus, self.session, self.sink)?;
        self.session.take(item, self.sink).map(drop)
    }

    fn pause(&mut self, waits: bool) -> Result<(), Failure> {
        self.sink.pause(self.session.settled_frame_id(), waits)
    }
}

fn read_input(
    input: &mut Input,
    session: &mut Session<'_>,
    wanted: &Wanted,
    sink: &mut impl Sink,
) -> Result<(), Failure> {
    let about = About::of(input);
    let progress = Progress::new(input.name(), input.size(), wanted.prints);
    let frames = session.frames();
    // Elsewhere the first item says which bus it is of.
    if input.format() == InputFormat::Table {
        let line = about.begin(BUS, session, sink)?;
        input.use_line(line);
    }
    let mut intake = Intake { about, session, sink, progress, bytes: 0, items: 0 };
    if input.format() == InputFormat::Mcap && input.size().is_some() && !wanted.follow {
        ahead::read(input, |stretch, position| intake.take_stretch(stretch, position))?;
    } else {
        read_in_turn(input, &mut intake)?;
    }
    let Intake { progress, bytes, .. } = intake;
    progress.finish();
    let frames = session.frames() - frames;
    tracing::info!("read '{}': {bytes} bytes, {frames} frames", input.name());
    say_doubts(input, if wanted.decodes() && frames == 0 { bytes } else { 0 });
    Ok(())
}

/// Reads an input item by item, and waits for one that grows.
fn read_in_turn(input: &mut Input, intake: &mut Intake<'_, '_, impl Sink>) -> Result<(), Failure> {
    loop {
        if input.advance()? {
            intake.take(&input.item(), input.position(), input.is_drained())?;
        } else if input.is_finished() {
            return Ok(());
        } else {
            intake.pause(true)?;
            wait();
        }
    }
}

/// Says what is strange about an input in which so many bytes gave no frame at all.
fn say_doubts(input: &Input, without_frame: usize) {
    let name = input.name();
    if without_frame > MANY_BYTES {
        message::warning(format_args!(
            "no frame in {without_frame} bytes of '{name}'; is it Modbus RTU, at this speed?"
        ));
        message::hint("check speed and character format (--line)");
    }
    if let Some(cut) = input.cut() {
        message::warning(format_args!("'{}', {cut}", input.name()));
        message::hint(cut.hint);
    }
    if let Some(back) = input.times_back() {
        let more = match back.count {
            1 => String::new(),
            count => format!(" and {} more", count - 1),
        };
        message::warning(format_args!(
            "'{name}': the time goes back in {} {}{more}; the time before is taken instead",
            back.unit, back.first
        ));
    }
}

/// Says what is missing in a recording, and that it can be mended.
fn report(name: &str, facts: &Facts, is_being_written: bool, follows: bool) {
    say_damage(name, facts);
    let is_open = facts.end.is_none() && facts.session.is_some();
    if is_open && is_being_written {
        if !follows {
            message::note(format_args!("'{name}' is being written; this is what is in it so far"));
            message::hint("'rtutap decode --follow' and 'rtutap replay --follow' go on as it grows");
        }
        return;
    }
    if is_open {
        message::warning(format_args!(
            "'{name}' was not closed: what had not been written to it when it ended is lost"
        ));
    }
    if is_open || facts.damage_count > 0 {
        message::hint(format_args!("'rtutap recover {name} -o FILE' makes a whole file of what is there"));
    }
}

/// Says where a recording cannot be read, and what is lost for it.
pub(super) fn say_damage(name: &str, facts: &Facts) {
    if let Some(first) = facts.damage.first() {
        let (count, bytes, offset) = (facts.damage_count, facts.damage_bytes, first.offset);
        let places = if count == 1 { "place" } else { "places" };
        message::warning(format_args!(
            "'{name}' cannot be read in {count} {places}, {bytes} bytes, first at byte {offset}: {}",
            first.cause
        ));
    }
    if !facts.guessed_buses.is_empty() {
        message::warning(format_args!(
            "'{name}': the definition of a channel is lost; its messages can only be bytes of a bus, taken for those of {}",
            facts.guessed_buses.join(", ")
        ));
    }
    if facts.undefined_messages > 0 {
        message::warning(format_args!(
            "'{name}': {} can be read, but the definition of the channel is lost",
            match facts.undefined_messages {
                1 => "a message".to_owned(),
                count => format!("{count} messages"),
            }
        ));
    }
    if facts.lost_bytes > 0 {
        let bytes = if facts.lost_bytes == 1 { "byte" } else { "bytes" };
        message::warning(format_args!("'{name}': {} {bytes} of the bus are not in it", facts.lost_bytes));
    }
}
