//! JUnit XML, as CI systems read it: a test case a rule, which fails with its findings.

use std::fmt::Write;

use super::Judgement;
use crate::analyze::verify::{Finding, all_rules};

/// Writes the findings of each rule that is judged.
pub(super) fn write(findings: &[(&str, &Finding)], judgement: &Judgement) -> String {
    let mut cases = String::new();
    let (mut tests, mut failures) = (0, 0);
    let is_ignored = |code: &str| judgement.ignored.iter().any(|given| given.eq_ignore_ascii_case(code));
    for rule in all_rules().filter(|rule| !is_ignored(rule.code)) {
        let of_rule: Vec<_> = findings.iter().filter(|(_, finding)| finding.rule == rule).collect();
        if of_rule.is_empty() && !judgement.judges(rule.party) {
            continue;
        }
        tests += 1;
        let (party, code, name) = (rule.party.name(), rule.code, rule.name);
        let _ = write!(cases, "    <testcase classname=\"rtutap.{party}\" name=\"{code} {name}\"");
        if of_rule.is_empty() {
            cases.push_str("/>\n");
            continue;
        }
        cases.push_str(">\n");
        let (failing, others): (Vec<_>, Vec<_>) = of_rule
            .into_iter()
            .partition(|(_, finding)| judgement.fail_on.is_some_and(|fail_on| finding.severity >= fail_on));
        failures += usize::from(!failing.is_empty());
        for (bus, finding) in &failing {
            let severity = finding.severity.name();
            let message = escaped(&finding.message);
            let _ = writeln!(cases, "      <failure type=\"{severity}\" message=\"{message}\">");
            let _ = writeln!(cases, "{}</failure>", escaped(&details(bus, finding)));
        }
        if !others.is_empty() {
            let told: Vec<String> = others.iter().map(|(bus, finding)| details(bus, finding)).collect();
            let _ = writeln!(cases, "      <system-out>{}</system-out>", escaped(&told.join("\n")));
        }
        cases.push_str("    </testcase>\n");
    }
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"rtutap verify\" tests=\"{tests}\" \
         failures=\"{failures}\">\n  <testsuite name=\"rtutap verify\" tests=\"{tests}\" failures=\"{failures}\">\n\
         {cases}  </testsuite>\n</testsuites>\n"
    )
}

/// Tells a finding in a few lines.
fn details(bus: &str, finding: &Finding) -> String {
    let Finding { rule, severity, party, count, message, frames, .. } = finding;
    let address = finding.address.map_or_else(String::new, |address| format!(", address {address}"));
    let frames: Vec<String> = frames.iter().map(u64::to_string).collect();
    format!(
        "{} {} on {bus}{address}, {count} times: {message}\n{} to blame; frames {}\n{} ({})",
        severity.name(),
        rule.code,
        party.name(),
        frames.join(", "),
        rule.help,
        rule.reference
    )
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
    use crate::analyze::verify::rule;

    #[test]
    fn a_rule_fails_with_findings_that_are_grave_enough() {
        let wrong = Finding::new(rule("D03").expect("a rule"), None, "takes 4 < 5 & \"6\"").at(1);
        let early = Finding::new(rule("D06").expect("a rule"), None, "read\u{7} at once").at(1);
        let xml = write(&[("bus0", &wrong), ("bus0", &early)], &Judgement::default());
        assert!(xml.contains("failures=\"1\""), "{xml}");
        assert!(xml.contains("message=\"takes 4 &lt; 5 &amp; &quot;6&quot;\""), "{xml}");
        assert!(xml.contains("<system-out>warning D06 on bus0, address 1"), "a warning is no failure: {xml}");
        assert!(!xml.contains('\u{7}'));
        assert_eq!(xml.matches("<testcase").count(), all_rules().count());
    }
}
