//! What styles mean. One accent; red and yellow are for trouble only.

use ratatui::style::{Color, Modifier, Style};

use super::store::Tone;

/// Names the themes there are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ThemeKind {
    /// For a dark background.
    #[default]
    Dark,
    /// For a light background.
    Light,
    /// Without colours: meaning is in glyphs, bold, reverse and underline.
    Plain,
}

/// Gives every meaning its style.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Theme {
    /// Ordinary text.
    pub text: Style,
    /// What matters less: units, labels, times.
    pub dim: Style,
    /// What matters more: headings, addresses.
    pub strong: Style,
    /// What one looks for first: commands, the current tab.
    pub accent: Style,
    /// The row the cursor is on, in the pane that has the focus.
    pub selected: Style,
    /// The row the cursor is on, in another pane.
    pub selected_elsewhere: Style,
    /// Bytes that belong to the selected field.
    pub lit: Style,
    /// Doubtful.
    pub warn: Style,
    /// Wrong.
    pub bad: Style,
    /// A filter that reads well.
    pub good: Style,
    /// What happened a moment ago.
    pub fresh: Style,
    /// What happened a little longer ago.
    pub fading: Style,
    /// Lines between panes.
    pub rule: Style,
    /// A line that something has to be read on at once.
    pub alarm: Style,
    /// Rows of which it is not known yet what came before them.
    pub provisional: Style,
}

impl Theme {
    /// Returns a theme.
    pub fn of(kind: ThemeKind) -> Theme {
        match kind {
            ThemeKind::Dark => Theme::coloured(Color::Cyan, Color::Indexed(236), Color::Indexed(24)),
            ThemeKind::Light => Theme::coloured(Color::Blue, Color::Indexed(254), Color::Indexed(153)),
            ThemeKind::Plain => Theme::plain(),
        }
    }

    fn coloured(accent: Color, shade: Color, selection: Color) -> Theme {
        let text = Style::new();
        let is_light = accent == Color::Blue;
        let dim = if is_light { Color::Indexed(243) } else { Color::Indexed(245) };
        let yellow = if is_light { Color::Indexed(136) } else { Color::Yellow };
        Theme {
            text,
            dim: text.fg(dim),
            strong: text.add_modifier(Modifier::BOLD),
            accent: text.fg(accent),
            selected: text.bg(selection).add_modifier(Modifier::BOLD),
            selected_elsewhere: text.bg(shade),
            lit: text.bg(selection).add_modifier(Modifier::BOLD),
            warn: text.fg(yellow),
            bad: text.fg(Color::Red),
            good: text.fg(Color::Green),
            fresh: text.fg(accent).add_modifier(Modifier::BOLD),
            fading: text.fg(accent),
            rule: text.fg(if is_light { Color::Indexed(250) } else { Color::Indexed(238) }),
            alarm: text.fg(Color::Red).add_modifier(Modifier::BOLD | Modifier::REVERSED),
            provisional: text.add_modifier(Modifier::ITALIC),
        }
    }

    fn plain() -> Theme {
        // Reset colours only: with any other, NO_COLOR makes the terminal library reset bold and reverse, too.
        let text = Style::new();
        let with = |modifier: Modifier| text.add_modifier(modifier);
        Theme {
            text,
            dim: text,
            strong: with(Modifier::BOLD),
            accent: text,
            selected: with(Modifier::REVERSED),
            selected_elsewhere: with(Modifier::UNDERLINED),
            lit: with(Modifier::REVERSED),
            warn: with(Modifier::UNDERLINED),
            bad: with(Modifier::BOLD),
            good: text,
            fresh: with(Modifier::BOLD),
            fading: text,
            rule: text,
            alarm: with(Modifier::BOLD | Modifier::REVERSED),
            provisional: with(Modifier::ITALIC),
        }
    }

    /// Returns the style of a tone; what is good stands out by nothing.
    pub fn tone(&self, tone: Tone) -> Style {
        match tone {
            Tone::Good => self.text,
            Tone::Info => self.accent,
            Tone::Warn => self.warn,
            Tone::Bad => self.bad,
        }
    }
}

/// Returns the glyph of a tone, which says the same without colour.
pub fn glyph(tone: Tone) -> &'static str {
    match tone {
        Tone::Good => "·",
        Tone::Info => "●",
        Tone::Warn => "▲",
        Tone::Bad => "✗",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plain_theme_has_no_colour_and_tells_trouble_apart() {
        let theme = Theme::of(ThemeKind::Plain);
        let all = [
            theme.text,
            theme.dim,
            theme.strong,
            theme.accent,
            theme.selected,
            theme.selected_elsewhere,
            theme.lit,
            theme.warn,
            theme.bad,
            theme.good,
            theme.fresh,
            theme.fading,
            theme.rule,
            theme.alarm,
            theme.provisional,
        ];
        assert!(all.iter().all(|style| style.fg.is_none() && style.bg.is_none()));
        assert!(theme.bad != theme.text && theme.warn != theme.text && theme.bad != theme.warn);
        assert!(theme.selected != theme.selected_elsewhere && theme.selected != theme.text);
    }

    #[test]
    fn every_tone_has_a_glyph_of_its_own() {
        let glyphs = [Tone::Good, Tone::Info, Tone::Warn, Tone::Bad].map(glyph);
        assert_eq!(glyphs.iter().collect::<std::collections::HashSet<_>>().len(), 4);
    }
}
