//! What the interfaces of a packet capture are called as buses.

use std::collections::{BTreeMap, BTreeSet};

/// How many characters of a name are kept: a line of hex text and a topic have to hold it.
const LONGEST: usize = 200;

/// Is what tells an interface from the others of its section; the same in another section is the same bus.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Identity {
    /// What it is called, such as the path of a device.
    Named(String),
    /// Without a name, its place in the section.
    Numbered(usize),
}

impl Identity {
    pub(super) fn new(name: &str, number: usize) -> Self {
        match name.trim() {
            "" => Identity::Numbered(number),
            name => Identity::Named(name.to_owned()),
        }
    }

    /// Returns what its bus would best be called: of a device's path its end says which.
    fn wish(&self, number: usize) -> String {
        let wish = match self {
            Identity::Named(name) => safe(name.rsplit('/').next().unwrap_or_default()),
            Identity::Numbered(_) => String::new(),
        };
        if wish.is_empty() { format!("bus{number}") } else { wish }
    }
}

/// Makes a name that a comment, a topic and a terminal can hold: in one line, without control characters.
fn safe(name: &str) -> String {
    let visible = |c: char| if c.is_control() { '_' } else { c };
    name.trim().chars().map(visible).take(LONGEST).collect()
}

/// Gives each interface a bus of its own.
#[derive(Debug, Default)]
pub(super) struct Names {
    known: BTreeMap<Identity, usize>,
    taken: BTreeSet<String>,
}

impl Names {
    /// Returns the place of the interface's bus among all, and its name where that is new; `number` counts the
    /// interfaces of the section.
    pub(super) fn bus(&mut self, identity: Identity, number: usize) -> (usize, Option<String>) {
        if let Some(place) = self.known.get(&identity) {
            return (*place, None);
        }
        let name = self.free(&identity.wish(number));
        let place = self.known.len();
        self.known.insert(identity, place);
        self.taken.insert(name.clone());
        (place, Some(name))
    }

    /// Returns a name that no other bus has.
    fn free(&self, wish: &str) -> String {
        let numbered = (2_u32..).map(|number| format!("{wish}-{number}"));
        let mut names = std::iter::once(wish.to_owned()).chain(numbered);
        names.find(|name| !self.taken.contains(name)).unwrap_or_default() // there are more numbers than buses
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::capture::hex_bus;

    fn names(of: &[&str]) -> Vec<String> {
        let mut names = Names::default();
        let bus = |(number, name): (usize, &&str)| names.bus(Identity::new(name, number), number).1;
        of.iter().enumerate().filter_map(bus).collect()
    }

    #[test]
    fn each_interface_has_a_name_that_no_other_has() {
        assert_eq!(names(&["/dev/left/bus", "/dev/right/bus", "bus"]), ["bus", "bus-2", "bus-3"]);
        assert_eq!(names(&["", "bus0", "bus2", ""]), ["bus0", "bus0-2", "bus2", "bus3"]);
        assert_eq!(names(&["a", "a-2", "/a"]), ["a", "a-2", "a-3"]);
        assert_eq!(names(&["/dev/pump", " /dev/pump "]), ["pump"], "the same one, with other settings");
    }

    #[test]
    fn a_name_is_one_line_that_can_be_shown() {
        assert_eq!(names(&["pump\n01 03", "\u{1b}[2J", "/", " \t"]), ["pump_01 03", "_[2J", "bus2", "bus3"]);
        assert_eq!(names(&[&"x".repeat(65_535)])[0].len(), LONGEST);
    }

    proptest! {
        #[test]
        fn every_name_can_be_written_as_hex_text_as_it_is(name in any::<String>()) {
            let names = names(&[&name]);
            prop_assert!(!names[0].is_empty() && !names[0].contains(|c: char| c == '/' || c.is_control()));
            prop_assert_eq!(hex_bus::bus(hex_bus::hex_bus(&names[0], None).as_bytes()), Some((names[0].clone(), None)));
        }
    }
}
