//! What a transaction means by what is known of its device.

use std::iter::Zip;
use std::slice;

use crate::decode::frame::Role;
use crate::decode::transaction::{Outcome, Transaction};

use super::data::{data_of, whole};
use super::derive::Environment;
use super::field::{Field, Origin, Reading};
use super::profile::{Command, Derived, FieldSpec, Profile};
use super::registry::{Declared, Entry, Profiles, Set};
use super::value::Value;

/// Is what a transaction means.
#[derive(Clone, Debug)]
pub struct Meaning<'a> {
    pub(super) profiles: &'a Profiles,
    pub(super) environment: Environment,
    /// Request and response, where they are whole.
    request: Option<&'a [u8]>,
    response: Option<&'a [u8]>,
    function: u8,
    quantity: Option<u16>,
    is_exception: bool,
    /// Whether the response gives readings.
    is_answered: bool,
    /// What the profiles declare for its function and start register.
    pub(super) entry: Option<&'a Entry>,
    /// The device's profile, when it is known.
    pub(super) device: Option<usize>,
    /// The profiles that fit while it is not.
    pub(super) candidates: Set,
    pub(super) serial_number: Option<&'a str>,
}

/// Is the likeliest reading of a transaction whose device is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Likely<'a> {
    /// What the device most likely is.
    pub device: &'a str,
    /// What the command then is.
    pub command: &'a str,
}

impl<'a> Meaning<'a> {
    /// Finds what the profiles say of a transaction; nothing is known of its device yet.
    ///
    /// `entry` is what they declare for its function and start register.
    pub(super) fn new(
        profiles: &'a Profiles,
        entry: Option<&'a Entry>,
        environment: Environment,
        t: &Transaction<'a>,
    ) -> Self {
        Meaning {
            profiles,
            environment,
            request: whole(&t.request),
            response: whole(&t.response),
            function: t.function.0,
            quantity: t.quantity,
            is_exception: t.outcome == Outcome::Exception,
            is_answered: matches!(t.outcome, Outcome::Answered | Outcome::Late),
            entry,
            device: None,
            candidates: Set::default(),
            serial_number: None,
        }
    }

    /// Returns the id of the device's profile, when it is known.
    pub fn device(&self) -> Option<&'a str> {
        self.profiles.id(self.device?).map(|id| &**id)
    }

    /// Returns the device's profile, when it is known.
    pub fn profile(&self) -> Option<&'a Profile> {
        self.profiles.at(self.device?)
    }

    /// Returns the serial number last read at the address.
    pub fn serial_number(&self) -> Option<&'a str> {
        self.serial_number
    }

    /// Returns the ids of the profiles that fit while the device is not known; else none.
    pub fn candidates(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        let profiles = self.profiles;
        self.candidates.iter().filter_map(|index| profiles.id(index).map(|id| &**id))
    }

    /// Returns the command's name: the device's, or the one on which all candidates agree.
    ///
    /// While the device is not known, not even a single candidate vouches for what a profile calls contested.
    pub fn command(&self) -> Option<&'a str> {
        self.agreed_command().map(|command| &*command.name)
    }

    /// Returns what the profiles say of the command: the device's, or all candidates' as far as they give it one name.
    pub fn agreed_command(&self) -> Option<&'a Command> {
        let declared = self.spokesman()?;
        let agreed = self.candidates.is_within(declared.same_name);
        self.profiles.command(declared).filter(|_| agreed)
    }

    /// Returns what the device's profile says of the command; `None` while the device is not known.
    pub fn specification(&self) -> Option<&'a Command> {
        self.profiles.command(self.entry?.by(self.device?)?)
    }

    /// Returns the fields on which all candidates agree, but no contested ones; or all of the device's.
    ///
    /// Those of the request come first, then the response's, each in the order of their bytes.
    pub fn fields(&self) -> impl Iterator<Item = Field<'a>> + use<'a> {
        self.agreed_on(Role::Request).chain(self.agreed_on(Role::Response))
    }

    /// Returns the likeliest reading, where the candidates do not agree on command and fields, or these are contested.
    pub fn likely(&self) -> Option<Likely<'a>> {
        let declared = self.likeliest()?;
        let command = self.profiles.command(declared)?;
        let adds = self.command().is_none() || self.likely_fields().next().is_some();
        let device = self.profiles.id(declared.profile).filter(|_| adds)?;
        Some(Likely { device, command: &command.name })
    }

    /// Returns the fields of the likeliest reading that are not agreed on.
    pub fn likely_fields(&self) -> impl Iterator<Item = Field<'a>> + use<'a> {
        let declared = self.likeliest();
        self.read(declared, Role::Request, false).chain(self.read(declared, Role::Response, false))
    }

    /// Returns what was measured, then what follows from it.
    ///
    /// Only an answered or late transaction gives readings. A value of `Null` is a reading too; nothing
    /// is derived from it.
    pub fn readings(&self) -> impl Iterator<Item = Reading<'a>> + use<'a> {
        let (device, serial_number) = (self.device(), self.serial_number);
        let fields = self.is_answered.then(|| self.agreed_on(Role::Response)).into_iter().flatten();
        let measured = fields.filter(|field| field.is_quantity).map(move |field| Reading {
            quantity: field.name,
            value: field.value.clone(),
            unit: field.unit,
            derived: false,
            device,
            serial_number,
            origin: Origin::Field(field),
        });
        measured.chain(self.is_answered.then(|| self.derived()).into_iter().flatten())
    }

    fn derived(&self) -> impl Iterator<Item = Reading<'a>> + use<'a> {
        let meaning = self.clone();
        let speaker = self.spokesman().map(|declared| declared.profile);
        let profile = speaker.and_then(|profile| Some((profile, self.profiles.at(profile)?)));
        let all = profile.into_iter().flat_map(|(index, profile)| {
            profile.derived.iter().enumerate().map(move |(derived, spec)| (index, derived, spec))
        });
        all.filter_map(move |(profile, derived, spec)| {
            let agreeing = meaning.profiles.same_derived(profile, derived);
            meaning.candidates.is_within(agreeing).then(|| meaning.derive(spec)).flatten()
        })
    }

    /// Calculates a derived value; `None` when an input is missing or null.
    fn derive(&self, spec: &'a Derived) -> Option<Reading<'a>> {
        let mut inputs = [0.0; 2]; // no formula has more
        let mut doubtful = None;
        let inputs = inputs.get_mut(..spec.inputs.len())?;
        for (input, name) in inputs.iter_mut().zip(&spec.inputs) {
            let field = self.agreed_on(Role::Response).find(|field| *field.name == **name)?;
            *input = field.value.as_f64()?;
            doubtful = doubtful.or_else(|| field.is_implausible().then_some(field.name));
        }
        Some(Reading {
            quantity: &spec.name,
            value: Value::Float64(spec.formula.evaluate(inputs, self.environment)?),
            unit: spec.unit.as_deref(),
            derived: true,
            device: self.device(),
            serial_number: self.serial_number,
            origin: Origin::Formula { formula: spec.formula, environment: self.environment, doubtful },
        })
    }

    /// Returns what the device declares, or the first candidate when all candidates declare something.
    fn spokesman(&self) -> Option<&'a Declared> {
        let entry = self.entry?;
        match self.device {
            Some(device) => entry.by(device),
            None if self.candidates.is_within(entry.declaring) => entry.by(self.candidates.first()?),
            None => None,
        }
    }

    fn agreed_on(&self, side: Role) -> SideFields<'a> {
        self.read(self.spokesman(), side, true)
    }

    fn data(&self, side: Role) -> Option<(usize, &'a [u8])> {
        let Meaning { request, response, function, is_exception, .. } = *self;
        data_of([request, response], side, function, is_exception)
    }

    /// Reads the fields of one side as one profile has them: those agreed on, or those that are not.
    fn read(&self, declared: Option<&'a Declared>, side: Role, agreed: bool) -> SideFields<'a> {
        let command = declared.and_then(|declared| Some((declared, self.profiles.command(declared)?)));
        let (Some((declared, command)), Some((data_start, data))) = (command, self.data(side)) else {
            return SideFields::default();
        };
        let fields = command.fields(side).iter().zip(declared.agreeing(side));
        SideFields { fields: Some(fields), side, data, data_start, candidates: self.candidates, agreed }
    }

    /// Returns what the likeliest of several candidates declares; the first among equals.
    fn likeliest(&self) -> Option<&'a Declared> {
        let mut best: Option<(&'a Declared, i32)> = None;
        for declared in self.entry?.among(self.candidates) {
            let score = self.likelihood(declared);
            if best.is_none_or(|(_, highest)| score > highest) {
                best = Some((declared, score));
            }
        }
        best.map(|(declared, _)| declared)
    }

    /// Scores how well a transaction fits one profile: plausible values weigh more than the quantity.
    fn likelihood(&self, declared: &'a Declared) -> i32 {
        let quantity = self.quantity;
        let accepts =
            |command: &Command| quantity.is_some_and(|quantity| command.quantities.contains(&quantity));
        let all = [true, false].map(|agreed| self.read(Some(declared), Role::Response, agreed));
        let implausible = all.into_iter().flatten().filter(Field::is_implausible).count();
        i32::from(self.profiles.command(declared).is_some_and(accepts)) - 2 * implausible.min(1000) as i32
    }
}

/// Iterates over the fields of one side as one profile has them.
struct SideFields<'a> {
    fields: Option<Zip<slice::Iter<'a, FieldSpec>, slice::Iter<'a, Set>>>,
    side: Role,
    data: &'a [u8],
    data_start: usize,
    candidates: Set,
    /// Whether those are wanted on which all candidates agree, or the others.
    agreed: bool,
}

impl Default for SideFields<'_> {
    fn default() -> Self {
        let candidates = Set::default();
        SideFields { fields: None, side: Role::Unknown, data: &[], data_start: 0, candidates, agreed: true }
    }
}

impl<'a> Iterator for SideFields<'a> {
    type Item = Field<'a>;

    fn next(&mut self) -> Option<Field<'a>> {
        let SideFields { fields, side, data, data_start, candidates, agreed } = self;
        fields.as_mut()?.find_map(|(spec, agreeing)| {
            let wanted = candidates.is_within(*agreeing) == *agreed;
            wanted.then(|| Field::read(spec, *side, data, *data_start)).flatten()
        })
    }
}
