//! The report for people.

use std::fmt;

use anstyle::Style;

use super::super::text::Styles;
use super::Audit;
use super::hearing::Hearing;
use crate::analyze::verify::{Finding, Party, Rule, Severity};
use crate::report::Clock;
use crate::time::{MILLISECOND, SECOND};

/// Is the report of an audit.
pub(super) struct Report<'a> {
    pub(super) audit: &'a Audit,
    pub(super) clock: Clock,
    pub(super) colour: bool,
    pub(super) verbose: bool,
}

impl fmt::Display for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let styles = if self.colour { Styles::coloured() } else { Styles::default() };
        self.heading(f, &styles)?;
        let findings = self.audit.folds.sorted();
        self.summary(f, &styles, &findings)?;
        for severity in Severity::ALL {
            let of_severity: Vec<_> =
                findings.iter().filter(|(_, finding)| finding.severity == severity).collect();
            if of_severity.is_empty() {
                continue;
            }
            let style = styles.severity(severity);
            writeln!(f, "\n{style}{}s{style:#}", severity.name())?;
            of_severity.iter().try_for_each(|(bus, finding)| self.finding(f, &styles, bus, finding))?;
        }
        self.requests(f, &styles)?;
        self.order(f, &styles)?;
        self.coverage(f, &styles)
    }
}

impl Report<'_> {
    fn heading(&self, f: &mut fmt::Formatter<'_>, styles: &Styles) -> fmt::Result {
        let (audit, bold) = (self.audit, styles.bold);
        for Hearing { bus, line, .. } in &audit.buses {
            writeln!(f, "{bold}{bus}{bold:#} {line}")?;
        }
        let runs = if audit.damaged == 1 { "run" } else { "runs" };
        write!(f, "{} frames, {} damaged {runs}", audit.frames, audit.damaged)?;
        match audit.first.zip(audit.last) {
            Some((first, last)) => {
                let seconds = (last - first) as f64 / SECOND as f64;
                writeln!(f, ", {} to {} ({seconds:.1} s)", self.clock.short(first), self.clock.short(last))
            }
            None => writeln!(f, ", without times: nothing is said about timing"),
        }
    }

    fn summary(
        &self,
        f: &mut fmt::Formatter<'_>,
        styles: &Styles,
        findings: &[(&str, &Finding)],
    ) -> fmt::Result {
        let dim = styles.dim;
        writeln!(f, "\n{dim}           errors  warnings     notes{dim:#}")?;
        for party in Party::ALL.into_iter().filter(|party| self.audit.judgement.judges(*party)) {
            write!(f, "{:<7}", party.name())?;
            for severity in Severity::ALL {
                let alike = |finding: &&Finding| finding.party == party && finding.severity == severity;
                let count: u64 =
                    findings.iter().map(|(_, finding)| *finding).filter(alike).map(|it| it.count).sum();
                let style = if count > 0 { styles.severity(severity) } else { Style::new() };
                write!(f, "{style}{count:>10}{style:#}")?;
            }
            writeln!(f)?;
        }
        if findings.is_empty() {
            let good = styles.good;
            writeln!(f, "\n{good}nothing to complain about{good:#}")?;
        }
        Ok(())
    }

    fn finding(
        &self,
        f: &mut fmt::Formatter<'_>,
        styles: &Styles,
        bus: &str,
        finding: &Finding,
    ) -> fmt::Result {
        let Finding { rule, party, count, message, frames, .. } = finding;
        let (style, dim, bold) = (styles.severity(finding.severity), styles.dim, styles.bold);
        write!(f, "  {style}{}{style:#} {bold}{}{bold:#}  {}", rule.code, rule.name, party.name())?;
        if let Some(address) = finding.address {
            write!(f, ", address {address}")?;
        }
        if self.audit.buses.len() > 1 {
            write!(f, ", {bus}")?;
        }
        if *count > 1 {
            write!(f, ", {count} times")?;
        }
        match (finding.first, finding.last) {
            (Some(first), Some(last)) if first != last => {
                write!(f, "{dim}  {} to {}{dim:#}", self.clock.short(first), self.clock.short(last))?;
            }
            (Some(first), _) => write!(f, "{dim}  {}{dim:#}", self.clock.short(first))?,
            _ => {}
        }
        writeln!(f, "\n      {message}")?;
        let ids: Vec<String> = frames.iter().map(u64::to_string).collect();
        let mut shown = match ids.len() {
            0 => String::new(),
            1 => format!("frame {}", ids[0]),
            _ => format!("frames {}", ids.join(", ")),
        };
        if let Some(span) = &finding.span {
            let last = span.end.saturating_sub(1);
            let bytes = if span.start == last {
                format!(", byte {last}")
            } else {
                format!(", bytes {}-{last}", span.start)
            };
            shown.push_str(&bytes);
        }
        let separator = if shown.is_empty() { "" } else { ": " };
        writeln!(f, "      {dim}{shown}{separator}{}{dim:#}", finding.help())?;
        if self.verbose {
            writeln!(f, "      {dim}{} [{}]{dim:#}", rule.explanation, rule.reference)?;
        }
        Ok(())
    }

    fn requests(&self, f: &mut fmt::Formatter<'_>, styles: &Styles) -> fmt::Result {
        let activity = &self.audit.activity;
        let (dim, accent) = (styles.dim, styles.accent);
        if activity.requests.is_empty() {
            return Ok(());
        }
        writeln!(f, "\nwhat the master asks")?;
        writeln!(
            f,
            "{dim}  unit  command                 request              count  a minute  answered   latency{dim:#}"
        )?;
        for ((bus, address, function, register, quantity), requests) in &activity.requests {
            let command = requests.command.as_deref().unwrap_or("-");
            let mut request = format!("FC{function:02}");
            if let Some(register) = register {
                request.push_str(&format!(" 0x{register:04x}"));
            }
            if let Some(quantity) = quantity {
                request.push_str(&format!(" ×{quantity}"));
            }
            let rate = requests.a_minute().map_or_else(|| "-".to_owned(), |rate| format!("{rate:.2}"));
            let latency = requests.latency_ns();
            let latency = latency
                .map_or_else(|| "-".to_owned(), |ns| format!("{:.1} ms", ns as f64 / MILLISECOND as f64));
            let (count, answered) = (requests.count, requests.answered);
            write!(
                f,
                "  {address:>4}  {accent}{command:<22}{accent:#}  {request:<17}  {count:>8}  {rate:>8}"
            )?;
            write!(f, "  {answered:>8}  {latency:>8}")?;
            self.bus_name(f, *bus)?;
        }
        Ok(())
    }

    fn order(&self, f: &mut fmt::Formatter<'_>, styles: &Styles) -> fmt::Result {
        let activity = &self.audit.activity;
        if activity.steps.is_empty() {
            return Ok(());
        }
        let dim = styles.dim;
        writeln!(f, "\nin which order, and after how long at least")?;
        for ((bus, address, from, to), step) in &activity.steps {
            let (from, to) = (activity.named(*from), activity.named(*to));
            let wait = step
                .least_ns
                .map_or_else(|| "-".to_owned(), |ns| format!("{:.2} s", ns as f64 / SECOND as f64));
            let times = format!("×{}", step.count);
            write!(f, "  {address:>4}  {from:<20} {dim}─{wait:─>9}─▶{dim:#} {to:<20} {times:>8}")?;
            self.bus_name(f, *bus)?;
        }
        Ok(())
    }

    fn coverage(&self, f: &mut fmt::Formatter<'_>, styles: &Styles) -> fmt::Result {
        let units = self.audit.activity.units.iter().filter(|(_, unit)| !unit.commands.is_empty());
        let (mut is_first, dim) = (true, styles.dim);
        for ((bus, address), unit) in units {
            if std::mem::take(&mut is_first) {
                writeln!(f, "\nwhich commands of the device's profile")?;
            }
            let sent = unit.commands.iter().filter(|(_, sent)| *sent).count();
            let device = unit.device.as_deref().unwrap_or("-");
            write!(f, "  {address:>4}  {device}: {sent} of {}", unit.commands.len())?;
            let never: Vec<&str> =
                unit.commands.iter().filter(|(_, sent)| !sent).map(|(name, _)| name.as_str()).collect();
            if !never.is_empty() {
                write!(f, "{dim}; never {}{dim:#}", never.join(", "))?;
            }
            self.bus_name(f, *bus)?;
        }
        Ok(())
    }

    /// Ends a line, with the bus where there are several.
    fn bus_name(&self, f: &mut fmt::Formatter<'_>, bus: usize) -> fmt::Result {
        match self.audit.activity.buses.get(bus).filter(|_| self.audit.buses.len() > 1) {
            Some(bus) => writeln!(f, "  {bus}"),
            None => writeln!(f),
        }
    }
}

/// Returns a rule's text for people.
pub fn explain(rule: &Rule) -> String {
    let Rule { code, name, severity, party, explanation, help, reference } = rule;
    let (severity, party) = (severity.name(), party.name());
    format!(
        "{code} {name}: {severity}, {party}\n\nObserved, and what it may mean\n  {}\n\nWhat to check next\n  {}\n\n\
         Where it is written\n  {reference}\n",
        wrapped(explanation),
        wrapped(help),
    )
}

/// Breaks a text into lines of at most 100 characters, indented.
fn wrapped(text: &str) -> String {
    let (mut out, mut column) = (String::new(), 0);
    for word in text.split_whitespace() {
        if column > 0 && column + word.len() > 98 {
            out.push_str("\n  ");
            column = 0;
        } else if column > 0 {
            out.push(' ');
            column += 1;
        }
        out.push_str(word);
        column += word.len();
    }
    out
}
