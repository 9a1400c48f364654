//! What writes each format.

use std::fs::File;
use std::io::{self, Seek, Write};

use super::super::failure::Failure;
use super::super::output::{GATHER, Output};
use super::super::printing::judge;
use super::super::session::Origin;
use crate::capture::{BUS, Item, hex_heading};
use crate::cli::{self, ExportKind, LinkKind};
use crate::device::Profiles;
use crate::line::LineSettings;
use crate::pipeline::Event;
use crate::report::hex::Hex;
#[cfg(feature = "parquet")]
use crate::report::parquet::{Parquet, Table};
use crate::report::pcapng::{LinkType, Pcapng};
use crate::report::redact::{REMARK, REMARK_KEY};
use crate::report::wide::Wide;
use crate::report::{Clock, Csv, Format, Json, Judge, Passing, Rows, Show};

/// The settings of a bus as hex text says them: those of the line, and how long the adapter keeps a byte back.
type HexSettings = (LineSettings, Option<i64>);

/// Writes one format.
pub(super) enum Writer {
    /// Rows, lines or packets that come and go.
    Rows(Rows),
    /// The reads, below what is said about them; and what a reader takes for a bus of which nothing is said.
    Hex { reads: Hex, remarks: Vec<String>, unsaid: HexSettings },
    /// A table whose heading is known at the end; until then its rows are in a file without a name.
    Wide { table: Wide, passing: Passing, rows: File, redacted: bool },
    /// Row groups.
    #[cfg(feature = "parquet")]
    Parquet { table: Box<Parquet>, passing: Passing },
}

impl Writer {
    /// Makes the writer of a format.
    pub(super) fn new(args: &cli::Export, kind: ExportKind, profiles: &Profiles) -> Result<Writer, Failure> {
        let judge = args.filter.as_deref().map(|text| judge("--filter", text, profiles)).transpose()?;
        let clock = Clock::new(args.time.unwrap_or_default().into());
        let mut show: Vec<Show> = args.show.iter().copied().map(Show::from).collect();
        show.dedup();
        let format: Box<dyn Format> = match kind {
            ExportKind::Hex => {
                let (reads, remarks) = (Hex::new(judge), remarks(args));
                return Ok(Writer::Hex { reads, remarks, unsaid: HexSettings::default() });
            }
            ExportKind::Parquet => return parquet(args, &show, judge),
            // It has a writer of its own.
            ExportKind::Mcap => return Err(Failure::new("MCAP is not written row by row")),
            ExportKind::Csv if args.wide => {
                let (table, passing) = (Wide::new(clock), Passing::new(judge));
                let rows = tempfile::tempfile().map_err(spill_failed)?;
                return Ok(Writer::Wide { table, passing, rows, redacted: args.redact });
            }
            ExportKind::Csv => {
                show = vec![only(&show, "CSV", "give one --show, or name the output .jsonl for several")?];
                let csv = Csv::new(show[0], clock);
                Box::new(if args.redact { csv.with_remark(REMARK_KEY, REMARK) } else { csv })
            }
            ExportKind::Jsonl => {
                if show.is_empty() {
                    show = vec![Show::Frames, Show::Transactions, Show::Readings];
                }
                let json = Json::default();
                Box::new(if args.redact { json.with_remark(REMARK) } else { json })
            }
            ExportKind::Pcapng => {
                show = vec![Show::Frames];
                let remarks = remarks(args);
                let remark = (!remarks.is_empty()).then(|| remarks.join("; "));
                Box::new(Pcapng::new(link_type(args.link_type.unwrap_or(LinkKind::RtacSerial)), remark))
            }
        };
        Ok(Writer::Rows(Rows::new(show, format, judge)))
    }

    /// Writes what stands before everything else.
    pub(super) fn heading(&mut self, origin: &Origin, out: &mut Vec<u8>) {
        match self {
            Writer::Rows(rows) => rows.heading(out),
            Writer::Hex { reads, remarks, unsaid } => {
                let line = (!origin.line_is_assumed).then_some(origin.settings.line);
                out.extend_from_slice(concat!("# rtutap ", env!("CARGO_PKG_VERSION"), "\n").as_bytes());
                out.extend_from_slice(
                    hex_heading(line, origin.settings.adapter_hold_ns, origin.is_raw).as_bytes(),
                );
                // What was done to the recording before stays true.
                let before = origin.settings.facts.get(REMARK_KEY).filter(|said| !remarks.contains(said));
                for remark in remarks.iter().chain(before) {
                    out.extend_from_slice(format!("# {}\n", one_line(remark)).as_bytes());
                }
                *unsaid = (line.unwrap_or_default(), origin.settings.adapter_hold_ns);
                if origin.settings.name != BUS {
                    reads.bus(&origin.settings.name, said(origin), out);
                }
            }
            _ => {}
        }
    }

    /// Writes what stands before the first row of an input.
    pub(super) fn begin(&mut self, origin: &Origin, out: &mut Vec<u8>) {
        if let Writer::Rows(rows) = self {
            rows.begin(&origin.settings.name, origin.settings.line, out);
        }
    }

    /// Begins another bus, or other settings.
    pub(super) fn change(&mut self, origin: &Origin, out: &mut Vec<u8>) {
        if let Writer::Hex { reads, unsaid, .. } = self {
            // What the head of the file says of the first bus would be taken for this one's, too.
            let settings = said(origin).or(Some(settings(origin)).filter(|settings| settings != unsaid));
            reads.bus(&origin.settings.name, settings, out);
        }
    }

    /// Takes what was received; rows have events for it.
    pub(super) fn received(&mut self, item: &Item<'_>, out: &mut Vec<u8>) {
        let (Writer::Hex { reads, .. }, Some(bus)) = (self, item.bus()) else { return };
        if matches!(item, Item::Chunk { .. } | Item::Lost { .. } | Item::Silence { .. }) {
            reads.bus(bus, None, out);
        }
        match item {
            Item::Chunk { chunk, .. } => reads.chunk(chunk, out),
            Item::Lost { lost, .. } => reads.lost(lost, out),
            Item::Silence { until, .. } => reads.silence(*until, out),
            Item::Line(_) | Item::Clock { .. } | Item::Note { .. } => {}
        }
    }

    /// Takes an event.
    pub(super) fn event(&mut self, bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        match self {
            Writer::Rows(rows) => rows.event(bus, event, out),
            Writer::Hex { reads, .. } => reads.event(bus, event),
            Writer::Wide { table, passing, .. } => {
                table.note_time(event);
                if passing.passes(bus, event) {
                    table.event(bus, event, out);
                }
            }
            #[cfg(feature = "parquet")]
            Writer::Parquet { table, passing } => {
                if passing.passes(bus, event) {
                    table.event(bus, event);
                }
            }
        }
    }

    /// Writes what is settled once every frame before `settled_frame` has its transaction or none.
    pub(super) fn settle(&mut self, settled_frame: u64, out: &mut Vec<u8>) -> Result<(), Failure> {
        match self {
            Writer::Rows(rows) => rows.settle(settled_frame, out),
            Writer::Hex { reads, .. } => reads.settle(settled_frame, out),
            Writer::Wide { rows, .. } if out.len() >= GATHER => spill(rows, out)?,
            Writer::Wide { .. } => {}
            #[cfg(feature = "parquet")]
            Writer::Parquet { table, .. } => table.drain(out).map_err(Failure::new)?,
        }
        Ok(())
    }

    /// Returns of how many transactions none passed the filter, nor anything else; `None` when something did.
    pub(super) fn none_of(&self) -> Option<u64> {
        match self {
            Writer::Rows(rows) => rows.none_of(),
            Writer::Hex { reads, .. } => reads.none_of(),
            Writer::Wide { passing, .. } => passing.none_of(),
            #[cfg(feature = "parquet")]
            Writer::Parquet { passing, .. } => passing.none_of(),
        }
    }

    /// Writes the rest.
    pub(super) fn finish(&mut self, output: &mut Output) -> Result<(), Failure> {
        match self {
            Writer::Rows(_) | Writer::Hex { .. } => {}
            Writer::Wide { table, rows, redacted, .. } => {
                table.finish_row(&mut output.buffer);
                spill(rows, &mut output.buffer)?;
                rows.rewind().map_err(spill_failed)?;
                let remark = redacted.then_some((REMARK_KEY, REMARK));
                table.finish(rows, &mut *output, remark).map_err(|error| output.failed(&error))?;
            }
            #[cfg(feature = "parquet")]
            Writer::Parquet { table, .. } => table.finish(&mut output.buffer).map_err(Failure::new)?,
        }
        output.flush()
    }
}

/// Returns the settings that a bus is decoded with.
fn settings(origin: &Origin) -> HexSettings {
    (origin.settings.line, origin.settings.adapter_hold_ns)
}

/// Returns the settings of a bus, unless nobody said them.
fn said(origin: &Origin) -> Option<HexSettings> {
    (!origin.line_is_assumed).then(|| settings(origin))
}

/// Returns text that a comment can hold: hex text has no control character.
fn one_line(text: &str) -> String {
    text.replace(char::is_control, " ")
}

fn link_type(kind: LinkKind) -> LinkType {
    match kind {
        LinkKind::RtacSerial => LinkType::RtacSerial,
        LinkKind::User0 => LinkType::User0,
    }
}

/// Returns what a file should say of itself. A redacted one keeps the filter to itself: it may name what is blanked.
pub(super) fn remarks(args: &cli::Export) -> Vec<String> {
    // In one line, as a comment has to be.
    let words = |filter: &str| filter.split_whitespace().collect::<Vec<_>>().join(" ");
    let part = args.filter.as_deref().map(|filter| match args.redact {
        true => "only a part, chosen by a filter".to_owned(),
        false => format!("only what passes: {}", words(filter)),
    });
    part.into_iter().chain(args.redact.then(|| REMARK.to_owned())).collect()
}

/// Returns the kind of rows of a file that has one only; readings unless asked otherwise.
fn only(show: &[Show], format: &str, hint: &str) -> Result<Show, Failure> {
    match show {
        [] => Ok(Show::Readings),
        [show] => Ok(*show),
        _ => Err(Failure::hinted(format!("{format} has one kind of row"), hint)),
    }
}

#[cfg(not(feature = "parquet"))]
fn parquet(_: &cli::Export, _: &[Show], _: Option<Judge>) -> Result<Writer, Failure> {
    let hint = "build it with 'cargo build --release --features parquet'";
    Err(Failure::hinted("this build of rtutap cannot write Parquet", hint))
}

#[cfg(feature = "parquet")]
fn parquet(args: &cli::Export, show: &[Show], judge: Option<Judge>) -> Result<Writer, Failure> {
    let hint = "give one --show, readings or transactions, and export once for each";
    let table = match only(show, "Parquet", hint)? {
        Show::Readings => Table::Readings,
        Show::Transactions => Table::Transactions,
        Show::Frames | Show::Findings | Show::Devices => {
            return Err(Failure::hinted("Parquet has readings or transactions only", hint));
        }
    };
    let mut metadata = vec![("rtutap.version".to_owned(), env!("CARGO_PKG_VERSION").to_owned())];
    let remarks = remarks(args);
    if !remarks.is_empty() {
        metadata.push(("rtutap.remark".to_owned(), remarks.join("; ")));
    }
    let table = Parquet::new(table, metadata).map_err(Failure::new)?;
    Ok(Writer::Parquet { table: Box::new(table), passing: Passing::new(judge) })
}

/// Writes rows to a file without a name, from where they are taken at the end.
fn spill(file: &mut File, rows: &mut Vec<u8>) -> Result<(), Failure> {
    let result = file.write_all(rows);
    rows.clear();
    result.map_err(spill_failed)
}

fn spill_failed(error: io::Error) -> Failure {
    let directory = std::env::temp_dir();
    let hint = "make room there, or set TMPDIR";
    Failure::hinted(format!("cannot keep rows in '{}': {error}", directory.display()), hint)
}
