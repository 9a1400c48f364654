//! A draft as text: TOML, with the evidence of each guess as a comment above it.

use std::fmt::{self, Write};
use std::ops::Range;

use crate::decode::shape::Form;
use crate::device::{Encoding, FORM_NAMES, Order, Value};

use super::guess::{Candidate, Ground, plausible_floats};
use super::layout::{Block, Orders};
use super::traffic::{Samples, Traffic};
use super::{Draft, Unit};

/// Guesses with fewer bits than this are called weak: bytes may look so by chance.
const WEAK_BITS: f64 = 6.0;

/// Profiles that fit which are worth a list.
const FEW_CANDIDATES: usize = 6;

/// Characters of a text from which on it may be a serial number.
const LEAST_SERIAL_NUMBER: usize = 8;

/// Is a command with the guesses at its data.
struct Drafted<'a> {
    function: u8,
    register: u16,
    traffic: &'a Traffic,
    quantities: Vec<u16>,
    /// The data that a read brings or a write carries; `None` when there is none.
    block: Option<Block<'a>>,
}

impl<'a> Drafted<'a> {
    fn new((&(function, register), traffic): (&(u8, u16), &'a Traffic), unit: &'a Unit) -> Self {
        let quantities: Vec<u16> = traffic.describable(function).collect();
        let bytes = 2 * usize::from(quantities.last().copied().unwrap_or(0));
        let mut samples = cut(if is_read(function) { &traffic.response } else { &traffic.request }, bytes);
        if !is_read(function) && !samples.is_empty() {
            // What is written to a register has the type of what is read there.
            let reads = [3, 4].iter().filter_map(|&read| unit.commands.get(&(read, register)));
            let length = samples.iter().map(|data| data.len()).max();
            let alike = reads.flat_map(|read| cut(&read.response, bytes));
            samples.extend(alike.filter(|data| Some(data.len()) == length));
        }
        let block = Some(samples).filter(|samples| !samples.is_empty()).map(Block::new);
        Drafted { function, register, traffic, quantities, block }
    }
}

fn is_read(function: u8) -> bool {
    matches!(function, 3 | 4)
}

/// Returns samples as far as the registers asked for reach.
fn cut(samples: &Samples, bytes: usize) -> Vec<&[u8]> {
    let cut = samples.iter().map(|data| data.get(..bytes).unwrap_or(data));
    cut.filter(|data| !data.is_empty()).collect()
}

/// Writes the profile of a device.
pub(super) fn write(address: u8, unit: &Unit, commands: &[(&(u8, u16), &Traffic)], is_full: bool) -> Draft {
    let drafted: Vec<_> = commands.iter().map(|&command| Drafted::new(command, unit)).collect();
    let blocks: Vec<_> = drafted.iter().filter_map(|it| it.block.as_ref()).collect();
    let orders = Orders::of(&blocks);
    let id = format!("unknown-{address}");
    let mut toml = String::new();
    // Writing to a string cannot fail.
    let _ = write_head(&mut toml, address, unit, is_full);
    let _ = drafted.iter().try_for_each(|command| write_command(&mut toml, command, orders));
    let _ = write_rest(&mut toml, unit);
    Draft { address, id, toml }
}

fn write_head(out: &mut String, address: u8, unit: &Unit, is_full: bool) -> fmt::Result {
    let requests =
        if unit.accepted == 1 { "1 request".to_owned() } else { format!("{} requests", unit.accepted) };
    writeln!(out, "# Drafted by rtutap from {requests} that address {address} accepted.")?;
    out.write_str(
        "# Functions, registers and quantities are what was seen. Types are guesses, each with its evidence above it;\n\
         # offsets count from the data's first byte. What is raw gave nothing to guess from. Names, units and meanings\n\
         # are for you to fill in, from a manual, a display or a second measurement.\n",
    )?;
    if let Some(device) = &unit.device {
        writeln!(out, "# It is known as {device}; this draft makes no use of that.")?;
    }
    match unit.candidates.len() {
        0 => {}
        1..=FEW_CANDIDATES => {
            writeln!(
                out,
                "# It answers as these do, so try --device first: {}.",
                unit.candidates.join(", ")
            )?;
        }
        many => writeln!(out, "# What it answers does not tell it from {many} of the known profiles.")?,
    }
    if is_full {
        writeln!(out, "# There were more commands on the bus than are kept: some may be missing.")?;
    }
    writeln!(out, "\nid = \"unknown-{address}\"\nname = \"unknown device at address {address}\"")?;
    writeln!(out, "source = \"capture\"\nconfidence = \"low\"")
}

fn write_command(out: &mut String, command: &Drafted<'_>, orders: Orders) -> fmt::Result {
    let Drafted { function, register, traffic, quantities, block } = command;
    writeln!(out, "\n[[command]]")?;
    write!(out, "# asked {}, accepted {}", times(traffic.asked), times(traffic.accepted))?;
    if let Some(seconds) = traffic.interval_s() {
        write!(out, ", every {seconds:.1} s on average")?;
    }
    if traffic.refused > 0 {
        write!(out, ", refused {}", times(traffic.refused))?;
    }
    let kind = match function {
        3 => "read",
        4 => "read-input",
        6 => "write-single",
        _ => "write",
    };
    let kind = if quantities == &[0] { "command" } else { kind };
    let list: Vec<_> = quantities.iter().map(u16::to_string).collect();
    writeln!(
        out,
        "\nname = \"{kind}-{register:04x}{}\"",
        if kind == "command" { suffix(*function) } else { "" }
    )?;
    writeln!(out, "function = {function}\nregister = 0x{register:04X}\nquantities = [{}]", list.join(", "))?;
    let declared = |form: &Form| *form != Form::ZeroQuantity || quantities.contains(&0);
    let quirks: Vec<_> = traffic.forms.iter().filter(|form| declared(form)).filter_map(quirk).collect();
    if !quirks.is_empty() {
        writeln!(out, "quirks = [{}]", quirks.join(", "))?;
    }
    match block {
        Some(block) => write_data(out, command, block, orders),
        None => Ok(()),
    }
}

/// Tells apart what reads and what writes nothing at one register.
fn suffix(function: u8) -> &'static str {
    match function {
        3 => "",
        4 => "-input",
        _ => "-write",
    }
}

fn times(count: u64) -> String {
    if count == 1 { "once".to_owned() } else { format!("{count} times") }
}

fn quirk(form: &Form) -> Option<String> {
    FORM_NAMES.iter().find(|(_, known)| known == form).map(|(name, _)| format!("\"{name}\""))
}

fn write_data(out: &mut String, command: &Drafted<'_>, block: &Block<'_>, orders: Orders) -> fmt::Result {
    let fields = block.fields(orders);
    let side = if is_read(command.function) { "response" } else { "request" };
    if fields.is_empty() {
        return write_raw(out, "", block, 0..block.length);
    }
    writeln!(out, "{side} = [")?;
    let mut end = 0;
    let mut has_serial_number = false;
    for field in &fields {
        write_raw(out, "    ", block, end..field.offset)?;
        end = field.end();
        write_evidence(out, block, field)?;
        let is_serial_number = !has_serial_number && looks_like_serial_number(field);
        has_serial_number |= is_serial_number;
        write_field(out, command, field, is_serial_number)?;
    }
    write_raw(out, "    ", block, end..block.length)?;
    writeln!(out, "]")
}

fn write_field(
    out: &mut String,
    command: &Drafted<'_>,
    field: &Candidate,
    is_serial_number: bool,
) -> fmt::Result {
    let Candidate { offset, encoding, ground, .. } = field;
    let register = command.register.wrapping_add((offset / 2) as u16); // an offset is at most 250
    let kind = match ground {
        Ground::Text { .. } => "text",
        Ground::Clock { .. } => "time",
        Ground::Version => "version",
        Ground::Numbers { .. } | Ground::Company => "value",
    };
    let name = if is_serial_number { "serial_number".to_owned() } else { format!("{kind}_{register:04x}") };
    write!(out, "    {{ name = \"{name}\", offset = {offset}, type = \"{encoding}\"")?;
    if let Encoding::Ascii { length } = encoding {
        write!(out, ", length = {length}")?;
    }
    let changes = matches!(ground, Ground::Numbers { series, .. } if series.distinct > 1);
    let quantity = if changes && is_read(command.function) { ", quantity = true" } else { "" };
    writeln!(out, "{quantity} }},")
}

fn looks_like_serial_number(field: &Candidate) -> bool {
    let Ground::Text { example, is_constant: true } = &field.ground else { return false };
    let digits = example.chars().filter(char::is_ascii_digit).count();
    example.len() >= LEAST_SERIAL_NUMBER && digits >= 4 && example.chars().all(|c| c.is_ascii_alphanumeric())
}

/// Says why bytes between fields are left raw.
fn write_raw(out: &mut String, indent: &str, block: &Block<'_>, span: Range<usize>) -> fmt::Result {
    if span.is_empty() {
        return Ok(());
    }
    let mut values: Vec<&[u8]> = block.samples.iter().filter_map(|data| data.get(span.clone())).collect();
    let count = values.len();
    values.sort_unstable();
    values.dedup();
    let place = match span.len() {
        1 => format!("data {}", span.start),
        _ => format!("data {}-{}", span.start, span.end.saturating_sub(1)),
    };
    write!(out, "{indent}# {place}, raw: ")?;
    match &values[..] {
        [] => writeln!(out, "seen in part only"),
        [only] => {
            let bytes: Vec<_> = only.iter().map(|byte| format!("{byte:02x}")).collect();
            writeln!(out, "always {} ({})", bytes.join(" "), samples(count))
        }
        several => {
            writeln!(out, "{} different values in {}, no type stands out", several.len(), samples(count))
        }
    }
}

fn samples(count: usize) -> String {
    if count == 1 { "1 sample".to_owned() } else { format!("{count} samples") }
}

fn write_evidence(out: &mut String, block: &Block<'_>, field: &Candidate) -> fmt::Result {
    let weak = if field.bits < WEAK_BITS { "weak: " } else { "" };
    match &field.ground {
        Ground::Numbers { series, plausible, short } => {
            write!(out, "    # {weak}{}, ", samples(series.count))?;
            let [low, high] = [series.low, series.high].map(|value| number(value, field.encoding));
            match series.distinct {
                1 => write!(out, "always {low}")?,
                distinct => write!(out, "{distinct} different from {low} to {high}")?,
            }
            if series.is_smooth() {
                write!(out, ", changing slowly")?;
            }
            if series.grows && series.distinct > 3 {
                write!(out, ", only growing")?;
            }
            if *short > 0.5 {
                write!(out, ", in round decimals")?;
            }
            if let Encoding::Float32(order) = field.encoding {
                let all =
                    if *plausible < 1.0 { format!("{:.0} %", plausible * 100.0) } else { "all".to_owned() };
                writeln!(out, "; {all} plausible as float")?;
                return write_alternatives(out, block, field.offset, order);
            }
            writeln!(out)
        }
        Ground::Text { example, is_constant } => {
            let always = if *is_constant { "always" } else { "readable, such as" };
            writeln!(out, "    # {always} '{example}' ({})", samples(block.samples.len()))
        }
        Ground::Clock { first, last } => {
            writeln!(
                out,
                "    # a date as binary coded decimals in {}: {first} to {last}",
                samples(block.samples.len())
            )
        }
        Ground::Version => {
            writeln!(out, "    # {weak}small bytes that never change, and nothing else beside")
        }
        Ground::Company => writeln!(out, "    # weak: always 0, beside floats"),
    }
}

/// Says what the float would be in other orders of its bytes.
fn write_alternatives(out: &mut String, block: &Block<'_>, offset: usize, chosen: Order) -> fmt::Result {
    let other = |order: &Order| {
        let (plausible, example) = plausible_floats(&block.samples, offset, *order)?;
        let share = (plausible * 100.0).round();
        Some(format!("{} {share:.0} %, such as {example}", Encoding::Float32(*order)))
    };
    let others: Vec<_> = Order::ALL.iter().filter(|order| **order != chosen).filter_map(other).collect();
    writeln!(out, "    # plausible in another order: {}", others.join("; "))
}

/// Writes a number as its type has it.
fn number(value: f64, encoding: Encoding) -> Value<'static> {
    match encoding {
        Encoding::Float32(_) => Value::Float32(value as f32), // it was one
        _ => Value::Float64(value),
    }
}

/// Lists what is no command: what was never accepted, and what no profile can describe.
fn write_rest(out: &mut String, unit: &Unit) -> fmt::Result {
    let rest = unit
        .commands
        .iter()
        .filter(|((function, _), traffic)| traffic.describable(*function).next().is_none());
    for (at, ((function, register), traffic)) in rest.enumerate() {
        if at == 0 {
            writeln!(out, "\n# Not drafted:")?;
        }
        write!(out, "# function {function} at 0x{register:04X}, asked {}, ", times(traffic.asked))?;
        match (traffic.accepted, traffic.refused) {
            (0, 0) => writeln!(out, "never answered")?,
            (0, refused) => writeln!(out, "refused {}", times(refused))?,
            (accepted, _) => writeln!(out, "accepted {}: no profile can describe it", times(accepted))?,
        }
    }
    Ok(())
}
