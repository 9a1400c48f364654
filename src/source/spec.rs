//! What a user writes to name a source.

use std::fmt;
use std::net::Ipv6Addr;
use std::str::FromStr;

use thiserror::Error;

/// Names a source, and the bus behind it where the user gave it a name: `[NAME=]SOURCE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Spec {
    /// The name of the bus.
    pub name: Option<String>,
    /// Where the bytes come from.
    pub place: Place,
}

/// Says where bytes come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A serial device, such as `/dev/ttyUSB0` or `COM3`.
    Serial(String),
    /// A raw serial server.
    Tcp {
        /// Its name or address; an IPv6 address without brackets.
        host: String,
        /// Its port, from 1.
        port: u16,
    },
    /// Standard input.
    StandardInput,
}

/// Says why a source could not be read from the command line, and how to write it.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("'{given}' is not a source: {problem}")]
pub struct SpecError {
    given: String,
    problem: String,
}

const GRAMMAR: &str = "write a serial device such as /dev/ttyUSB0, tcp://host:port, or - for standard input; \
                       a name for the bus may stand before it, as in pond=/dev/ttyUSB0";
const TCP: &str = "write tcp://host:port, such as tcp://192.168.1.20:4001";

impl FromStr for Spec {
    type Err = SpecError;

    /// Reads `[NAME=]SOURCE`, where a name is of letters, digits, `-`, `_` and `.`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let error = |problem| SpecError { given: text.to_owned(), problem };
        let is_name = |name: &str| !name.contains(['/', ':', '\\']);
        let (name, place) = match text.split_once('=') {
            Some((name, place)) if is_name(name) => (Some(name), place),
            _ => (None, text),
        };
        if let Some(name) = name {
            check_name(name).map_err(error)?;
        }
        let place = place.parse().map_err(error)?;
        Ok(Spec { name: name.map(str::to_owned), place })
    }
}

fn check_name(name: &str) -> Result<(), String> {
    match name.chars().find(|c| !(c.is_alphanumeric() || "-_.".contains(*c))) {
        _ if name.is_empty() => Err("there is no name before '='".to_owned()),
        Some(c) => {
            Err(format!("'{c}' in the name of the bus; letters, digits, '-', '_' and '.' may be in it"))
        }
        None => Ok(()),
    }
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "-" => Ok(Place::StandardInput),
            "" => Err(format!("it is empty; {GRAMMAR}")),
            _ => match text.strip_prefix("tcp://") {
                Some(server) => server_from(server.strip_suffix('/').unwrap_or(server)),
                None if is_device(text) => Ok(Place::Serial(text.to_owned())),
                None => Err(GRAMMAR.to_owned()),
            },
        }
    }
}

/// Tells whether this looks like a serial device: a path, or a name such as `COM3`.
fn is_device(text: &str) -> bool {
    let is_com = text.get(..3).is_some_and(|head| head.eq_ignore_ascii_case("com"))
        && text.len() > 3
        && text.bytes().skip(3).all(|byte| byte.is_ascii_digit());
    let is_url = text.contains("://");
    is_com || (!is_url && text.contains(['/', '\\']))
}

fn server_from(server: &str) -> Result<Place, String> {
    let Some((host, port)) = server.rsplit_once(':').filter(|(host, _)| !host.ends_with(':')) else {
        return Err(format!("there is no port; {TCP}"));
    };
    let bare = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
    let host = match bare {
        Some(address) if address.parse::<Ipv6Addr>().is_err() => {
            return Err(format!("'{address}' is not an IPv6 address; {TCP}"));
        }
        Some(address) => address,
        None if host.contains(':') => {
            return Err("an IPv6 address stands in brackets, as in tcp://[fd00::20]:4001".to_owned());
        }
        None if host.is_empty() => return Err(format!("there is no host; {TCP}")),
        None => host,
    };
    match port.parse() {
        Ok(port @ 1..) => Ok(Place::Tcp { host: host.to_owned(), port }),
        _ => Err(format!("'{port}' is not a port from 1 to 65535; {TCP}")),
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Serial(device) => f.write_str(device),
            Place::Tcp { host, port } if host.contains(':') => write!(f, "tcp://[{host}]:{port}"),
            Place::Tcp { host, port } => write!(f, "tcp://{host}:{port}"),
            Place::StandardInput => f.write_str("-"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(text: &str) -> Spec {
        text.parse().expect("a source of this test")
    }

    #[test]
    fn a_name_may_stand_before_a_source_and_every_form_prints_as_it_is_read() {
        for place in ["/dev/ttyUSB0", "COM3", "./link", "tcp://moxa.local:4001", "tcp://[fd00::1]:4001", "-"]
        {
            assert_eq!(spec(place).place.to_string(), place);
            assert_eq!(spec(place).name, None);
            let named = spec(&format!("pond-2={place}"));
            assert_eq!((named.name.as_deref(), named.place), (Some("pond-2"), spec(place).place));
        }
    }

    #[test]
    fn an_equals_sign_in_a_path_or_host_is_no_name() {
        assert_eq!(spec("/dev/by-id/a=b").place, Place::Serial("/dev/by-id/a=b".to_owned()));
    }

    #[test]
    fn an_error_names_what_is_wrong_and_how_to_write_it() {
        for (text, part) in [
            ("tcp://host", "there is no port; write tcp://host:port"),
            ("tcp://host:", "'' is not a port"),
            ("tcp://host:0", "'0' is not a port from 1 to 65535"),
            ("tcp://host:70000", "'70000' is not a port"),
            ("tcp://:4001", "there is no host"),
            ("tcp://fd00::1:4001", "in brackets"),
            ("tcp://[host]:4001", "'host' is not an IPv6 address"),
            ("udp://host:4001", "tcp://host:port"),
            ("night.mcap", "a serial device such as"),
            ("COM", "a serial device such as"),
            ("", "it is empty"),
            ("=-", "no name before"),
            ("a b=-", "' ' in the name"),
        ] {
            let error = text.parse::<Spec>().expect_err(text).to_string();
            assert!(error.contains(part) && error.starts_with(&format!("'{text}'")), "{error}");
        }
    }
}
