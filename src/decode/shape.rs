//! Frame forms outside the specification that devices declare: data for the framer.
//!
//! The framer knows the union of what all loaded profiles declare, before any device is identified.

/// Names a form that the specification does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Form {
    /// The request asks for, or writes, zero registers.
    ZeroQuantity,
    /// The response's byte count is 0, yet two bytes follow for each register asked for.
    UncountedData,
    /// The response's byte count gives registers where it should give bytes.
    CountsRegisters,
}

/// Declares a form for a function at a start register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Quirk {
    /// Function code of the request.
    pub function: u8,
    /// Start register of the request.
    pub start_register: u16,
    /// What is unusual about it.
    pub form: Form,
}

/// Holds what all loaded profiles declare.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Shapes {
    /// Forms outside the specification, sorted, without duplicates.
    pub quirks: Vec<Quirk>,
    /// Function codes with the byte counts that stand for registers, by [`Form::CountsRegisters`]; likewise.
    pub register_counts: Vec<(u8, u8)>,
    /// Addresses from 248 to 255 at which devices answer, such as 0xFF; sorted, without duplicates.
    pub service_addresses: Vec<u8>,
}

impl Shapes {
    /// Tells whether any device declares `form` for this function and start register.
    pub fn declares(&self, function: u8, start_register: u16, form: Form) -> bool {
        self.quirks.binary_search(&Quirk { function, start_register, form }).is_ok()
    }

    /// Tells whether any device declares `form` for this function, at whatever register.
    pub fn any(&self, function: u8, form: Form) -> bool {
        self.quirks.iter().any(|quirk| quirk.function == function && quirk.form == form)
    }

    /// Tells whether any device declares that this byte count stands for registers.
    pub fn counts_registers(&self, function: u8, count: u8) -> bool {
        self.register_counts.binary_search(&(function, count)).is_ok()
    }

    /// Tells whether devices answer at this reserved address.
    pub fn is_service_address(&self, address: u8) -> bool {
        self.service_addresses.binary_search(&address).is_ok()
    }
}
