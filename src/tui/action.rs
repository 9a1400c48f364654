//! What a key can do, and everything there is to say about it: name, help, keys, where it works.

/// Names what a key can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the table below says what each does")]
pub enum Action {
    Up,
    Down,
    PageUp,
    PageDown,
    Top,
    Bottom,
    Left,
    Right,
    Open,
    Back,
    NextPane,
    PreviousPane,
    Traffic,
    Devices,
    Health,
    Findings,
    NextView,
    PreviousView,
    Filter,
    FilterSelected,
    ClearFilter,
    Search,
    SearchNext,
    SearchPrevious,
    NextError,
    PreviousError,
    NextFinding,
    PreviousFinding,
    Partner,
    Mark,
    NextMark,
    PreviousMark,
    Note,
    GoToTime,
    Follow,
    Freeze,
    Break,
    Frames,
    Columns,
    Sort,
    Zoom,
    Grow,
    Shrink,
    CopyRow,
    CopyHex,
    CopyJson,
    Export,
    Record,
    Play,
    Faster,
    Slower,
    StepForward,
    StepBack,
    SeekForward,
    SeekBack,
    SeekBegin,
    SeekEnd,
    TimeStyle,
    Mouse,
    Messages,
    Help,
    Redraw,
    Suspend,
    Quit,
}

/// Says where a key works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Context {
    /// Wherever nothing is being typed.
    Everywhere,
    /// In the traffic view.
    Traffic,
    /// In the traffic, device and finding views: wherever there is a list.
    Lists,
    /// Wherever a recording is shown.
    Replay,
}

/// Says everything about an action.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// What it is.
    pub action: Action,
    /// Its key in the configuration.
    pub name: &'static str,
    /// The keys that do it, unless the configuration says otherwise.
    pub keys: &'static [&'static str],
    /// Where it works.
    pub context: Context,
    /// A word or two for the footer.
    pub short: &'static str,
    /// What it does, for the help.
    pub help: &'static str,
}

/// Writes an entry in a line.
const fn entry(
    action: Action,
    name: &'static str,
    keys: &'static [&'static str],
    context: Context,
    short: &'static str,
    help: &'static str,
) -> Entry {
    Entry { action, name, keys, context, short, help }
}

use Context::{Everywhere, Lists, Replay, Traffic};

/// Lists all actions in the order of the help.
#[rustfmt::skip]
pub const ACTIONS: &[Entry] = &[
    entry(Action::Up, "up", &["up", "k"], Everywhere, "up", "move up"),
    entry(Action::Down, "down", &["down", "j"], Everywhere, "down", "move down"),
    entry(Action::PageUp, "page-up", &["pageup", "ctrl-b"], Everywhere, "page up", "move up a page"),
    entry(Action::PageDown, "page-down", &["pagedown", "ctrl-f"], Everywhere, "page down", "move down a page"),
    entry(Action::Top, "top", &["home", "g"], Everywhere, "first", "go to the first row"),
    entry(Action::Bottom, "bottom", &["end", "G"], Everywhere, "last", "go to the last row; in the traffic, follow"),
    entry(Action::Left, "left", &["left", "h"], Everywhere, "left", "move left: a byte, a bus"),
    entry(Action::Right, "right", &["right", "l"], Everywhere, "right", "move right: a byte, a bus"),
    entry(Action::Open, "open", &["enter"], Everywhere, "open", "open what is selected"),
    entry(Action::Back, "back", &["esc"], Everywhere, "back", "close, or go back"),
    entry(Action::Traffic, "traffic", &["1"], Everywhere, "traffic", "show the traffic"),
    entry(Action::Devices, "devices", &["2"], Everywhere, "devices", "show the devices"),
    entry(Action::Health, "health", &["3"], Everywhere, "health", "show how the bus is"),
    entry(Action::Findings, "findings", &["4"], Everywhere, "findings", "show what is wrong with the traffic"),
    entry(Action::NextView, "next-view", &["]"], Everywhere, "next view", "show the next view"),
    entry(Action::PreviousView, "previous-view", &["["], Everywhere, "previous view", "show the view before"),
    entry(Action::NextPane, "next-pane", &["tab"], Traffic, "pane", "go to the next pane: rows, fields, bytes"),
    entry(Action::PreviousPane, "previous-pane", &["shift-tab"], Traffic, "pane", "go to the pane before"),
    entry(Action::Filter, "filter", &["/"], Everywhere, "filter", "show only rows that pass a filter"),
    entry(Action::FilterSelected, "filter-selected", &["f"], Lists, "filter this", "show only rows like what is selected"),
    entry(Action::ClearFilter, "clear-filter", &["x"], Everywhere, "all rows", "show all rows again"),
    entry(Action::Search, "search", &["s"], Traffic, "search", "look for words or bytes"),
    entry(Action::SearchNext, "search-next", &["n"], Traffic, "next", "go to the next hit"),
    entry(Action::SearchPrevious, "search-previous", &["N"], Traffic, "previous", "go to the hit before"),
    entry(Action::NextError, "next-error", &["e"], Traffic, "next error", "go to the next row with trouble"),
    entry(Action::PreviousError, "previous-error", &["E"], Traffic, "error before", "go to the row with trouble before"),
    entry(Action::NextFinding, "next-finding", &["d"], Traffic, "next finding", "go to the next row with a finding"),
    entry(Action::PreviousFinding, "previous-finding", &["D"], Traffic, "finding before", "go to the row with a finding before"),
    entry(Action::Partner, "partner", &["p"], Traffic, "partner", "jump between request and response"),
    entry(Action::Mark, "mark", &["m"], Traffic, "mark", "mark the row, or unmark it; an export keeps marks"),
    entry(Action::NextMark, "next-mark", &["'"], Traffic, "next mark", "go to the next mark or note"),
    entry(Action::PreviousMark, "previous-mark", &["\""], Traffic, "mark before", "go to the mark or note before"),
    entry(Action::Note, "note", &["a"], Everywhere, "note", "write a note; kept in the recording, in a replay by an export"),
    entry(Action::GoToTime, "go-to-time", &[":"], Traffic, "time", "go to a time"),
    entry(Action::Follow, "follow", &["F"], Traffic, "follow", "follow the newest row"),
    entry(Action::Freeze, "freeze", &["space"], Everywhere, "freeze", "freeze the screen, or let it go; the capture goes on"),
    entry(Action::Break, "break", &["b"], Everywhere, "break", "freeze when a row passes a filter"),
    entry(Action::Frames, "frames", &["v"], Traffic, "frames", "show frames, or transactions"),
    entry(Action::Columns, "columns", &["c"], Traffic, "columns", "choose columns, and by which to sort"),
    entry(Action::Sort, "sort", &["o"], Lists, "sort", "sort by the next column"),
    entry(Action::Zoom, "zoom", &["z"], Everywhere, "zoom", "give the pane the whole screen; in charts, another span"),
    entry(Action::Grow, "grow", &["+"], Traffic, "larger", "make the list larger"),
    entry(Action::Shrink, "shrink", &["-"], Traffic, "smaller", "make the list smaller"),
    entry(Action::CopyRow, "copy-row", &["y"], Lists, "copy", "copy the row as text"),
    entry(Action::CopyHex, "copy-hex", &["Y"], Traffic, "copy hex", "copy the row's bytes"),
    entry(Action::CopyJson, "copy-json", &["J"], Traffic, "copy JSON", "copy the row as JSON"),
    entry(Action::Export, "export", &["w"], Everywhere, "export", "write what passes the filter to a recording"),
    entry(Action::Record, "record", &["r"], Everywhere, "record", "start or stop recording"),
    entry(Action::Play, "play", &["P"], Replay, "play", "play the recording, or pause; as does the key that freezes"),
    entry(Action::Faster, "faster", &[">"], Replay, "faster", "play faster, up to 1000 times"),
    entry(Action::Slower, "slower", &["<"], Replay, "slower", "play slower, down to 0.1 times"),
    entry(Action::StepForward, "step-forward", &["."], Replay, "step", "go on by a frame"),
    entry(Action::StepBack, "step-back", &[","], Replay, "step back", "go back by a frame"),
    entry(Action::SeekForward, "seek-forward", &["}"], Replay, "go on", "go on by a fiftieth of the recording"),
    entry(Action::SeekBack, "seek-back", &["{"], Replay, "go back", "go back by a fiftieth of the recording"),
    entry(Action::SeekBegin, "seek-begin", &["("], Replay, "begin", "go to the beginning of the recording"),
    entry(Action::SeekEnd, "seek-end", &[")"], Replay, "end", "go to the end of the recording; follow it while it grows"),
    entry(Action::TimeStyle, "time-style", &["t"], Everywhere, "time", "show times as local, universal or relative"),
    entry(Action::Mouse, "mouse", &["M"], Everywhere, "mouse", "use the mouse, or leave it to the terminal"),
    entry(Action::Messages, "messages", &["L"], Everywhere, "messages", "show what was said so far"),
    entry(Action::Help, "help", &["?", "f1"], Everywhere, "help", "show the keys"),
    entry(Action::Redraw, "redraw", &["ctrl-l"], Everywhere, "redraw", "draw the screen anew"),
    entry(Action::Suspend, "suspend", &["ctrl-z"], Everywhere, "suspend", "stop until the shell brings it back; nothing is received meanwhile"),
    entry(Action::Quit, "quit", &["q", "ctrl-c"], Everywhere, "quit", "end"),
];

impl Action {
    /// Returns what there is to say about it.
    pub fn entry(self) -> Option<&'static Entry> {
        ACTIONS.iter().find(|entry| entry.action == self)
    }

    /// Returns the action of a name.
    pub fn named(name: &str) -> Option<Action> {
        ACTIONS.iter().find(|entry| entry.name == name).map(|entry| entry.action)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_actions_are_all_different() {
        for (at, entry) in ACTIONS.iter().enumerate() {
            for other in &ACTIONS[..at] {
                assert!(entry.name != other.name && entry.action != other.action, "{}", entry.name);
            }
            assert_eq!(Action::named(entry.name), Some(entry.action));
        }
    }
}
