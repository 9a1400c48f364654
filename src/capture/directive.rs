//! What comments at the head of hex text say about its bytes.

use crate::line::LineSettings;
use crate::time::MILLISECOND;

/// The comment that says that lines without a time have no silence between them.
pub(super) const RAW: &str = "raw: lines are no reads";

/// Holds what was said before the first byte.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Directives {
    /// `# line 19200-8E1`: speed and character format.
    pub(super) line: Option<LineSettings>,
    /// `# adapter-hold 16 ms`: the longest time the adapter kept a byte back, in nanoseconds.
    pub(super) adapter_hold_ns: Option<i64>,
    /// `# raw: lines are no reads`: nothing is known of silences between lines without times.
    pub(super) is_raw: bool,
}

impl Directives {
    /// Takes in a comment with its `#`; the first word on anything holds.
    pub(super) fn read(&mut self, comment: &[u8]) {
        let Some(text) = comment.strip_prefix(b"#").and_then(|text| str::from_utf8(text).ok()) else {
            return;
        };
        let text = text.trim();
        self.line = self.line.or_else(|| line(text));
        self.adapter_hold_ns = self.adapter_hold_ns.or_else(|| adapter_hold(text));
        self.is_raw |= text == RAW;
    }
}

/// Reads line settings from `line 19200-8E1; a line a byte`.
fn line(text: &str) -> Option<LineSettings> {
    let rest = text.strip_prefix("line ")?.trim_start();
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '-' && c != '.').unwrap_or(rest.len());
    rest[..end].parse().ok()
}

pub(super) fn adapter_hold(text: &str) -> Option<i64> {
    let ms: f64 = text.strip_prefix("adapter-hold ")?.strip_suffix("ms")?.trim().parse().ok()?;
    // As much as `--adapter-hold` takes.
    (0.0..=10_000.0).contains(&ms).then(|| (ms * MILLISECOND as f64).round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_word_on_anything_holds_and_other_comments_say_nothing() {
        let mut directives = Directives::default();
        for comment in
            [&b"# line up"[..], b"# adapter-hold long ms", b"# adapter-hold -1 ms", b"# raw", b"#\xff", b""]
        {
            directives.read(comment);
        }
        assert_eq!(directives, Directives::default());
        for comment in
            [&b"# line 19200-8E1; a line a byte"[..], b"# line 9600-8N1", b"#adapter-hold 16.5 ms\t"]
        {
            directives.read(comment);
        }
        directives.read(b"# raw: lines are no reads");
        let line = "19200-8E1".parse().ok();
        assert_eq!(directives, Directives { line, adapter_hold_ns: Some(16_500_000), is_raw: true });
    }
}
