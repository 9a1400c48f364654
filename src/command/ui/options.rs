//! What the UI goes on: configuration, environment and command line.

use crate::analyze::filter::{Filter, Vocabulary};
use crate::command::output;
use crate::config::Screen;
use crate::device::Profiles;
use crate::report::TimeStyle;
use crate::tui::app::Options;
use crate::tui::theme::ThemeKind;

/// Tells whether there is a terminal to show the UI on.
pub(in crate::command) fn has_terminal() -> bool {
    output::stdout_is_terminal() && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Returns what the UI of a session goes on.
pub(in crate::command) fn options(
    screen: Screen,
    profiles: &Profiles,
    time: TimeStyle,
    filter: Option<Filter>,
    source: String,
) -> Options {
    let is_plain = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    Options {
        theme: if is_plain { ThemeKind::Plain } else { screen.theme },
        keymap: screen.keymap,
        time,
        mouse: screen.mouse,
        filter,
        source,
        is_live: true,
        must_record: true,
        vocabulary: vocabulary(profiles),
    }
}

/// Returns the words of filters that the profiles bring.
fn vocabulary(profiles: &Profiles) -> Vocabulary {
    let mut words = Vocabulary::default();
    let add = |words: &mut Vec<String>, word: &str| {
        if !words.iter().any(|known| known == word) {
            words.push(word.to_owned());
        }
    };
    for profile in profiles.iter() {
        add(&mut words.devices, &profile.id);
        for command in &profile.commands {
            add(&mut words.commands, &command.name);
            let fields = command.request.iter().chain(&command.response);
            fields.for_each(|field| add(&mut words.fields, &field.name));
        }
        profile.derived.iter().for_each(|derived| add(&mut words.fields, &derived.name));
    }
    words
}
