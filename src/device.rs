//! Stands in for the device module until it is there.
#![expect(missing_docs, reason = "a stand-in")]
use crate::decode::{frame::Role, shape::Shapes, transaction::Transaction};
use std::{borrow::Cow, fmt, ops::Range, sync::Arc};
#[derive(Clone, Debug, PartialEq)]
pub enum Value<'a> {
    Float32(f32),
    Float64(f64),
    Integer(i64),
    Text(Cow<'a, str>),
    Boolean(bool),
    Null,
}
#[derive(Clone, Debug)]
pub struct Field<'a> {
    pub name: &'a str,
    pub value: Value<'a>,
    pub unit: Option<&'a str>,
    pub side: Role,
    pub span: Range<usize>,
    pub is_quantity: bool,
}
impl fmt::Display for Field<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.value)
    }
}
#[derive(Clone, Debug)]
pub struct Reading<'a> {
    pub quantity: &'a str,
    pub value: Value<'a>,
    pub unit: Option<&'a str>,
    pub derived: bool,
    pub device: Option<&'a str>,
    pub serial_number: Option<&'a str>,
}
impl fmt::Display for Reading<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.value)
    }
}
#[derive(Clone, Debug)]
pub struct Identified {
    pub address: u8,
    pub device: Arc<str>,
    pub serial_number: Option<String>,
    pub evidence: String,
    pub frames: Vec<u64>,
}
pub struct Likely<'a> {
    pub device: &'a str,
    pub command: &'a str,
}
pub struct Meaning<'a>(pub Vec<Field<'a>>);
impl<'a> Meaning<'a> {
    pub fn device(&self) -> Option<&'a str> {
        None
    }
    pub fn serial_number(&self) -> Option<&'a str> {
        None
    }
    pub fn candidates(&self) -> impl Iterator<Item = &'a str> {
        std::iter::empty()
    }
    pub fn command(&self) -> Option<&'a str> {
        None
    }
    pub fn likely(&self) -> Option<Likely<'a>> {
        None
    }
    pub fn fields(&self) -> impl Iterator<Item = Field<'a>> {
        self.0.iter().cloned()
    }
    pub fn likely_fields(&self) -> impl Iterator<Item = Field<'a>> {
        self.0.iter().cloned()
    }
    pub fn readings(&self) -> impl Iterator<Item = Reading<'a>> {
        std::iter::empty()
    }
}
pub struct Environment {
    pub salinity: f64,
    pub pressure_kpa: f64,
}
pub struct Profiles;
pub struct Profile {
    pub id: Box<str>,
    pub name: Box<str>,
    pub vendor: Option<Box<str>>,
    pub manual: Option<Box<str>>,
}
#[derive(Debug)]
pub struct ProfileError;
impl fmt::Display for ProfileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "")
    }
}
#[derive(Debug)]
pub struct UnknownDevice;
impl fmt::Display for UnknownDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "")
    }
}
impl Profile {
    pub fn from_toml(_: &str, _: &str) -> Result<Profile, ProfileError> {
        Err(ProfileError)
    }
}
impl Profiles {
    pub fn built_in() -> Self {
        Self
    }
    pub fn add(&mut self, _: Profile) {}
    pub fn get(&self, _: &str) -> Option<&Profile> {
        None
    }
    pub fn iter(&self) -> impl Iterator<Item = &Profile> {
        [].iter()
    }
    pub fn shapes(&self) -> Shapes {
        Shapes::default()
    }
}
pub struct Devices;
impl Devices {
    pub fn new(_: Arc<Profiles>, _: Environment) -> Self {
        Self
    }
    pub fn assign(&mut self, _: u8, _: &str) -> Result<(), UnknownDevice> {
        Ok(())
    }
    pub fn observe(&mut self, _: &Transaction<'_>) -> Option<Identified> {
        None
    }
    pub fn meaning<'a>(&'a self, _: &Transaction<'a>) -> Meaning<'a> {
        Meaning(vec![])
    }
}
