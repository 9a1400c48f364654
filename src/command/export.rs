//! `rtutap export`: writes a recording in another format.

use std::fs::File;
use std::io::{self, Seek, Write};
use std::path::Path;

use super::bus::{self, BUS, Origin, Sink, Wanted};
use super::decode::judge;
use super::failure::Failure;
use super::output::{GATHER, Output};
use crate::cli::{self, ExportKind, LinkKind};
use crate::decode::chunk::Chunk;
use crate::pipeline::Event;
use crate::report::hex::Hex;
#[cfg(feature = "parquet")]
use crate::report::parquet::{Parquet, Table};
use crate::report::pcapng::{LinkType, Pcapng};
use crate::report::redact::REMARK;
use crate::report::wide::Wide;
use crate::report::{Clock, Csv, Format, Json, Judge, Passing, Rows, Show};
use crate::time::MILLISECOND;

/// Runs the command.
pub(super) fn run(args: &cli::Export) -> Result<(), Failure> {
    let kind = kind(args)?;
    check(args, kind)?;
    let profiles = bus::profiles(&args.bus.profiles)?;
    let mut exporter = Exporter {
        writer: Writer::new(args, kind)?,
        output: Output::later(&args.output),
        redacted: args.redact,
        filter: args.filter.as_deref(),
        begun: false,
        derived: false,
    };
    let wanted =
        Wanted { readings: !matches!(kind, ExportKind::Hex | ExportKind::Pcapng), redacted: args.redact };
    let result = bus::read(&args.bus, &profiles, wanted, &mut exporter);
    if exporter.begun {
        // What was decoded before something went wrong is written first.
        exporter.finish()?;
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
        return Err(Failure::hinted(
            "hex text holds one recording",
            "export each input to a file of its own",
        ));
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

/// Writes one format.
enum Writer {
    Rows(Rows),
    Hex(Hex),
    Wide {
        table: Wide,
        passing: Passing,
        rows: File,
    },
    #[cfg(feature = "parquet")]
    Parquet {
        table: Box<Parquet>,
        passing: Passing,
    },
}

impl Writer {
    fn new(args: &cli::Export, kind: ExportKind) -> Result<Writer, Failure> {
        let judge = args.filter.as_deref().map(judge).transpose()?;
        let clock = Clock::new(args.time.into());
        let mut show: Vec<Show> = args.show.iter().copied().map(Show::from).collect();
        show.dedup();
        let rows = |show, format: Box<dyn Format>, judge| Ok(Writer::Rows(Rows::new(show, format, judge)));
        match (kind, &show[..]) {
            (ExportKind::Hex, _) => Ok(Writer::Hex(Hex::new(judge))),
            (ExportKind::Csv, _) if args.wide => Ok(Writer::Wide {
                table: Wide::new(clock),
                passing: Passing::new(judge),
                rows: tempfile::tempfile().map_err(spill_failed)?,
            }),
            (ExportKind::Csv, [] | [_]) => {
                let show = show.first().copied().unwrap_or(Show::Readings);
                let csv = Csv::new(show, clock);
                let csv = if args.redact { csv.with_remark(REMARK_KEY, REMARK) } else { csv };
                rows(vec![show], Box::new(csv), judge)
            }
            (ExportKind::Csv, _) => {
                let hint = "give one --show, or name the output .jsonl for several";
                Err(Failure::hinted("CSV has one kind of row", hint))
            }
            (ExportKind::Jsonl, _) => {
                if show.is_empty() {
                    show = vec![Show::Frames, Show::Transactions, Show::Readings];
                }
                let json = Json::default();
                let json = if args.redact { json.with_remark(REMARK) } else { json };
                rows(show, Box::new(json), judge)
            }
            (ExportKind::Pcapng, _) => {
                let link_type = match args.link_type {
                    LinkKind::RtacSerial => LinkType::RtacSerial,
                    LinkKind::User0 => LinkType::User0,
                };
                let remark = args.redact.then(|| REMARK.to_owned());
                rows(vec![Show::Frames], Box::new(Pcapng::new(link_type, remark)), judge)
            }
            (ExportKind::Parquet, show) => parquet_writer(args, show, judge),
        }
    }
}

#[cfg(not(feature = "parquet"))]
fn parquet_writer(_: &cli::Export, _: &[Show], _: Option<Judge>) -> Result<Writer, Failure> {
    let hint = "build it with 'cargo build --release --features parquet'";
    Err(Failure::hinted("this build of rtutap cannot write Parquet", hint))
}

#[cfg(feature = "parquet")]
fn parquet_writer(args: &cli::Export, show: &[Show], judge: Option<Judge>) -> Result<Writer, Failure> {
    let table = match show {
        [] | [Show::Readings] => Table::Readings,
        [Show::Transactions] => Table::Transactions,
        _ => {
            let hint = "give one --show, readings or transactions, and export once for each";
            return Err(Failure::hinted("Parquet has one kind of row", hint));
        }
    };
    let mut metadata = vec![("rtutap.version".to_owned(), env!("CARGO_PKG_VERSION").to_owned())];
    metadata.extend(args.filter.iter().map(|filter| ("rtutap.filter".to_owned(), filter.clone())));
    metadata.extend(args.redact.then(|| ("rtutap.remark".to_owned(), REMARK.to_owned())));
    let table = Parquet::new(table, metadata).map_err(Failure::new)?;
    Ok(Writer::Parquet { table: Box::new(table), passing: Passing::new(judge) })
}

/// The column that says that a CSV was redacted.
const REMARK_KEY: &str = "remark";

/// Writes an export as it is decoded.
struct Exporter<'a> {
    writer: Writer,
    output: Output,
    redacted: bool,
    filter: Option<&'a str>,
    begun: bool,
    derived: bool,
}

impl Exporter<'_> {
    /// Writes what stands before everything else.
    fn heading(&mut self, origin: &Origin) {
        let out = &mut self.output.buffer;
        // Writing to memory cannot fail.
        let _ = match &mut self.writer {
            Writer::Rows(rows) => {
                rows.heading(out);
                Ok(())
            }
            Writer::Hex(_) => hex_heading(origin, self.redacted, self.filter, out),
            _ => Ok(()),
        };
    }

    fn finish(&mut self) -> Result<(), Failure> {
        if let Writer::Wide { table, rows, .. } = &mut self.writer {
            table.finish_row(&mut self.output.buffer);
            spill(rows, &mut self.output.buffer)?;
            rows.rewind().map_err(spill_failed)?;
            let remark = self.redacted.then_some((REMARK_KEY, REMARK));
            table.finish(rows, &mut self.output, remark).map_err(|error| self.output.failed(&error))?;
        }
        #[cfg(feature = "parquet")]
        if let Writer::Parquet { table, .. } = &mut self.writer {
            table.finish(&mut self.output.buffer).map_err(Failure::new)?;
        }
        self.output.flush()
    }
}

/// Writes rows to a file without a name, from where they are taken at the end.
fn spill(file: &mut File, rows: &mut Vec<u8>) -> Result<(), Failure> {
    let result = file.write_all(rows);
    rows.clear();
    result.map_err(spill_failed)
}

fn spill_failed(error: io::Error) -> Failure {
    let directory = std::env::temp_dir();
    Failure::hinted(
        format!("cannot keep rows in '{}': {error}", directory.display()),
        "make room there, or set TMPDIR",
    )
}

fn hex_heading(origin: &Origin, redacted: bool, filter: Option<&str>, out: &mut Vec<u8>) -> io::Result<()> {
    writeln!(out, "# rtutap {}: a line a read, with the time it ended", env!("CARGO_PKG_VERSION"))?;
    if !origin.line_is_assumed {
        writeln!(out, "# line {}", origin.line)?;
    }
    if let Some(ns) = origin.adapter_hold_ns {
        writeln!(out, "# adapter-hold {} ms", ns as f64 / MILLISECOND as f64)?;
    }
    if let Some(filter) = filter {
        // A line's end within would end the comment.
        writeln!(out, "# only what passes: {}", filter.split_whitespace().collect::<Vec<_>>().join(" "))?;
    }
    if redacted {
        writeln!(out, "# {REMARK}")?;
    }
    Ok(())
}

impl Sink for Exporter<'_> {
    const PRINTS: bool = false;

    fn begin(&mut self, origin: &Origin) {
        if !self.begun {
            self.heading(origin);
            self.begun = true;
        }
        if let Writer::Rows(rows) = &mut self.writer {
            rows.begin(BUS, origin.line, &mut self.output.buffer);
        }
    }

    fn chunk(&mut self, chunk: &Chunk<'_>) {
        if let Writer::Hex(hex) = &mut self.writer {
            hex.chunk(chunk, &mut self.output.buffer);
        }
    }

    fn event(&mut self, event: &Event<'_>) {
        let out = &mut self.output.buffer;
        if let Event::Reading { reading, .. } = event {
            self.derived |= reading.derived;
        }
        match &mut self.writer {
            Writer::Rows(rows) => rows.event(BUS, event, out),
            Writer::Hex(hex) => hex.event(BUS, event),
            Writer::Wide { table, passing, .. } => {
                if passing.passes(BUS, event) {
                    table.event(BUS, event, out);
                }
            }
            #[cfg(feature = "parquet")]
            Writer::Parquet { table, passing } => {
                if passing.passes(BUS, event) {
                    table.event(BUS, event);
                }
            }
        }
    }

    fn pause(&mut self, settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        let out = &mut self.output.buffer;
        match &mut self.writer {
            Writer::Rows(rows) => rows.settle(settled_frame, out),
            Writer::Hex(hex) => hex.settle(settled_frame, out),
            Writer::Wide { rows, .. } => return if out.len() < GATHER { Ok(()) } else { spill(rows, out) },
            #[cfg(feature = "parquet")]
            Writer::Parquet { table, .. } => table.drain(out).map_err(Failure::new)?,
        }
        self.output.drain()
    }
}
