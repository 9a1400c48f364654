//! Reads TOML key by key and collects all that is wrong with it, with line and column.

use std::cell::RefCell;
use std::fmt::{self, Display};
use std::ops::{Range, RangeInclusive};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Is one thing that is wrong with a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// From 1.
    pub line: usize,
    /// From 1, in characters.
    pub column: usize,
    /// What is wrong.
    pub message: String,
    /// How it may be mended.
    pub hint: Option<String>,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.line, self.column, self.message)?;
        match &self.hint {
            Some(hint) => write!(f, "; {hint}"),
            None => Ok(()),
        }
    }
}

/// Collects problems of one text.
pub(crate) struct Problems<'t> {
    text: &'t str,
    found: RefCell<Vec<(usize, Problem)>>,
}

impl<'t> Problems<'t> {
    pub(crate) fn new(text: &'t str) -> Self {
        Problems { text, found: RefCell::default() }
    }

    /// Notes a problem at a byte offset of the text.
    pub(crate) fn add(&self, at: usize, message: impl Display, hint: Option<String>) {
        let (line, column) = position(self.text, at);
        self.found.borrow_mut().push((at, Problem { line, column, message: message.to_string(), hint }));
    }

    /// Returns what was found, in the order of the text.
    pub(crate) fn into_sorted(self) -> Vec<Problem> {
        let mut found = self.found.into_inner();
        found.sort_by_key(|&(at, _)| at);
        found.into_iter().map(|(_, problem)| problem).collect()
    }
}

/// Reads a text as TOML, section by section.
///
/// # Errors
///
/// All problems in the order of the text; those of the TOML syntax hide all others.
pub(crate) fn read<T>(text: &str, read: impl FnOnce(&Section<'_>) -> Option<T>) -> Result<T, Vec<Problem>> {
    let problems = Problems::new(text);
    let (table, syntax) = DeTable::parse_recoverable(text);
    if !syntax.is_empty() {
        for error in syntax {
            let at = error.span().map_or(0, |span| span.start);
            problems.add(at, error.message(), None);
        }
        return Err(problems.into_sorted());
    }
    let value = read(&Section::new(&problems, table.get_ref(), 0));
    let found = problems.into_sorted();
    match value {
        Some(value) if found.is_empty() => Ok(value),
        _ => Err(found),
    }
}

/// Is a value with the place it was read from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Located<T> {
    pub(crate) value: T,
    /// Byte offset in the text.
    pub(crate) at: usize,
}

impl<T> Located<T> {
    fn new(value: T, span: Range<usize>) -> Self {
        Located { value, at: span.start }
    }
}

/// Is a table being read; what nobody asked for is found by `finish`.
pub(crate) struct Section<'t> {
    problems: &'t Problems<'t>,
    table: &'t DeTable<'t>,
    /// Byte offset of the table in the text.
    pub(crate) at: usize,
    known: RefCell<Vec<&'static str>>,
}

impl<'t> Section<'t> {
    pub(crate) fn new(problems: &'t Problems<'t>, table: &'t DeTable<'t>, at: usize) -> Self {
        Section { problems, table, at, known: RefCell::default() }
    }

    /// Notes a problem.
    pub(crate) fn problem(&self, at: usize, message: impl Display) {
        self.problems.add(at, message, None);
    }

    /// Notes a problem with a hint at its mend.
    pub(crate) fn problem_with_hint(&self, at: usize, message: impl Display, hint: impl Into<String>) {
        self.problems.add(at, message, Some(hint.into()));
    }

    /// Notes every key that was not asked for.
    pub(crate) fn finish(&self) {
        let known = self.known.borrow();
        for (key, _) in self.table.iter() {
            let name: &str = key.get_ref();
            if !known.contains(&name) {
                let hint = match nearest(name, known.iter().copied()) {
                    Some(near) => format!("did you mean '{near}'?"),
                    None => format!("known here: {}", known.join(", ")),
                };
                self.problem_with_hint(key.span().start, format_args!("unknown key '{name}'"), hint);
            }
        }
    }

    /// Returns a value by its key.
    fn value(&self, key: &'static str) -> Option<&'t Spanned<DeValue<'t>>> {
        self.known.borrow_mut().push(key);
        self.table.get(key)
    }

    /// Notes that a value is not what it should be.
    fn mismatch(&self, key: &str, value: &Spanned<DeValue<'_>>, expected: impl Display) {
        let found = value.get_ref().type_str();
        self.problem(value.span().start, format_args!("'{key}' is of type {found}, not {expected}"));
    }

    /// Notes that a key is missing when there is no value.
    pub(crate) fn required<T>(&self, key: &str, value: Option<T>) -> Option<T> {
        if value.is_none() && !self.table.contains_key(key) {
            self.problem(self.at, format_args!("'{key}' is missing"));
        }
        value
    }

    /// Reads a text that is not empty.
    pub(crate) fn string(&self, key: &'static str) -> Option<Located<&'t str>> {
        let value = self.value(key)?;
        match value.get_ref().as_str() {
            Some("") => self.problem(value.span().start, format_args!("'{key}' is empty")),
            Some(text) => return Some(Located::new(text, value.span())),
            None => self.mismatch(key, value, "a text"),
        }
        None
    }

    /// Reads one of several words.
    pub(crate) fn choice<T: Copy>(&self, key: &'static str, choices: &[(&'static str, T)]) -> Option<T> {
        let given = self.string(key)?;
        let found = choices.iter().find(|(name, _)| *name == given.value);
        if found.is_none() {
            let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
            let hint = match nearest(given.value, names.iter().copied()) {
                Some(near) => format!("did you mean '{near}'?"),
                None => format!("use one of {}", names.join(", ")),
            };
            self.problem_with_hint(given.at, format_args!("'{}' is no {key}", given.value), hint);
        }
        found.map(|&(_, choice)| choice)
    }

    /// Reads true or false.
    pub(crate) fn boolean(&self, key: &'static str) -> Option<bool> {
        let value = self.value(key)?;
        let truth = value.get_ref().as_bool();
        if truth.is_none() {
            self.mismatch(key, value, "true or false");
        }
        truth
    }

    /// Reads a whole number within a range.
    pub(crate) fn integer(&self, key: &'static str, range: RangeInclusive<i64>) -> Option<Located<i64>> {
        self.value(key).and_then(|value| self.whole_number(key, value, &range))
    }

    /// Reads a list of whole numbers within a range.
    pub(crate) fn integers(
        &self,
        key: &'static str,
        range: RangeInclusive<i64>,
    ) -> Option<Vec<Located<i64>>> {
        let values = self.array(key)?;
        Some(values.iter().filter_map(|value| self.whole_number(key, value, &range)).collect())
    }

    fn whole_number(
        &self,
        key: &str,
        value: &Spanned<DeValue<'_>>,
        range: &RangeInclusive<i64>,
    ) -> Option<Located<i64>> {
        let expected = format!("a whole number from {} to {}", range.start(), range.end());
        let Some(number) = value.get_ref().as_integer() else {
            self.mismatch(key, value, expected);
            return None;
        };
        match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(number) if range.contains(&number) => Some(Located::new(number, value.span())),
            _ => {
                self.problem(value.span().start, format_args!("'{key}' is {number}, not {expected}"));
                None
            }
        }
    }

    /// Reads a finite number.
    pub(crate) fn number(&self, key: &'static str) -> Option<Located<f64>> {
        self.value(key).and_then(|value| self.finite(key, value))
    }

    /// Reads a list of finite numbers.
    pub(crate) fn numbers(&self, key: &'static str) -> Option<Located<Vec<f64>>> {
        let values = self.array(key)?;
        let at = self.place(key);
        let numbers: Vec<f64> =
            values.iter().filter_map(|value| Some(self.finite(key, value)?.value)).collect();
        (numbers.len() == values.len()).then_some(Located { value: numbers, at })
    }

    fn finite(&self, key: &str, value: &Spanned<DeValue<'_>>) -> Option<Located<f64>> {
        let text = match value.get_ref() {
            DeValue::Integer(number) if number.radix() == 10 => number.as_str(),
            DeValue::Float(number) => number.as_str(),
            _ => {
                self.mismatch(key, value, "a decimal number");
                return None;
            }
        };
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Some(Located::new(number, value.span())),
            _ => {
                self.problem(value.span().start, format_args!("'{key}' is not a finite number"));
                None
            }
        }
    }

    /// Reads a list of texts that are not empty.
    pub(crate) fn strings(&self, key: &'static str) -> Option<Vec<Located<&'t str>>> {
        let values = self.array(key)?;
        let texts = values.iter().filter_map(|value| match value.get_ref().as_str() {
            Some(text) if !text.is_empty() => Some(Located::new(text, value.span())),
            Some(_) => {
                self.problem(value.span().start, format_args!("'{key}' holds an empty text"));
                None
            }
            None => {
                self.mismatch(key, value, "a list of texts");
                None
            }
        });
        Some(texts.collect())
    }

    /// Returns all keys with their texts, whatever the keys are.
    pub(crate) fn texts(&self) -> Vec<(Located<&'t str>, &'t str)> {
        let texts = self.table.iter().filter_map(|(key, value)| {
            let text = value.get_ref().as_str();
            if text.is_none() {
                self.mismatch(key.get_ref(), value, "a text");
            }
            Some((Located::new(&**key.get_ref(), key.span()), text?))
        });
        texts.collect()
    }

    /// Reads a table.
    pub(crate) fn section(&self, key: &'static str) -> Option<Section<'t>> {
        let value = self.value(key)?;
        self.as_section(key, value)
    }

    /// Reads a list of tables; none when the key is missing.
    pub(crate) fn sections(&self, key: &'static str) -> Vec<Section<'t>> {
        let values = self.array(key).unwrap_or_default();
        values.iter().filter_map(|value| self.as_section(key, value)).collect()
    }

    fn as_section(&self, key: &str, value: &'t Spanned<DeValue<'t>>) -> Option<Section<'t>> {
        let Some(table) = value.get_ref().as_table() else {
            self.mismatch(key, value, "a table");
            return None;
        };
        Some(Section::new(self.problems, table, value.span().start))
    }

    fn array(&self, key: &'static str) -> Option<&'t [Spanned<DeValue<'t>>]> {
        let value = self.value(key)?;
        match value.get_ref().as_array() {
            Some(values) => Some(values),
            None => {
                self.mismatch(key, value, "a list");
                None
            }
        }
    }

    /// Returns the byte offset of a key's value, or the table's.
    pub(crate) fn place(&self, key: &str) -> usize {
        self.table.get(key).map_or(self.at, |value| value.span().start)
    }
}

/// Returns line and column, from 1 and in characters, of a byte offset in a text.
fn position(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// Returns the name that a misspelt one probably stands for.
pub(crate) fn nearest<'a>(given: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    names
        .into_iter()
        .map(|name| (strsim::jaro_winkler(given, name), name))
        .filter(|&(likeness, _)| likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}
