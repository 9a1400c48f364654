//! What `-v` adds beneath a row: bytes, and the fields in them with their offsets.

use std::fmt::{self, Write};

use super::style::Styles;
use crate::decode::frame::{Place, Role};
use crate::decode::pdu;
use crate::decode::transaction::{Side, Transaction};
use crate::device::Meaning;
use crate::time::MILLISECOND;

/// How many of the profiles that fit are named.
const MOST_CANDIDATES: usize = 3;

/// Writes where and how surely a run of bytes was received.
pub(super) fn place(line: &mut String, styles: &Styles, place: &Place<'_>) -> fmt::Result {
    let dim = styles.dim;
    write!(line, "\n      {dim}#{} at byte {} of the stream", place.id, place.stream_offset)?;
    if let Some(time) = place.time {
        write!(line, ", time ±{:.3} ms", time.uncertainty_ns() as f64 / MILLISECOND as f64)?;
    }
    for error in place.line_errors {
        write!(line, ", {} at {}", error.kind.name(), error.offset)?;
    }
    write!(line, "{dim:#}")
}

/// Writes both sides of a transaction.
pub(super) fn transaction(
    line: &mut String,
    styles: &Styles,
    row: &Transaction<'_>,
    meaning: &Meaning<'_>,
) -> fmt::Result {
    let dim = styles.dim;
    if let Some(serial) = meaning.serial_number() {
        write!(line, "\n      {dim}serial number {serial}{dim:#}")?;
    }
    let candidates: Vec<&str> = meaning.candidates().collect();
    if !candidates.is_empty() {
        let (named, others) = candidates.split_at(candidates.len().min(MOST_CANDIDATES));
        write!(line, "\n      {dim}could be {}", named.join(", "))?;
        if !others.is_empty() {
            write!(line, " or {} others", others.len())?;
        }
        write!(line, "{dim:#}")?;
    }
    let fields: Vec<_> = super::marked_fields(meaning).collect();
    for (side, role) in [(row.request, Role::Request), (row.response, Role::Response)] {
        if let Some(side) = side {
            self::side(line, styles, side, role)?;
            for (field, mark) in fields.iter().filter(|(field, _)| field.side == role) {
                let (accent, span) = (styles.accent, &field.span);
                let offsets = offsets(span.start, span.end);
                let name = format!("{}{mark}", field.name);
                write!(line, "\n      {offsets}  {accent}{name:<18}{accent:#}  {field}")?;
            }
        }
    }
    Ok(())
}

fn side(line: &mut String, styles: &Styles, side: Side<'_>, role: Role) -> fmt::Result {
    let (dim, bad) = (styles.dim, styles.bad);
    write!(line, "\n      {dim}{} #{}{dim:#} ", role.name(), side.id)?;
    for byte in side.bytes {
        write!(line, " {byte:02x}")?;
    }
    if side.damaged {
        write!(line, "  {bad}damaged{bad:#}")?;
    }
    adu(line, styles, side.bytes, role)
}

/// Writes the fields of an ADU, as the specification has them.
pub(super) fn adu(line: &mut String, styles: &Styles, bytes: &[u8], role: Role) -> fmt::Result {
    let (dim, warn) = (styles.dim, styles.warn);
    let dissection = pdu::dissect(bytes, role);
    for field in &dissection.fields {
        let offsets = offsets(field.span.start, field.span.end);
        let item = field.item.map(|item| format!("[{item}] ")).unwrap_or_default();
        let name = format!("{item}{}", field.name);
        write!(line, "\n      {dim}{offsets}  {name:<18}  {}{dim:#}", field.value)?;
        if let Some(remark) = &field.remark {
            write!(line, "  {warn}{remark}{warn:#}")?;
        }
    }
    match &dissection.stopped {
        Some(stop) => write!(line, "\n      {warn}{stop}{warn:#}"),
        None => Ok(()),
    }
}

/// Writes the first and the last offset of a span, counted from the address byte.
fn offsets(start: usize, end: usize) -> String {
    let last = end.saturating_sub(1);
    if last <= start { format!("{start:>9}") } else { format!("{:>9}", format!("{start}-{last}")) }
}
