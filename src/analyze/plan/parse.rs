//! Reads a plan, with every problem in it.

use super::{Command, Device, Plan};
use crate::device::Profiles;
use crate::section::{self, Problem, Section, nearest};
use crate::time::{MILLISECOND, SECOND};

/// Devices and commands of one device that a plan may have.
const MOST: usize = 1000;

pub(super) fn plan(text: &str, profiles: &Profiles) -> Result<Plan, Vec<Problem>> {
    section::read(text, |section| {
        let sections = section.sections("device");
        if sections.is_empty() {
            section.problem_with_hint(section.at, "there is no device", "a plan has at least one [[device]]");
        }
        let mut devices: Vec<Device> = Vec::new();
        for section in sections.iter().take(MOST) {
            let Some(device) = device(section, profiles) else { continue };
            if devices.iter().any(|other| other.address == device.address) {
                section.problem(section.place("address"), format!("a second device at {}", device.address));
            }
            devices.push(device);
        }
        section.finish();
        Some(Plan { devices })
    })
}

fn device(section: &Section<'_>, profiles: &Profiles) -> Option<Device> {
    let address = section.required("address", section.integer("address", 0..=255));
    let mut commands: Vec<Command> = Vec::new();
    for section in section.sections("command").iter().take(MOST) {
        let Some(command) = command(section) else { continue };
        if commands.iter().any(|other| other.name == command.name) {
            section.problem(section.place("name"), format!("a second command '{}'", command.name));
        }
        commands.push(command);
    }
    let latency = section.number("latency");
    if let Some(latency) = latency.filter(|latency| !(0.0..=3_600_000.0).contains(&latency.value)) {
        section.problem(latency.at, "'latency' is not within 0 to 3600000 ms");
    }
    let silence = section.number("silence");
    if let Some(silence) = silence.filter(|silence| !(0.0..=1e9).contains(&silence.value)) {
        section.problem(silence.at, "'silence' is not within 0 to 1000000000 s");
    }
    let device = Device {
        address: address.map_or(0, |address| address.value as u8),
        device: profile(section, profiles),
        silence_ns: silence.map(|silence| (silence.value * SECOND as f64).round() as i64),
        latency_ns: latency.map(|latency| (latency.value * MILLISECOND as f64).round() as i64),
        order: order(section, &commands),
        commands,
    };
    section.finish();
    address.map(|_| device)
}

/// Reads which profile a device has.
fn profile(section: &Section<'_>, profiles: &Profiles) -> Option<String> {
    let id = section.string("device")?;
    if profiles.get(id.value).is_none() {
        let hint = match nearest(id.value, profiles.iter().map(|profile| &*profile.id)) {
            Some(near) => format!("did you mean '{near}'?"),
            None => "'rtutap profiles' lists those built in, --profile adds one".to_owned(),
        };
        section.problem_with_hint(id.at, format!("no profile is called '{}'", id.value), hint);
    }
    Some(id.value.to_owned())
}

fn command(section: &Section<'_>) -> Option<Command> {
    let name = section.required("name", section.string("name"));
    let function = section.required("function", section.integer("function", 1..=127));
    let word = |key| section.integer(key, 0..=0xFFFF).map(|number| number.value as u16);
    let command = Command {
        name: name?.value.to_owned(),
        function: function.map_or(0, |function| function.value as u8),
        register: word("register"),
        quantity: word("quantity"),
        every_ns: every(section),
    };
    section.finish();
    function.map(|_| command)
}

fn every(section: &Section<'_>) -> Option<(i64, i64)> {
    let every = section.numbers("every")?;
    match every.value[..] {
        [least, most] if 0.0 <= least && least <= most && most <= 1e9 => {
            let ns = |seconds: f64| (seconds * SECOND as f64).round() as i64;
            Some((ns(least), ns(most)))
        }
        _ => {
            let hint = "such as every = [0.9, 1.1]";
            section.problem_with_hint(
                every.at,
                "'every' is not the least and the most seconds between two",
                hint,
            );
            None
        }
    }
}

fn order(section: &Section<'_>, commands: &[Command]) -> Vec<(String, String)> {
    let names = || commands.iter().map(|command| command.name.as_str());
    let mut order = Vec::new();
    for step in section.strings("order").unwrap_or_default() {
        let Some((from, to)) = step.value.split_once('>').map(|(from, to)| (from.trim(), to.trim())) else {
            section.problem_with_hint(step.at, format!("'{}' is no step", step.value), "write 'this > that'");
            continue;
        };
        for name in [from, to] {
            if !names().any(|known| known == name) {
                let hint = match nearest(name, names()) {
                    Some(near) => format!("did you mean '{near}'?"),
                    None => "name commands of the device".to_owned(),
                };
                section.problem_with_hint(step.at, format!("the device has no command '{name}'"), hint);
            }
        }
        order.push((from.to_owned(), to.to_owned()));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_named_with_its_place_and_mend() {
        for (text, expected) in [
            ("", "1:1: there is no device; a plan has at least one [[device]]"),
            ("[[device]]\nadress = 1", "1:1: 'address' is missing"),
            (
                "[[device]]\naddress = 1\ndevice = 'yosemitech-d0'",
                "3:10: no profile is called 'yosemitech-d0'; did you mean 'yosemitech-do'?",
            ),
            ("[[device]]\naddress = 1\nsilence = -1", "3:11: 'silence' is not within 0 to 1000000000 s"),
            ("[[device]]\naddress = 1\nlatency = -1", "3:11: 'latency' is not within 0 to 3600000 ms"),
            ("[[device]]\naddress = 1\norder = [\"read\"]", "3:10: 'read' is no step; write 'this > that'"),
            ("[[device]]\naddress = 1\norder = [\"a > b\"]", "3:10: the device has no command 'a'"),
            (
                "[[device]]\naddress = 1\n[[device.command]]\nname = 'a'\nfunction = 3\nevery = [2, 1]",
                "6:9: 'every' is not the least and the most seconds between two; such as",
            ),
            ("[[device]]\naddress = 1\n[[device]]\naddress = 1", "4:11: a second device at 1"),
        ] {
            let problems = plan(text, &Profiles::built_in()).expect_err(text);
            assert!(problems[0].to_string().starts_with(expected), "{} for {text}", problems[0]);
        }
    }

    #[test]
    fn a_plan_reads_as_it_was_written() {
        let text = "[[device]]\naddress = 1\ndevice = \"yosemitech-do\"\nlatency = 40\nsilence = 10\n\
                    order = [\n    \"a > a\",\n]\n\n\
                    [[device.command]]\nname = \"a\"\nfunction = 3\nregister = 0x2600\nquantity = 4\nevery = [0.9, 1.25]\n";
        let read = plan(text, &Profiles::built_in()).expect("a plan");
        let written = read.to_string();
        assert_eq!(plan(&written, &Profiles::built_in()), Ok(read));
        let bare =
            |line: &str| line.split(" #").next().filter(|line| !line.starts_with('#')).map(str::to_owned);
        assert_eq!(written.lines().filter_map(bare).collect::<Vec<_>>().join("\n") + "\n", text);
        for what in ["# ms: an answer", "# s: it is asked", "# s between two"] {
            assert!(written.contains(what), "{what} in {written}");
        }
    }
}
