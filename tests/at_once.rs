//! Reads that are there at once decode as one by one: the same rows, in the same order, with the same ids.

mod support;

use proptest::prelude::*;
use rtutap::decode::chunk::{Chunk, LineError, LineErrorKind, ReadTime};
use rtutap::line::LineSettings;
use rtutap::pipeline::{Lost, LostKind, Pipeline};
use rtutap::simulate::{Adapter, Scenario};
use rtutap::time::{MILLISECOND, Timestamp};
use support::traffic::{any_bytes, any_reads, any_timed, cuts, simulated, steps, timed};
use support::{Read, assert_same_rows, drain, judging_pipeline, pipeline};

const BREAK: [LineError; 1] = [LineError { offset: 0, kind: LineErrorKind::Break }];

/// Is what may happen between two runs of reads.
#[derive(Clone, Copy, Debug)]
enum Between {
    Nothing,
    /// Frames and transactions of another bus.
    Others,
    /// It is known to be silent up to the last read.
    Silence,
    Loss,
    Compaction,
}

fn chunk(read: &Read, has_error: bool) -> Chunk<'_> {
    let line_errors: &[LineError] = if has_error && !read.bytes.is_empty() { &BREAK } else { &[] };
    Chunk { time: read.time, bytes: &read.bytes, line_errors }
}

/// Decodes the same reads both ways.
struct Both {
    pipelines: [Pipeline; 2],
    rows: [Vec<String>; 2],
    last: Timestamp,
}

impl Both {
    fn new(pipeline: Pipeline) -> Self {
        let rows = Default::default();
        Both { pipelines: [pipeline.clone(), pipeline], rows, last: Timestamp::MIN }
    }

    fn run(&mut self, reads: &[Read], has_errors: bool) {
        let [one, many] = &mut self.pipelines;
        for read in reads {
            one.handle_bytes(&chunk(read, has_errors));
            drain(one, &mut self.rows[0]);
            if let ReadTime::At(time) = read.time {
                self.last = self.last.max(time);
            }
        }
        let mut chunks = reads.iter().map(|read| chunk(read, has_errors));
        while many.handle_reads(&mut chunks) {
            drain(many, &mut self.rows[1]);
        }
        drain(many, &mut self.rows[1]);
        assert_eq!(one.next_ids(), many.next_ids());
        assert_eq!(one.settled_frame_id(), many.settled_frame_id());
        assert_eq!(one.poll_timeout(), many.poll_timeout());
        self.compare();
    }

    fn happens(&mut self, between: Between) {
        let time = (self.last > Timestamp::MIN).then_some(self.last);
        for (pipeline, rows) in self.pipelines.iter_mut().zip(&mut self.rows) {
            match between {
                Between::Nothing => {}
                Between::Others => {
                    let (frame, transaction) = pipeline.next_ids();
                    pipeline.set_next_ids((frame + 3, transaction + 2));
                }
                Between::Silence => pipeline.handle_timeout(self.last),
                Between::Loss => {
                    pipeline.handle_lost(Lost { time, stream_offset: 0, kind: LostKind::Disk, count: 5 });
                }
                Between::Compaction => pipeline.compact(),
            }
            drain(pipeline, rows);
        }
    }

    fn compare(&mut self) {
        assert_same_rows(&self.rows[0], &self.rows[1], "at once");
        self.rows.iter_mut().for_each(Vec::clear);
    }

    fn finish(mut self) {
        for (pipeline, rows) in self.pipelines.iter_mut().zip(&mut self.rows) {
            pipeline.finish();
            drain(pipeline, rows);
        }
        self.compare();
    }
}

/// Decodes runs of these lengths both ways, with this happening after each; both go round.
fn both_ways(pipeline: Pipeline, reads: &[Read], runs: &[(usize, bool, Between)]) {
    let mut both = Both::new(pipeline);
    let mut rest = reads;
    for (length, has_errors, between) in runs.iter().cycle() {
        let (run, later) = rest.split_at((*length).min(rest.len()));
        both.run(run, *has_errors);
        both.happens(*between);
        rest = later;
        if rest.is_empty() {
            return both.finish();
        }
    }
}

fn runs() -> impl Strategy<Value = Vec<(usize, bool, Between)>> {
    let between = prop_oneof![
        4 => Just(Between::Nothing),
        1 => Just(Between::Others),
        1 => Just(Between::Silence),
        1 => Just(Between::Loss),
        1 => Just(Between::Compaction),
    ];
    prop::collection::vec((1_usize..20, any::<bool>(), between), 1..8)
}

/// Says what a pipeline is asked or told.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// It judges the traffic.
    Judging,
    /// It is told what the adapter keeps back at most, in nanoseconds.
    Holding(Option<i64>),
}

impl Kind {
    fn pipeline(self) -> Pipeline {
        let line = LineSettings::default();
        match self {
            Kind::Judging => judging_pipeline(line),
            Kind::Holding(hold) => pipeline(line, hold),
        }
    }
}

fn kinds() -> impl Strategy<Value = Kind> {
    let holds = prop_oneof![Just(None), Just(Some(0)), Just(Some(16 * MILLISECOND)), Just(Some(i64::MAX))];
    prop_oneof![1 => Just(Kind::Judging), 3 => holds.prop_map(Kind::Holding)]
}

proptest! {
    #[test]
    fn reads_that_are_there_at_once_decode_as_one_by_one(
        kind in kinds(), reads in prop_oneof![any_timed(), any_reads()], runs in runs(),
    ) {
        both_ways(kind.pipeline(), &reads, &runs);
    }

    #[test]
    fn so_do_reads_of_which_some_have_no_time_or_no_bytes(
        bytes in any_bytes(), lengths in cuts(), steps in steps(), runs in runs(),
        kinds in prop::collection::vec(0_u8..6, 1..9),
    ) {
        let mut reads = timed(&bytes, &lengths, 1_767_225_600_000_000_000, &steps);
        for (read, kind) in reads.iter_mut().zip(kinds.iter().cycle()) {
            match kind {
                0 => read.time = ReadTime::Unknown,
                1 => read.time = ReadTime::UnknownAfterSilence,
                2 => read.bytes.clear(),
                _ => {}
            }
        }
        both_ways(pipeline(LineSettings::default(), None), &reads, &runs);
    }
}

#[test]
fn every_scenario_behind_every_adapter_decodes_the_same_at_once() {
    let line = LineSettings::default();
    for scenario in Scenario::all() {
        for adapter in Adapter::ALL {
            let reads = simulated(*scenario, adapter, line, 301, 150);
            both_ways(pipeline(line, None), &reads, &[(64, false, Between::Nothing)]);
        }
    }
}
