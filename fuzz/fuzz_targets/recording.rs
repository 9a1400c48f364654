//! Any bytes as a recording: told apart by content, decoded, written as text, JSON lines and CSV.
//!
//! ```text
//! cargo install cargo-fuzz
//! cargo +nightly fuzz run recording -- -max_len=4096
//! ```
//!
//! With a stable compiler, `RUSTC_BOOTSTRAP=1 cargo fuzz run recording`.

#![no_main]

use std::path::PathBuf;
use std::sync::{Arc, LazyLock};

use libfuzzer_sys::fuzz_target;
use rtutap::capture::{Input, InputFormat};
use rtutap::device::{Devices, Environment, Profiles};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Event, Options, Pipeline};
use rtutap::report::info::Info;
use rtutap::report::{Clock, Csv, Format, Json, Show, Text, TimeStyle};

static PROFILES: LazyLock<Arc<Profiles>> = LazyLock::new(|| Arc::new(Profiles::built_in()));
static FILE: LazyLock<PathBuf> =
    LazyLock::new(|| std::env::temp_dir().join(format!("rtutap-fuzz-{}", std::process::id())));

/// What the first byte chooses; the others are the recording.
fn split(data: &[u8]) -> Option<(Option<InputFormat>, Option<i64>, &[u8])> {
    let (choice, recording) = data.split_first()?;
    let format = [None, Some(InputFormat::Hex), Some(InputFormat::Raw), None][usize::from(choice & 3)];
    let hold = [None, Some(0), Some(16_000_000), Some(i64::MAX)][usize::from(choice >> 2 & 3)];
    Some((format, hold, recording))
}

fuzz_target!(|data: &[u8]| {
    let Some((format, adapter_hold_ns, recording)) = split(data) else { return };
    std::fs::write(&*FILE, recording).expect("the folder for temporary files can be written");
    let Ok(mut input) = Input::open(&FILE, format) else { return };
    let line = input.line().unwrap_or_else(LineSettings::default);
    let options = Options { readings: true, ..Options::new(line, adapter_hold_ns) };
    let devices = Devices::new(Arc::clone(&PROFILES), Environment::default());
    let mut pipeline = Pipeline::new(options, devices, PROFILES.shapes());
    let mut report = Report::new(line);
    let mut bytes = 0;
    // An error in the middle ends the recording; what came before was decoded.
    while let Ok(Some(chunk)) = input.next_chunk() {
        bytes += chunk.bytes.len() as u64;
        pipeline.handle_bytes(&chunk);
        report.drain(&mut pipeline);
    }
    pipeline.finish();
    report.drain(&mut pipeline);
    assert_eq!(report.given_back, bytes, "every byte comes back");
    let summary: serde_json::Value = serde_json::from_str(&report.info.to_json()).expect("JSON");
    assert_eq!(summary["bytes"], bytes);
    report.info.to_text(Clock::new(TimeStyle::Utc));
});

/// Writes every row in every format.
struct Report {
    info: Info,
    formats: [Box<dyn Format>; 3],
    given_back: u64,
    out: Vec<u8>,
}

impl Report {
    fn new(line: LineSettings) -> Self {
        let mut info = Info::default();
        info.begin("bus0", line);
        let clock = Clock::new(TimeStyle::Utc);
        let text = Text::new(clock, true, true, &PROFILES);
        let csv = Csv::new(Show::Transactions, Clock::new(TimeStyle::Relative));
        let formats: [Box<dyn Format>; 3] = [Box::new(text), Box::new(Json::default()), Box::new(csv)];
        Report { info, formats, given_back: 0, out: Vec::new() }
    }

    fn drain(&mut self, pipeline: &mut Pipeline) {
        while let Some(event) = pipeline.poll_event() {
            self.info.event("bus0", &event);
            if let Event::Frame(rtutap::decode::frame::Frame { place, .. })
            | Event::Damaged(rtutap::decode::frame::Damaged { place, .. }) = &event
            {
                assert_eq!(place.stream_offset, self.given_back);
                self.given_back += place.bytes.len() as u64;
            }
            let [text, json, csv] = &mut self.formats;
            self.out.clear();
            text.note_time(&event);
            text.row("bus0", &event, &mut self.out);
            std::str::from_utf8(&self.out).expect("text is UTF-8");
            self.out.clear();
            json.row("bus0", &event, &mut self.out);
            serde_json::from_slice::<serde_json::Value>(&self.out).expect("a JSON line is JSON");
            if matches!(event, Event::Transaction { .. }) {
                csv.row("bus0", &event, &mut self.out);
            }
        }
    }
}
