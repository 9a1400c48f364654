//! A line that is typed: a filter, words to look for, a note, a time, the name of a file.

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use tui_input::{Input, InputRequest};

use crate::analyze::filter::{Completion, Filter, Vocabulary};

/// How many lines are remembered.
const MOST: usize = 50;

/// Says what is typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask {
    /// Which rows to show.
    Filter,
    /// At which row to stop.
    Break,
    /// What to look for.
    Search,
    /// A note in time.
    Note,
    /// Which time to go to.
    Time,
    /// Where to write.
    Export,
}

impl Ask {
    /// Returns what stands before the line.
    pub fn title(self) -> &'static str {
        match self {
            Ask::Filter => "filter",
            Ask::Break => "freeze when",
            Ask::Search => "search",
            Ask::Note => "note",
            Ask::Time => "go to",
            Ask::Export => "export to",
        }
    }

    /// Returns what may be typed, while nothing is.
    pub fn example(self) -> &'static str {
        match self {
            Ask::Filter => "addr == 1 && temperature > 20; empty shows all",
            Ask::Break => "outcome in (no-response, damaged); empty takes it back",
            Ask::Search => "words of a row, or bytes such as 26 00",
            Ask::Note => "cable at sensor 3 moved",
            Ask::Time => "13:05, 13:05:30, 2026-01-01T13:05:00Z, or seconds from the start such as 12.5",
            Ask::Export => "part.mcap, .csv, .jsonl, …; what passes the filter, in .mcap with all bytes",
        }
    }

    /// Tells whether it is in the language of filters.
    pub fn is_filter(self) -> bool {
        matches!(self, Ask::Filter | Ask::Break)
    }
}

/// Is a line that is being typed.
#[derive(Clone, Debug)]
pub struct Prompt {
    /// What it is for.
    pub ask: Ask,
    /// The text, with the cursor.
    pub input: Input,
    /// What is wrong with it, and at which character.
    pub error: Option<(usize, String)>,
    /// What may be typed next; the one that is chosen.
    pub completion: Completion,
    /// Which of them Tab puts in next.
    chosen: Option<usize>,
    /// How far back in what was typed before.
    back: usize,
}

/// Says what becomes of a line after a key.
#[derive(Debug, PartialEq, Eq)]
pub enum Typed {
    /// It goes on.
    More,
    /// It is done.
    Done,
    /// It is given up.
    Cancelled,
}

impl Prompt {
    /// Begins a line with a text.
    pub fn new(ask: Ask, text: String, vocabulary: &Vocabulary) -> Self {
        let mut prompt = Prompt {
            ask,
            input: Input::new(text),
            error: None,
            completion: Completion::default(),
            chosen: None,
            back: 0,
        };
        prompt.judge(vocabulary);
        prompt
    }

    /// Returns the text.
    pub fn text(&self) -> &str {
        self.input.value()
    }

    /// Takes a key.
    pub fn key(&mut self, key: KeyEvent, vocabulary: &Vocabulary, history: &[String]) -> Typed {
        let is_held = key.modifiers.contains(KeyModifiers::CONTROL);
        let request = match key.code {
            KeyCode::Enter if self.error.is_none() => return Typed::Done,
            KeyCode::Esc => return Typed::Cancelled,
            KeyCode::Char('c') if is_held => return Typed::Cancelled,
            KeyCode::Tab => {
                self.complete();
                self.check();
                return Typed::More;
            }
            KeyCode::Up | KeyCode::Down => {
                self.recall(key.code == KeyCode::Up, history);
                None
            }
            _ => request(key, is_held),
        };
        if let Some(request) = request {
            self.input.handle(request);
        }
        self.judge(vocabulary);
        Typed::More
    }

    /// Takes a text at once.
    pub fn paste(&mut self, text: &str, vocabulary: &Vocabulary) {
        for letter in text.chars().filter(|letter| !letter.is_control()).take(1000) {
            self.input.handle(InputRequest::InsertChar(letter));
        }
        self.judge(vocabulary);
    }

    /// Puts in what may be typed next, one after the other.
    fn complete(&mut self) {
        let Completion { start, words } = &self.completion;
        if words.is_empty() {
            return;
        }
        let next = self.chosen.map_or(0, |at| (at + 1) % words.len());
        let text = self.input.value();
        let cursor = text.char_indices().nth(self.input.cursor()).map_or(text.len(), |(at, _)| at);
        let (before, after) = (text.get(..*start).unwrap_or(text), text.get(cursor..).unwrap_or_default());
        let filled = format!("{before}{}", words[next]); // below its length
        let at = filled.chars().count();
        self.input = Input::new(format!("{filled}{after}")).with_cursor(at);
        self.chosen = Some(next);
    }

    fn recall(&mut self, is_older: bool, history: &[String]) {
        self.back = if is_older { (self.back + 1).min(history.len()) } else { self.back.saturating_sub(1) };
        let text = match self.back {
            0 => String::new(),
            back => history.get(history.len().saturating_sub(back)).cloned().unwrap_or_default(),
        };
        self.input = Input::new(text);
    }

    /// Looks what is wrong with the text, and what may come next.
    fn judge(&mut self, vocabulary: &Vocabulary) {
        self.check();
        self.chosen = None;
        if self.ask.is_filter() {
            let before: String = self.text().chars().take(self.input.cursor()).collect();
            self.completion = Completion::of(&before, vocabulary);
        }
    }

    fn check(&mut self) {
        let text = self.input.value().trim();
        self.error = match self.ask {
            _ if text.is_empty() => None,
            Ask::Filter | Ask::Break => {
                Filter::parse(self.input.value()).err().map(|error| {
                    // What may have been meant comes first: it is read first, and not cut.
                    let (column, expected) = (error.column(), error.expected());
                    let text = match error.hint() {
                        Some(hint) => format!("column {column}: {hint}; expected {expected}"),
                        None => format!("column {column}: expected {expected}"),
                    };
                    (column, text)
                })
            }
            Ask::Time => time_filter(text).err().map(|message| (1, message)),
            Ask::Search | Ask::Note | Ask::Export => None,
        };
    }
}

/// Returns what a key does to a text.
fn request(key: KeyEvent, is_held: bool) -> Option<InputRequest> {
    Some(match (key.code, is_held) {
        (KeyCode::Char('a'), true) | (KeyCode::Home, _) => InputRequest::GoToStart,
        (KeyCode::Char('e'), true) | (KeyCode::End, _) => InputRequest::GoToEnd,
        (KeyCode::Char('w'), true) => InputRequest::DeletePrevWord,
        (KeyCode::Char('u'), true) => InputRequest::DeleteLine,
        (KeyCode::Char('k'), true) => InputRequest::DeleteTillEnd,
        (KeyCode::Char(letter), false) => InputRequest::InsertChar(letter),
        (KeyCode::Backspace, _) => InputRequest::DeletePrevChar,
        (KeyCode::Delete, _) => InputRequest::DeleteNextChar,
        (KeyCode::Left, true) => InputRequest::GoToPrevWord,
        (KeyCode::Right, true) => InputRequest::GoToNextWord,
        (KeyCode::Left, false) => InputRequest::GoToPrevChar,
        (KeyCode::Right, false) => InputRequest::GoToNextChar,
        _ => return None,
    })
}

/// Is a time to go to.
pub enum Target {
    /// The first row that passes.
    Filter(Filter),
    /// So many seconds after the first byte.
    Seconds(f64),
}

/// Reads a time as filters have it, or seconds from the start.
///
/// # Errors
/// What is wrong with it.
pub fn time_filter(text: &str) -> Result<Target, String> {
    if let Some(seconds) = text.parse::<f64>().ok().filter(|seconds| seconds.is_finite()) {
        return Ok(Target::Seconds(seconds));
    }
    let parsed = Filter::parse(&format!("time >= {text}"));
    parsed.map(Target::Filter).map_err(|error| match error.hint() {
        Some(hint) => hint.to_owned(),
        None => format!("expected {}", error.expected()),
    })
}

/// Remembers a line that was typed.
pub fn remember(history: &mut Vec<String>, text: &str) {
    if text.is_empty() {
        return;
    }
    history.retain(|known| known != text);
    history.push(text.to_owned());
    if history.len() > MOST {
        history.remove(0);
    }
}
