//! What neither serialport nor rustix has: the counters of an adapter, and its low-latency flag.
#![expect(unsafe_code, reason = "ioctl numbers and their structures agree by argument, not by type")]

use std::mem;
use std::os::fd::{AsRawFd, BorrowedFd};

use rustix::io::Result;
use rustix::ioctl::{Getter, Opcode, Setter, ioctl};
use serialport::TTYPort;

const GET_COUNTS: Opcode = libc::TIOCGICOUNT as Opcode;
const GET_SERIAL: Opcode = libc::TIOCGSERIAL as Opcode;
const SET_SERIAL: Opcode = libc::TIOCSSERIAL as Opcode;
/// Bit 13 of `flags` (include/uapi/linux/tty_flags.h).
const ASYNC_LOW_LATENCY: i32 = 1 << 13;

/// Mirrors `struct serial_icounter_struct` of include/uapi/linux/serial.h; the kernel's counts wrap.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    cts: i32,
    dsr: i32,
    rng: i32,
    dcd: i32,
    pub(super) rx: i32,
    tx: i32,
    pub(super) frame: i32,
    pub(super) overrun: i32,
    pub(super) parity: i32,
    pub(super) brk: i32,
    pub(super) buf_overrun: i32,
    reserved: [i32; 9],
}

/// Mirrors `struct serial_struct` of include/uapi/linux/serial.h.
#[repr(C)]
#[derive(Clone, Copy)]
struct SerialStruct {
    kind: i32,
    line: i32,
    port: u32,
    irq: i32,
    flags: i32,
    xmit_fifo_size: i32,
    custom_divisor: i32,
    baud_base: i32,
    close_delay: u16,
    io_type: i8,
    reserved_char: i8,
    hub6: i32,
    closing_wait: u16,
    closing_wait2: u16,
    iomem_base: usize,
    iomem_reg_shift: u16,
    port_high: u32,
    iomap_base: usize,
}

const _: () = assert!(mem::size_of::<Counts>() == 80);
#[cfg(target_pointer_width = "64")]
const _: () = assert!(mem::size_of::<SerialStruct>() == 72);

/// Borrows the descriptor of a port.
pub(super) fn descriptor(port: &TTYPort) -> BorrowedFd<'_> {
    // SAFETY: the port owns the descriptor and keeps it open until it is dropped, which the borrow outlives not.
    unsafe { BorrowedFd::borrow_raw(port.as_raw_fd()) }
}

/// Returns what the driver has counted.
///
/// # Errors
/// `ENOTTY` where the driver does not count, as on ptys and of CH340 adapters.
pub(super) fn counts(port: BorrowedFd<'_>) -> Result<Counts> {
    // SAFETY: TIOCGICOUNT fills a `serial_icounter_struct` and nothing beyond; `Counts` mirrors it, its size is
    // checked above, and any bits are a value of it.
    unsafe { ioctl(port, Getter::<GET_COUNTS, Counts>::new()) }
}

/// Asks the driver to hand bytes over soon; of those for USB only ftdi_sio acts on it, with a latency timer of 1 ms.
///
/// # Errors
/// `ENOTTY` where there is no such flag, `EPERM` where it may not be set.
pub(super) fn ask_for_low_latency(port: BorrowedFd<'_>) -> Result<()> {
    // SAFETY: TIOCGSERIAL fills a `serial_struct` and nothing beyond; `SerialStruct` mirrors it, its size is checked
    // above, and any bits are a value of it.
    let mut serial = unsafe { ioctl(port, Getter::<GET_SERIAL, SerialStruct>::new())? };
    if serial.flags & ASYNC_LOW_LATENCY != 0 {
        return Ok(());
    }
    serial.flags |= ASYNC_LOW_LATENCY;
    // SAFETY: TIOCSSERIAL only reads a `serial_struct`; this is the driver's own but for one flag.
    unsafe { ioctl(port, Setter::<SET_SERIAL, SerialStruct>::new(serial)) }
}
