//! Keys and what they do: the table of actions, as the configuration changes it.

use std::fmt;
use std::str::FromStr;

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use thiserror::Error;

use super::action::{ACTIONS, Action};

/// Is a key with what is held beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Key {
    code: KeyCode,
    modifiers: KeyModifiers,
}

impl From<KeyEvent> for Key {
    /// Takes a key as a terminal reports it: a capital letter is itself, whether Shift is reported or not.
    fn from(event: KeyEvent) -> Key {
        let mut modifiers =
            event.modifiers & (KeyModifiers::CONTROL | KeyModifiers::ALT | KeyModifiers::SHIFT);
        let code = match event.code {
            KeyCode::BackTab => {
                modifiers |= KeyModifiers::SHIFT;
                KeyCode::Tab
            }
            KeyCode::Char(letter) => {
                modifiers -= KeyModifiers::SHIFT;
                KeyCode::Char(letter)
            }
            code => code,
        };
        Key { code, modifiers }
    }
}

/// Names of keys that are no characters.
const NAMES: &[(&str, KeyCode)] = &[
    ("space", KeyCode::Char(' ')),
    ("enter", KeyCode::Enter),
    ("esc", KeyCode::Esc),
    ("tab", KeyCode::Tab),
    ("backspace", KeyCode::Backspace),
    ("delete", KeyCode::Delete),
    ("insert", KeyCode::Insert),
    ("up", KeyCode::Up),
    ("down", KeyCode::Down),
    ("left", KeyCode::Left),
    ("right", KeyCode::Right),
    ("home", KeyCode::Home),
    ("end", KeyCode::End),
    ("pageup", KeyCode::PageUp),
    ("pagedown", KeyCode::PageDown),
];

/// What may stand before a key's name.
const HELD: [(&str, KeyModifiers); 3] =
    [("ctrl-", KeyModifiers::CONTROL), ("alt-", KeyModifiers::ALT), ("shift-", KeyModifiers::SHIFT)];

/// Says why a text is no key.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("'{0}' is no key; write a character, or a name such as space, enter, f5, ctrl-f or shift-tab")]
pub struct KeyError(String);

impl FromStr for Key {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Key, KeyError> {
        let mut rest = text;
        let mut modifiers = KeyModifiers::NONE;
        while let Some((held, after)) =
            HELD.iter().find_map(|(name, held)| Some((*held, rest.strip_prefix(name)?)))
        {
            (modifiers, rest) = (modifiers | held, after);
        }
        let mut letters = rest.chars();
        let code = match (letters.next(), letters.next()) {
            (Some(letter), None) if !letter.is_control() && letter != ' ' => Some(KeyCode::Char(letter)),
            _ => NAMES.iter().find(|(name, _)| *name == rest).map(|(_, code)| *code),
        };
        let numbered = || {
            let number = rest.strip_prefix('f')?.parse().ok()?;
            (1..=24).contains(&number).then_some(KeyCode::F(number))
        };
        let code = code.or_else(numbered).ok_or_else(|| KeyError(text.to_owned()))?;
        Ok(Key { code, modifiers })
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, held) in HELD {
            if self.modifiers.contains(held) {
                f.write_str(name)?;
            }
        }
        match (NAMES.iter().find(|(_, code)| *code == self.code), self.code) {
            (Some((name, _)), _) => f.write_str(name),
            (None, KeyCode::Char(letter)) => write!(f, "{letter}"),
            (None, code) => write!(f, "{}", code.to_string().to_lowercase()),
        }
    }
}

impl Key {
    /// Returns how it is shown on the screen: shorter than its name.
    pub fn shown(self) -> String {
        match (self.code, self.modifiers) {
            (KeyCode::Enter, KeyModifiers::NONE) => "⏎".to_owned(),
            (KeyCode::Up, KeyModifiers::NONE) => "↑".to_owned(),
            (KeyCode::Down, KeyModifiers::NONE) => "↓".to_owned(),
            (KeyCode::Left, KeyModifiers::NONE) => "←".to_owned(),
            (KeyCode::Right, KeyModifiers::NONE) => "→".to_owned(),
            (KeyCode::Char(letter), KeyModifiers::CONTROL) if letter != ' ' => {
                format!("^{}", letter.to_ascii_uppercase())
            }
            _ => self.to_string(),
        }
    }
}

/// Says which key does what.
#[derive(Clone, Debug, PartialEq)]
pub struct Keymap {
    bindings: Vec<(Action, Vec<Key>)>,
}

impl Default for Keymap {
    fn default() -> Self {
        let keys = |keys: &[&str]| keys.iter().filter_map(|key| key.parse().ok()).collect();
        Keymap { bindings: ACTIONS.iter().map(|entry| (entry.action, keys(entry.keys))).collect() }
    }
}

impl Keymap {
    /// Gives an action other keys; none takes them away.
    pub fn bind(&mut self, action: Action, keys: Vec<Key>) {
        if let Some((_, bound)) = self.bindings.iter_mut().find(|(known, _)| *known == action) {
            *bound = keys;
        }
    }

    /// Returns what a key does.
    pub fn action(&self, key: Key) -> Option<Action> {
        self.bindings.iter().find(|(_, keys)| keys.contains(&key)).map(|(action, _)| *action)
    }

    /// Returns the keys that do something.
    pub fn keys(&self, action: Action) -> &[Key] {
        self.bindings.iter().find(|(known, _)| *known == action).map_or(&[], |(_, keys)| keys)
    }

    /// Returns two actions that one key is to do, if there are such.
    pub fn conflict(&self) -> Option<(Key, Action, Action)> {
        let all = || self.bindings.iter().flat_map(|(action, keys)| keys.iter().map(|key| (*key, *action)));
        all().enumerate().find_map(|(at, (key, action))| {
            all().take(at).find(|(other, _)| *other == key).map(|(_, other)| (key, other, action))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_reads_as_it_is_written() {
        for entry in ACTIONS {
            for text in entry.keys {
                let key: Key = text.parse().expect(text);
                assert_eq!(key.to_string(), *text);
            }
        }
        for text in ["f12", "alt-x", "ctrl-alt-space", "ö"] {
            assert_eq!(text.parse::<Key>().expect(text).to_string(), text);
        }
        for text in ["", " ", "hyper-x", "f25", "ctrl-", "enter key"] {
            assert!(text.parse::<Key>().is_err(), "{text}");
        }
    }

    #[test]
    fn no_key_does_two_things() {
        assert_eq!(Keymap::default().conflict(), None);
        let mut keymap = Keymap::default();
        keymap.bind(Action::Mark, vec!["q".parse().expect("a key")]);
        let key = "q".parse().expect("a key");
        assert_eq!(keymap.conflict(), Some((key, Action::Mark, Action::Quit)));
    }

    #[test]
    fn a_terminal_may_report_shift_with_a_capital_or_not() {
        let keymap = Keymap::default();
        for modifiers in [KeyModifiers::NONE, KeyModifiers::SHIFT] {
            let key = Key::from(KeyEvent::new(KeyCode::Char('G'), modifiers));
            assert_eq!(keymap.action(key), Some(Action::Bottom));
        }
        let back = Key::from(KeyEvent::new(KeyCode::BackTab, KeyModifiers::SHIFT));
        assert_eq!(keymap.action(back), Some(Action::PreviousPane));
    }
}
