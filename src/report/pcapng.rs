//! pcapng for Wireshark: a packet a frame or damaged run, an interface a bus.
//!
//! Blocks are those of draft-ietf-opsawg-pcapng, little-endian. As RTAC serial (link type 250), each packet
//! begins with a header of twelve bytes, big-endian: seconds, microseconds, event, control lines, footer
//! (Wireshark's `packet-rtacser.c`). Events without bytes say what the UART complained about and what was lost.
//! A packet's time is when its last byte had been received, as in hex text; the header has that of its first.

use super::Format;
use crate::decode::chunk::{LineError, LineErrorKind};
use crate::decode::frame::{Place, Reason, Role};
use crate::line::{LineSettings, Parity};
use crate::pipeline::Event;
use crate::time::{SECOND, Timestamp};

/// Names the link types that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinkType {
    /// `LINKTYPE_RTAC_SERIAL`, 250: a header before each frame says who sent it.
    RtacSerial,
    /// `LINKTYPE_USER0`, 147: the frames alone; what they are is for Wireshark's `DLT_USER` preferences.
    User0,
}

impl LinkType {
    fn number(self) -> u16 {
        match self {
            LinkType::RtacSerial => 250,
            LinkType::User0 => 147,
        }
    }
}

/// Events of `packet-rtacser.c`: TX is the master here, RX a device.
mod event {
    pub(super) const DATA_TX_START: u8 = 0x01;
    pub(super) const DATA_RX_START: u8 = 0x02;
    pub(super) const CAPTURE_DATA_LOST: u8 = 0x05;
    pub(super) const FRAMING_ERROR: u8 = 0x07;
    pub(super) const PARITY_ERROR: u8 = 0x08;
    pub(super) const SERIAL_BREAK_EVENT: u8 = 0x09;
    pub(super) const SERIAL_OVERFLOW_EVENT: u8 = 0x0A;
}

/// Bits of `epb_flags` (draft, 4.3.1).
mod flag {
    pub(super) const INBOUND: u32 = 1;
    pub(super) const OUTBOUND: u32 = 2;
    pub(super) const CRC_ERROR: u32 = 1 << 24;
    pub(super) const TOO_SHORT: u32 = 1 << 26;
}

const SECTION_HEADER: u32 = 0x0A0D_0D0A;
const INTERFACE_DESCRIPTION: u32 = 1;
const SIMPLE_PACKET: u32 = 3;
const ENHANCED_PACKET: u32 = 6;

const OPT_COMMENT: u16 = 1;
const SHB_USERAPPL: u16 = 4;
const IF_NAME: u16 = 2;
const IF_DESCRIPTION: u16 = 3;
const IF_SPEED: u16 = 8;
const IF_TSRESOL: u16 = 9;
const EPB_FLAGS: u16 = 2;

/// Writes a pcapng.
#[derive(Debug)]
pub struct Pcapng {
    link_type: LinkType,
    remark: Option<String>,
    interfaces: Vec<(String, LineSettings)>,
}

impl Pcapng {
    /// Makes a writer; `remark` becomes the comment of the file.
    pub fn new(link_type: LinkType, remark: Option<String>) -> Self {
        Pcapng { link_type, remark, interfaces: Vec::new() }
    }

    /// Returns the number of a bus's interface: its latest.
    fn interface(&self, bus: &str) -> usize {
        self.interfaces.iter().rposition(|(name, _)| name == bus).unwrap_or(0)
    }

    fn packet(&self, bus: &str, packet: &Packet<'_>, out: &mut Vec<u8>) {
        let interface = self.interface(bus);
        let mut data = Vec::with_capacity(12 + packet.bytes.len());
        if self.link_type == LinkType::RtacSerial {
            rtac_header(packet, &mut data);
        } else if packet.bytes.is_empty() {
            return; // an event, for which this link type has no place
        }
        data.extend_from_slice(packet.bytes);
        let length = data.len() as u32; // frames and runs are at most what the framer holds
        // A simple packet has no time; it belongs to the first interface.
        if packet.time.is_none() && interface == 0 {
            return block(SIMPLE_PACKET, out, |out| {
                word(length, out);
                padded(&data, out);
            });
        }
        block(ENHANCED_PACKET, out, |out| {
            word(interface as u32, out);
            let ns = u64::try_from(packet.time.unwrap_or_default().as_ns()).unwrap_or(0);
            word((ns >> 32) as u32, out);
            word(ns as u32, out);
            word(length, out);
            word(length, out);
            padded(&data, out);
            option(EPB_FLAGS, &packet.flags.to_le_bytes(), out);
            if let Some(comment) = &packet.comment {
                option(OPT_COMMENT, comment.as_bytes(), out);
            }
            option(0, &[], out);
        });
    }

    /// Writes what the UART complained about in a frame or run, before it.
    fn line_errors(&self, bus: &str, place: &Place<'_>, out: &mut Vec<u8>) {
        let parity = self.interfaces.get(self.interface(bus)).map(|(_, line)| line.parity);
        for LineError { offset, kind } in place.line_errors {
            let event = match kind {
                LineErrorKind::ParityOrFraming if parity == Some(Parity::None) => event::FRAMING_ERROR,
                LineErrorKind::ParityOrFraming => event::PARITY_ERROR,
                LineErrorKind::Break => event::SERIAL_BREAK_EVENT,
                LineErrorKind::Overrun => event::SERIAL_OVERFLOW_EVENT,
            };
            let comment = Some(format!("{} at byte {offset} of the next packet", kind.name()));
            let time = place.time.map(|time| time.end.midpoint());
            self.packet(bus, &Packet { time, start: time, event, bytes: &[], flags: 0, comment }, out);
        }
    }
}

/// Is what becomes a packet: bytes, or an event without any.
struct Packet<'a> {
    time: Option<Timestamp>,
    /// When it began, where that is another time.
    start: Option<Timestamp>,
    event: u8,
    bytes: &'a [u8],
    flags: u32,
    comment: Option<String>,
}

impl Format for Pcapng {
    fn heading(&mut self, out: &mut Vec<u8>) {
        block(SECTION_HEADER, out, |out| {
            word(0x1A2B_3C4D, out); // byte order
            word(1, out); // version 1.0
            out.extend_from_slice(&u64::MAX.to_le_bytes()); // the section's length is not told
            option(SHB_USERAPPL, concat!("rtutap ", env!("CARGO_PKG_VERSION")).as_bytes(), out);
            if let Some(remark) = &self.remark {
                option(OPT_COMMENT, remark.as_bytes(), out);
            }
            option(0, &[], out);
        });
    }

    fn begin(&mut self, bus: &str, line: LineSettings, out: &mut Vec<u8>) {
        if self.interfaces.get(self.interface(bus)).is_some_and(|it| it.0 == bus && it.1 == line) {
            return;
        }
        self.interfaces.push((bus.to_owned(), line));
        block(INTERFACE_DESCRIPTION, out, |out| {
            word(self.link_type.number().into(), out);
            word(0, out); // packets have any length
            option(IF_NAME, bus.as_bytes(), out);
            option(IF_DESCRIPTION, line.to_string().as_bytes(), out);
            option(IF_SPEED, &u64::from(line.baud).to_le_bytes(), out);
            option(IF_TSRESOL, &[9], out); // nanoseconds
            option(0, &[], out);
        });
    }

    fn row(&mut self, bus: &str, event: &Event<'_>, out: &mut Vec<u8>) {
        let packet = match event {
            Event::Frame(frame) => {
                let comment = frame.echo.then(|| "echo of the adapter".to_owned());
                sent(frame.role, 0, comment, &frame.place)
            }
            Event::Damaged(damaged) => {
                let flags = match damaged.reason {
                    Reason::Crc => flag::CRC_ERROR,
                    Reason::Truncated | Reason::Stray => flag::TOO_SHORT,
                    Reason::Noise => 0,
                };
                let comment = Some(format!("damaged: {}", damaged.reason.name()));
                sent(damaged.role, flags, comment, &damaged.place)
            }
            Event::Lost(lost) => {
                let comment = Some(format!("{} lost: {}", super::words::bytes(lost.count), lost.kind.name()));
                let event = event::CAPTURE_DATA_LOST;
                Packet { time: lost.time, start: lost.time, event, bytes: &[], flags: 0, comment }
            }
            _ => return,
        };
        match event {
            Event::Frame(frame) => self.line_errors(bus, &frame.place, out),
            Event::Damaged(damaged) => self.line_errors(bus, &damaged.place, out),
            _ => {}
        }
        self.packet(bus, &packet, out);
    }
}

/// Makes the packet of bytes that a master or a device sent; of whom it is not known, a device.
fn sent<'a>(role: Role, flags: u32, comment: Option<String>, place: &Place<'a>) -> Packet<'a> {
    let (event, direction) = match role {
        Role::Request => (event::DATA_TX_START, flag::OUTBOUND),
        Role::Response => (event::DATA_RX_START, flag::INBOUND),
        Role::Unknown => (event::DATA_RX_START, 0),
    };
    let time = place.time.map(|time| time.end.midpoint());
    let start = place.time.map(|time| time.start.midpoint());
    Packet { time, start, event, bytes: place.bytes, flags: flags | direction, comment }
}

fn rtac_header(packet: &Packet<'_>, out: &mut Vec<u8>) {
    let ns = packet.start.unwrap_or_default().as_ns().max(0);
    let seconds = u32::try_from(ns / SECOND).unwrap_or(u32::MAX);
    let microseconds = (ns % SECOND / 1000) as u32; // below a million
    out.extend_from_slice(&seconds.to_be_bytes());
    out.extend_from_slice(&microseconds.to_be_bytes());
    // Control lines are not known, and the footer means nothing.
    out.extend_from_slice(&[packet.event, 0, 0, 0]);
}

fn word(value: u32, out: &mut Vec<u8>) {
    out.extend_from_slice(&value.to_le_bytes());
}

/// Writes bytes, and zeros up to a multiple of four.
fn padded(bytes: &[u8], out: &mut Vec<u8>) {
    out.extend_from_slice(bytes);
    out.resize(out.len() + bytes.len().wrapping_neg() % 4, 0);
}

/// Writes an option; what is longer than its length can say is cut.
fn option(code: u16, value: &[u8], out: &mut Vec<u8>) {
    let value = value.get(..usize::from(u16::MAX)).unwrap_or(value);
    out.extend_from_slice(&code.to_le_bytes());
    out.extend_from_slice(&(value.len() as u16).to_le_bytes()); // cut to fit
    padded(value, out);
}

/// Writes a block around its body, with its length before and after.
fn block(kind: u32, out: &mut Vec<u8>, body: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len();
    word(kind, out);
    word(0, out);
    body(out);
    let length = (out.len() - start + 4) as u32; // packets are at most what the framer holds
    word(length, out);
    if let Some(place) = out.get_mut(start + 4..start + 8) {
        place.copy_from_slice(&length.to_le_bytes());
    }
}
