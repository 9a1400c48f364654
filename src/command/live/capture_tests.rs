use super::super::script::{Act, Script, ScriptClock};
use super::*;

/// Takes at most so many things between two calls of `drain`.
struct Narrow {
    room: usize,
    taken: Vec<Captured>,
    since: usize,
}

impl Narrow {
    fn new(room: usize) -> Self {
        Narrow { room, taken: Vec::new(), since: 0 }
    }
}

impl Outlet for Narrow {
    fn offer(&mut self, what: Captured) -> Result<(), Refused> {
        if self.since == self.room {
            return Err(Refused::Full(what));
        }
        self.since += 1;
        self.taken.push(what);
        Ok(())
    }
}

/// Lets a script be captured to its end, with room for `room` things every `every` steps.
fn captured(
    acts: Vec<(u64, Act)>,
    counts: bool,
    is_patient: bool,
    room: usize,
    every: usize,
) -> Vec<Captured> {
    let clock = ScriptClock::new();
    let source = Script::new(&clock, acts, counts);
    let mut capture = Capture::new(Box::new(source), clock.clone(), is_patient);
    let mut outlet = Narrow::new(room);
    for step in 1.. {
        match capture.step(&mut outlet) {
            Next::End => break,
            Next::Step => {}
            Next::Wait(time) => clock.go_to(clock.monotonic_ns() + time.as_nanos() as u64),
        }
        if step % every == 0 {
            outlet.since = 0;
        }
    }
    outlet.taken
}

fn at(ms: u64) -> u64 {
    3_600_000_000_000 + ms * 1_000_000
}

/// Reads one byte a millisecond, each of another value.
fn reads(count: u8) -> Vec<(u64, Act)> {
    (0..count).map(|n| (at(n.into()), Act::read(&[n]))).collect()
}

/// Writes what was captured as bytes and losses; silences and counters are left out.
fn shown(captured: &[Captured]) -> Vec<String> {
    let shown = captured.iter().filter_map(|what| match what {
        Captured::Read(read) => Some(format!("{:?}", read.bytes)),
        Captured::Lost { kind, count, .. } => Some(format!("{} {count}", kind.name())),
        Captured::Gone(_) => Some("gone".to_owned()),
        Captured::Back { .. } => Some("back".to_owned()),
        Captured::Ended(error) => Some(format!("ended {}", error.is_some())),
        Captured::Silence(_) | Captured::Counters(_) | Captured::Line { .. } => None,
    });
    shown.collect()
}

#[test]
fn what_finds_no_room_is_counted_where_it_is_missing() {
    let shown = shown(&captured(reads(12), true, false, 4, 6));
    // The first room goes to the counters too; a loss is told before what comes after it.
    assert_eq!(shown[..3], ["[0]", "[1]", "[2]"]);
    assert_eq!(shown[3..5], ["queue 3", "[6]"]);
    assert_eq!(shown.last().map(String::as_str), Some("ended false"));
    let bytes = shown.iter().filter(|what| what.starts_with('[')).count();
    let lost: usize =
        shown.iter().filter_map(|what| what.strip_prefix("queue ")?.parse::<usize>().ok()).sum();
    assert_eq!(bytes + lost, 12, "{shown:?}");
}

#[test]
fn a_source_that_can_wait_loses_nothing() {
    let shown = shown(&captured(reads(50), false, true, 1, 7));
    let expected: Vec<String> = (0..50).map(|n| format!("[{n}]")).chain(["ended false".to_owned()]).collect();
    assert_eq!(shown, expected);
}

#[test]
fn an_overrun_is_counted_after_the_bytes_before_it() {
    let mut acts = reads(3);
    acts.push((at(500), Act::Overruns(7)));
    acts.push((at(1500), Act::read(&[9])));
    let shown = shown(&captured(acts, true, false, usize::MAX, 1));
    assert_eq!(shown, ["[0]", "[1]", "[2]", "overrun 7", "[9]", "ended false"]);
}

#[test]
fn where_the_adapter_cannot_count_a_suspect_stretch_is_marked() {
    let suspect = Act::Read { bytes: vec![1], line_errors: Vec::new(), is_suspect: true };
    for (counts, expected) in [(false, &["[1]", "overrun 0", "[2]"][..]), (true, &["[1]", "[2]"])] {
        let acts = vec![(at(0), suspect.clone()), (at(1), Act::read(&[2]))];
        let shown = shown(&captured(acts, counts, false, usize::MAX, 1));
        assert_eq!(shown[..expected.len()], *expected);
    }
}

#[test]
fn a_source_that_went_away_is_tried_until_it_is_back_and_time_goes_on() {
    let acts = vec![(at(0), Act::read(&[1])), (at(10), Act::Gone), (at(9000), Act::read(&[2]))];
    let captured = captured(acts, false, false, usize::MAX, 1);
    assert_eq!(shown(&captured), ["[1]", "gone", "back", "[2]", "ended false"]);
    let away = captured.iter().skip_while(|what| !matches!(what, Captured::Gone(_)));
    let silences = away.take_while(|what| !matches!(what, Captured::Back { .. }));
    assert!(silences.filter(|what| matches!(what, Captured::Silence(_))).count() > 2);
}

#[test]
fn a_source_that_fails_says_so_after_all_its_bytes() {
    let mut acts = reads(3);
    acts.push((at(5), Act::Fail));
    let shown = shown(&captured(acts, false, false, 1, 4));
    assert_eq!(shown.last().map(String::as_str), Some("ended true"));
}
