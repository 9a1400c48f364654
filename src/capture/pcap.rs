//! Packet captures, pcapng and pcap: a frame a packet, with the packet's time as its read time.
//!
//! Link type 147 (and the other private ones to 162) is raw RTU frames, 250 is serial data behind the header of
//! an RTAC. The blocks are parsed by pcap-parser; its readers are not used, as they hide what the system says.

use std::io::Read;

use pcap_parser::nom;
use pcap_parser::pcapng::{EnhancedPacketBlock, InterfaceDescriptionBlock, SimplePacketBlock};
use pcap_parser::traits::PcapNGPacketBlock;
use pcap_parser::{Block, LegacyPcapBlock, PcapHeader};

use super::BUS;
use super::instant::{self, OUT_OF_RANGE};
use super::interface_name::{Identity, Names};
use super::mcap::BusSettings;
use super::reader::{Failure, Forward, Malformed, ReadChunks, TimesBack};
use super::rtac;
use super::window::Window;
use crate::decode::chunk::{Chunk, LineError, LineErrorKind, ReadTime};
use crate::line::LineSettings;
use crate::time::{SECOND, Timestamp};

/// How much of a file is held at once: the largest block that can be read, in bytes.
const WINDOW: usize = 1024 * 1024;
/// How many interfaces a section may have: more is a mistake, or malice.
const MOST_INTERFACES: usize = 1000;
/// How many buses the interfaces of all sections may be.
const MOST_BUSES: usize = 1000;
/// The link types that their users give a meaning, USER0 to USER15 (tcpdump.org, link-layer header types).
const USER: std::ops::RangeInclusive<i32> = 147..=162;

const CUT: &str = "the capture was cut off: all packets before were read";
const CHECK: &str = "check the file with 'capinfos' or Wireshark";
const LINK_TYPE: &str = "captures of a serial line have link type 147 (raw RTU frames) or 250 (RTAC serial)";

/// Tells whether an input begins like pcapng or pcap.
pub(super) fn is_pcap(prefix: &[u8]) -> bool {
    let pcapng = prefix.starts_with(&[0x0A, 0x0D, 0x0D, 0x0A])
        && matches!(prefix.get(8..12), Some([0x1A, 0x2B, 0x3C, 0x4D] | [0x4D, 0x3C, 0x2B, 0x1A]));
    let pcap = matches!(
        prefix,
        [0xA1, 0xB2, 0xC3, 0xD4, ..]
            | [0xD4, 0xC3, 0xB2, 0xA1, ..]
            | [0xA1, 0xB2, 0x3C, 0x4D, ..]
            | [0x4D, 0x3C, 0xB2, 0xA1, ..]
            | [0x34, 0xCD, 0xB2, 0xA1, ..]
    );
    pcapng || pcap
}

/// Reads pcapng or pcap, a packet at a time.
pub(super) struct Pcap<R> {
    window: Window<R>,
    format: Format,
    bus: Buses,
    cut: Option<Malformed>,
}

/// Is how the blocks of a file look.
enum Format {
    NotSeen,
    Ng { big_endian: bool },
    Legacy(PcapHeader),
}

impl<R: Read> Pcap<R> {
    pub(super) fn new(source: R) -> Self {
        Pcap { window: Window::new(source, WINDOW), format: Format::NotSeen, bus: Buses::new(), cut: None }
    }

    /// Reads a block; tells whether there was one.
    fn block(&mut self) -> Result<bool, Failure> {
        loop {
            let data = self.window.data();
            if data.is_empty() && self.window.is_at_end() {
                return Ok(false);
            }
            let offset = self.window.offset();
            let malformed = |problem: String, hint| {
                Failure::Malformed(Malformed { place: format!("byte {offset}"), problem, hint })
            };
            match parse(&self.format, data) {
                Ok((rest, item)) => {
                    let length = data.len() - rest.len();
                    match item {
                        Item::Header(header) => self.format = Format::Legacy(header),
                        Item::Block(Block::SectionHeader(section)) => {
                            self.format = Format::Ng { big_endian: section.big_endian() };
                            self.bus.section();
                        }
                        item => self.bus.take(&self.format, &item).map_err(|(problem, hint)| {
                            malformed(format!("packet {}: {problem}", self.bus.packet), hint)
                        })?,
                    }
                    self.window.consume(length);
                    return Ok(true);
                }
                Err(nom::Err::Incomplete(_)) if self.window.is_at_end() => {
                    let place = format!("byte {offset}");
                    let problem = "the file ends within a block".to_owned();
                    let cut = Malformed { place, problem, hint: CUT };
                    // A capture that is cut before its first packet tells nothing.
                    if self.bus.packet == 0 {
                        return Err(Failure::Malformed(cut));
                    }
                    self.cut = Some(cut);
                    return Ok(false);
                }
                Err(nom::Err::Incomplete(_)) if self.window.is_full() => {
                    return Err(malformed("a block of more than a MiB".into(), CHECK));
                }
                Err(nom::Err::Incomplete(_)) => self.window.fill()?,
                Err(_) if matches!(self.format, Format::NotSeen) => {
                    return Err(malformed("neither pcapng nor pcap begins like this".into(), CHECK));
                }
                Err(_) => return Err(malformed("a block that is none".into(), CHECK)),
            }
        }
    }
}

impl<R: Read> ReadChunks for Pcap<R> {
    /// Goes on to the next packet with bytes of the bus.
    fn advance(&mut self) -> Result<bool, Failure> {
        if std::mem::take(&mut self.bus.says_settings) {
            return Ok(true); // the packet they stand before is there
        }
        self.bus.bytes.clear();
        while self.bus.bytes.is_empty() {
            if !self.block()? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn bus(&self) -> &str {
        self.bus.buses.get(self.bus.at).map_or(BUS, |(name, _)| name)
    }

    fn settings(&self) -> Option<&BusSettings> {
        self.bus.settings.as_ref().filter(|_| self.bus.says_settings)
    }

    fn chunk(&self) -> Chunk<'_> {
        Chunk { time: self.bus.time, bytes: &self.bus.bytes, line_errors: &self.bus.errors }
    }

    fn position(&self) -> u64 {
        self.window.position()
    }

    fn is_drained(&self) -> bool {
        self.window.data().is_empty()
    }

    fn times_back(&self) -> Option<TimesBack> {
        TimesBack::of(self.bus.buses.iter().map(|(_, forward)| forward))
    }

    fn cut(&self) -> Option<&Malformed> {
        self.cut.as_ref()
    }
}

/// Is a block of either format.
enum Item<'a> {
    Header(PcapHeader),
    Legacy(LegacyPcapBlock<'a>),
    Block(Block<'a>),
}

type Parsed<'a> = nom::IResult<&'a [u8], Item<'a>, pcap_parser::PcapError<&'a [u8]>>;

fn parse<'a>(format: &Format, data: &'a [u8]) -> Parsed<'a> {
    use pcap_parser::pcap::{parse_pcap_frame, parse_pcap_frame_be, parse_pcap_frame_modified};
    use pcap_parser::pcapng::{parse_block_be, parse_block_le};

    let (rest, item) = match format {
        Format::NotSeen if data.first() == Some(&0x0A) => {
            let (rest, section) = pcap_parser::parse_sectionheaderblock(data)?;
            (rest, Item::Block(Block::SectionHeader(section)))
        }
        Format::NotSeen => {
            let (rest, header) = pcap_parser::parse_pcap_header(data)?;
            (rest, Item::Header(header))
        }
        Format::Ng { big_endian } => {
            let (rest, block) = if *big_endian { parse_block_be(data)? } else { parse_block_le(data)? };
            (rest, Item::Block(block))
        }
        Format::Legacy(header) => {
            let (rest, packet) = if header.is_modified_format() {
                parse_pcap_frame_modified(data)?
            } else if header.is_bigendian() {
                parse_pcap_frame_be(data)?
            } else {
                parse_pcap_frame(data)?
            };
            (rest, Item::Legacy(packet))
        }
    };
    Ok((rest, item))
}

/// Is an interface of a section: how its packets look, and how they count time.
struct Interface {
    /// Which of the buses it is.
    bus: usize,
    /// What it says of its line, until that is told.
    line: Option<LineSettings>,
    link_type: i32,
    /// The longest packet that is kept, in bytes; 0 for any.
    snap_length: u32,
    /// Powers of ten, or with the highest bit of two, in a second (pcapng, `if_tsresol`).
    resolution: u8,
    /// What is added to times, in seconds (pcapng, `if_tsoffset`).
    offset: i64,
    /// What happened before the next byte.
    pending: Vec<LineErrorKind>,
}

type Wrong = (String, &'static str);

/// Gathers packets, each of the bus that its interface is.
struct Buses {
    interfaces: Vec<Interface>,
    names: Names,
    /// Their names, over all sections; times go forward in each.
    buses: Vec<(String, Forward)>,
    /// The bus of the latest packet.
    at: usize,
    /// What its interface says, when that is new.
    settings: Option<BusSettings>,
    says_settings: bool,
    /// Counts packets from 1.
    packet: u64,
    time: ReadTime,
    bytes: Vec<u8>,
    errors: Vec<LineError>,
}

impl Buses {
    fn new() -> Self {
        Buses {
            interfaces: Vec::new(),
            names: Names::default(),
            buses: Vec::new(),
            at: 0,
            settings: None,
            says_settings: false,
            packet: 0,
            time: ReadTime::Unknown,
            bytes: Vec::new(),
            errors: Vec::new(),
        }
    }

    /// Begins a section: interfaces are counted anew.
    fn section(&mut self) {
        self.interfaces.clear();
    }

    fn take(&mut self, format: &Format, item: &Item<'_>) -> Result<(), Wrong> {
        match (format, item) {
            (Format::Legacy(header), Item::Legacy(packet)) => self.legacy(header, packet),
            (Format::Ng { big_endian }, Item::Block(Block::InterfaceDescription(block))) => {
                self.interface(block, *big_endian)
            }
            (_, Item::Block(Block::EnhancedPacket(packet))) => self.enhanced(packet),
            (_, Item::Block(Block::SimplePacket(packet))) => self.simple(packet),
            _ => Ok(()), // names, statistics, comments
        }
    }

    fn interface(&mut self, block: &InterfaceDescriptionBlock<'_>, big_endian: bool) -> Result<(), Wrong> {
        if self.interfaces.len() == MOST_INTERFACES {
            return Err((format!("more than {MOST_INTERFACES} interfaces"), CHECK));
        }
        // pcap-parser reads the offset as little-endian always.
        let offset = block.if_tsoffset().and_then(Result::ok).unwrap_or(0);
        let name = block.if_name().and_then(Result::ok).unwrap_or_default();
        let bus = self.bus(Identity::new(name, self.interfaces.len()))?;
        let line = block.if_description().and_then(Result::ok).and_then(|said| said.parse().ok());
        let interface = Interface {
            bus,
            line,
            pending: Vec::new(),
            link_type: block.linktype.0,
            snap_length: block.snaplen,
            resolution: block.if_tsresol().and_then(Result::ok).unwrap_or(6),
            offset: if big_endian { offset.swap_bytes() } else { offset },
        };
        self.interfaces.push(interface);
        Ok(())
    }

    /// Returns the place of the bus that the next interface is.
    fn bus(&mut self, identity: Identity) -> Result<usize, Wrong> {
        let (place, new) = self.names.bus(identity, self.interfaces.len());
        if let Some(name) = new {
            if self.buses.len() == MOST_BUSES {
                return Err((format!("more than {MOST_BUSES} buses"), CHECK));
            }
            self.buses.push((name, Forward::new("packet")));
        }
        Ok(place)
    }

    /// Returns the time of the packet, or that of the one before on its bus where it goes back.
    fn forward(&mut self, bus: usize, time: Timestamp) -> ReadTime {
        let packet = self.packet;
        let forward = self.buses.get_mut(bus).map(|(_, forward)| forward.forward(time, packet));
        ReadTime::At(forward.unwrap_or(time))
    }

    fn legacy(&mut self, header: &PcapHeader, packet: &LegacyPcapBlock<'_>) -> Result<(), Wrong> {
        self.packet += 1;
        let unit = if header.is_nanosecond_precision() { 1 } else { 1000 };
        let ns = i64::from(packet.ts_sec) * SECOND + i64::from(packet.ts_usec) * unit;
        if self.interfaces.is_empty() {
            // The format knows one interface, without a name. The upper bits say how long a frame check sequence is
            // (tcpdump.org, pcap file format).
            let bus = self.bus(Identity::Named(BUS.to_owned()))?;
            let (link_type, pending) = (header.network.0 & 0xFFFF, Vec::new());
            let (line, snap_length, resolution, offset) = (None, 0, 9, 0);
            self.interfaces.push(Interface {
                bus,
                line,
                link_type,
                snap_length,
                resolution,
                offset,
                pending,
            });
        }
        let time = self.forward(self.interfaces[0].bus, Timestamp::from_ns(ns));
        let captured = packet.data.get(..packet.caplen as usize).unwrap_or(packet.data);
        self.packet(time, 0, captured, packet.origlen)
    }

    fn enhanced(&mut self, packet: &EnhancedPacketBlock<'_>) -> Result<(), Wrong> {
        self.packet += 1;
        let interface = self.interface_of(packet.if_id)?;
        let bus = interface.bus;
        let units = u64::from(packet.ts_high) << 32 | u64::from(packet.ts_low);
        let time = time(units, interface).ok_or((OUT_OF_RANGE.to_owned(), CHECK))?;
        let time = self.forward(bus, time);
        self.packet(time, packet.if_id as usize, packet.packet_data(), packet.origlen)
    }

    fn simple(&mut self, packet: &SimplePacketBlock<'_>) -> Result<(), Wrong> {
        self.packet += 1;
        let interface = self.interface_of(0)?;
        let most = if interface.snap_length == 0 { u32::MAX } else { interface.snap_length };
        let data = packet.packet_data();
        let data = data.get(..most as usize).unwrap_or(data);
        self.packet(ReadTime::UnknownAfterSilence, 0, data, packet.origlen)
    }

    /// Returns the interface of a packet.
    fn interface_of(&self, id: u32) -> Result<&Interface, Wrong> {
        let interface = self.interfaces.get(id as usize);
        interface.ok_or_else(|| (format!("it is of interface {id}, which is not described before"), CHECK))
    }

    /// Takes the bytes of a packet, of which the capture holds `data`.
    fn packet(&mut self, time: ReadTime, interface: usize, data: &[u8], length: u32) -> Result<(), Wrong> {
        let interface = &mut self.interfaces[interface]; // it was looked up before
        let bytes = match interface.link_type {
            rtac::LINK_TYPE => {
                let Some((event, bytes)) = rtac::split(data) else {
                    let problem = format!("{} bytes hold no RTAC header, which has 12", data.len());
                    return Err((problem, CHECK));
                };
                if let Some(kind) = rtac::line_error(event) {
                    note(&mut interface.pending, kind);
                }
                bytes
            }
            link_type if USER.contains(&link_type) => data,
            other => return Err((format!("link type {other} is no serial line"), LINK_TYPE)),
        };
        if !bytes.is_empty() {
            self.time = time;
            self.bytes.extend_from_slice(bytes);
            self.errors.clear();
            self.errors.extend(interface.pending.drain(..).map(|kind| LineError { offset: 0, kind }));
            self.at = interface.bus;
            if let Some(line) = interface.line.take() {
                let name = self.buses.get(self.at).map_or_else(String::new, |(name, _)| name.clone());
                self.settings = Some(BusSettings { name, line, ..BusSettings::default() });
                self.says_settings = true;
            }
        }
        if data.len() < length as usize {
            note(&mut interface.pending, LineErrorKind::Overrun);
        }
        Ok(())
    }
}

/// Notes an error before the next byte, once.
fn note(pending: &mut Vec<LineErrorKind>, kind: LineErrorKind) {
    if !pending.contains(&kind) {
        pending.push(kind);
    }
}

/// Converts a time of an interface, exact but for what is finer than a nanosecond.
fn time(units: u64, interface: &Interface) -> Option<Timestamp> {
    let exponent = u32::from(interface.resolution & 0x7F);
    let base: u128 = if interface.resolution & 0x80 == 0 { 10 } else { 2 };
    // What a power of ten beyond 128 bits divides is less than a nanosecond.
    let per_second = base.checked_pow(exponent).unwrap_or(u128::MAX);
    let ns = u128::from(units) * SECOND as u128 / per_second;
    instant::from_ns(i128::try_from(ns).ok()? + i128::from(interface.offset) * i128::from(SECOND))
}

#[cfg(test)]
#[path = "pcap_tests.rs"]
mod tests;
