//! Frames in hex with their times, told as a listener hears them, and what is found in them.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use rtutap::analyze::verify::{Finding, Party, all_rules};
use rtutap::decode::chunk::{Chunk, LineError, LineErrorKind, Lost, LostKind, ReadTime};
use rtutap::decode::crc;
use rtutap::device::{Devices, Environment, Profiles};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Event, Options, Pipeline};
use rtutap::time::{MILLISECOND, Timestamp};

/// Is what a listener hears through a UART that keeps nothing back.
pub struct Story {
    pipeline: Pipeline,
    line: LineSettings,
    now: i64,
    found: Vec<Finding>,
}

/// Reads bytes from hex.
pub fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("hex")).collect()
}

/// Reads bytes from hex and appends their CRC.
pub fn sealed(text: &str) -> Vec<u8> {
    let mut bytes = hex(text);
    let sum = crc::checksum(&bytes);
    bytes.extend(sum.to_le_bytes());
    bytes
}

impl Story {
    /// Begins with these devices, such as `1=yosemitech-do`.
    pub fn of(devices: &[&str]) -> Story {
        Story::with(devices, "9600-8N1", Some(0))
    }

    pub fn with(devices: &[&str], line: &str, hold_ns: Option<i64>) -> Story {
        let profiles = Arc::new(Profiles::built_in());
        let mut known = Devices::new(Arc::clone(&profiles), Environment::default());
        for device in devices {
            let (address, id) = device.split_once('=').expect("ADDRESS=PROFILE");
            known.assign(address.parse().expect("an address"), id).expect("a profile");
        }
        let line = line.parse().expect("line settings");
        let options = Options { readings: true, findings: true, ..Options::new(line, hold_ns) };
        let shapes = profiles.shapes();
        Story {
            pipeline: Pipeline::new(options, known, shapes),
            line,
            now: 1_000_000 * MILLISECOND,
            found: Vec::new(),
        }
    }

    /// Lets time pass, in milliseconds.
    pub fn wait(mut self, ms: i64) -> Self {
        self.now += ms * MILLISECOND;
        self
    }

    pub fn wait_ns(mut self, ns: i64) -> Self {
        self.now += ns;
        self
    }

    /// Lets bytes come, one read each.
    pub fn bytes(self, bytes: &[u8]) -> Self {
        bytes.iter().fold(self, |story, byte| story.chunk(&[*byte]))
    }

    /// Lets bytes come, one read.
    pub fn chunk(mut self, bytes: &[u8]) -> Self {
        self.now += self.line.character_ns() * bytes.len() as i64;
        self.read(bytes, &[])
    }

    fn read(mut self, bytes: &[u8], line_errors: &[LineError]) -> Self {
        let time = ReadTime::At(Timestamp::from_ns(self.now));
        self.pipeline.handle_bytes(&Chunk { time, bytes, line_errors });
        self.drain();
        self
    }

    /// Lets bytes come of which some were received with an error.
    pub fn errors(mut self, bytes: &[u8], offsets: &[u32], kind: LineErrorKind) -> Self {
        self.now += self.line.character_ns() * bytes.len() as i64;
        let errors: Vec<_> = offsets.iter().map(|&offset| LineError { offset, kind }).collect();
        self.read(bytes, &errors)
    }

    /// Loses bytes.
    pub fn lose(mut self, count: u64) -> Self {
        let time = Some(Timestamp::from_ns(self.now));
        self.pipeline.handle_lost(Lost { time, stream_offset: 0, kind: LostKind::Queue, count });
        self.drain();
        self
    }

    /// Asks after half a second of rest; the CRC is added.
    pub fn ask(self, request: &str) -> Self {
        self.wait(500).bytes(&sealed(request))
    }

    /// Asks, and answers 20 ms later; the CRCs are added.
    pub fn tell(self, request: &str, response: &str) -> Self {
        self.ask(request).wait(20).bytes(&sealed(response))
    }

    /// Tells the same again and again, `ms` apart.
    pub fn repeat(mut self, count: usize, ms: i64, request: &str, response: &str) -> Self {
        for _ in 0..count {
            self = self.tell(request, response).wait(ms);
        }
        self
    }

    fn drain(&mut self) {
        while let Some(event) = self.pipeline.poll_event() {
            if let Event::Finding(finding) = event {
                self.found.push(finding.clone());
            }
        }
    }

    /// Returns all findings, notes on quirks and granularity left out.
    pub fn findings(mut self) -> Vec<Finding> {
        self.pipeline.finish();
        self.drain();
        self.found.retain(|finding| !matches!(finding.rule.code, "Q01" | "L03"));
        self.found
    }

    pub fn all_findings(mut self) -> Vec<Finding> {
        self.pipeline.finish();
        self.drain();
        self.found
    }

    /// Returns the codes of all findings, each once, in order.
    pub fn codes(self) -> Vec<&'static str> {
        let codes: BTreeSet<_> = self.findings().iter().map(|finding| finding.rule.code).collect();
        codes.into_iter().collect()
    }

    /// Fails unless the only finding of a code is shown by these frames and bytes.
    pub fn shows(self, code: &str, party: Party, frames: &[u64], span: Option<Range<usize>>) -> Finding {
        let found = self.findings();
        assert!(all_rules().any(|rule| rule.code == code), "{code} is no rule");
        let mut of_code: Vec<_> = found.iter().filter(|finding| finding.rule.code == code).cloned().collect();
        assert_eq!(of_code.len(), 1, "{code} in {found:#?}");
        let finding = of_code.remove(0);
        assert_eq!(
            (finding.party, &finding.frames[..], &finding.span),
            (party, frames, &span),
            "{finding:#?}"
        );
        assert!(finding.time.is_some() && finding.first == finding.time && finding.count == 1, "{finding:?}");
        finding
    }
}
