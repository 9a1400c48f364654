//! Finding the next of something, or the last before, in all of a recording: where nothing of it is, is not decoded.

use super::super::super::failure::Failure;
use super::decoder::Reached;
use super::head::{Goal, Head, Stop};
use crate::tui::store::List;
use crate::tui::timeline::Sought;

/// Is a search under way.
#[derive(Clone, Debug)]
pub(super) struct Find {
    pub(super) what: Sought,
    pub(super) is_forward: bool,
    /// A list, and the row before which it is looked for.
    before: Option<(List, u64)>,
    /// Where it was begun.
    pub(super) from: Reached,
    /// Whether that was after the end.
    pub(super) was_over: bool,
    /// The stretch that is looked through, and the items after the last hit in it.
    stretch: Option<(i64, i64)>,
    latest: Option<u64>,
    /// Before which place it is looked for next, when it goes back.
    until: i64,
}

impl Find {
    /// Begins where the playhead is.
    pub(super) fn new(
        what: Sought,
        is_forward: bool,
        before: Option<(List, u64)>,
        head: &Head<'_, '_>,
    ) -> Self {
        let from = head.decoder.reached();
        let (was_over, until) = (head.is_over, from.elapsed_ns);
        Find { what, is_forward, before, from, was_over, stretch: None, latest: None, until }
    }
}

impl Head<'_, '_> {
    /// Goes on with a search.
    pub(super) fn find(&mut self, find: Find, more: &mut dyn FnMut() -> bool) -> Result<Stop, Failure> {
        if find.is_forward { self.find_next(find, more) } else { self.find_last(find, more) }
    }

    fn find_next(&mut self, mut find: Find, more: &mut dyn FnMut() -> bool) -> Result<Stop, Failure> {
        let (what, from) = (find.what, find.from.items);
        loop {
            let here = self.decoder.reached().elapsed_ns;
            let next = self.series(what, |series, until, is_all| {
                let next = series.next_with(what, series.index(here.max(find.until)));
                (next.map(|at| (series.begin_of(at), series.begin_of(at + 1))), until, is_all)
            });
            let Some((next, until, is_all)) = next else {
                // Nobody looks for it any more.
                return Ok(Stop::Reached);
            };
            let Some((begin, end)) = next else {
                if is_all {
                    self.give_up(&find);
                    return Ok(Stop::Reached);
                }
                // What the background has passed has none; go there, and wait for more.
                find.until = find.until.max(until);
                self.set_goal(Goal::Find(find));
                return Ok(Stop::Wait);
            };
            if here < begin {
                self.approach(&|decoder| decoder.reached().elapsed_ns, begin.saturating_sub(1))?;
            }
            let (mut found, was_over) = (false, self.is_over);
            let stop = self.run(more, |head, next| {
                found = head.decoder.reached().items > from && Head::is_hit(&head.decoder.last(), what);
                found || next >= end
            })?;
            match stop {
                Stop::Reached if found => {
                    self.arrive();
                    return Ok(Stop::Reached);
                }
                Stop::Over if Head::is_hit(&self.decoder.last(), what) && !was_over => {
                    self.arrive();
                    return Ok(Stop::Reached);
                }
                Stop::Reached => find.until = find.until.max(end),
                Stop::Over => {
                    self.give_up(&find);
                    return Ok(Stop::Reached);
                }
                Stop::Paused | Stop::Wait => {
                    self.set_goal(Goal::Find(find));
                    return Ok(stop);
                }
            }
        }
    }

    fn find_last(&mut self, mut find: Find, more: &mut dyn FnMut() -> bool) -> Result<Stop, Failure> {
        let what = find.what;
        loop {
            let Some((begin, end)) = find.stretch else {
                let last = self.series(what, |series, _, _| {
                    let last = series.last_with(what, series.index(find.until));
                    last.map(|at| (series.begin_of(at), series.begin_of(at + 1)))
                });
                let Some(stretch) = last.flatten().filter(|_| find.until >= 0) else {
                    self.give_up(&find);
                    return Ok(Stop::Reached);
                };
                find.stretch = Some(stretch);
                self.restore(&|decoder| decoder.reached().elapsed_ns < stretch.0)?;
                continue;
            };
            let (before, from) = (find.before, find.from.items);
            let mut latest = find.latest;
            let stop = self.run(more, |head, next| {
                let reached = head.decoder.reached();
                let is_before = match before {
                    Some((list, row)) => head.decoder.rows(list) <= row,
                    None => reached.items < from,
                };
                if is_before && Head::is_hit(&head.decoder.last(), what) {
                    latest = Some(reached.items);
                }
                !is_before || next >= end
            })?;
            find.latest = latest;
            match (stop, latest) {
                (Stop::Paused, _) => {
                    self.set_goal(Goal::Find(find));
                    return Ok(stop);
                }
                (_, Some(items)) => {
                    self.set_goal(Goal::Items(items));
                    return Ok(Stop::Reached);
                }
                (_, None) => (find.stretch, find.until) = (None, begin.saturating_sub(1)),
            }
        }
    }
}
