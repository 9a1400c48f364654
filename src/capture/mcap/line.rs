//! Line settings as messages and metadata have them.

use std::collections::BTreeMap;

use super::schema::Line;
use crate::line::{LineSettings, Parity, StopBits};
use crate::time::MILLISECOND;

/// Says how a bus is set and connected.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BusSettings {
    /// What the bus is called; part of its topics, so without '/'.
    pub name: String,
    /// Speed and character format.
    pub line: LineSettings,
    /// The longest time the adapter keeps a byte back, in nanoseconds; `None` when not known.
    pub adapter_hold_ns: Option<i64>,
    /// Facts for people, such as `source`, `usb_vid_pid`, `usb_serial` and `latency_timer_ms`.
    pub facts: BTreeMap<String, String>,
}

/// What the metadata record of a bus is called.
pub(super) const LINE_METADATA: &str = "rtutap.line";

fn parity_name(parity: Parity) -> &'static str {
    match parity {
        Parity::None => "none",
        Parity::Even => "even",
        Parity::Odd => "odd",
        Parity::Mark => "mark",
        Parity::Space => "space",
    }
}

fn stop_bits_name(stop_bits: StopBits) -> &'static str {
    match stop_bits {
        StopBits::One => "1",
        StopBits::OneAndHalf => "1.5",
        StopBits::Two => "2",
    }
}

fn hold_ms(hold_ns: Option<i64>) -> Option<f64> {
    hold_ns.map(|ns| ns as f64 / MILLISECOND as f64)
}

fn hold_ns(hold_ms: Option<f64>) -> Option<i64> {
    // An hour is far more than any adapter keeps a byte back.
    let plausible = hold_ms.filter(|ms| (0.0..=3_600_000.0).contains(ms));
    plausible.map(|ms| (ms * MILLISECOND as f64).round() as i64)
}

impl BusSettings {
    /// Returns the settings as a message.
    pub(super) fn message(&self) -> Line {
        Line {
            baud: self.line.baud,
            data_bits: self.line.data_bits.into(),
            parity: parity_name(self.line.parity).to_owned(),
            stop_bits: stop_bits_name(self.line.stop_bits).to_owned(),
            adapter_hold_ms: hold_ms(self.adapter_hold_ns),
        }
    }

    /// Returns the settings as metadata.
    pub(super) fn metadata(&self) -> BTreeMap<String, String> {
        let mut map = self.facts.clone();
        let line = self.message();
        let mut put = |key: &str, value: String| map.insert(key.to_owned(), value);
        put("bus", self.name.clone());
        put("baud", line.baud.to_string());
        put("data_bits", line.data_bits.to_string());
        put("parity", line.parity);
        put("stop_bits", line.stop_bits);
        if let Some(ms) = line.adapter_hold_ms {
            put("adapter_hold_ms", ms.to_string());
        }
        map
    }

    /// Reads the settings of a bus from a message; `None` when they are none.
    pub(super) fn from_message(name: &str, line: &Line) -> Option<Self> {
        let parity = match &*line.parity {
            "none" => 'N',
            "even" => 'E',
            "odd" => 'O',
            "mark" => 'M',
            "space" => 'S',
            _ => return None,
        };
        let settings = format!("{}-{}{parity}{}", line.baud, line.data_bits, line.stop_bits);
        Some(BusSettings {
            name: name.to_owned(),
            line: settings.parse().ok()?,
            adapter_hold_ns: hold_ns(line.adapter_hold_ms),
            facts: BTreeMap::new(),
        })
    }

    /// Reads the settings from metadata; `None` when they are none.
    pub(super) fn from_metadata(map: &BTreeMap<String, String>) -> Option<Self> {
        let line = Line {
            baud: map.get("baud")?.parse().ok()?,
            data_bits: map.get("data_bits")?.parse().ok()?,
            parity: map.get("parity")?.clone(),
            stop_bits: map.get("stop_bits")?.clone(),
            adapter_hold_ms: map.get("adapter_hold_ms").and_then(|ms| ms.parse().ok()),
        };
        let mut settings = BusSettings::from_message(map.get("bus")?, &line)?;
        let own = ["bus", "baud", "data_bits", "parity", "stop_bits", "adapter_hold_ms"];
        settings.facts = map.clone();
        settings.facts.retain(|key, _| !own.contains(&&**key));
        Some(settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_as_message_and_as_metadata() {
        for (line, hold) in [("9600-8N1", None), ("300-5M1.5", Some(0)), ("115200-8S2", Some(17_000_001))] {
            let settings = BusSettings {
                name: "pump".into(),
                line: line.parse().expect("a line setting"),
                adapter_hold_ns: hold,
                facts: BTreeMap::new(),
            };
            assert_eq!(BusSettings::from_message("pump", &settings.message()), Some(settings.clone()));
            assert_eq!(BusSettings::from_metadata(&settings.metadata()), Some(settings));
        }
    }

    #[test]
    fn settings_that_are_none_are_refused() {
        for (baud, data_bits, parity, stop) in
            [(0, 8, "none", "1"), (9600, 9, "none", "1"), (9600, 8, "", "1")]
        {
            let line = Line {
                baud,
                data_bits,
                parity: parity.into(),
                stop_bits: stop.into(),
                adapter_hold_ms: Some(f64::NAN),
            };
            assert_eq!(BusSettings::from_message("bus0", &line), None);
        }
    }
}
