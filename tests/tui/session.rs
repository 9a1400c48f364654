//! A simulated session in the UI, always the same.

use std::sync::Arc;

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use rtutap::analyze::verify::{Finding, rule};
use rtutap::decode::chunk::{Chunk, ReadTime};
use rtutap::decode::frame::{Boundary, Frame, Place, Role, WireTime};
use rtutap::device::{Devices, Environment, Profiles};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Event, Options, Pipeline};
use rtutap::report::TimeStyle;
use rtutap::report::words::Labels;
use rtutap::simulate::{Adapter, Config, Scenario, Simulation};
use rtutap::time::{Interval, Timestamp};
use rtutap::tui::app::{self, App, Effect, Message};
use rtutap::tui::store::{BusFacts, Feed};
use rtutap::tui::view;

/// Decodes a simulated bus into a feed, one read after the other.
pub struct Source {
    simulation: Simulation,
    pipeline: Pipeline,
    pub feed: Feed,
    /// The JSON line of each transaction and frame, as `decode` prints it.
    pub json: Vec<String>,
    pub now: Timestamp,
}

impl Source {
    pub fn new() -> Self {
        let line = LineSettings::default();
        let scenario = Scenario::named("demo").expect("a scenario");
        let adapter = Adapter::Usb1;
        let config = Config { seed: 20, frames: u64::MAX, line, adapter, scenario };
        let profiles = Arc::new(Profiles::built_in());
        let devices = Devices::new(Arc::clone(&profiles), Environment::default());
        let adapter_hold_ns = Some(adapter.hold_ns(line));
        let options = Options::new(line, adapter_hold_ns);
        let mut feed = Feed::new(Labels::new(&profiles));
        feed.begin(BusFacts {
            name: "bus0".to_owned(),
            line,
            source: Some("/dev/ttyUSB0".to_owned()),
            hold_ns: adapter_hold_ns,
            facts: vec![("driver".to_owned(), "ftdi_sio".to_owned())],
            error_reports: Some("reported for a packet of up to 62 bytes"),
        });
        let pipeline = Pipeline::new(options, devices, profiles.shapes());
        let simulation = Simulation::new(config);
        Source { simulation, pipeline, feed, json: Vec::new(), now: Timestamp::default() }
    }

    /// Takes so many reads.
    pub fn take(&mut self, reads: usize) {
        use rtutap::report::Format as _;
        let mut json = rtutap::report::Json::default();
        for read in self.simulation.by_ref().take(reads) {
            let chunk =
                Chunk { time: ReadTime::At(read.time), bytes: &read.bytes, line_errors: &read.line_errors };
            self.pipeline.handle_bytes(&chunk);
            while let Some(event) = self.pipeline.poll_event() {
                self.feed.event("bus0", &event);
                if !matches!(event, Event::Reading { .. }) {
                    let mut line = Vec::new();
                    json.row("bus0", &event, &mut line);
                    self.json.push(String::from_utf8(line).expect("JSON is UTF-8").trim_end().to_owned());
                }
            }
            self.now = read.time;
            self.feed.settle(self.pipeline.settled_frame_id());
        }
        self.feed.pass(self.now);
    }

    /// Takes so many small frames, one a millisecond.
    pub fn flood(&mut self, frames: u64) {
        let bytes = [1, 3, 0x26, 0, 0, 4, 0x4f, 0x41];
        for id in 0..frames {
            let time = Timestamp::from_ns(i64::try_from(id).expect("few") * 1_000_000);
            let at = Interval::new(time, time);
            let time = Some(WireTime { start: at, end: at });
            let place =
                Place { id, stream_offset: id * 8, bytes: &bytes, time, gap_before: None, line_errors: &[] };
            let (role, boundary) = (Role::Request, Boundary::Length);
            let frame = Frame { place, role, echo: false, boundary, confidence: 1.0 };
            self.feed.event("bus0", &Event::Frame(frame));
        }
    }

    /// Adds findings about the first frames.
    pub fn find(&mut self) {
        for (code, frame) in [("T01", 20), ("T01", 30), ("D06", 40)] {
            let rule = rule(code).expect("a rule");
            let message = "seen in a request for 4 registers at 0x2600";
            let finding = Finding::new(rule, Some(self.now), message).at(1).shown_by([frame]);
            self.feed.event("bus0", &Event::Finding(&finding));
        }
    }
}

/// Is the UI over a simulated session.
pub struct Session {
    pub app: App,
    pub source: Source,
}

impl Session {
    /// Shows so many reads on a screen of that size.
    pub fn new(columns: u16, lines: u16, reads: usize) -> Self {
        Session::with(app::Options::default(), columns, lines, reads)
    }

    pub fn with(options: app::Options, columns: u16, lines: u16, reads: usize) -> Self {
        let options = app::Options { time: TimeStyle::Utc, source: "/dev/ttyUSB0".to_owned(), ..options };
        let mut session = Session { app: App::new(options), source: Source::new() };
        session.app.update(Message::Resize(columns, lines));
        session.grow(reads);
        session
    }

    /// Lets the traffic go on by so many reads.
    pub fn grow(&mut self, reads: usize) {
        self.source.take(reads);
        self.show();
    }

    /// Hands over what the source has.
    pub fn show(&mut self) {
        self.app.update(Message::Tick(self.source.now));
        self.app.update(Message::Grown(self.source.feed.store().clone()));
    }

    /// Presses keys: names as in the configuration, with spaces between.
    pub fn press(&mut self, keys: &str) -> Option<Effect> {
        let mut effect = None;
        for name in keys.split(' ') {
            effect = self.app.update(Message::Key(key(name)));
        }
        effect
    }

    /// Types a text.
    pub fn type_text(&mut self, text: &str) {
        for letter in text.chars() {
            self.app.update(Message::Key(KeyEvent::new(KeyCode::Char(letter), KeyModifiers::NONE)));
        }
    }

    /// Draws the screen.
    pub fn buffer(&self) -> Buffer {
        let (columns, lines) = self.app.size();
        let mut buffer = Buffer::empty(Rect::new(0, 0, columns, lines));
        view::draw(&self.app, &mut buffer);
        buffer
    }

    /// Returns the symbols on the screen.
    pub fn screen(&self) -> String {
        text(&self.buffer())
    }

    /// Returns the number of the selected row.
    pub fn selected(&self) -> u64 {
        self.app.traffic.selected.expect("a row is selected")
    }
}

/// Returns the symbols of a buffer, a line a line.
pub fn text(buffer: &Buffer) -> String {
    let area = buffer.area();
    let line = |y: u16| {
        let symbols: String = (0..area.width).map(|x| buffer[(x, y)].symbol()).collect();
        symbols.trim_end().to_owned()
    };
    (0..area.height).map(line).collect::<Vec<_>>().join("\n")
}

/// Returns the key of a name.
pub fn key(name: &str) -> KeyEvent {
    let code = match name.strip_prefix("ctrl-").unwrap_or(name) {
        "space" => KeyCode::Char(' '),
        "enter" => KeyCode::Enter,
        "esc" => KeyCode::Esc,
        "tab" => KeyCode::Tab,
        "shift-tab" => KeyCode::BackTab,
        "up" => KeyCode::Up,
        "down" => KeyCode::Down,
        "left" => KeyCode::Left,
        "right" => KeyCode::Right,
        "home" => KeyCode::Home,
        "end" => KeyCode::End,
        "pageup" => KeyCode::PageUp,
        "pagedown" => KeyCode::PageDown,
        letter => KeyCode::Char(letter.chars().next().expect("a key")),
    };
    let modifiers = if name.starts_with("ctrl-") { KeyModifiers::CONTROL } else { KeyModifiers::NONE };
    KeyEvent::new(code, modifiers)
}
