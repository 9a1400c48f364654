//! Simulated buses with known truth: what the framer and the pairing recover of them.
//!
//! `cargo test --release --test scenarios -- --ignored --nocapture` prints the whole table:
//! every scenario behind every adapter, at least 20,000 frames each, pooled over ten seeds that nothing was tuned to.

#![allow(clippy::print_stdout)] // the table is what the ignored test is for

mod tally;

use rtutap::line::LineSettings;
use rtutap::simulate::{Adapter, Scenario};
use tally::{Tally, run};

/// Least share of undamaged frames found with the right role.
fn threshold(scenario: &str) -> f64 {
    match scenario {
        "echo" | "vendor" | "corrupt-1" | "heavy-tail" | "everything-bad" => 0.998,
        // Not in the study's table: frames overlap, or an answer comes when another is due.
        "two-masters" | "late" | "same-address" => 0.99,
        _ => 0.9995,
    }
}

fn pool(
    scenario: Scenario,
    adapter: Adapter,
    line: LineSettings,
    seeds: std::ops::Range<u64>,
    frames: u64,
) -> Tally {
    seeds.map(|seed| run(scenario, adapter, line, seed, frames)).sum()
}

fn check(line: &str, seeds: std::ops::Range<u64>, frames: u64) {
    let line: LineSettings = line.parse().expect("a line setting of this test");
    let mut failures = Vec::new();
    for scenario in Scenario::all() {
        for adapter in Adapter::ALL {
            let tally = pool(*scenario, adapter, line, seeds.clone(), frames);
            println!("{line} {:16} {adapter:7} {tally}", scenario.name);
            if tally.right() < threshold(scenario.name) || tally.phantoms_per_thousand() > 0.7 {
                failures.push(format!("{line} {} behind {adapter}: {tally}", scenario.name));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn every_scenario_keeps_its_threshold_at_9600_8n1() {
    check("9600-8N1", 100..102, 2000);
}

#[test]
#[ignore = "the full table takes a minute; run in release"]
fn the_full_table() {
    for line in ["9600-8N1", "19200-8E1", "115200-8N1"] {
        check(line, 7000..7010, 2100);
    }
}
