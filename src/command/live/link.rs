//! Whether what comes from a source makes sense: finds its line settings where it is to, and says what is wrong.

use super::notice::Notice;
use crate::analyze::connection::{Connection, Trouble};
use crate::analyze::line_search::{Action, ErrorReports, LineSearch, Options};
use crate::capture::mcap::BusSettings;
use crate::decode::chunk::Chunk;
use crate::decode::frame::Frame;
use crate::line::LineSettings;
use crate::source::{Counters, LineErrorReports};
use crate::time::Timestamp;

/// Watches a bus; what it decides depends on the times of what is taken in only.
pub(in crate::command) struct Link {
    bus: String,
    /// Stands before what is said, where there are several buses.
    prefix: String,
    search: Option<LineSearch>,
    /// Whether all settings were tried in vain: what is tried is not said any more.
    is_hushed: bool,
    connection: Connection,
    /// Whether line errors are counted, but no bytes marked.
    only_counts: bool,
    /// Whether it is known what bytes decode to.
    decodes: bool,
    is_away: bool,
    /// Up to when it is known what came, and what did not.
    now: Timestamp,
}

impl Link {
    /// Begins to watch; where it `searches`, it looks for the line settings first, beginning with [`LineSearch::first`].
    pub(super) fn new(settings: &BusSettings, searches: bool, decodes: bool, now: Timestamp) -> Self {
        let error_reports = error_reports(settings.facts.get("driver").map(String::as_str));
        let options =
            searches.then_some(Options { adapter_hold_ns: settings.adapter_hold_ns, error_reports });
        Link {
            bus: settings.name.clone(),
            only_counts: error_reports == ErrorReports::Counts,
            prefix: String::new(),
            search: options.map(|options| LineSearch::new(options, now)),
            is_hushed: false,
            connection: Connection::new(now),
            decodes,
            is_away: false,
            now,
        }
    }

    /// Says of each thing which bus it is about.
    pub(super) fn name_bus(&mut self) {
        self.prefix = format!("{}: ", self.bus);
    }

    pub(super) fn is_of(&self, bus: &str) -> bool {
        self.bus == bus
    }

    /// Takes in a read.
    pub(super) fn read(&mut self, chunk: &Chunk<'_>, now: Timestamp) {
        self.now = now;
        match &mut self.search {
            Some(search) => search.handle_bytes(chunk),
            None => self.connection.handle_bytes(now, chunk.bytes.len(), chunk.line_errors),
        }
    }

    /// Takes in that nothing came.
    pub(super) fn silence(&mut self, now: Timestamp) {
        self.now = now;
    }

    /// Takes in a frame.
    pub(super) fn frame(&mut self, frame: &Frame<'_>) {
        // What the settings before have given does not count.
        if self.search.is_none() {
            self.connection.handle_frame(frame);
        }
    }

    /// Takes in what the adapter has counted.
    pub(super) fn counters(&mut self, counters: Option<Counters>) {
        let Some(Counters { framing, parity, breaks, .. }) = counters else { return };
        let line_errors = framing.saturating_add(parity).saturating_add(breaks);
        match &mut self.search {
            Some(search) => search.handle_counters(line_errors, self.now),
            None if self.only_counts => self.connection.handle_counters(line_errors),
            None => {}
        }
    }

    /// Takes in that line settings were set, or not.
    pub(super) fn line(&mut self, is_set: bool, now: Timestamp) {
        self.now = now;
        match &mut self.search {
            Some(search) => search.handle_line(is_set, now),
            None => self.connection = Connection::new(now),
        }
    }

    /// Takes in that the source went away, or came back: its silence is no finding.
    pub(super) fn set_away(&mut self, is_away: bool) {
        self.is_away = is_away;
        self.connection = Connection::new(self.now);
    }

    /// Decides what is due, says it, and returns the settings to receive with from now on, if they are others.
    pub(super) fn pass(&mut self, notices: &mut Vec<Notice>) -> Option<LineSettings> {
        if self.is_away {
            return None;
        }
        let mut order = None;
        if let Some(search) = &mut self.search {
            search.handle_timeout(self.now);
            let actions: Vec<Action> = std::iter::from_fn(|| search.poll_action()).collect();
            for action in actions {
                order = self.act(action, notices).or(order);
            }
            return order;
        }
        self.connection.handle_timeout(self.now);
        let diagnosis = self.connection.poll_diagnosis()?;
        let is_known = self.decodes || matches!(diagnosis.trouble, Some(Trouble::Silence) | None);
        if is_known {
            let text = format!("{}{diagnosis}", self.prefix);
            match diagnosis.trouble {
                Some(_) => notices.extend([Notice::Warning(text), Notice::Hint(diagnosis.advice.to_owned())]),
                None => notices.push(Notice::Note(text)),
            }
        }
        None
    }

    /// Does what the search wants.
    fn act(&mut self, action: Action, notices: &mut Vec<Notice>) -> Option<LineSettings> {
        let text = format!("{}{action}", self.prefix);
        match action {
            Action::Try(line, _) => {
                if !self.is_hushed {
                    notices.push(Notice::Note(text));
                }
                return Some(line);
            }
            Action::Lock(lock) => {
                notices.push(Notice::Note(text));
                notices.extend(
                    Some(lock.doubt().to_owned()).filter(|doubt| !doubt.is_empty()).map(Notice::Note),
                );
                self.search = None;
                self.connection = Connection::new(self.now);
            }
            Action::NoTraffic(_) => notices.push(Notice::Warning(text)),
            Action::NothingFits(diagnosis) => {
                self.is_hushed = true;
                notices.extend([Notice::Warning(text), Notice::Hint(diagnosis.advice.to_owned())]);
            }
            Action::Refused => {
                notices.push(Notice::Warning(text));
                self.search = None;
            }
        }
        None
    }
}

/// Returns how the adapter of a driver tells of line errors.
fn error_reports(driver: Option<&str>) -> ErrorReports {
    match LineErrorReports::of(driver) {
        LineErrorReports::Byte | LineErrorReports::Packet => ErrorReports::Marks,
        LineErrorReports::Count => ErrorReports::Counts,
        LineErrorReports::None => ErrorReports::None,
        LineErrorReports::Unknown => ErrorReports::Unknown,
    }
}
