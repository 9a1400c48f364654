//! `rtutap export`: writes a recording in another format.

mod writer;

use std::path::Path;

use super::bus::{self, BUS, Origin, Sink, Wanted};
use super::failure::Failure;
use super::output::Output;
use crate::cli::{self, ExportKind};
use crate::decode::chunk::Chunk;
use crate::pipeline::Event;
use writer::Writer;

/// Runs the command.
pub(super) fn run(args: &cli::Export) -> Result<(), Failure> {
    let kind = kind(args)?;
    check(args, kind)?;
    let profiles = bus::profiles(&args.bus.profiles)?;
    let mut exporter = Exporter {
        writer: Writer::new(args, kind, &profiles)?,
        output: Output::later(&args.output),
        begun: false,
        derived: false,
    };
    let readings = !matches!(kind, ExportKind::Hex | ExportKind::Pcapng);
    let wanted = Wanted { readings, redacted: args.redact };
    let result = bus::read(&args.bus, &profiles, wanted, &mut exporter);
    if exporter.begun {
        // What was decoded before something went wrong is written first.
        exporter.writer.finish(&mut exporter.output)?;
    }
    if exporter.derived {
        bus::say_environment(&args.bus);
    }
    result
}

/// Chooses the format: the one asked for, or the extension's.
fn kind(args: &cli::Export) -> Result<ExportKind, Failure> {
    if let Some(kind) = args.format {
        return Ok(kind);
    }
    let name = args.output.display();
    let hint = "name it .hex, .csv, .jsonl, .pcapng or .parquet, or give --format";
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
    if !args.show.is_empty() && (args.wide || matches!(kind, ExportKind::Hex | ExportKind::Pcapng)) {
        let hint = "--show chooses the rows of CSV, JSON lines and Parquet";
        return Err(Failure::hinted("--show has nothing to choose here", hint));
    }
    if kind == ExportKind::Hex && args.bus.inputs.len() > 1 {
        let hint = "export each input to a file of its own";
        return Err(Failure::hinted("hex text holds one recording", hint));
    }
    if args.bus.inputs.iter().any(|input| is_same(input, &args.output)) {
        let hint = "name another file; the recording is kept";
        return Err(Failure::hinted(format!("--output '{name}' is an input as well"), hint));
    }
    Ok(())
}

/// Tells whether two paths lead to one file that exists.
fn is_same(input: &Path, output: &Path) -> bool {
    let real = |path: &Path| path.canonicalize().ok();
    real(input).is_some_and(|input| Some(input) == real(output))
}

/// Writes an export as it is decoded.
struct Exporter {
    writer: Writer,
    output: Output,
    /// Whether an input could be opened: what is written then replaces what stood there.
    begun: bool,
    derived: bool,
}

impl Sink for Exporter {
    const PRINTS: bool = false;

    fn begin(&mut self, origin: &Origin) {
        let out = &mut self.output.buffer;
        if !self.begun {
            self.writer.heading(origin, out);
            self.begun = true;
        }
        self.writer.begin(BUS, origin, out);
    }

    fn chunk(&mut self, chunk: &Chunk<'_>) {
        self.writer.chunk(chunk, &mut self.output.buffer);
    }

    fn event(&mut self, event: &Event<'_>) {
        if let Event::Reading { reading, .. } = event {
            self.derived |= reading.needs_environment();
        }
        self.writer.event(BUS, event, &mut self.output.buffer);
    }

    fn pause(&mut self, settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        self.writer.settle(settled_frame, &mut self.output.buffer)?;
        self.output.drain()
    }
}
