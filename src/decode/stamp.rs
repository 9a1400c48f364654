//! When each byte was on the wire: intervals from the read's time, the speed and what the adapter holds back.
//!
//! A read at `R` of `n` bytes says: the last byte ended at `R` at the latest, each one before a character
//! earlier. It says nothing certain of how long the bytes waited: at most the adapter's hold `W` plus the
//! wake-up allowance, unless the reader was stalled. So a byte has three times: `latest`, `earliest` (as long as
//! nothing stalled) and `certain` (whatever stalled: the read before would have had it otherwise).

use crate::decode::chunk::ReadTime;
use crate::decode::frame::WireTime;
use crate::line::LineSettings;
use crate::time::{Interval, MILLISECOND, SECOND, Span, Timestamp};

/// Nanoseconds from a byte being there to an idle host reading it: the wake-up allowance.
pub const WAKE_NS: i64 = 500_000;
/// Nanoseconds that the USB may add to an adapter's own hold: a frame.
const USB_NS: i64 = MILLISECOND;
/// Data bytes of a full packet of the commonest USB adapters (FTDI AN232B-04).
const PACKET: u64 = 62;
/// Nanoseconds of their latency timer as it comes.
const LATENCY_TIMER_NS: i64 = 16 * MILLISECOND;
/// Nanoseconds that an adapter is believed to keep a byte back at most; no driver comes near.
const MOST_HOLD_NS: i64 = 60 * SECOND;

/// How many of the last reads are looked at one by one.
const LAST: usize = 4;

/// The earliest time that a read is believed to have, 1896; one before is taken for it.
pub const EARLIEST: Timestamp = Timestamp::from_ns(i64::MIN / 4);
/// The latest time that a read is believed to have, 2116: between both no sum or difference here reaches 2^63.
pub const LATEST: Timestamp = Timestamp::from_ns(i64::MAX / 2);

/// Before any time that a read can have, less its bytes.
const NEVER: i64 = i64::MIN / 2;

/// Bounds when the last stop bit of a byte ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ByteTime {
    /// Not before this, even if the host stalled.
    pub certain: Timestamp,
    /// Not before this, as long as the host did not stall.
    pub earliest: Timestamp,
    /// Not after this.
    pub latest: Timestamp,
}

impl ByteTime {
    /// Returns the interval to report: it assumes that the host did not stall.
    pub fn interval(self) -> Interval {
        Interval::new(self.earliest, self.latest)
    }
}

/// The bytes of one read that are still of interest.
#[derive(Clone, Copy, Debug)]
struct Read {
    /// Stream offset of the first byte, also when bytes before were forgotten.
    offset: u64,
    length: u64,
    timed: bool,
    after_silence: bool,
    /// Bounds of the first byte's end, in nanoseconds since the epoch, as are all times here: asked for too often to
    /// be checked for overflow, which [`EARLIEST`] and [`LATEST`] rule out.
    certain: i64,
    earliest: i64,
    /// Upper bound of the last byte's end.
    latest: i64,
    /// The same before later reads tightened it.
    read: i64,
}

/// Keeps the times of the bytes that the framer still holds.
#[derive(Clone, Debug)]
pub struct Stamper {
    character_ns: i64,
    /// The longest the adapter keeps a byte back, in nanoseconds.
    hold_ns: i64,
    /// How long a byte may have waited for an unstalled reader: the hold and what comes on top.
    held_ns: i64,
    /// Whether the hold is known, not estimated from the reads.
    hold_known: bool,
    /// The reads, in one piece: they are looked at far oftener than dropped.
    reads: Vec<Read>,
    /// Reads at the front that nobody needs any more; moved out now and then.
    dropped: usize,
    /// Whether any read had a time.
    timed: bool,
    /// Time of the last read; [`NEVER`] before the first.
    last_read: i64,
    /// The lower bounds of its last byte, if it had a time.
    last: Option<(i64, i64)>,
    /// Offset just after the last byte.
    end: u64,
}

impl Stamper {
    /// Makes a stamper; without a hold it is estimated from how many bytes come at once.
    pub fn new(line: LineSettings, hold_ns: Option<i64>) -> Self {
        let hold = hold_ns.unwrap_or(0).clamp(0, MOST_HOLD_NS);
        Stamper {
            character_ns: line.character_ns(),
            hold_ns: hold,
            held_ns: held_ns(hold),
            hold_known: hold_ns.is_some(),
            reads: Vec::new(),
            dropped: 0,
            timed: false,
            last_read: NEVER,
            last: None,
            end: 0,
        }
    }

    /// Returns the time of a character in nanoseconds.
    pub fn character_ns(&self) -> i64 {
        self.character_ns
    }

    /// Returns the longest time the adapter keeps a byte back, in nanoseconds: given, or seen so far.
    pub fn hold_ns(&self) -> i64 {
        self.hold_ns
    }

    /// Tells whether the hold is known, not estimated from the reads.
    pub fn is_hold_known(&self) -> bool {
        self.hold_known
    }

    /// Returns up to when a read of `length` bytes may have been preceded by silence: the latest end of its first byte,
    /// for a read that comes late was no silence; for untimed input the time of the read before.
    pub fn silent_until(&self, time: ReadTime, length: usize) -> Option<Timestamp> {
        match time {
            ReadTime::At(at) => {
                let first = near(at) - self.run_ns((length as u64).saturating_sub(1));
                Some(Timestamp::from_ns(self.last_read.max(first)))
            }
            ReadTime::Unknown | ReadTime::UnknownAfterSilence => {
                (self.last_read > NEVER).then(|| Timestamp::from_ns(self.last_read))
            }
        }
    }

    /// Returns the time a chunk was read, with untimed input dated at line speed from 0; never goes back.
    pub fn read_time(&self, time: ReadTime, length: usize) -> Timestamp {
        Timestamp::from_ns(self.read_ns(time, length))
    }

    fn read_ns(&self, time: ReadTime, length: usize) -> i64 {
        match time {
            ReadTime::At(at) => self.last_read.max(near(at)),
            ReadTime::Unknown | ReadTime::UnknownAfterSilence => {
                let last = if self.last_read > NEVER { self.last_read } else { 0 };
                LATEST.as_ns().min(last + self.run_ns(length as u64))
            }
        }
    }

    /// Takes in the read of `length` bytes, 0 of which change nothing; returns its time as [`Stamper::read_time`] does.
    #[inline(always)] // done for every read
    pub fn push(&mut self, time: ReadTime, length: usize) -> Timestamp {
        let read = self.read_ns(time, length);
        let Some(left) = (length as u64).checked_sub(1) else { return Timestamp::from_ns(read) };
        let timed = matches!(time, ReadTime::At(_));
        self.timed |= timed;
        let length = length as u64;
        if timed && !self.hold_known && length > 1 {
            self.hold_ns = self.hold_ns.max(self.hold_seen_ns(length));
            self.held_ns = held_ns(self.hold_ns);
        }
        let run = self.run_ns(left);
        let entry = self.bound(read, timed, matches!(time, ReadTime::UnknownAfterSilence), length, run);
        self.tighten(entry.latest - run - self.character_ns);
        self.last = timed.then_some((entry.certain + run, entry.earliest + run));
        self.last_read = read;
        self.end += length;
        self.reads.push(entry);
        Timestamp::from_ns(read)
    }

    /// Estimates from a read of several bytes how long the adapter keeps a byte back, in nanoseconds: it collects
    /// them, as the commonest does for its latency timer, or longer.
    fn hold_seen_ns(&self, length: u64) -> i64 {
        self.run_ns(length.min(PACKET)).max(LATENCY_TIMER_NS)
    }

    /// Bounds a read's bytes by itself and the read before; `run` is from its first byte's end to its last byte's.
    fn bound(&self, read: i64, timed: bool, after_silence: bool, length: u64, run: i64) -> Read {
        let first_latest = read - run;
        let held = self.held_ns;
        let certain = match self.last {
            Some((certain, _)) => (certain + self.character_ns).max(self.last_read - held),
            None => read - held.max(run + self.character_ns),
        };
        // More bytes than the adapter can hold were read late: nothing is known but the certain bound.
        // A single byte never says so.
        let stalled = self.hold_known && length > 1 && run + self.character_ns > held;
        let earliest = if stalled { certain } else { certain.max(read - held) };
        let chained = self.last.map_or(earliest, |(_, before)| earliest.max(before + self.character_ns));
        // Bytes that come faster than the line's speed allows: some time is wrong by as much as they contradict.
        let wrong = (chained - first_latest).max(0);
        let earliest = chained - wrong;
        // Without times they simply follow at line speed.
        let latest = if timed && wrong > 0 { chained + wrong + run } else { read };
        Read {
            offset: self.end,
            length,
            timed,
            after_silence,
            certain: certain.min(earliest),
            earliest,
            latest,
            read,
        }
    }

    /// Lowers the upper bounds of the reads before: a byte ended a character before the next.
    fn tighten(&mut self, mut latest: i64) {
        let character_ns = self.character_ns;
        for read in self.reads[self.dropped..].iter_mut().rev() {
            if !read.timed || read.latest <= latest {
                return;
            }
            let run = character_ns * (read.length as i64 - 1);
            read.latest = latest.max(read.earliest + run);
            latest = read.latest - run - character_ns;
        }
    }

    fn run_ns(&self, characters: u64) -> i64 {
        // A read is not larger than 64 MiB: at 1 baud far below 2^61.
        self.character_ns.wrapping_mul(characters as i64)
    }

    /// Forgets the bytes before `offset`.
    pub fn forget_before(&mut self, offset: u64) {
        let stale = self.kept().iter().take_while(|read| read.offset + read.length <= offset).count();
        self.dropped += stale;
        if self.dropped * 2 > self.reads.len() {
            self.reads.drain(..self.dropped);
            self.dropped = 0;
        }
    }

    fn kept(&self) -> &[Read] {
        &self.reads[self.dropped..]
    }

    /// Estimates the end of the byte at `offset`: the middle of its interval.
    #[inline]
    pub fn middle(&self, offset: u64) -> Option<Timestamp> {
        if self.timed { self.timed_middle(offset) } else { None }
    }

    fn timed_middle(&self, offset: u64) -> Option<Timestamp> {
        let read = self.find(offset).filter(|read| read.timed)?;
        let (earliest, latest) = self.bounds(read, offset);
        let width = latest - earliest;
        Some(Timestamp::from_ns(earliest + (width >> 1) + (width & 1))) // not negative
    }

    /// Bounds when the bytes from `first` to `last` were on the wire, and the silence before them.
    ///
    /// `None` when the input has no times for them.
    #[inline]
    pub fn frame(&self, first: u64, last: u64) -> Option<(WireTime, Option<Span>)> {
        if self.timed { self.timed_frame(first, last) } else { None }
    }

    fn timed_frame(&self, first: u64, last: u64) -> Option<(WireTime, Option<Span>)> {
        let kept = self.kept();
        // A frame is decided soon after its last byte came: it is among the latest reads.
        let mut end = kept.len().checked_sub(1)?;
        while kept[end].offset > last {
            end = end.checked_sub(1)?;
        }
        let mut begin = end;
        while kept[begin].offset > first {
            begin = begin.checked_sub(1)?;
        }
        let before = if first > kept[begin].offset { Some(begin) } else { begin.checked_sub(1) };
        let (from, to) = (&kept[begin], &kept[end]);
        if last >= to.offset + to.length || !from.timed || !to.timed {
            return None;
        }
        let (earliest, latest) = self.bounds(from, first);
        let start = (earliest - self.character_ns, latest - self.character_ns);
        // Bytes that come faster than the line's speed allows have no sound times, but keep their order.
        let (earliest, latest) = self.bounds(to, last);
        let end = (earliest.max(start.0), latest.max(start.1));
        let gap = before.map(|index| &kept[index]).filter(|read| read.timed).map(|read| {
            let (earliest, latest) = self.bounds(read, first - 1); // there is a byte before
            Span { least: (start.0 - latest).max(0), most: (start.1 - earliest).max(0) }
        });
        let interval = |(earliest, latest)| Interval {
            earliest: Timestamp::from_ns(earliest),
            latest: Timestamp::from_ns(latest),
        };
        Some((WireTime { start: interval(start), end: interval(end) }, gap))
    }

    /// Bounds the end of a byte of a read, as long as the host did not stall.
    #[inline]
    fn bounds(&self, read: &Read, offset: u64) -> (i64, i64) {
        let run = self.run_ns(offset - read.offset);
        let left = self.run_ns(read.offset + read.length - 1 - offset);
        (read.earliest + run, read.latest - left)
    }

    fn find(&self, offset: u64) -> Option<&Read> {
        self.kept().get(self.index(offset)?)
    }

    /// Returns the index of the read with the byte at `offset`, among those kept.
    #[inline]
    fn index(&self, offset: u64) -> Option<usize> {
        // Nearly all questions are about the latest read, and the others about those right before it.
        match self.kept().last() {
            Some(last) if offset >= last.offset => {
                (offset < last.offset + last.length).then(|| self.kept().len() - 1)
            }
            _ => self.index_of_earlier(offset),
        }
    }

    fn index_of_earlier(&self, offset: u64) -> Option<usize> {
        let reads = self.kept();
        let latest = reads.len().saturating_sub(LAST)..reads.len();
        let has_begun = |index: &usize| offset >= reads[*index].offset;
        let at = latest
            .rev()
            .find(has_begun)
            .unwrap_or_else(|| reads.partition_point(|read| read.offset + read.length <= offset));
        let read = reads.get(at)?;
        (read.offset..read.offset + read.length).contains(&offset).then_some(at)
    }

    /// Tells whether any read had a time.
    pub fn has_times(&self) -> bool {
        self.timed
    }

    /// Bounds the end of the byte at `offset`; `None` when the input has no time for it.
    #[inline]
    pub fn byte(&self, offset: u64) -> Option<ByteTime> {
        if self.timed { self.timed_byte(offset) } else { None }
    }

    fn timed_byte(&self, offset: u64) -> Option<ByteTime> {
        let read = self.find(offset)?;
        read.timed.then(|| self.of(read, offset))
    }

    /// Bounds the end of a byte of a read.
    #[inline]
    fn of(&self, read: &Read, offset: u64) -> ByteTime {
        let (earliest, latest) = self.bounds(read, offset);
        ByteTime {
            certain: Timestamp::from_ns(read.certain + self.run_ns(offset - read.offset)),
            earliest: Timestamp::from_ns(earliest),
            latest: Timestamp::from_ns(latest),
        }
    }

    /// Returns when the byte at `offset` was there at the latest, untimed input at line speed.
    pub fn arrival(&self, offset: u64) -> Option<Timestamp> {
        let read = self.find(offset)?;
        Some(Timestamp::from_ns(read.latest - self.run_ns(read.offset + read.length - 1 - offset)))
    }

    /// Bounds the silence between the byte at `offset` and the one before.
    ///
    /// `None` when it may have had any length. An estimated hold makes no lower bound; a known one makes it as
    /// long as the host did not stall, which a single late byte cannot rule out.
    pub fn gap_before(&self, offset: u64) -> Option<Span> {
        let before = self.byte(offset.checked_sub(1)?)?;
        let after = self.byte(offset)?;
        let least = if self.hold_known {
            (after.earliest - before.latest).saturating_sub(self.character_ns)
        } else {
            0
        };
        let most = (after.latest - before.certain).saturating_sub(self.character_ns);
        Some(Span { least: least.max(0), most: most.max(0) })
    }

    /// Tells whether a silence of at least `gap_ns` may lie before the byte at `offset`.
    ///
    /// By what was known when the byte was read: the answer stays the same whatever is read later.
    pub fn gap_possible(&self, offset: u64, gap_ns: i64) -> bool {
        let before = offset.checked_sub(1).and_then(|before| self.byte(before));
        match before.zip(self.find(offset).filter(|read| read.timed)) {
            Some((before, read)) => {
                let latest = read.read - self.run_ns(read.offset + read.length - 1 - offset);
                latest - before.certain.as_ns() - self.character_ns >= gap_ns
            }
            None => self.find(offset).is_none_or(|read| {
                // Bytes of one untimed line belong together; raw bytes tell nothing.
                read.offset == offset || !self.kept().iter().any(|read| read.after_silence)
            }),
        }
    }
}

/// Returns how long a byte may have waited for an unstalled reader behind an adapter with this hold, in nanoseconds.
fn held_ns(hold_ns: i64) -> i64 {
    if hold_ns > 0 { hold_ns + USB_NS + WAKE_NS } else { WAKE_NS }
}

/// Returns a time that can be reckoned with.
fn near(time: Timestamp) -> i64 {
    time.clamp(EARLIEST, LATEST).as_ns()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TC: i64 = 1_041_667; // a character at 9600 8N1

    fn at(ms: i64) -> ReadTime {
        ReadTime::At(Timestamp::from_ns(ms * MILLISECOND))
    }

    fn stamper(hold_ms: Option<i64>) -> Stamper {
        Stamper::new(LineSettings::default(), hold_ms.map(|ms| ms * MILLISECOND))
    }

    #[test]
    fn bytes_of_one_read_lie_a_character_apart_below_the_read_time() {
        let mut stamper = stamper(Some(16));
        stamper.push(at(1000), 3);
        let times: Vec<_> = (0..3).map(|i| stamper.byte(i).expect("timed")).collect();
        assert_eq!(times[2].latest, Timestamp::from_ns(1000 * MILLISECOND));
        assert_eq!(times[2].latest - times[1].latest, TC);
        assert_eq!(times[1].earliest - times[0].earliest, TC);
        assert_eq!(
            times[0].earliest,
            Timestamp::from_ns(1000 * MILLISECOND - 16 * MILLISECOND - USB_NS - WAKE_NS)
        );
    }

    #[test]
    fn a_byte_cannot_be_older_than_the_read_before_allows() {
        let mut stamper = stamper(Some(16));
        stamper.push(at(1000), 1);
        stamper.push(at(5000), 1);
        let late = stamper.byte(1).expect("timed");
        // Had the host stalled it could have come right after the first read; otherwise it is fresh.
        let first = stamper.byte(0).expect("timed");
        assert_eq!(late.certain, first.certain + TC);
        assert_eq!(
            late.earliest,
            Timestamp::from_ns(5000 * MILLISECOND - 16 * MILLISECOND - USB_NS - WAKE_NS)
        );
    }

    #[test]
    fn a_late_read_was_silent_only_until_its_first_byte() {
        let mut stamper = stamper(None);
        stamper.push(at(1000), 1);
        let first = Timestamp::from_ns(1200 * MILLISECOND) - 99 * TC;
        assert_eq!(stamper.silent_until(at(1200), 100), Some(first));
        assert_eq!(stamper.silent_until(at(1010), 100), stamper.silent_until(at(1000), 0));
    }

    #[test]
    fn a_read_larger_than_the_adapter_holds_was_stalled() {
        let mut stamper = stamper(Some(1));
        stamper.push(at(1000), 1);
        stamper.push(at(1100), 40);
        let first = stamper.byte(1).expect("timed");
        assert_eq!(first.earliest, first.certain);
        assert!(first.earliest < first.latest);
    }

    #[test]
    fn the_next_read_tightens_the_bytes_before() {
        let mut stamper = stamper(Some(16));
        stamper.push(at(1000), 2);
        stamper.push(at(1010), 12);
        let last = stamper.byte(1).expect("timed");
        assert_eq!(last.latest, Timestamp::from_ns(1010 * MILLISECOND) - 12 * TC);
        let mut before = stamper.byte(0).expect("timed");
        for offset in 1..14 {
            let byte = stamper.byte(offset).expect("timed");
            assert!(byte.certain <= byte.earliest && byte.earliest <= byte.latest);
            assert_eq!(stamper.middle(offset), Some(byte.interval().midpoint()));
            let (time, gap) = stamper.frame(offset, 13).expect("timed");
            assert_eq!(time.start, Interval::new(byte.earliest - TC, byte.latest - TC));
            assert_eq!(time.end, stamper.byte(13).expect("timed").interval());
            let silence = before.interval().until(time.start);
            assert_eq!(gap, Some(Span { least: silence.least.max(0), most: silence.most.max(0) }));
            assert!(byte.latest - before.latest >= TC && byte.earliest - before.earliest >= TC);
            before = byte;
        }
        assert_eq!((stamper.frame(2, 14), stamper.frame(20, 30)), (None, None), "not received");
    }

    #[test]
    fn an_estimated_hold_makes_no_gap_certain() {
        for (hold, certain) in [(Some(1), true), (None, false)] {
            let mut stamper = stamper(hold);
            stamper.push(at(1000), 1);
            stamper.push(at(1100), 1);
            let gap = stamper.gap_before(1).expect("timed");
            assert_eq!(gap.least > 90 * MILLISECOND, certain, "{hold:?}");
            assert!(gap.most >= 98 * MILLISECOND);
        }
    }

    #[test]
    fn an_adapter_that_collects_bytes_is_believed_to_have_a_latency_timer() {
        let mut stamper = stamper(None);
        stamper.push(at(1000), 1);
        assert_eq!(stamper.hold_ns(), 0);
        stamper.push(at(1100), 2);
        assert_eq!(stamper.hold_ns(), LATENCY_TIMER_NS);
        stamper.push(at(1200), 40);
        assert_eq!(stamper.hold_ns(), 40 * TC);
    }

    #[test]
    fn times_too_coarse_for_the_line_widen_the_bounds() {
        let mut stamper = stamper(Some(0));
        stamper.push(at(1000), 8);
        stamper.push(at(1000), 13);
        let (request, response) = (stamper.byte(7).expect("timed"), stamper.byte(8).expect("timed"));
        // Thirteen characters cannot pass in no time: the second read's time is off by about that much.
        assert!(response.interval().half_width() >= 12 * TC, "{response:?}");
        assert!(response.interval().midpoint() > request.interval().midpoint());
    }

    #[test]
    fn untimed_bytes_have_no_time_but_go_on_at_line_speed() {
        let mut stamper = stamper(None);
        stamper.push(ReadTime::Unknown, 100);
        assert_eq!(stamper.byte(5), None);
        assert_eq!(stamper.read_time(ReadTime::Unknown, 10), Timestamp::from_ns(110 * TC));
        stamper.push(ReadTime::Unknown, 10);
        for offset in 0..110 {
            assert_eq!(stamper.arrival(offset), Some(Timestamp::from_ns((offset as i64 + 1) * TC)));
        }
    }

    #[test]
    fn impossible_times_keep_the_order_of_the_bounds() {
        let mut stamper = stamper(None);
        for time in [i64::MAX, 0, i64::MIN, 5] {
            stamper.push(ReadTime::At(Timestamp::from_ns(time)), 300);
        }
        for offset in 0..1200 {
            let byte = stamper.byte(offset).expect("timed");
            assert!(byte.certain <= byte.earliest && byte.earliest <= byte.latest, "{offset}");
            assert_eq!(stamper.middle(offset), Some(byte.interval().midpoint()), "{offset}");
            let (time, gap) = stamper.frame(offset, 1199).expect("timed");
            assert!(
                time.start.earliest <= time.start.latest && time.end.earliest <= time.end.latest,
                "{offset}"
            );
            assert!(gap.is_none_or(|gap| 0 <= gap.least && gap.least <= gap.most), "{offset}");
        }
    }
}
