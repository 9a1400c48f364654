//! Fields and readings of a transaction, and how they read as text.

use std::fmt;
use std::ops::Range;

use crate::decode::frame::Role;

use super::derive::{Environment, Formula};
use super::encoding::Encoding;
use super::profile::{FieldSpec, Show};
use super::value::Value;

/// Is a value found in a frame. Its `Display` is the text for people, with unit and notes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Field<'a> {
    /// What it is called.
    pub name: &'a str,
    /// What it is worth.
    pub value: Value<'a>,
    /// In what it is measured.
    pub unit: Option<&'a str>,
    /// Which frame it is in.
    pub side: Role,
    /// Where its bytes lie in that frame, counted from the address byte.
    pub span: Range<usize>,
    /// Whether it is measured, and so gives a reading.
    pub is_quantity: bool,
    /// What the profile says about it.
    pub spec: &'a FieldSpec,
    bytes: &'a [u8],
}

impl<'a> Field<'a> {
    /// Reads a field from the data of a frame; `None` when it is not there.
    pub(super) fn read(spec: &'a FieldSpec, side: Role, data: &'a [u8], data_start: usize) -> Option<Self> {
        let bytes = spec.bytes(data)?;
        let span = spec.span();
        Some(Field {
            name: &spec.name,
            value: scaled(spec.encoding.read(bytes), spec.scale),
            unit: spec.unit.as_deref(),
            side,
            span: data_start + span.start..data_start + span.end, // both within a frame
            is_quantity: spec.is_quantity,
            spec,
            bytes,
        })
    }

    /// Tells whether the value is outside the profile's range, not a number or infinite.
    ///
    /// `false` where the profile gives no range.
    pub fn is_implausible(&self) -> bool {
        match (self.value.as_f64(), self.spec.range) {
            (Some(value), Some((low, high))) => !(low..=high).contains(&value),
            (None, _) => self.spec.encoding.is_number(),
            (Some(_), None) => false,
        }
    }
}

/// Multiplies a number; by the reciprocal where that is whole, so that 3 · 0.1 is 0.3.
fn scaled(value: Value<'_>, scale: f64) -> Value<'_> {
    let apply = |number: f64| {
        let reciprocal = (1.0 / scale).round();
        if (scale * reciprocal - 1.0).abs() < 1e-12 { number / reciprocal } else { number * scale }
    };
    match value {
        _ if scale == 1.0 => value,
        Value::Float32(number) => {
            let number = apply(f64::from(number)) as f32;
            if number.is_finite() { Value::Float32(number) } else { Value::Null }
        }
        Value::Integer(number) => {
            let number = apply(number as f64);
            if number.is_finite() { Value::Float64(number) } else { Value::Null }
        }
        other => other,
    }
}

impl fmt::Display for Field<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_value(f)?;
        let mut separator = " (";
        let mut remark = |f: &mut fmt::Formatter<'_>, text: fmt::Arguments<'_>| {
            let opening = std::mem::replace(&mut separator, "; ");
            write!(f, "{opening}{text}")
        };
        let value = self.value.as_f64();
        let mut is_noted = false;
        for note in self.spec.notes.iter().filter(|note| note.is_due(value)) {
            remark(f, format_args!("{}", note.text))?;
            is_noted |= note.at != super::profile::NoteAt::Always;
        }
        if let Some((low, high)) = self.spec.range.filter(|_| !is_noted && value.is_some())
            && self.is_implausible()
        {
            remark(f, format_args!("implausible: not within {low} to {high}"))?;
        }
        if separator == "; " { f.write_str(")") } else { Ok(()) }
    }
}

impl Field<'_> {
    fn write_value(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.value, self.spec.encoding) {
            (Value::Null, Encoding::BcdTime) => {
                f.write_str("not a date:")?;
                self.bytes.iter().try_for_each(|byte| write!(f, " {byte:02x}"))
            }
            (Value::Null, Encoding::Float32(order)) => f.write_str(order.name_non_finite(self.bytes)),
            (Value::Integer(mask), Encoding::Flags { .. }) => self.write_flags(f, *mask as u32), // at most 4 bytes
            (Value::Integer(value), _) if !self.spec.values.is_empty() => {
                match self.spec.values.iter().find(|(known, _)| known == value) {
                    Some((_, text)) => f.write_str(text),
                    None => write!(f, "undefined {value:#04x}"),
                }
            }
            (Value::Integer(value), _) if self.spec.show == Show::Hex => write!(f, "{value:#04x}"),
            (value, _) if self.spec.show == Show::Percent => match value.as_f64() {
                // Rounded to 32 bits, so that 0.952 is 95.2 % and not 95.19999…
                Some(fraction) => write!(f, "{} %", Value::Float32(percent(value, fraction))),
                None => write!(f, "{value}"),
            },
            (value, _) => write_with_unit(f, value, self.unit),
        }
    }

    fn write_flags(&self, f: &mut fmt::Formatter<'_>, mask: u32) -> fmt::Result {
        let mut unknown = mask;
        let mut separator = "";
        for (bit, text) in self.spec.bits.iter().filter(|(bit, _)| mask & bit == *bit) {
            unknown &= !bit;
            write!(f, "{separator}{text}")?;
            separator = ", ";
        }
        match (unknown, mask) {
            (0, 0) => f.write_str("none"),
            (0, _) => Ok(()),
            (unknown, _) => write!(f, "{separator}undefined {unknown:#04x}"),
        }
    }
}

/// Returns a fraction in percent, from its shortest decimal.
fn percent(value: &Value<'_>, fraction: f64) -> f32 {
    let decimal = value.to_string().parse().unwrap_or(fraction);
    (decimal * 100.0) as f32
}

fn write_with_unit(f: &mut fmt::Formatter<'_>, value: &Value<'_>, unit: Option<&str>) -> fmt::Result {
    match unit {
        Some(unit) if unit != "1" => write!(f, "{value} {unit}"),
        _ => write!(f, "{value}"),
    }
}

/// Is what a device measured, or what follows from it. Its `Display` is the text for people.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Reading<'a> {
    /// What was measured.
    pub quantity: &'a str,
    /// What it is worth.
    pub value: Value<'a>,
    /// In what it is measured.
    pub unit: Option<&'a str>,
    /// Whether it was calculated.
    pub derived: bool,
    /// What the device is, when it is known.
    pub device: Option<&'a str>,
    /// Whose it is, when it is known.
    pub serial_number: Option<&'a str>,
    pub(super) origin: Origin<'a>,
}

/// Says where a reading is from.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Origin<'a> {
    Field(Field<'a>),
    Formula {
        formula: Formula,
        environment: Environment,
        /// The first input that is implausible.
        doubtful: Option<&'a str>,
    },
}

impl Reading<'_> {
    /// Tells whether the value is outside the profile's range, not a number or infinite, or follows from one.
    pub fn is_implausible(&self) -> bool {
        match &self.origin {
            Origin::Field(field) => field.is_implausible(),
            Origin::Formula { doubtful, .. } => doubtful.is_some(),
        }
    }

    /// Tells whether it was calculated with salinity and air pressure.
    pub fn needs_environment(&self) -> bool {
        matches!(&self.origin, Origin::Formula { formula, .. } if formula.needs_environment())
    }
}

impl fmt::Display for Reading<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (formula, environment, doubtful) = match &self.origin {
            Origin::Field(field) => return field.fmt(f),
            Origin::Formula { formula, environment, doubtful } => (formula, environment, doubtful),
        };
        // Three decimals are more than the sensors resolve.
        let rounded = self.value.as_f64().map_or(Value::Null, |value| Value::Float64(round(value)));
        write_with_unit(f, &rounded, self.unit)?;
        if formula.needs_environment() {
            write!(f, " (salinity {}, {} kPa", environment.salinity, environment.pressure_kpa)?;
        }
        match (doubtful, formula.needs_environment()) {
            (Some(input), true) => write!(f, "; implausible: from {input})"),
            (Some(input), false) => write!(f, " (implausible: from {input})"),
            (None, true) => f.write_str(")"),
            (None, false) => Ok(()),
        }
    }
}

fn round(value: f64) -> f64 {
    let rounded = (value * 1000.0).round() / 1000.0;
    if rounded.is_finite() { rounded } else { value }
}
