//! `rtutap export`: writes a recording in another format.

mod survey;
#[cfg(test)]
mod tests;
mod writer;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::UNIX_EPOCH;

use super::bus::{self, Wanted};
use super::failure::Failure;
use super::message;
use super::output::{Output, real, unfinished};
use super::printing::{judge, say_none};
use super::scribe::Scribe;
use super::session::{Origin, Sink};
use crate::capture::Item;
use crate::capture::mcap::Options;
use crate::cli::{self, ExportKind};
use crate::device::Profiles;
use crate::pipeline::Event;
use crate::report::redact::Secrets;
use crate::time::Timestamp;
use writer::{Writer, remarks};

/// Refuses --time where nothing shows times; what the environment and the configuration say is for all commands.
pub(super) fn check_time(args: &cli::Export) -> Result<(), Failure> {
    let is_given = args.time.is_some() && std::env::var_os("RTUTAP_TIME").is_none();
    if is_given && !matches!(kind(args)?, ExportKind::Csv) {
        let hint = "times are nanoseconds since 1970 elsewhere, and in UTC in hex text";
        return Err(Failure::hinted("--time is for CSV", hint));
    }
    Ok(())
}

/// Runs the command.
pub(super) fn run(args: &cli::Export) -> Result<(), Failure> {
    let kind = kind(args)?;
    check(args, kind)?;
    if !args.redact {
        return write(args, kind, None);
    }
    let mut args = args.clone();
    // Removed when all is done.
    let _kept = survey::keep_streams(&mut args.bus.inputs)?;
    let profiles = bus::profiles(&args.bus.equipment.profiles, &args.bus.inputs)?;
    let secrets = survey::secrets(&args.bus, &profiles)?;
    write(&args, kind, Some(Arc::new(secrets)))
}

fn write(args: &cli::Export, kind: ExportKind, secrets: Option<Arc<Secrets>>) -> Result<(), Failure> {
    let profiles = bus::profiles(&args.bus.equipment.profiles, &args.bus.inputs)?;
    if kind == ExportKind::Mcap {
        return write_mcap(args, &profiles, secrets);
    }
    let mut exporter = Exporter {
        writer: Writer::new(args, kind, &profiles)?,
        output: Output::later(&args.output),
        begun: false,
        has_bytes: false,
        is_cut_hex: kind == ExportKind::Hex && args.filter.is_some(),
        derived: false,
    };
    let readings = !matches!(kind, ExportKind::Hex | ExportKind::Pcapng);
    let findings = args.filter.is_some();
    let wanted = Wanted { readings, findings, secrets, ..Wanted::default() };
    let result = bus::read(&args.bus, &profiles, wanted, &mut exporter, |_, _| {});
    // What was decoded before something went wrong is written where nothing stands yet.
    let is_worth_it = exporter.has_bytes && !args.output.is_file() && !exporter.output.is_broken();
    let is_kept = result.is_ok() && exporter.begun || is_worth_it;
    if is_kept {
        exporter.writer.finish(&mut exporter.output)?;
        exporter.output.keep()?;
    } else {
        say_untouched(&args.output);
    }
    if result.is_ok() {
        say_none(exporter.writer.none_of());
    }
    if exporter.derived {
        bus::say_environment(&args.bus.equipment);
    }
    result
}

/// Writes a recording in MCAP, with the profiles given in it.
fn write_mcap(
    args: &cli::Export,
    profiles: &Arc<Profiles>,
    secrets: Option<Arc<Secrets>>,
) -> Result<(), Failure> {
    let mut attachments = bus::attachments(&args.bus)?;
    if let Some(secrets) = &secrets {
        for (name, _, content) in &mut attachments {
            *name = secrets.blank(name, profiles);
            secrets.blank_bytes(content, profiles);
        }
    }
    let session_id = session_id(&args.bus.inputs[0]); // there is one at least
    let judge = args.filter.as_deref().map(|text| judge("--filter", text, profiles)).transpose()?;
    let anchor = bus::anchor(&args.bus.inputs);
    let options = Options { session_id, anchor, attachments, ..Options::default() };
    let output = real(&args.output);
    let mut scribe = Scribe::create(&output, options)?;
    if let Some(judge) = judge {
        scribe = scribe.with_filter(judge);
    }
    if args.redact || args.filter.is_some() {
        let decoded = if args.filter.is_some() { "decoded messages: " } else { "" };
        scribe = scribe.with_remark(format!("{decoded}{}", remarks(args).join("; ")));
    }
    let wanted =
        Wanted { readings: true, findings: true, secrets, raw_only: args.raw_only, ..Wanted::default() };
    let mut result = bus::read(&args.bus, profiles, wanted, &mut scribe, |_, _| {});
    for (time, text) in &args.notes {
        let note = Item::Note { time: Some(*time), text };
        result = result.and_then(|()| scribe.received(&note));
    }
    // What was read before something went wrong is written where nothing stands yet.
    if scribe.has_begun() && (result.is_ok() || !output.exists()) {
        say_none(scribe.none_of().filter(|_| result.is_ok()));
        result = result.and(scribe.finish().map(drop));
    } else {
        scribe.abandon();
        say_untouched(&args.output);
    }
    if result.is_err() {
        // It is there where writing to it failed.
        let _ = std::fs::remove_file(unfinished(&output));
    }
    result
}

/// Says that a file is still the one that stood there.
fn say_untouched(output: &Path) {
    if output.is_file() {
        message::note(format_args!("'{}' is left as it was", output.display()));
    }
}

/// Returns what to ask for, where a screen asks.
pub(super) fn of(
    inputs: Vec<PathBuf>,
    filter: Option<String>,
    output: PathBuf,
    equipment: cli::Equipment,
    notes: Vec<(Timestamp, String)>,
) -> cli::Export {
    cli::Export {
        bus: cli::Bus { inputs, line: None, input_format: None, adapter_hold: None, equipment },
        output,
        format: None,
        show: Vec::new(),
        wide: false,
        filter,
        redact: false,
        raw_only: false,
        link_type: None,
        time: None,
        notes,
    }
}

/// Names the session of an export: the same for the same file, as far as its size and time tell. Its name is nobody's
/// business.
fn session_id(input: &Path) -> String {
    let metadata = input.metadata().ok();
    let size = metadata.as_ref().map_or(0, |metadata| metadata.len());
    let changed = metadata.and_then(|metadata| metadata.modified().ok()?.duration_since(UNIX_EPOCH).ok());
    format!("export-{size}-{}", changed.unwrap_or_default().as_nanos())
}

/// Chooses the format: the one asked for, or the extension's.
fn kind(args: &cli::Export) -> Result<ExportKind, Failure> {
    if let Some(kind) = args.format {
        return Ok(kind);
    }
    let name = args.output.display();
    let hint = "name it .mcap, .hex, .csv, .jsonl, .pcapng or .parquet, or give --format";
    let extension = args.output.extension().and_then(|extension| extension.to_str());
    let extension = extension.ok_or_else(|| {
        Failure::hinted(format!("--output '{name}' has no extension that says what to write"), hint)
    })?;
    ExportKind::of(extension)
        .ok_or_else(|| Failure::hinted(format!("--output '{name}': no format is called '{extension}'"), hint))
}

/// Refuses options that do not go together, and to write over an input.
fn check(args: &cli::Export, kind: ExportKind) -> Result<(), Failure> {
    let name = args.output.display();
    if args.wide && kind != ExportKind::Csv {
        return Err(Failure::hinted("--wide is for CSV", "name the output .csv"));
    }
    let keeps_reads = matches!(kind, ExportKind::Hex | ExportKind::Mcap);
    if args.raw_only && kind != ExportKind::Mcap {
        return Err(Failure::hinted("--raw-only is for MCAP", "name the output .mcap"));
    }
    if args.raw_only && args.filter.is_some() {
        let hint =
            "MCAP keeps every byte; --filter chooses among what they decode to, which --raw-only leaves out";
        return Err(Failure::hinted("--raw-only leaves nothing to --filter", hint));
    }
    if args.link_type.is_some() && kind != ExportKind::Pcapng {
        return Err(Failure::hinted("--link-type is for pcapng", "name the output .pcapng"));
    }
    if kind == ExportKind::Mcap && args.output.as_os_str() == "-" {
        return Err(Failure::hinted("MCAP needs a file, not standard output", "name it with -o"));
    }
    if !args.show.is_empty() && (args.wide || keeps_reads || kind == ExportKind::Pcapng) {
        let hint = "--show chooses the rows of CSV, JSON lines and Parquet";
        return Err(Failure::hinted("--show has nothing to choose here", hint));
    }
    if keeps_reads && args.bus.inputs.len() > 1 && !bus::is_one_session(&args.bus.inputs) {
        let hint = "export each input to a file of its own";
        return Err(Failure::hinted("hex text and MCAP hold one recording", hint));
    }
    let on_the_way = unfinished(&real(&args.output));
    if args.bus.inputs.iter().any(|input| is_same(input, &on_the_way)) {
        let hint = "name another file with -o; the input is kept";
        let problem =
            format!("'{}' is an input, and what '{name}' is called until it is whole", on_the_way.display());
        return Err(Failure::hinted(problem, hint));
    }
    if args.bus.inputs.iter().any(|input| is_same(input, &args.output)) {
        let hint = "name another file; the recording is kept";
        return Err(Failure::hinted(format!("--output '{name}' is an input as well"), hint));
    }
    Ok(())
}

/// Tells whether two paths lead to one file that exists.
fn is_same(input: &Path, output: &Path) -> bool {
    let found = |path: &Path| path.canonicalize().ok();
    found(input).is_some_and(|input| Some(input) == found(output))
}

/// Writes an export as it is decoded.
struct Exporter {
    writer: Writer,
    output: Output,
    /// Whether an input could be opened.
    begun: bool,
    /// Whether a byte was received that goes out.
    has_bytes: bool,
    /// Whether it is hex text of what passes a filter.
    is_cut_hex: bool,
    derived: bool,
}

impl Sink for Exporter {
    const RECEIVES: bool = true;

    fn begin(&mut self, origin: &Origin) -> Result<(), Failure> {
        if self.is_cut_hex && self.begun {
            self.has_bytes = false;
            let hint = "export it to MCAP, CSV or JSON lines";
            let problem = "hex text of what passes a filter holds one bus with one setting; this has more";
            return Err(Failure::hinted(problem, hint));
        }
        let out = &mut self.output.buffer;
        if self.begun {
            self.writer.change(origin, out);
        } else {
            self.writer.heading(origin, out);
            self.begun = true;
        }
        self.writer.begin(origin, out);
        Ok(())
    }

    fn received(&mut self, item: &Item<'_>) -> Result<(), Failure> {
        self.has_bytes |= matches!(item, Item::Chunk { .. });
        self.writer.received(item, &mut self.output.buffer);
        Ok(())
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        if let Event::Reading { reading, .. } = event {
            self.derived |= reading.needs_environment();
        }
        self.writer.event(bus, event, &mut self.output.buffer);
    }

    fn pause(&mut self, settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        self.writer.settle(settled_frame, &mut self.output.buffer)?;
        self.output.drain()
    }
}
