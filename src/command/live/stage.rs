//! Where a live session's items and events go: rows, the recording, counts.

use super::super::failure::Failure;
use super::super::scribe::Decoded;
use super::super::session::{Origin, Sink};
use super::link::Link;
use super::monitor::Monitor;
use super::rows::RowStream;
use super::tally::Tally;
use super::tape::Tape;
use crate::capture::Item;
use crate::pipeline::Event;
use crate::report::Judge;
use crate::report::audit::Audit;
use crate::report::info::Info;
use crate::time::Timestamp;

/// Takes what a live session receives and decodes.
#[derive(Default)]
pub(in crate::command) struct Stage {
    pub(in crate::command) tally: Tally,
    pub(in crate::command) rows: Option<RowStream>,
    pub(in crate::command) tape: Option<Tape>,
    pub(in crate::command) info: Option<Info>,
    pub(in crate::command) monitor: Option<Monitor>,
    pub(in crate::command) audit: Option<Audit>,
    /// What is worth the minutes around it.
    pub(in crate::command) trigger: Option<Judge>,
    pub(super) decoded: Decoded,
    /// The sources in their order, by whether they make sense.
    pub(super) links: Vec<Link>,
    /// The latest time.
    pub(super) now: Timestamp,
}

impl Sink for Stage {
    const RECEIVES: bool = true;

    fn begin(&mut self, origin: &Origin) -> Result<(), Failure> {
        self.tally.begin(&origin.settings);
        self.decoded.begin(&origin.settings.name);
        if let Some(info) = &mut self.info {
            info.begin(&origin.settings.name, origin.settings.line);
        }
        if let Some(monitor) = &mut self.monitor {
            monitor.begin(origin);
        }
        if let Some(audit) = &mut self.audit {
            audit.begin(
                &origin.settings.name,
                origin.settings.line,
                origin.settings.adapter_hold_ns.is_some(),
            );
        }
        if let Some(rows) = &mut self.rows {
            rows.begin(&origin.settings);
        }
        if let Some(tape) = &mut self.tape {
            tape.begin(origin.settings.clone());
        }
        Ok(())
    }

    fn received(&mut self, item: &Item<'_>) -> Result<(), Failure> {
        self.tally.received(item);
        if let Some(tape) = &mut self.tape {
            tape.received(item);
        }
        Ok(())
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        self.tally.event(event);
        if let Event::Frame(frame) = event
            && let Some(link) = self.links.iter_mut().find(|link| link.is_of(bus))
        {
            link.frame(frame);
        }
        if let Some(info) = &mut self.info {
            info.event(bus, event);
        }
        if let Some(audit) = &mut self.audit {
            audit.event(bus, event);
        }
        if let Some(rows) = &mut self.rows {
            rows.event(bus, event);
        }
        if let Some(monitor) = &mut self.monitor {
            monitor.event(bus, event);
        }
        let Some(tape) = &mut self.tape else { return };
        if tape.wants_messages()
            && let Some(message) = self.decoded.event(bus, event)
        {
            tape.message(message);
        }
        if self.trigger.as_ref().is_some_and(|trigger| trigger(bus, event)) {
            tape.trigger(self.now);
        }
    }

    fn pause(&mut self, settled_frame: u64, waits: bool) -> Result<(), Failure> {
        if let Some(monitor) = &mut self.monitor {
            monitor.settle(settled_frame);
        }
        match &mut self.rows {
            Some(rows) => {
                rows.settle(settled_frame);
                if waits { rows.flush() } else { Ok(()) }
            }
            None => Ok(()),
        }
    }
}
