//! What a profile says about a device: identity, commands and fields, all as data.

use std::ops::Range;

use crate::decode::frame::Role;
use crate::decode::shape::Form;

use super::derive::Formula;
use super::encoding::Encoding;
use super::parse;
use super::problem::ProfileError;

/// The field that holds a device's serial number, the same in every profile.
pub const SERIAL_NUMBER: &str = "serial_number";
/// The field that holds the byte before the serial number: the type code as BCD, or 0.
pub const TYPE_BYTE: &str = "type_byte";
/// The field of a write that gives a device another unit address.
pub const NEW_ADDRESS: &str = "new_address";

/// Says where the facts of a profile or a command come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Source {
    /// A manual of the vendor.
    #[default]
    Manual,
    /// Real traffic.
    Capture,
    /// A program of somebody else that works with the device.
    Code,
    /// A conclusion.
    Inference,
}

impl Source {
    /// Returns the name used in profiles.
    pub fn name(self) -> &'static str {
        match self {
            Source::Manual => "manual",
            Source::Capture => "capture",
            Source::Code => "code",
            Source::Inference => "inference",
        }
    }
}

/// Says how far the facts of a profile can be relied on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Confidence {
    /// A single report, or a conclusion.
    Low,
    /// A manual, or a program that many use; no traffic has been published.
    Medium,
    /// A manual, and real traffic or logged values that agree with it.
    High,
}

impl Confidence {
    /// Returns the name used in profiles.
    pub fn name(self) -> &'static str {
        match self {
            Confidence::Low => "low",
            Confidence::Medium => "medium",
            Confidence::High => "high",
        }
    }
}

/// Describes a kind of device.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Profile {
    /// What it is called on the command line and in the output, such as `yosemitech-do`.
    pub id: Box<str>,
    /// What people call it.
    pub name: Box<str>,
    /// The maker's model numbers, such as `Y504`.
    pub models: Vec<Box<str>>,
    /// Who makes it.
    pub vendor: Option<Box<str>>,
    /// The manual that the profile follows, with its edition.
    pub manual: Option<Box<str>>,
    /// Where the facts come from, unless a command says otherwise.
    pub source: Source,
    /// How far the facts can be relied on, where the profile says.
    pub confidence: Option<Confidence>,
    /// The address from 248 to 255 at which every device of the kind answers.
    pub service_address: Option<u8>,
    /// What a serial number tells of the kind.
    pub serial_number: Option<SerialNumberRule>,
    /// What it asks of a master that measures.
    pub measuring: Measuring,
    /// What a reader of the manual should know: contradictions and how they are read.
    pub remarks: Vec<Box<str>>,
    /// What a master can ask for, in the profile's order.
    pub commands: Vec<Command>,
    /// What is calculated from readings.
    pub derived: Vec<Derived>,
}

impl Profile {
    /// Reads a profile from TOML; `name` stands for the text in messages, such as a path.
    ///
    /// # Errors
    ///
    /// Every problem that was found, with line and column.
    pub fn from_toml(text: &str, name: &str) -> Result<Self, ProfileError> {
        parse::profile(text).map_err(|problems| ProfileError::new(name, problems))
    }

    /// Returns the command of a function code and start register.
    pub fn command(&self, function: u8, start_register: u16) -> Option<&Command> {
        self.commands.iter().find(|command| command.key() == (function, start_register))
    }
}

/// Says what a device asks of a master that measures; lengths of time in nanoseconds, `None` where nothing is asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Measuring {
    /// Whether it measures only after a start command.
    pub needs_start: bool,
    /// From which major software version on it measures by itself.
    pub starts_itself_software: Option<u8>,
    /// The quantity of a measurement that only devices answer which measure by themselves.
    pub starts_itself_quantity: Option<u16>,
    /// From a start to the first value that counts.
    pub warm_up_ns: Option<i64>,
    /// Between two reads.
    pub cycle_ns: Option<i64>,
    /// How long the brush sweeps after it was started.
    pub brush_sweep_ns: Option<i64>,
}

/// Says what a command is for, as far as rules on masters depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Begins to measure.
    Start,
    /// Ends measuring.
    Stop,
    /// Reads what was measured.
    Measurement,
    /// Lets the brush sweep.
    Brush,
    /// Writes how values are corrected; survives a loss of power.
    Calibration,
    /// Writes anything else that is kept.
    Setting,
    /// Writes the unit address.
    Address,
    /// Writes the clock.
    Clock,
    /// Something else.
    Other,
}

/// Tells a kind of device by its serial numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct SerialNumberRule {
    /// What all serial numbers of the maker begin with.
    pub prefix: Box<str>,
    /// What follows the prefix in this kind's; none where nobody has seen one.
    pub type_codes: Vec<Box<str>>,
}

/// Says what a serial number tells about a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict<'a> {
    /// It is of this kind, by this type code.
    Claims(&'a str),
    /// It is the maker's, but of another kind.
    Denies,
    /// It does not tell.
    Silent,
}

impl SerialNumberRule {
    /// Judges a serial number and the byte before it.
    ///
    /// The byte, type code as BCD, counts only when the text does not begin as the maker's do.
    pub(super) fn judge(&self, serial_number: &str, type_byte: Option<u8>) -> Verdict<'_> {
        let code = |fits: &dyn Fn(&str) -> bool| self.type_codes.iter().find(|code| fits(code));
        if let Some(rest) = serial_number.strip_prefix(&*self.prefix) {
            return match code(&|code| rest.starts_with(code)) {
                Some(code) => Verdict::Claims(code),
                None if rest.is_empty() => Verdict::Silent,
                None => Verdict::Denies,
            };
        }
        let byte = type_byte.filter(|&byte| byte != 0);
        let claims = byte.and_then(|byte| code(&|code| u8::from_str_radix(code, 16) == Ok(byte)));
        claims.map_or(Verdict::Silent, |code| Verdict::Claims(code))
    }
}

/// Describes what a master can ask for.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Command {
    /// What it is called, such as `get-measurement`.
    pub name: Box<str>,
    /// Function code: 3, 4, 6 or 16.
    pub function: u8,
    /// The first register, as on the wire.
    pub start_register: u16,
    /// How many registers the device takes, ascending.
    pub quantities: Vec<u16>,
    /// What it is for.
    pub kind: Kind,
    /// How its frames differ from the specification.
    pub forms: Vec<Form>,
    /// Whether an accepted exchange with one of the quantities proves the kind of device.
    pub is_fingerprint: bool,
    /// Whether models that no profile describes answer it too, and mean something else.
    ///
    /// Then name and fields hold only once the device is known.
    pub is_contested: bool,
    /// Where the facts come from.
    pub source: Source,
    /// What a reader should know.
    pub remark: Option<Box<str>>,
    /// What a write carries.
    pub request: Vec<FieldSpec>,
    /// What a read brings.
    pub response: Vec<FieldSpec>,
}

impl Command {
    /// Returns function code and start register.
    pub fn key(&self) -> (u8, u16) {
        (self.function, self.start_register)
    }

    /// Returns the name that profiles use for what it is for.
    pub fn kind_name(&self) -> &'static str {
        parse::KINDS.iter().find(|(_, kind)| *kind == self.kind).map_or("other", |it| it.0)
    }

    /// Returns the names that profiles use for its forms, such as `zero-quantity`.
    pub fn quirks(&self) -> impl Iterator<Item = &'static str> {
        self.forms
            .iter()
            .filter_map(|form| parse::FORMS.iter().find(|(_, known)| known == form))
            .map(|it| it.0)
    }

    /// Returns the fields of one side.
    pub fn fields(&self, side: Role) -> &[FieldSpec] {
        match side {
            Role::Request => &self.request,
            Role::Response => &self.response,
            Role::Unknown => &[],
        }
    }

    /// Returns the field of one side by its name; the first where several share it.
    pub fn field(&self, side: Role, name: &str) -> Option<&FieldSpec> {
        self.fields(side).iter().find(|field| &*field.name == name)
    }
}

/// Says how a number is shown to people.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Show {
    /// As it is.
    #[default]
    Plain,
    /// A fraction of 1, in percent.
    Percent,
    /// In hexadecimal.
    Hex,
}

/// Says when a field is there: depending on text elsewhere in the data.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Condition {
    /// Where the text is looked for, in bytes from the data's start.
    pub offset: usize,
    /// What is looked for.
    pub text: Box<str>,
    /// Whether it must be there or must not.
    pub present: bool,
}

impl Condition {
    /// Tells whether data fulfils the condition.
    fn holds(&self, data: &[u8]) -> bool {
        let found = data.get(self.offset..).is_some_and(|data| data.starts_with(self.text.as_bytes()));
        found == self.present
    }
}

/// Says for which values a note is due.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoteAt {
    /// All values.
    Always,
    /// This value.
    Equals(f64),
    /// Larger values.
    Above(f64),
    /// Smaller values.
    Below(f64),
}

/// Is a remark that is shown beside a value.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Note {
    /// For which values.
    pub at: NoteAt,
    /// What is said.
    pub text: Box<str>,
}

impl Note {
    /// Tells whether the note is due for a value.
    pub(super) fn is_due(&self, value: Option<f64>) -> bool {
        match (self.at, value) {
            (NoteAt::Always, _) => true,
            (NoteAt::Equals(at), Some(value)) => value == at,
            (NoteAt::Above(at), Some(value)) => value > at,
            (NoteAt::Below(at), Some(value)) => value < at,
            (_, None) => false,
        }
    }
}

/// Describes a value in the data of a frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FieldSpec {
    /// What it is called, such as `temperature`.
    pub name: Box<str>,
    /// Where it lies, in bytes from the data's start.
    pub offset: usize,
    /// How it is encoded.
    pub encoding: Encoding,
    /// In what it is measured.
    pub unit: Option<Box<str>>,
    /// By what the number on the wire is multiplied.
    pub scale: f64,
    /// Whether it is measured, and so gives readings.
    pub is_quantity: bool,
    /// Whether models that no profile describes have something else here: it holds only once the device is known.
    pub is_contested: bool,
    /// The plausible values, both ends included.
    pub range: Option<(f64, f64)>,
    /// What it is after a loss of power, for settings that do not survive one.
    pub default: Option<f64>,
    /// How it is shown.
    pub show: Show,
    /// For a mask: what its bits mean.
    pub bits: Vec<(u32, Box<str>)>,
    /// For a code: what its values mean.
    pub values: Vec<(i64, Box<str>)>,
    /// What is shown beside values.
    pub notes: Vec<Note>,
    /// When it is there.
    pub condition: Option<Condition>,
    /// What a reader of the profile should know.
    pub remark: Option<Box<str>>,
}

impl FieldSpec {
    /// Returns where the field lies in data, in bytes from the data's start.
    pub fn span(&self) -> Range<usize> {
        self.offset..self.offset.saturating_add(self.encoding.size())
    }

    /// Returns the field's bytes when it is there and lies within the data.
    pub(super) fn bytes<'a>(&self, data: &'a [u8]) -> Option<&'a [u8]> {
        let is_there = self.condition.as_ref().is_none_or(|condition| condition.holds(data));
        data.get(self.span()).filter(|_| is_there)
    }

    /// Tells whether two profiles say the same of a field: name, place, type, scale, unit and meanings.
    pub(super) fn agrees(&self, other: &FieldSpec) -> bool {
        self.name == other.name
            && self.offset == other.offset
            && self.encoding == other.encoding
            && self.scale == other.scale
            && self.unit == other.unit
            && self.is_quantity == other.is_quantity
            && self.bits == other.bits
            && self.values == other.values
            && self.condition == other.condition
    }
}

/// Describes a value that is calculated from the fields of a response.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Derived {
    /// What it is called, such as `tds`.
    pub name: Box<str>,
    /// In what it is measured.
    pub unit: Option<Box<str>>,
    /// How it is calculated.
    pub formula: Formula,
    /// The fields that go in, in the formula's order.
    pub inputs: Vec<Box<str>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_serial_number_claims_denies_or_is_silent() {
        let rule = SerialNumberRule { prefix: "YL".into(), type_codes: vec!["01".into(), "24".into()] };
        assert_eq!(rule.judge("YL0114010022", Some(0)), Verdict::Claims("01"));
        assert_eq!(rule.judge("YL2917050209", Some(0x29)), Verdict::Denies);
        assert_eq!(rule.judge("YL2917050209", Some(0x24)), Verdict::Denies, "text before byte");
        assert_eq!(rule.judge("14010022", Some(0x24)), Verdict::Claims("24"));
        assert_eq!(rule.judge("14010022", Some(0)), Verdict::Silent);
        assert_eq!(rule.judge("YL", None), Verdict::Silent);
    }
}
