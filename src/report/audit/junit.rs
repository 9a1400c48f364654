//! JUnit XML, as CI systems read it: a test case a finding, and one for each rule that found nothing.

use std::fmt::Write;

use super::Judgement;
use crate::analyze::verify::{Finding, all_rules};
use crate::time::{SECOND, Timestamp};

/// Is what the report is about.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Heard {
    /// Time of the first frame or run, and of the last.
    pub(super) first: Option<Timestamp>,
    pub(super) last: Option<Timestamp>,
}

/// Writes a case for each finding, and one for each rule that found nothing.
///
/// CI systems show one failure a case, by class and name: a class is a party, a name says what is where.
pub(super) fn write(findings: &[(&str, &Finding)], judgement: &Judgement, heard: Heard) -> String {
    let mut cases = String::new();
    let (mut tests, mut failures, mut skipped) = (0, 0, 0);
    for rule in all_rules() {
        let of_rule: Vec<_> = findings.iter().filter(|(_, finding)| finding.rule == rule).collect();
        let is_ignored = judgement.ignored.iter().any(|given| given.eq_ignore_ascii_case(rule.code));
        if of_rule.is_empty() && (is_ignored || judgement.judges(rule.party)) {
            tests += 1;
            skipped += usize::from(is_ignored);
            let close = if is_ignored { "><skipped message=\"ignored\"/></testcase>" } else { "/>" };
            let (party, code, name) = (rule.party.name(), rule.code, rule.name);
            let _ = writeln!(
                cases,
                "    <testcase classname=\"rtutap.{party}\" name=\"{code} {name}\" time=\"0\"{close}"
            );
        }
        for (index, (bus, finding)) in of_rule.iter().enumerate() {
            tests += 1;
            let fails = judgement.fail_on.is_some_and(|fail_on| finding.severity >= fail_on);
            failures += usize::from(fails);
            case(bus, finding, index + 1, fails, &mut cases);
        }
    }
    let seconds =
        heard.first.zip(heard.last).map_or(0.0, |(first, last)| (last - first) as f64 / SECOND as f64);
    let begun = heard.first.map_or_else(String::new, |first| format!(" timestamp=\"{}\"", utc(first)));
    let counts =
        format!("tests=\"{tests}\" failures=\"{failures}\" skipped=\"{skipped}\" time=\"{seconds:.3}\"");
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"rtutap verify\" {counts}>\n  \
         <testsuite name=\"rtutap verify\" errors=\"0\" {counts}{begun}>\n{cases}  </testsuite>\n</testsuites>\n"
    )
}

/// Writes the case of a finding, the `index`th of its rule.
fn case(bus: &str, finding: &Finding, index: usize, fails: bool, cases: &mut String) {
    let Finding { rule, severity, party, message, .. } = finding;
    let address = finding.address.map_or_else(String::new, |address| format!(" address {address}"));
    let name = format!("{} {}: {bus}{address} #{index}", rule.code, rule.name);
    let (party, severity, name) = (party.name(), severity.name(), escaped(&name));
    let _ = writeln!(cases, "    <testcase classname=\"rtutap.{party}\" name=\"{name}\" time=\"0\">");
    let told = escaped(&details(bus, finding));
    let _ = match fails {
        true => {
            let message = escaped(message);
            writeln!(cases, "      <failure type=\"{severity}\" message=\"{message}\">{told}</failure>")
        }
        false => writeln!(cases, "      <system-out>{told}</system-out>"),
    };
    cases.push_str("    </testcase>\n");
}

/// Tells a finding in a few lines.
fn details(bus: &str, finding: &Finding) -> String {
    let Finding { rule, severity, party, count, message, frames, .. } = finding;
    let address = finding.address.map_or_else(String::new, |address| format!(", address {address}"));
    let times = if *count == 1 { "once".to_owned() } else { format!("{count} times") };
    let when = match (finding.first, finding.last) {
        (Some(first), Some(last)) if first != last => format!(", {} to {}", utc(first), utc(last)),
        (Some(first), _) => format!(", {}", utc(first)),
        _ => String::new(),
    };
    let frames: Vec<String> = frames.iter().map(u64::to_string).collect();
    let mut shown = if frames.is_empty() { String::new() } else { format!("; frames {}", frames.join(", ")) };
    if let Some(span) = &finding.span {
        let _ = write!(shown, ", bytes {} to {}", span.start, span.end.saturating_sub(1));
    }
    format!(
        "{} {} on {bus}{address}, {times}{when}: {message}\n{} to blame{shown}\n{} ({})",
        severity.name(),
        rule.code,
        party.name(),
        finding.help(),
        rule.reference
    )
}

/// Writes a time as JUnit wants it.
fn utc(time: Timestamp) -> String {
    let time = chrono::DateTime::from_timestamp_nanos(time.as_ns());
    time.format("%Y-%m-%dT%H:%M:%S%.3fZ").to_string()
}

/// Escapes what XML would take for its own, and leaves out what it cannot hold.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' => out.push(c),
            c if c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}') => out.push('\u{FFFD}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analyze::verify::{Party, rule};

    #[test]
    fn a_finding_is_a_case_that_fails_when_it_is_grave_enough() {
        let at = |ns| Some(Timestamp::from_ns(ns));
        let wrong =
            Finding::new(rule("D03").expect("a rule"), at(SECOND), "takes 4 < 5 & \"6\"").at(1).within(4..6);
        let wrong = Finding { last: at(3 * SECOND), count: 2, frames: vec![7], ..wrong };
        let other = Finding::new(rule("D03").expect("a rule"), at(SECOND), "takes 7").at(2).by(Party::Device);
        let early = Finding::new(rule("D06").expect("a rule"), None, "read\u{7} at once").at(1);
        let judgement = Judgement { ignored: vec!["l03".to_owned()], ..Judgement::default() };
        let heard = Heard { first: at(0), last: at(90 * SECOND) };
        let xml = write(&[("bus0", &wrong), ("bus0", &other), ("bus0", &early)], &judgement, heard);
        let has = |text: &str| assert!(xml.contains(text), "{text} in {xml}");
        has("failures=\"2\" skipped=\"1\" time=\"90.000\"");
        has("timestamp=\"1970-01-01T00:00:00.000Z\"");
        has("classname=\"rtutap.master\" name=\"D03 wrong-quantity: bus0 address 1 #1\"");
        has("classname=\"rtutap.device\" name=\"D03 wrong-quantity: bus0 address 2 #2\"");
        has("message=\"takes 4 &lt; 5 &amp; &quot;6&quot;\"");
        has("2 times, 1970-01-01T00:00:01.000Z to 1970-01-01T00:00:03.000Z: ");
        has("frames 7, bytes 4 to 5");
        has("<system-out>warning D06 on bus0, address 1");
        has("name=\"L03 timing-not-measurable\" time=\"0\"><skipped");
        assert!(!xml.contains('\u{7}'));
        assert_eq!(xml.matches("<testcase").count(), all_rules().count() + 1);
        assert_eq!(
            xml.matches("<testcase").count(),
            xml.matches("</testcase>").count() + xml.matches("time=\"0\"/>").count()
        );
    }
}
