//! Rows as text, hexadecimal and JSON, to be copied.

use super::{App, Effect, View};
use crate::report::words;
use crate::tui::action::Action;
use crate::tui::store::{List, Row, RowJson, Store, Tone};

impl App {
    /// Copies what is selected.
    pub(super) fn copy(&mut self, action: Action) -> Option<Effect> {
        let text = match (self.view, action) {
            (View::Traffic, Action::CopyRow) => self.traffic.row(&self.store).map(|row| self.row_text(row)),
            (View::Traffic, Action::CopyHex) => {
                self.traffic.row(&self.store).map(|row| hex(&self.store, row))
            }
            (View::Traffic, Action::CopyJson) => {
                let row = self.traffic.row(&self.store);
                row.map(|row| RowJson::new(&self.store, row).to_string())
            }
            (View::Devices, _) => self.devices.text(&self.store),
            (View::Findings, _) => self.store.findings().list().get(self.finding).map(|found| {
                let (rule, message) = (found.finding.rule, &found.finding.message);
                format!("{} {}: {message} {}", rule.code, rule.name, found.finding.help())
            }),
            _ => None,
        };
        let text = text.filter(|text| !text.is_empty())?;
        let bytes = text.len();
        self.say(Tone::Info, format!("copied {bytes} characters, where the terminal allows it"));
        Some(Effect::Copy(text))
    }

    /// Returns a row in a line.
    fn row_text(&self, row: &Row) -> String {
        let time = row.time().map_or_else(String::new, |time| self.clock().short(time).to_string());
        let address = row.address().map_or_else(|| "-".to_owned(), |address| address.to_string());
        let span = words::latency(row.span());
        let (device, title, said) = match row {
            Row::Exchange(row) => (row.label.to_string(), row.title.to_string(), row.said.to_string()),
            Row::Run(run) => {
                let function = run.function.map(words::function).unwrap_or_default();
                (
                    run.reason().map_or(run.role.name(), |reason| reason.name()).to_owned(),
                    function,
                    hex(&self.store, row),
                )
            }
            Row::Remark(row) => (String::new(), String::new(), row.text.to_string()),
        };
        let parts = [time, address, device, title, span, said];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("  ")
    }
}

/// Returns the bytes of a row in hexadecimal, a line a frame.
pub(super) fn hex(store: &Store, row: &Row) -> String {
    let line = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
    match row {
        Row::Run(run) => line(&run.bytes),
        Row::Exchange(exchange) => {
            let runs = exchange.sides.into_iter().flatten().filter_map(|side| {
                match store.list(List::Frames).get(side)? {
                    Row::Run(run) => Some(line(&run.bytes)),
                    _ => None,
                }
            });
            runs.collect::<Vec<_>>().join("\n")
        }
        Row::Remark(_) => String::new(),
    }
}
