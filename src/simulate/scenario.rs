//! What may go on, and go wrong, on a simulated bus: plain data, with names for common mixtures.

use crate::simulate::script::{self, Script};

/// Says what is connected to the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Equipment {
    /// One to four units of any make, with random poll maps and all common functions.
    Generic,
    /// The three Yosemitech sensors of the manuals, polled as the manuals ask.
    Installation,
    /// The same, but set up long ago: the capture begins in the middle of its life.
    RunningInstallation,
    /// The sensors and the master of a script.
    Script(&'static Script),
}

/// Says how fast the talkers of a generic bus follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Answers after 3 to 30 ms, steady for each unit; the master pauses for 5 to 60 ms.
    Relaxed,
    /// Every silence between frames is 1 to 1.7 times t3.5.
    Tight,
    /// Answers after a single character; in 5 % of the frames a pause of up to ten characters.
    Sloppy,
}

/// Describes a simulated bus; rates are probabilities from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scenario {
    /// The name by which users ask for it.
    pub name: &'static str,
    /// What it is, in a line.
    pub summary: &'static str,
    /// What is connected.
    pub equipment: Equipment,
    /// How fast a generic bus talks.
    pub pace: Pace,
    /// How often a generic unit answers with an exception.
    pub exceptions: f64,
    /// How often a generic master uses a function code of its vendor, without a known length.
    pub vendor: f64,
    /// How often a generic master reads what gives a frame whose head is a valid frame, too.
    pub ambiguous: f64,
    /// Whether answers of a generic bus are sometimes ten or a hundred times slower than usual.
    pub heavy_tail: bool,
    /// How often a unit does not answer; the master then asks again.
    pub no_response: f64,
    /// How often a unit answers 5 to 60 ms after the master has given up.
    pub late: f64,
    /// Whether only one unit (of an installation: conductivity) is silent or late, not all of them.
    pub one_weak_unit: bool,
    /// How often the master asks again before it goes on.
    pub retries: u32,
    /// Whether every request appears twice on the line, as a converter repeats it.
    pub echo: bool,
    /// Whether a second master polls the same units, knowing nothing of the first.
    pub second_master: bool,
    /// How often two units answer at once, as they have the same address.
    pub two_answers: f64,
    /// How often a byte is received with a wrong bit.
    pub corrupt: f64,
    /// How often a byte is not received.
    pub drop: f64,
    /// How often one to three bytes of noise appear in the silence after a frame.
    pub stray: f64,
    /// How often a driver that switches off makes a byte 00 or FF right after its frame.
    pub glitch: f64,
    /// How often the listening process wakes up to 50 ms late.
    pub stall: f64,
    /// How often a USB packet is handed over up to 50 ms late.
    pub host_stall: f64,
}

/// A generic bus without faults, but for the silent units and exceptions of everyday life.
const CLEAN: Scenario = Scenario {
    name: "clean",
    summary: "a generic bus: 1 to 4 units, 2 % unanswered, 2 % exceptions",
    equipment: Equipment::Generic,
    pace: Pace::Relaxed,
    exceptions: 0.02,
    vendor: 0.0,
    ambiguous: 0.0,
    heavy_tail: false,
    no_response: 0.02,
    late: 0.0,
    one_weak_unit: false,
    retries: 2,
    echo: false,
    second_master: false,
    two_answers: 0.0,
    corrupt: 0.0,
    drop: 0.0,
    stray: 0.0,
    glitch: 0.0,
    stall: 0.0,
    host_stall: 0.0,
};

/// The same, heard by a busy host.
const STALLS: Scenario = Scenario {
    name: "stalls",
    summary: "a listener that wakes late now and then, as in all scenarios after this one",
    stall: 0.02,
    ..CLEAN
};

/// The sensors of the manuals without a fault.
const INSTALLATION: Scenario = Scenario {
    name: "installation",
    summary: "the three sensors of the manuals, set up and polled as the manuals ask",
    equipment: Equipment::Installation,
    no_response: 0.0,
    exceptions: 0.0,
    ..CLEAN
};

static ALL: [Scenario; 25] = [
    INSTALLATION,
    Scenario {
        name: "good-master",
        summary: "the three sensors, and a master that does all as their manuals ask",
        equipment: Equipment::Script(&script::GOOD_MASTER),
        ..INSTALLATION
    },
    Scenario {
        name: "mistaken-master",
        summary: "the three sensors, and a master that gets most things wrong",
        equipment: Equipment::Script(&script::MISTAKEN_MASTER),
        ..INSTALLATION
    },
    Scenario {
        name: "demo",
        summary: "the installation with a tired conductivity probe, a glitching driver and bit errors",
        equipment: Equipment::RunningInstallation,
        no_response: 0.25,
        late: 0.15,
        one_weak_unit: true,
        retries: 1,
        corrupt: 0.004,
        glitch: 0.08,
        ..INSTALLATION
    },
    CLEAN,
    Scenario { name: "tight", summary: "silences of 3.5 to 6 characters", pace: Pace::Tight, ..CLEAN },
    Scenario {
        name: "sloppy",
        summary: "answers after a character, pauses inside frames",
        pace: Pace::Sloppy,
        ..CLEAN
    },
    Scenario {
        name: "late",
        summary: "one unit often answers after the master has gone on",
        late: 0.3,
        one_weak_unit: true,
        retries: 0,
        ..CLEAN
    },
    Scenario {
        name: "two-masters",
        summary: "a second master polls on its own; some requests and answers collide",
        second_master: true,
        ..CLEAN
    },
    Scenario {
        name: "same-address",
        summary: "two units share an address: every tenth answer is a collision",
        two_answers: 0.1,
        ..CLEAN
    },
    STALLS,
    Scenario {
        name: "tight-stalls",
        summary: "silences of 3.5 to 6 characters, and stalls",
        pace: Pace::Tight,
        ..STALLS
    },
    Scenario {
        name: "corrupt-0.01",
        summary: "a wrong bit in 0.01 % of the bytes",
        corrupt: 0.0001,
        ..STALLS
    },
    Scenario { name: "corrupt-0.1", summary: "a wrong bit in 0.1 % of the bytes", corrupt: 0.001, ..STALLS },
    Scenario { name: "corrupt-1", summary: "a wrong bit in 1 % of the bytes", corrupt: 0.01, ..STALLS },
    Scenario { name: "drops", summary: "0.1 % of the bytes are lost", drop: 0.001, ..STALLS },
    Scenario { name: "noise", summary: "stray bytes after 10 % of the frames", stray: 0.1, ..STALLS },
    Scenario {
        name: "glitch",
        summary: "a byte 00 or FF right after 10 % of the frames",
        glitch: 0.1,
        ..STALLS
    },
    Scenario { name: "echo", summary: "every request appears twice", echo: true, ..STALLS },
    Scenario { name: "vendor", summary: "5 % function codes of unknown length", vendor: 0.05, ..STALLS },
    Scenario { name: "no-response", summary: "20 % of the requests unanswered", no_response: 0.2, ..STALLS },
    Scenario {
        name: "heavy-tail",
        summary: "answers sometimes a hundred times slower",
        heavy_tail: true,
        ..STALLS
    },
    Scenario {
        name: "host-stalls",
        summary: "1 % of the USB packets come up to 50 ms late",
        host_stall: 0.01,
        ..STALLS
    },
    Scenario {
        name: "collisions",
        summary: "30 % of the reads give frames whose head is a valid frame, too",
        ambiguous: 0.3,
        ..STALLS
    },
    Scenario {
        name: "everything-bad",
        summary: "tight, with some of every fault but echo",
        pace: Pace::Tight,
        vendor: 0.02,
        ambiguous: 0.1,
        no_response: 0.05,
        corrupt: 0.001,
        drop: 0.0001,
        stray: 0.05,
        glitch: 0.02,
        host_stall: 0.01,
        ..STALLS
    },
];

impl Scenario {
    /// Returns all named scenarios; the first is the default of `simulate`.
    pub fn all() -> &'static [Scenario] {
        &ALL
    }

    /// Finds a scenario by its name.
    pub fn named(name: &str) -> Option<Scenario> {
        ALL.iter().copied().find(|scenario| scenario.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scenario_has_a_name_of_its_own() {
        for scenario in Scenario::all() {
            assert_eq!(Scenario::named(scenario.name), Some(*scenario));
        }
        assert_eq!(Scenario::named("no such"), None);
    }
}
