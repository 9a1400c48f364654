//! What the detail pane shows of a row: a tree of fields, and the bytes they lie in.

use std::ops::Range;

use crate::analyze::filter::Filter;
use crate::analyze::verify::Severity;
use crate::decode::frame::Role;
use crate::decode::pdu;
use crate::device::Value;
use crate::time::MILLISECOND;
use crate::tui::store::{Exchange, Field, List, Row, Run, Store, Tone};

/// Is what there is to know of a row.
#[derive(Clone, Debug, Default)]
pub struct Detail {
    /// Its frames: request and response, or the one it is.
    pub sides: Vec<Side>,
    /// The tree, as lines.
    pub nodes: Vec<Node>,
}

/// Is a frame or damaged run of a row.
#[derive(Clone, Debug)]
pub struct Side {
    /// What it is called.
    pub title: String,
    /// As received.
    pub bytes: Box<[u8]>,
    /// Offsets of bytes that the UART complained about.
    pub marked: Vec<usize>,
}

/// Is a line of the tree.
#[derive(Clone, Debug)]
pub struct Node {
    /// How deep it is in the tree: 0 for a frame.
    pub depth: usize,
    /// What it is called.
    pub label: String,
    /// What it says.
    pub text: String,
    /// The frame it is in.
    pub side: usize,
    /// Its bytes there; empty when it has none.
    pub span: Range<usize>,
    /// How it is.
    pub tone: Tone,
    /// A filter that rows like this pass.
    pub filter: Option<String>,
}

impl Detail {
    /// Looks at the row of a number.
    pub fn of(store: &Store, list: List, number: u64) -> Detail {
        let mut detail = Detail::default();
        match store.list(list).get(number) {
            Some(Row::Exchange(exchange)) => detail.exchange(store, exchange),
            Some(Row::Run(run)) => {
                let exchange = run.exchange.and_then(|number| store.list(List::Exchanges).get(number));
                let fields = match exchange {
                    Some(Row::Exchange(exchange)) => &exchange.fields[..],
                    _ => &[],
                };
                detail.run(store, run, fields, run.role);
            }
            Some(Row::Remark(remark)) => detail.line(0, "", &remark.text, 0..0, Tone::Info, None),
            None => {}
        }
        detail.findings(store, list, number);
        detail
    }

    fn line(
        &mut self,
        depth: usize,
        label: &str,
        text: &str,
        span: Range<usize>,
        tone: Tone,
        filter: Option<String>,
    ) {
        let side = self.sides.len().saturating_sub(1);
        let (label, text) = (label.to_owned(), text.to_owned());
        self.nodes.push(Node { depth, label, text, side, span, tone, filter });
    }

    fn exchange(&mut self, store: &Store, exchange: &Exchange) {
        for (side, role) in exchange.sides.into_iter().zip([Role::Request, Role::Response]) {
            let run = side.and_then(|number| match store.list(List::Frames).get(number)? {
                Row::Run(run) => Some(run),
                _ => None,
            });
            match (run, side) {
                (Some(run), _) => self.run(store, run, &exchange.fields, role),
                (None, Some(_)) => {
                    self.line(0, role.name(), "its bytes have left memory", 0..0, Tone::Info, None);
                }
                (None, None) => {}
            }
        }
        let derived = exchange.fields.iter().filter(|field| field.span.1 == 0);
        for (index, field) in derived.enumerate() {
            if index == 0 {
                self.line(0, "derived", "", 0..0, Tone::Good, None);
            }
            self.line(1, &field.name, &field.text, 0..0, tone(field), filter(field));
        }
    }

    /// Adds a frame with its fields: those of the specification, and in them those of the device.
    fn run(&mut self, store: &Store, run: &Run, fields: &[Field], role: Role) {
        let name = run.reason().map_or(run.role.name(), |reason| reason.name());
        let title = match store.known_from() {
            Some(_) => name.to_owned(),
            None => format!("{name} #{}", run.id),
        };
        let marked = run.line_errors.iter().map(|error| error.offset as usize).collect();
        self.sides.push(Side { title: title.clone(), bytes: run.bytes.clone(), marked });
        let length = run.bytes.len();
        let tone = if run.reason().is_some() { Tone::Bad } else { Tone::Good };
        self.line(
            0,
            &title,
            &about(store, run),
            0..length,
            tone,
            Some(match run.reason() {
                Some(reason) => format!("reason == {}", reason.name()),
                None => format!("role == {}", run.role.name()),
            }),
        );
        for error in &run.line_errors {
            let at = error.offset as usize;
            self.line(1, "line error", error.kind.name(), at..at.saturating_add(1), Tone::Bad, None);
        }
        let dissection = pdu::dissect(&run.bytes, run.role);
        for field in &dissection.fields {
            let item = field.item.map(|item| format!("[{item}] ")).unwrap_or_default();
            let label = format!("{item}{}", field.name);
            let (text, tone) = match &field.remark {
                Some(remark) => (format!("{}  {remark}", field.value), Tone::Warn),
                None => (field.value.to_string(), Tone::Good),
            };
            self.line(1, &label, &text, field.span.clone(), tone, pdu_filter(field, run));
            let inner = fields.iter().filter(|inner| inner.side == role && inner.span.1 > 0);
            for inner in inner.filter(|inner| field.span.contains(&usize::from(inner.span.0))) {
                let label = format!("{}{}", inner.name, if inner.is_guess { "?" } else { "" });
                let span = usize::from(inner.span.0)..usize::from(inner.span.1);
                self.line(2, &label, &inner.text, span, self::tone(inner), filter(inner));
            }
        }
        if let Some(stop) = &dissection.stopped {
            self.line(1, "", &stop.to_string(), stop.offset.min(length)..length, Tone::Bad, None);
        }
    }

    fn findings(&mut self, store: &Store, list: List, number: u64) {
        let Some(row) = store.list(list).get(number) else { return };
        for finding in store.findings().of_row(row) {
            let tone = match finding.severity {
                Severity::Error => Tone::Bad,
                Severity::Warning => Tone::Warn,
                Severity::Note => Tone::Info,
            };
            let filter = Some(format!("finding == {}", finding.rule.code));
            let label = format!("{} {}", finding.rule.code, finding.rule.name);
            self.line(0, &label, &finding.message, 0..0, tone, filter);
        }
    }

    /// Returns the innermost line that has a byte of a frame.
    pub fn node_at(&self, side: usize, byte: usize) -> Option<usize> {
        let has = |node: &Node| node.side == side && node.span.contains(&byte);
        let inside = self.nodes.iter().enumerate().filter(|(_, node)| has(node));
        inside.min_by_key(|(at, node)| (node.span.len(), std::cmp::Reverse(*at))).map(|(at, _)| at)
    }

    /// Returns all bytes in one sequence: frame and offset.
    pub fn bytes(&self) -> impl Iterator<Item = (usize, usize)> {
        let sides = self.sides.iter().enumerate();
        sides.flat_map(|(side, of)| (0..of.bytes.len()).map(move |offset| (side, offset)))
    }
}

/// Says where and when a run of bytes was.
fn about(store: &Store, run: &Run) -> String {
    let bytes = run.bytes.len();
    let mut text = format!("{bytes} byte{}", if bytes == 1 { "" } else { "s" });
    if run.time.is_some() {
        text += &format!(", time ±{:.1} ms", run.uncertainty_ns as f64 / MILLISECOND as f64);
    }
    if store.known_from().is_none() {
        text += &format!(", at byte {} of the stream", run.stream_offset);
    }
    if run.is_echo() {
        text += ", echo of the adapter";
    }
    text
}

fn tone(field: &Field) -> Tone {
    match (field.is_implausible, field.is_guess) {
        (true, _) => Tone::Warn,
        (false, true) => Tone::Info,
        (false, false) => Tone::Good,
    }
}

/// Returns a filter for rows with this value of a field.
fn filter(field: &Field) -> Option<String> {
    if field.is_guess {
        return None;
    }
    let text = match &field.value {
        Value::Null => return None,
        value => value.to_string(),
    };
    let is_number = field.value.as_f64().is_some();
    Some(Filter::of_field(&field.name, &text, is_number).to_string())
}

/// Returns a filter for rows with this value of a field of the specification.
fn pdu_filter(field: &pdu::PduField<'_>, run: &Run) -> Option<String> {
    let word = || match field.value {
        pdu::PduValue::Word(word) | pdu::PduValue::Number(word) => Some(word),
        _ => None,
    };
    Some(match field.name {
        "address" => format!("addr == {}", run.address?),
        "function" => format!("fn == {}", run.function?.without_exception().0),
        "start register" | "register" => format!("reg == 0x{:04x}", word()?),
        "quantity" => format!("quantity == {}", word()?),
        "exception code" => match field.value {
            pdu::PduValue::Exception(code) => format!("exception == {}", code.0),
            _ => return None,
        },
        _ => {
            let bytes = run.bytes.get(field.span.clone()).filter(|bytes| !bytes.is_empty())?;
            let hex: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            format!("bytes contains {}", hex.join(" "))
        }
    })
}
