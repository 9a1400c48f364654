//! The catalogue of rules, as data: a file for the wire, one for the conversation, one for devices and their values,
//! one for the master's plan.

mod conversation;
mod device;
mod plan;
mod wire;

use super::finding::{Party, Rule, Severity};

pub(super) use conversation::*;
pub(super) use device::*;
pub use plan::*;
pub(super) use wire::*;

/// Defines rules: severity and party, then what is observed and may be meant, what to check next, where it is written.
macro_rules! rules {
    ($all:ident: $($code:ident $name:literal $severity:ident $party:ident
        $explanation:literal $help:literal $reference:literal)*) => {
        $(
            #[doc = concat!("Is the rule ", stringify!($code), ", `", $name, "`.")]
            pub static $code: super::Rule = super::Rule {
                code: stringify!($code),
                name: $name,
                severity: super::Severity::$severity,
                party: super::Party::$party,
                explanation: $explanation,
                help: $help,
                reference: $reference,
            };
        )*
        /// Lists the rules of this file.
        pub(super) const $all: &[&super::Rule] = &[$(&$code),*];
    };
}
use rules;

/// Lists all rules, in the order in which they are shown to people.
pub static CATALOGUE: [&[&Rule]; 4] = [wire::WIRE, conversation::CONVERSATION, device::DEVICE, plan::PLAN];

/// What to check next where another party is to blame than the rule's help is for.
const HELP_BY_PARTY: [(&str, Party, &str); 6] = [
    (
        "L01",
        Party::Master,
        "Let the master write each frame in one go: a loop that writes bytes must not wait in between.",
    ),
    (
        "L01",
        Party::Device,
        "A gateway or converter before the device may pass bytes on in pieces; else ask its maker.",
    ),
    (
        "L02",
        Party::Device,
        "The device answers sooner than receivers can tell frames apart: see whether the master copes, \
                            or ask for a response delay.",
    ),
    (
        "T01",
        Party::Master,
        "Mend the request: register, quantity and function of the device's manual, at its present address.",
    ),
    ("F02", Party::Device, "The device computes its CRC over another address than it sends: ask its maker."),
    (
        "F03",
        Party::Device,
        "The device sends its CRC high byte first: ask its maker, or see whether it has a setting for it.",
    ),
];

/// Returns what to check next where a party is to blame for what a rule found.
pub(super) fn help(rule: &Rule, party: Party) -> &'static str {
    let own = HELP_BY_PARTY.iter().find(|(code, of, _)| (*code, *of) == (rule.code, party));
    own.map_or(rule.help, |(.., help)| help)
}

/// Returns a rule by its code, whatever the case.
pub fn rule(code: &str) -> Option<&'static Rule> {
    all_rules().find(|rule| rule.code.eq_ignore_ascii_case(code))
}

/// Returns all rules of the catalogue.
pub fn all_rules() -> impl Iterator<Item = &'static Rule> {
    CATALOGUE.iter().copied().flatten().copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_is_a_family_and_two_digits_and_stands_for_one_rule() {
        let mut codes: Vec<&str> = all_rules().map(|rule| rule.code).collect();
        assert!(codes.iter().all(|code| {
            let (family, number) = code.split_at(1);
            "LFTMDVQP".contains(family) && number.len() == 2 && number.parse::<u8>().is_ok()
        }));
        codes.sort_unstable();
        assert!(codes.windows(2).all(|pair| pair[0] != pair[1]), "{codes:?}");
        assert_eq!(rule("d06").map(|rule| rule.name), Some("read-too-early"));
        assert_eq!(rule("D99"), None);
    }

    #[test]
    fn what_to_check_depends_on_who_is_to_blame() {
        let l02 = rule("L02").expect("a rule");
        assert!(
            help(l02, Party::Master).contains("master wait") && help(l02, Party::Device).contains("device")
        );
        for (code, party, help) in HELP_BY_PARTY {
            let rule = rule(code).expect("a rule of the catalogue");
            assert!(rule.help != help, "{code} of the {} has the rule's own help", party.name());
        }
    }

    #[test]
    fn every_rule_says_what_it_means_what_to_check_and_where_it_is_written() {
        for rule in all_rules() {
            assert!(rule.explanation.len() > 40 && rule.help.len() > 20, "{}", rule.code);
            assert!(!rule.reference.is_empty(), "{}", rule.code);
        }
    }
}
