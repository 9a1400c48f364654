//! The search for line settings, on lines that are modelled bit by bit.

#![allow(clippy::print_stdout)] // the figures are what the ignored test is for

mod bench;

use bench::{Delivery, Outcome, line, search};
use rtutap::analyze::line_search::{Action, LineSearch, Options, Reason, SPEEDS};
use rtutap::line::{LineSettings, Parity};
use rtutap::simulate::AfterFramingError::{TakeAsStart, WaitForMark};
use rtutap::simulate::{Adapter, AfterFramingError, Config, Scenario, Wire};
use rtutap::time::{MILLISECOND, SECOND, Timestamp};

const FORMATS: [&str; 4] = ["8N1", "8E1", "8O1", "8N2"];

fn wire(line: LineSettings, scenario: &str, seed: u64) -> Wire {
    let scenario = Scenario::named(scenario).expect("a scenario");
    Wire::traffic(Config { seed, frames: 100_000, line, adapter: Adapter::Uart, scenario })
}

/// Returns what is right to find: two stop bits read as one, and parity cannot be told without line errors.
fn expected(line: LineSettings, delivery: Delivery) -> LineSettings {
    let parity = if delivery == Delivery::Silent { Parity::None } else { line.parity };
    LineSettings { parity, ..LineSettings { baud: line.baud, ..LineSettings::default() } }
}

/// Searches on all lines; returns the outcomes with the speed and format of each.
fn all_lines(
    scenario: &str,
    seeds: std::ops::Range<u64>,
    delivery: Delivery,
    after_error: AfterFramingError,
) -> Vec<(LineSettings, Outcome)> {
    let mut outcomes = Vec::new();
    for baud in SPEEDS {
        for format in FORMATS {
            for seed in seeds.clone() {
                let sent = line(&format!("{baud}-{format}"));
                // Somewhere in the middle of the traffic, and of a byte.
                let begin = 700 * MILLISECOND + (seed as i64 * 377_777_777) % (20 * SECOND);
                let outcome = search(wire(sent, scenario, seed), delivery, after_error, begin, 120 * SECOND);
                outcomes.push((sent, outcome));
            }
        }
    }
    outcomes
}

fn check(outcomes: &[(LineSettings, Outcome)], delivery: Delivery, most_seconds: impl Fn(u32) -> f64) {
    let mut wrong = Vec::new();
    for (sent, outcome) in outcomes {
        let right = expected(*sent, delivery).to_string();
        if outcome.line() != Some(right) || outcome.seconds() > most_seconds(sent.baud) {
            wrong.push(format!(
                "{sent}: {:?} after {:.1} s\n  {}",
                outcome.line(),
                outcome.seconds(),
                outcome.said.join("\n  ")
            ));
        }
    }
    assert!(wrong.is_empty(), "{} of {} wrong:\n{}", wrong.len(), outcomes.len(), wrong.join("\n"));
}

/// Prints the figures that the documentation of `analyze::line_search` gives.
#[test]
#[ignore = "a table for people; takes minutes"]
fn the_full_table() {
    for scenario in ["installation", "clean", "tight", "everything-bad"] {
        for delivery in Delivery::ALL {
            for after_error in [WaitForMark, TakeAsStart] {
                let outcomes = all_lines(scenario, 0..20, delivery, after_error);
                let is_right = |(sent, outcome): &&(LineSettings, Outcome)| {
                    outcome.line() == Some(expected(*sent, delivery).to_string())
                };
                let right = outcomes.iter().filter(is_right).count();
                let wrong = outcomes.iter().filter(|outcome| !is_right(outcome));
                let wrong: Vec<String> =
                    wrong.map(|(sent, outcome)| format!("{sent}→{:?}", outcome.line())).collect();
                for baud in SPEEDS {
                    let mut seconds: Vec<f64> = outcomes
                        .iter()
                        .filter(|(sent, _)| sent.baud == baud)
                        .map(|(_, outcome)| outcome.seconds())
                        .collect();
                    seconds.sort_by(f64::total_cmp);
                    let [median, most] = [seconds[seconds.len() / 2], seconds[seconds.len() - 1]];
                    println!(
                        "{scenario:14} {delivery:?} {after_error:?} {baud:6}: median {median:.2} s, most {most:.2} s"
                    );
                }
                println!(
                    "{scenario:14} {delivery:?} {after_error:?}: {right} of {} right {wrong:?}",
                    outcomes.len()
                );
            }
        }
    }
}

#[test]
fn on_a_busy_bus_every_line_is_found_within_seconds() {
    // Three seconds for all speeds, as the study has it, hold where a trial ends by its bytes.
    let most = |baud: u32| if baud >= 9600 { 5.0 } else { 20.0 };
    check(&all_lines("clean", 0..2, Delivery::Uart, WaitForMark), Delivery::Uart, most);
    check(&all_lines("clean", 2..3, Delivery::Packets, WaitForMark), Delivery::Packets, most);
}

#[test]
fn on_an_installation_every_line_is_found_within_one_and_a_half_polls_for_a_speed() {
    // 3.1 s between polls most of the time: 8 × 1.5 × 3.1 s, and one or two polls for each parity.
    for (delivery, seeds) in [(Delivery::Uart, 0..2), (Delivery::Packets, 2..3)] {
        check(&all_lines("installation", seeds, delivery, WaitForMark), delivery, |_| 40.0);
    }
}

#[test]
fn an_adapter_that_only_counts_line_errors_finds_the_parity_too() {
    check(&all_lines("installation", 3..5, Delivery::Counts, WaitForMark), Delivery::Counts, |_| 60.0);
}

#[test]
fn without_line_errors_the_speed_is_found_and_the_doubt_is_said() {
    let outcomes = all_lines("installation", 4..5, Delivery::Silent, WaitForMark);
    check(&outcomes, Delivery::Silent, |_| 40.0);
    assert!(outcomes.iter().all(|(_, outcome)| {
        outcome.lock.as_ref().is_some_and(|lock| lock.doubt().contains("parity may be another"))
    }));
}

#[test]
fn a_chip_that_loses_bytes_after_a_line_error_takes_longer_and_finds_the_same() {
    check(&all_lines("installation", 5..6, Delivery::Uart, TakeAsStart), Delivery::Uart, |_| 60.0);
}

#[test]
fn noise_never_locks_and_is_told() {
    for seed in 0..40 {
        for delivery in [Delivery::Uart, Delivery::Silent] {
            let outcome = search(Wire::noise(seed), delivery, WaitForMark, 0, 60 * SECOND);
            assert_eq!(outcome.lock, None, "seed {seed}");
            assert!(outcome.misfits > 0 && outcome.silences == 0, "{outcome:?}");
        }
    }
}

#[test]
#[ignore = "ten minutes of noise at each of a thousand seeds take a while"]
fn hours_of_noise_never_lock() {
    for seed in 1000..2000 {
        let outcome = search(Wire::noise(seed), Delivery::Silent, WaitForMark, 0, 600 * SECOND);
        assert_eq!(outcome.lock, None, "seed {seed}");
    }
}

#[test]
fn a_swapped_pair_never_locks_and_is_told() {
    for (seed, format) in (0..).zip(FORMATS) {
        let sent = line(&format!("9600-{format}"));
        let outcome =
            search(wire(sent, "clean", seed).swapped(), Delivery::Uart, WaitForMark, 0, 120 * SECOND);
        assert_eq!(outcome.lock, None, "{format}");
        assert!(outcome.misfits > 0, "{outcome:?}");
    }
}

#[test]
fn silence_is_no_answer_and_is_told_ever_less_often() {
    let nothing = Wire::traffic(Config {
        seed: 1,
        frames: 0,
        line: LineSettings::default(),
        adapter: Adapter::Uart,
        scenario: Scenario::named("clean").expect("a scenario"),
    });
    let outcome = search(nothing, Delivery::Packets, WaitForMark, 0, 3600 * SECOND);
    assert_eq!((&outcome.lock, outcome.tried.len(), outcome.misfits), (&None, 1, 0));
    assert!((5..20).contains(&outcome.silences), "{}", outcome.silences);
    assert!(outcome.said[0].contains("no traffic: not a byte in 10 s"), "{}", outcome.said[0]);
}

#[test]
fn a_search_says_what_it_tries_and_why() {
    let outcome =
        search(wire(line("19200-8E1"), "clean", 7), Delivery::Uart, WaitForMark, SECOND, 60 * SECOND);
    let said = outcome.said.join("\n");
    for part in [
        "trying 19200-8N1: 9600-8N1 gave no frame in ",
        "trying 19200-8E1: 19200-8N1 gave ",
        "the line is 19200-8E1: ",
    ] {
        assert!(said.contains(part), "{said}");
    }
    assert!(said.contains("(19200-8N1: ") && said.contains("% of them with line errors"), "{said}");
}

/// Lets the search ask for the next settings, by garbage.
fn fail(search: &mut LineSearch, now: &mut Timestamp) -> Option<(LineSettings, Reason)> {
    use rtutap::decode::chunk::{Chunk, ReadTime};
    for _ in 0..100 {
        *now = *now + 30 * MILLISECOND;
        search.handle_bytes(&Chunk { time: ReadTime::At(*now), bytes: &[0xA7; 64], line_errors: &[] });
        while let Some(action) = search.poll_action() {
            if let Action::Try(line, reason) = action {
                return Some((line, reason));
            }
        }
    }
    None
}

#[test]
fn what_comes_until_the_settings_are_set_does_not_count() {
    let (mut now, request) = (Timestamp::default(), [0x01, 0x03, 0x26, 0x00, 0x00, 0x04, 0x4F, 0x41]);
    let mut search = LineSearch::new(Options::default(), now);
    let asked = fail(&mut search, &mut now).expect("garbage fails");
    assert_eq!(asked.0, line("19200-8N1"));
    let read = |search: &mut LineSearch, now: &mut Timestamp| {
        use rtutap::decode::chunk::{Chunk, ReadTime};
        *now = *now + 500 * MILLISECOND;
        search.handle_bytes(&Chunk { time: ReadTime::At(*now), bytes: &request, line_errors: &[] });
        search.handle_timeout(*now);
        search.poll_action()
    };
    for _ in 0..6 {
        assert_eq!(read(&mut search, &mut now), None);
    }
    search.handle_line(true, now);
    // 40 bytes in frames prove the parity, too.
    for _ in 0..4 {
        assert_eq!(read(&mut search, &mut now), None);
    }
    assert!(
        matches!(read(&mut search, &mut now), Some(Action::Lock(lock)) if lock.line == line("19200-8N1"))
    );
}

#[test]
fn speeds_that_the_source_refuses_are_left_out() {
    let mut now = Timestamp::default();
    let mut search = LineSearch::new(Options::default(), now);
    let mut asked = Vec::new();
    while let Some((line, _)) = fail(&mut search, &mut now) {
        asked.push(line.baud);
        search.handle_line(line.baud == 38400, now);
        if asked.len() > 20 {
            break;
        }
    }
    let refused = asked.iter().filter(|baud| **baud != 38400).count();
    assert_eq!(refused, 7, "{asked:?}");
    assert!(asked.iter().filter(|baud| **baud == 38400).count() > 10);
}

#[test]
fn a_source_that_refuses_everything_ends_the_search() {
    let mut now = Timestamp::default();
    let mut search = LineSearch::new(Options::default(), now);
    assert!(fail(&mut search, &mut now).is_some());
    let mut last = None;
    for _ in 0..20 {
        search.handle_line(false, now);
        while let Some(action) = search.poll_action() {
            last = Some(action);
        }
    }
    assert_eq!(last, Some(Action::Refused));
    assert!(search.is_over());
}
