//! The profiles in use, and an index from function and register to what they declare.

use std::sync::Arc;

use crate::decode::frame::Role;
use crate::decode::shape::{Form, Quirk, Shapes};

use super::profile::{Command, FieldSpec, NEW_ADDRESS, Profile, SERIAL_NUMBER};

/// Profiles built into the program, in the order in which they are listed.
const BUILT_IN: [(&str, &str); 15] = [
    ("yosemitech-do", include_str!("profiles/yosemitech-do.toml")),
    ("yosemitech-sonde", include_str!("profiles/yosemitech-sonde.toml")),
    ("yosemitech-conductivity", include_str!("profiles/yosemitech-conductivity.toml")),
    ("yosemitech-turbidity", include_str!("profiles/yosemitech-turbidity.toml")),
    ("yosemitech-turb-wiper", include_str!("profiles/yosemitech-turb-wiper.toml")),
    ("yosemitech-chlorophyll", include_str!("profiles/yosemitech-chlorophyll.toml")),
    ("yosemitech-bga", include_str!("profiles/yosemitech-bga.toml")),
    ("yosemitech-cod", include_str!("profiles/yosemitech-cod.toml")),
    ("yosemitech-ph", include_str!("profiles/yosemitech-ph.toml")),
    ("yosemitech-orp", include_str!("profiles/yosemitech-orp.toml")),
    ("yosemitech-ammonium", include_str!("profiles/yosemitech-ammonium.toml")),
    ("yosemitech-depth", include_str!("profiles/yosemitech-depth.toml")),
    ("yosemitech-tss", include_str!("profiles/yosemitech-tss.toml")),
    ("yosemitech-oil", include_str!("profiles/yosemitech-oil.toml")),
    ("yosemitech-sonde-v2", include_str!("profiles/yosemitech-sonde-v2.toml")),
];

/// Is a set of profiles, by their index in the registry.
///
/// It holds the first 128; a profile beyond can be assigned to an address, but is never inferred.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Set(u128);

impl Set {
    pub(super) fn insert(&mut self, index: usize) {
        self.0 |= u32::try_from(index).ok().and_then(|index| 1_u128.checked_shl(index)).unwrap_or(0);
    }

    pub(super) fn of(indices: impl IntoIterator<Item = usize>) -> Self {
        let mut set = Set::default();
        indices.into_iter().for_each(|index| set.insert(index));
        set
    }

    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub(super) fn contains(self, index: usize) -> bool {
        !self.and(Set::of([index])).is_empty()
    }

    pub(super) fn and(self, other: Set) -> Set {
        Set(self.0 & other.0)
    }

    pub(super) fn without(self, other: Set) -> Set {
        Set(self.0 & !other.0)
    }

    /// Returns what is in both sets; this set where that is nothing.
    pub(super) fn narrowed_to(self, other: Set) -> Set {
        let both = self.and(other);
        if both.is_empty() { self } else { both }
    }

    /// Tells whether all members are members of another set.
    pub(super) fn is_within(self, other: Set) -> bool {
        self.without(other).is_empty()
    }

    pub(super) fn first(self) -> Option<usize> {
        (!self.is_empty()).then(|| self.0.trailing_zeros() as usize)
    }

    /// Returns the member when there is one only.
    pub(super) fn single(self) -> Option<usize> {
        self.first().filter(|_| self.0.is_power_of_two())
    }

    pub(super) fn iter(self) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(self), |set| Some(Set(set.0 & set.0.saturating_sub(1))))
            .map_while(Set::first)
    }
}

/// Holds what all profiles declare for a function and start register.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    function: u8,
    start_register: u16,
    /// The profiles that declare it.
    pub(super) declaring: Set,
    /// Whether an accepted exchange can tell more than which profiles declare it.
    pub(super) is_telling: bool,
    declared: Vec<Declared>,
}

impl Entry {
    /// Returns what one profile declares.
    pub(super) fn by(&self, profile: usize) -> Option<&Declared> {
        self.declared.iter().find(|declared| declared.profile == profile)
    }

    /// Returns what the profiles of a set declare, in the registry's order.
    pub(super) fn among(&self, set: Set) -> impl Iterator<Item = &Declared> {
        self.declared.iter().filter(move |declared| set.contains(declared.profile))
    }
}

/// Holds what one profile declares, and who says the same.
#[derive(Clone, Debug)]
pub(super) struct Declared {
    pub(super) profile: usize,
    command: usize,
    /// The profiles that give the command the same name; none where it is contested.
    pub(super) same_name: Set,
    /// For each field of the request, the profiles that have the same field; none where it is contested.
    request: Vec<Set>,
    /// For each field of the response, likewise.
    response: Vec<Set>,
}

impl Declared {
    /// Returns the profiles that agree on each field of a side.
    pub(super) fn agreeing(&self, side: Role) -> &[Set] {
        match side {
            Role::Request => &self.request,
            Role::Response => &self.response,
            Role::Unknown => &[],
        }
    }
}

/// Holds the profiles in use; built in ones first, then those added.
#[derive(Clone, Debug, Default)]
pub struct Profiles {
    list: Vec<(Arc<str>, Profile)>,
    /// Sorted by function and register.
    entries: Vec<Entry>,
    /// For each derived value of each profile, the profiles that have the same.
    same_derived: Vec<Vec<Set>>,
    shapes: Shapes,
}

impl Profiles {
    /// Returns the profiles built into the program.
    pub fn built_in() -> Self {
        let mut profiles = Profiles::default();
        for (name, text) in BUILT_IN {
            match Profile::from_toml(text, name) {
                Ok(profile) => profiles.insert(profile),
                Err(error) => debug_assert!(false, "{error}"), // a test reads them all
            }
        }
        profiles.index();
        profiles
    }

    /// Adds a profile; one with the same id is replaced.
    pub fn add(&mut self, profile: Profile) {
        self.insert(profile);
        self.index();
    }

    fn insert(&mut self, profile: Profile) {
        match self.list.iter_mut().find(|(id, _)| **id == *profile.id) {
            Some((_, known)) => *known = profile,
            None => self.list.push((profile.id.as_ref().into(), profile)),
        }
    }

    /// Returns a profile by its id.
    pub fn get(&self, id: &str) -> Option<&Profile> {
        self.iter().find(|profile| &*profile.id == id)
    }

    /// Returns all profiles in the order in which they were added.
    pub fn iter(&self) -> impl Iterator<Item = &Profile> {
        self.list.iter().map(|(_, profile)| profile)
    }

    /// Returns the frame forms and service addresses that the profiles declare, for the framer.
    pub fn shapes(&self) -> Shapes {
        self.shapes.clone()
    }

    /// Tells whether devices answer at this reserved address.
    pub(super) fn is_service_address(&self, address: u8) -> bool {
        self.shapes.is_service_address(address)
    }

    pub(super) fn position(&self, id: &str) -> Option<usize> {
        self.list.iter().position(|(known, _)| **known == *id)
    }

    /// Returns the profile at an index; `None` past the last.
    pub(super) fn at(&self, index: usize) -> Option<&Profile> {
        self.list.get(index).map(|(_, profile)| profile)
    }

    pub(super) fn id(&self, index: usize) -> Option<&Arc<str>> {
        self.list.get(index).map(|(id, _)| id)
    }

    /// Returns the index of what is declared for a function and start register.
    pub(super) fn find(&self, function: u8, start_register: u16) -> Option<usize> {
        let key = (function, start_register);
        self.entries.binary_search_by_key(&key, |entry| (entry.function, entry.start_register)).ok()
    }

    /// Returns what is declared, by its index.
    pub(super) fn entry(&self, index: usize) -> Option<&Entry> {
        self.entries.get(index)
    }

    pub(super) fn command(&self, declared: &Declared) -> Option<&Command> {
        self.at(declared.profile)?.commands.get(declared.command)
    }

    /// Returns the profiles that have the same derived value as one of a profile.
    pub(super) fn same_derived(&self, profile: usize, derived: usize) -> Set {
        self.same_derived.get(profile).and_then(|sets| sets.get(derived)).copied().unwrap_or_default()
    }

    fn index(&mut self) {
        self.shapes = shapes_of(self.iter());
        self.entries = entries_of(&self.list);
        let all = || self.list.iter().map(|(_, profile)| profile).enumerate();
        let same = |derived| {
            Set::of(all().filter(|(_, other)| other.derived.contains(derived)).map(|(index, _)| index))
        };
        self.same_derived =
            self.list.iter().map(|(_, profile)| profile.derived.iter().map(same).collect()).collect();
    }
}

fn shapes_of<'a>(profiles: impl Iterator<Item = &'a Profile>) -> Shapes {
    let mut shapes = Shapes::default();
    for profile in profiles {
        shapes.service_addresses.extend(profile.service_address);
        for command in &profile.commands {
            let (function, start_register) = command.key();
            let quirk = |&form| Quirk { function, start_register, form };
            shapes.quirks.extend(command.forms.iter().map(quirk));
            if command.forms.contains(&Form::CountsRegisters) {
                let counts = command.quantities.iter().filter_map(|&quantity| u8::try_from(quantity).ok());
                shapes.register_counts.extend(counts.map(|count| (function, count)));
            }
        }
    }
    shapes.quirks.sort_unstable();
    shapes.quirks.dedup();
    shapes.register_counts.sort_unstable();
    shapes.register_counts.dedup();
    shapes.service_addresses.sort_unstable();
    shapes.service_addresses.dedup();
    shapes
}

fn entries_of(list: &[(Arc<str>, Profile)]) -> Vec<Entry> {
    let mut all: Vec<((u8, u16), usize, usize)> = Vec::new();
    for (profile, (_, known)) in list.iter().enumerate() {
        let keys = known.commands.iter().enumerate().map(|(command, known)| (known.key(), profile, command));
        all.extend(keys);
    }
    all.sort_unstable();
    let command = |&(_, profile, command): &((u8, u16), usize, usize)| {
        let (_, known) = list.get(profile)?;
        Some((profile, known.commands.get(command)?))
    };
    all.chunk_by(|a, b| a.0 == b.0)
        .map(|group| {
            let commands: Vec<(usize, &Command)> = group.iter().filter_map(command).collect();
            let declared =
                group.iter().filter_map(|key| Some(declare(command(key)?, key.2, &commands))).collect();
            let (function, start_register) = group[0].0; // `chunk_by` gives no empty group
            let is_telling = commands.iter().any(|(_, command)| is_telling(command));
            let declaring = Set::of(commands.iter().map(|&(profile, _)| profile));
            Entry { function, start_register, declaring, is_telling, declared }
        })
        .collect()
}

fn is_telling(command: &Command) -> bool {
    command.is_fingerprint
        || command.field(Role::Response, SERIAL_NUMBER).is_some()
        || command.field(Role::Request, NEW_ADDRESS).is_some()
}

/// Finds who says the same as one profile about a function and register.
fn declare((profile, command): (usize, &Command), index: usize, all: &[(usize, &Command)]) -> Declared {
    let who = |agrees: &dyn Fn(&Command) -> bool| {
        let agreeing = all.iter().filter(|(_, other)| agrees(other) && !other.is_contested);
        Set::of(agreeing.map(|&(profile, _)| profile))
    };
    let agreeing = |side: Role| {
        let has = |field: &FieldSpec| {
            let agrees = |theirs: &FieldSpec| field.agrees(theirs) && !theirs.is_contested;
            who(&|other| other.fields(side).iter().any(agrees))
        };
        command.fields(side).iter().map(has).collect()
    };
    Declared {
        profile,
        command: index,
        same_name: who(&|other| other.name == command.name),
        request: agreeing(Role::Request),
        response: agreeing(Role::Response),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_profiles_are_right_and_listed_in_order() {
        for (name, text) in BUILT_IN {
            let profile = Profile::from_toml(text, name).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(&*profile.id, name);
        }
        let built_in = Profiles::built_in();
        let ids: Vec<_> = built_in.iter().map(|profile| &*profile.id).collect();
        assert_eq!(ids, BUILT_IN.map(|(id, _)| id));
        assert!(built_in.iter().all(|profile| profile.confidence.is_some()));
    }

    #[test]
    fn the_framer_learns_every_frame_form_of_the_manuals() {
        let shapes = Profiles::built_in().shapes();
        for (function, register) in [(3, 0x2500), (3, 0x2E00), (16, 0x1C00), (16, 0x2F00), (16, 0x3100)] {
            assert!(shapes.declares(function, register, Form::ZeroQuantity), "{function} {register:#06x}");
        }
        assert!(shapes.declares(3, 0x2500, Form::UncountedData));
        assert!(shapes.declares(3, 0x2E00, Form::UncountedData));
        assert!(!shapes.declares(3, 0x2600, Form::ZeroQuantity), "a measurement has registers");
        assert_eq!(shapes.register_counts, [(3, 12)], "K1 to K6 of pH probes");
        assert_eq!(shapes.service_addresses, [0xFF]);
    }

    #[test]
    fn a_profile_with_the_same_id_replaces() {
        let mut profiles = Profiles::built_in();
        let text = "id = \"yosemitech-do\"\nname = \"mine\"\n[[command]]\nname = \"get-level\"\nfunction = 3\n\
                    register = 0x10\nquantities = [1]";
        profiles.add(Profile::from_toml(text, "mine.toml").expect("a profile"));
        assert_eq!(profiles.iter().count(), BUILT_IN.len());
        assert_eq!(profiles.get("yosemitech-do").map(|profile| &*profile.name), Some("mine"));
        assert!(profiles.find(16, 0x2700).is_none(), "the index follows");
    }

    #[test]
    fn a_set_iterates_in_order_and_ignores_what_it_cannot_hold() {
        let set = Set::of([5, 127, 0, 128, usize::MAX]);
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 5, 127]);
        assert_eq!((set.single(), Set::of([7]).single()), (None, Some(7)));
    }
}
