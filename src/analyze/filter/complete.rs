//! What may be typed next in a filter.

use super::keys::{Key, NAMES, TextKey};
use super::token::is_word;
use super::tree::Operator;
use super::value::number_of;

/// Holds words that depend on the traffic and the profiles.
#[derive(Clone, Debug, Default)]
pub struct Vocabulary {
    /// Names of decoded fields.
    pub fields: Vec<String>,
    /// Ids of devices.
    pub devices: Vec<String>,
    /// Serial numbers.
    pub serials: Vec<String>,
    /// Names of commands.
    pub commands: Vec<String>,
    /// Names of buses.
    pub buses: Vec<String>,
    /// Codes of findings.
    pub findings: Vec<String>,
}

/// Is what may stand in place of the word that is being typed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Completion {
    /// Where that word begins, in bytes.
    pub start: usize,
    /// What may stand there, the likeliest first.
    pub words: Vec<String>,
}

/// Says what stands before a word.
enum Place<'a> {
    /// Nothing, or what joins: a name is next.
    Start,
    /// A name: an operator is next.
    Name(&'a str),
    /// A name and an operator: a value is next.
    Value(&'a str),
    /// A name and `in`: the values in parentheses are next.
    In(&'a str),
    /// A number: its unit is next.
    Unit,
    /// A value: `and` or `or` is next.
    Done,
}

impl Completion {
    /// Looks at a filter up to the cursor.
    pub fn of(text: &str, vocabulary: &Vocabulary) -> Completion {
        let start = text
            .rfind(|c| !is_word(c))
            .map_or(0, |at| at + text[at..].chars().next().map_or(1, char::len_utf8));
        let (before, typed) = text.split_at(start);
        let place = place(before);
        let all: Vec<String> = match place {
            Place::Start => names(vocabulary),
            Place::Name(name) => operators(name),
            Place::Value(name) => values(name, vocabulary),
            Place::In(_) => vec!["(".to_owned()],
            Place::Unit => ["ms", "s", "us", "ns"].map(str::to_owned).to_vec(),
            Place::Done => ["&&", "||"].map(str::to_owned).to_vec(),
        };
        let typed_lower = typed.to_ascii_lowercase();
        let mut words: Vec<String> = all.iter().filter(|word| word.starts_with(typed)).cloned().collect();
        for word in all {
            if !words.contains(&word) && !typed.is_empty() && word.to_ascii_lowercase().contains(&typed_lower)
            {
                words.push(word);
            }
        }
        words.retain(|word| word != typed);
        Completion { start, words }
    }
}

/// Splits a text into words and signs.
fn tokens(text: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let end = if is_word(first) {
            rest.find(|c| !is_word(c)).unwrap_or(rest.len())
        } else if first == '"' || first == '\'' {
            let inner = &rest[1..]; // a quote is one byte
            inner.find(first).map_or(rest.len(), |at| at + 2)
        } else {
            let sign = Operator::ALL.iter().map(|(sign, _)| *sign).chain(["&&", "||"]);
            sign.into_iter().find(|sign| rest.starts_with(sign)).map_or(first.len_utf8(), str::len)
        };
        let (token, after) = rest.split_at(end);
        tokens.push(token);
        rest = after.trim_start();
    }
    tokens
}

/// Finds out what is next behind a text.
fn place(before: &str) -> Place<'_> {
    let mut place = Place::Start;
    let mut is_list = false;
    for token in tokens(before) {
        let joins = matches!(token, "&&" | "||" | "!" | "and" | "or" | "not");
        let is_operator =
            Operator::ALL.iter().any(|(sign, _)| *sign == token) || matches!(token, "in" | "contains");
        place = match place {
            _ if joins => {
                is_list = false;
                Place::Start
            }
            Place::Start if token == "(" => Place::Start,
            Place::Start => match Key::named(token) {
                Some(Key::Echo | Key::Damaged) => Place::Done,
                Some(Key::Crc) => Place::Value(token),
                _ => Place::Name(token),
            },
            Place::Name(name) if token == "in" => Place::In(name),
            Place::Name(name) if is_operator => Place::Value(name),
            Place::In(name) if token == "(" => {
                is_list = true;
                Place::Value(name)
            }
            Place::Value(name) if token == "," => Place::Value(name),
            Place::Value("latency") if number_of(token).is_some() => Place::Unit,
            Place::Unit if is_list => Place::Value("latency"),
            Place::Value(name) if is_list && token != ")" => Place::Value(name),
            Place::Name(_) | Place::Value(_) | Place::In(_) | Place::Unit | Place::Done => Place::Done,
        };
    }
    place
}

fn names(vocabulary: &Vocabulary) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (name, key) in NAMES {
        // The first of several names is enough.
        if NAMES.iter().find(|(_, other)| other == key).is_some_and(|(first, _)| first == name) {
            names.push((*name).to_owned());
        }
    }
    names.extend(vocabulary.fields.iter().filter(|field| Key::named(field).is_none()).cloned());
    names
}

fn operators(name: &str) -> Vec<String> {
    let words: &[&str] = match Key::named(name) {
        Some(Key::Bytes) => &["contains"],
        Some(Key::Text(_)) => &["==", "!=", "~", "in"],
        Some(_) => &["==", "!=", ">", ">=", "<", "<=", "in"],
        None => &["==", "!=", ">", ">=", "<", "<=", "~", "in"],
    };
    words.iter().map(|word| (*word).to_owned()).collect()
}

fn values(name: &str, vocabulary: &Vocabulary) -> Vec<String> {
    match Key::named(name) {
        Some(Key::Crc) => ["bad", "good"].map(str::to_owned).to_vec(),
        Some(Key::Text(key)) => match (key, key.choices()) {
            (_, Some(choices)) => choices.into_iter().map(str::to_owned).collect(),
            (TextKey::Device, None) => vocabulary.devices.clone(),
            (TextKey::Serial, None) => vocabulary.serials.clone(),
            (TextKey::Command, None) => vocabulary.commands.clone(),
            (TextKey::Bus, None) => vocabulary.buses.clone(),
            (TextKey::Finding, None) => vocabulary.findings.clone(),
            (_, None) => Vec::new(),
        },
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect();
        let vocabulary = Vocabulary {
            fields: words(&["temperature", "turbidity"]),
            devices: words(&["yosemitech-do"]),
            commands: words(&["get-measurement", "get-calibration"]),
            ..Vocabulary::default()
        };
        Completion::of(text, &vocabulary).words
    }

    #[test]
    fn what_is_offered_depends_on_what_stands_before() {
        assert_eq!(words("te")[0], "temperature");
        assert!(words("").contains(&"addr".to_owned()) && !words("").contains(&"address".to_owned()));
        assert_eq!(words("outcome "), ["==", "!=", "~", "in"]);
        assert_eq!(words("outcome in (no-response, la"), ["late"]);
        assert_eq!(words("cmd ~ cal"), ["get-calibration"]);
        assert_eq!(words("device == "), ["yosemitech-do"]);
        assert_eq!(words("crc "), ["bad", "good"]);
        assert_eq!(words("addr == 1 "), ["&&", "||"]);
        assert_eq!(words("addr == 1 && tu"), ["turbidity", "temperature"], "what begins so comes first");
        assert_eq!(words("bytes "), ["contains"]);
        assert_eq!(words("latency > 100 "), ["ms", "s", "us", "ns"]);
        assert_eq!(words("outcome in "), ["("]);
    }

    #[test]
    fn it_says_where_the_word_begins() {
        let completion = Completion::of("addr == 1 && out", &Vocabulary::default());
        assert_eq!((completion.start, &completion.words[..]), (13, &["outcome".to_owned()][..]));
        for odd in ["ö", "\"", "'a", "ä == ", "(((", "x in (\"ü"] {
            let start = Completion::of(odd, &Vocabulary::default()).start;
            assert!(odd.is_char_boundary(start));
        }
    }
}
