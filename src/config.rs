//! The configuration file: flags go before the environment, the environment before the file, the file before
//! what is built in.
//!
//! Keys are the long options of the command line; `config.sample.toml` has them all.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use etcetera::BaseStrategy;

use crate::analyze::verify::Severity;
use crate::cli::{self, Assignment, Command, FailOn, Nanoseconds, RowFormat, ShowKind, TimeKind};
use crate::section::{self, Located, Problem, Section, nearest};
use crate::tui::action::{ACTIONS, Action};
use crate::tui::keymap::{Key, Keymap};
use crate::tui::theme::ThemeKind;

/// Holds what a configuration file says; what it does not say is `None` or empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Config {
    /// Speed and character format.
    pub line: Option<cli::Line>,
    /// The longest time the adapter keeps a byte back.
    pub adapter_hold: Option<Nanoseconds>,
    /// What device is at which address.
    pub devices: Vec<Assignment>,
    /// Files of further device profiles; relative ones are beside the configuration file.
    pub profiles: Vec<PathBuf>,
    /// Salinity of the water in g/kg, 0 to 100.
    pub salinity: Option<f64>,
    /// Air pressure in kPa, 20 to 200.
    pub pressure_kpa: Option<f64>,
    /// What to print.
    pub show: Option<Vec<ShowKind>>,
    /// How to print rows.
    pub format: Option<RowFormat>,
    /// How to show times.
    pub time: Option<TimeKind>,
    /// From which severity on `verify` fails.
    pub fail_on: Option<FailOn>,
    /// Codes of findings that `verify` leaves out.
    pub ignore: Vec<String>,
    /// Severities that `verify` gives to codes.
    pub severities: Vec<(String, Severity)>,
    /// How the terminal UI looks and is used.
    pub screen: Screen,
}

/// Says how the terminal UI looks and is used.
#[derive(Clone, Debug, PartialEq)]
pub struct Screen {
    /// How things look, unless NO_COLOR says otherwise.
    pub theme: ThemeKind,
    /// Whether the mouse is used.
    pub mouse: bool,
    /// Which key does what.
    pub keymap: Keymap,
}

impl Default for Screen {
    fn default() -> Self {
        Screen { theme: ThemeKind::default(), mouse: true, keymap: Keymap::default() }
    }
}

/// Says why a configuration file could not be used.
#[derive(Debug)]
pub enum ConfigError {
    /// The system refused to read it.
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// There is something in it that cannot be understood.
    Content {
        /// The file.
        path: PathBuf,
        /// What, in the order of the text.
        problems: Vec<Problem>,
    },
}

impl ConfigError {
    /// Returns what could be done about it.
    pub fn hint(&self) -> &'static str {
        match self {
            ConfigError::Io { .. } => "check --config and RTUTAP_CONFIG",
            ConfigError::Content { .. } => "config.sample.toml shows every key with its default",
        }
    }
}

impl fmt::Display for ConfigError {
    /// Writes a line for each problem.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ConfigError::Io { path, error } => write!(f, "cannot read '{}': {error}", path.display()),
            ConfigError::Content { path, problems } => {
                for (index, problem) in problems.iter().enumerate() {
                    let separator = if index == 0 { "" } else { "\n" };
                    write!(f, "{separator}{}:{problem}", path.display())?;
                }
                Ok(())
            }
        }
    }
}

impl std::error::Error for ConfigError {}

impl Config {
    /// Reads the file given, or the one in the user's configuration directory if there is one.
    ///
    /// # Errors
    /// When the file cannot be read, or its content not understood.
    pub fn load(given: Option<&Path>) -> Result<Config, ConfigError> {
        let Some(path) = given.map(Path::to_owned).or_else(usual_path) else { return Ok(Config::default()) };
        #[expect(clippy::disallowed_methods, reason = "the configuration is a file")]
        let text = match std::fs::read_to_string(&path) {
            Err(error) if given.is_none() && error.kind() == io::ErrorKind::NotFound => {
                return Ok(Config::default());
            }
            Err(error) => return Err(ConfigError::Io { path, error }),
            Ok(text) => text,
        };
        let mut config = match Config::from_toml(&text) {
            Err(problems) => return Err(ConfigError::Content { path, problems }),
            Ok(config) => config,
        };
        let directory = path.parent().unwrap_or(Path::new(""));
        for profile in &mut config.profiles {
            *profile = directory.join(&*profile);
        }
        Ok(config)
    }

    /// Reads the content of a configuration file.
    ///
    /// # Errors
    /// All problems in the order of the text.
    pub fn from_toml(text: &str) -> Result<Config, Vec<Problem>> {
        section::read(text, read)
    }

    /// Gives the options of a command that are not given yet the values of the configuration.
    pub fn complete(self, command: &mut Command) {
        match command {
            Command::Decode(args) => {
                self.complete_printing(&mut args.printing);
                self.complete_bus(&mut args.bus);
            }
            Command::Listen(args) => {
                self.complete_printing(&mut args.printing);
                self.complete_live(&mut args.live);
            }
            Command::Record(args) => self.complete_live(&mut args.live),
            Command::Replay(args) => {
                args.time = args.time.or(self.time);
                self.complete_bus(&mut args.bus);
            }
            Command::Verify(args) => {
                args.time = args.time.or(self.time);
                args.fail_on = args.fail_on.or(self.fail_on);
                args.ignore.extend(self.ignore.iter().cloned());
                args.severities.clone_from(&self.severities);
                // A recording has nothing to find; a live source is searched when that is asked for.
                args.line = args.line.or(self.line.filter(|line| *line != cli::Line::Auto));
                args.adapter_hold = args.adapter_hold.or(self.adapter_hold);
                self.complete_equipment(&mut args.equipment);
            }
            Command::Info(args) => {
                args.time = args.time.or(self.time);
                self.complete_bus(&mut args.bus);
            }
            Command::Export(args) => {
                args.time = args.time.or(self.time);
                self.complete_bus(&mut args.bus);
            }
            Command::Profiles(cli::Profiles { action: Some(cli::ProfileAction::New(args)) }) => {
                self.complete_bus(&mut args.bus);
            }
            _ => {}
        }
    }

    fn complete_printing(&self, printing: &mut cli::Printing) {
        if printing.show.is_empty() {
            printing.show = self.show.clone().unwrap_or_default();
        }
        printing.format = printing.format.or(self.format);
        printing.time = printing.time.or(self.time);
    }

    fn complete_bus(self, bus: &mut cli::Bus) {
        // A recording was made with some settings: there is nothing to find.
        bus.line = bus.line.filter(|line| *line != cli::Line::Auto).or(self.line);
        bus.adapter_hold = bus.adapter_hold.or(self.adapter_hold);
        self.complete_equipment(&mut bus.equipment);
    }

    fn complete_live(self, live: &mut cli::Live) {
        live.line = live.line.or(self.line);
        live.adapter_hold = live.adapter_hold.or(self.adapter_hold);
        self.complete_equipment(&mut live.equipment);
    }

    fn complete_equipment(self, equipment: &mut cli::Equipment) {
        equipment.salinity = equipment.salinity.or(self.salinity);
        equipment.pressure_kpa = equipment.pressure_kpa.or(self.pressure_kpa);
        // The last word on an address, or a profile, is that of the command line.
        equipment.devices.splice(..0, self.devices);
        equipment.profiles.splice(..0, self.profiles);
    }
}

/// Returns where a user's configuration usually is.
fn usual_path() -> Option<PathBuf> {
    let strategy = etcetera::choose_base_strategy().ok()?;
    Some(strategy.config_dir().join("rtutap").join("config.toml"))
}

fn read(section: &Section<'_>) -> Option<Config> {
    let profiles = section.strings("profiles").unwrap_or_default();
    let verify = section.section("verify").map(|section| verify(&section)).unwrap_or_default();
    let config = Config {
        line: section.string("line").and_then(|line| checked(section, line.at, line.value.parse())),
        adapter_hold: number(section, "adapter-hold", cli::milliseconds),
        devices: section.section("devices").map(|section| devices(&section)).unwrap_or_default(),
        profiles: profiles.iter().map(|file| file.value.into()).collect(),
        salinity: number(section, "salinity", cli::salinity),
        pressure_kpa: number(section, "pressure-kpa", cli::pressure),
        show: section
            .strings("show")
            .map(|words| words.into_iter().filter_map(|word| choice(section, "show", word)).collect()),
        format: section.string("format").and_then(|word| choice(section, "format", word)),
        time: section.string("time").and_then(|word| choice(section, "time", word)),
        screen: screen(section),
        ..verify
    };
    section.finish();
    Some(config)
}

/// Reads how the terminal UI looks and is used.
fn screen(section: &Section<'_>) -> Screen {
    let themes = [("dark", ThemeKind::Dark), ("light", ThemeKind::Light), ("plain", ThemeKind::Plain)];
    let mut keymap = Keymap::default();
    if let Some(keys) = section.section("keys") {
        bind(&keys, &mut keymap);
    }
    let default = Screen::default();
    Screen {
        theme: section.choice("theme", &themes).unwrap_or(default.theme),
        mouse: section.boolean("mouse").unwrap_or(default.mouse),
        keymap,
    }
}

/// Reads which keys do what: the name of an action, and its keys with spaces between.
fn bind(section: &Section<'_>, keymap: &mut Keymap) {
    for (name, text) in section.texts() {
        let Some(action) = Action::named(name.value) else {
            let near = nearest(name.value, ACTIONS.iter().map(|entry| entry.name));
            let hint = near.map_or_else(
                || "config.sample.toml has them all".to_owned(),
                |near| format!("did you mean '{near}'?"),
            );
            section.problem_with_hint(name.at, format_args!("nothing is called '{}'", name.value), hint);
            continue;
        };
        let keys: Result<Vec<Key>, _> = text.split_whitespace().map(str::parse).collect();
        if let Some(keys) = checked(section, name.at, keys) {
            keymap.bind(action, keys);
        }
    }
    if let Some((key, one, other)) = keymap.conflict() {
        let name = |action: Action| action.entry().map_or("", |entry| entry.name);
        let hint = "give one of them another key, or none";
        let text = format!("'{key}' is to do both '{}' and '{}'", name(one), name(other));
        section.problem_with_hint(section.at, text, hint);
    }
}

/// Reads what `verify` is to make of findings.
fn verify(section: &Section<'_>) -> Config {
    let ignored = section.strings("ignore").unwrap_or_default();
    let severities = section.section("severity").map(|section| severities(&section)).unwrap_or_default();
    let config = Config {
        fail_on: section.string("fail-on").and_then(|word| choice(section, "fail-on", word)),
        ignore: ignored.iter().filter_map(|it| checked(section, it.at, cli::code(it.value))).collect(),
        severities,
        ..Config::default()
    };
    section.finish();
    config
}

fn severities(section: &Section<'_>) -> Vec<(String, Severity)> {
    let severities = section.texts().into_iter().filter_map(|(code, severity)| {
        let known = checked(section, code.at, cli::code(code.value))?;
        Some((known, checked(section, code.at, cli::severity(severity))?))
    });
    severities.collect()
}

/// Notes what is wrong with a value.
fn checked<T>(section: &Section<'_>, at: usize, value: Result<T, impl fmt::Display>) -> Option<T> {
    value.map_err(|error| section.problem(at, error)).ok()
}

/// Reads a number as the command line does.
fn number<T>(
    section: &Section<'_>,
    key: &'static str,
    parse: impl Fn(&str) -> Result<T, String>,
) -> Option<T> {
    let number = section.number(key)?;
    let value = parse(&number.value.to_string()).map_err(|error| format!("'{key}' is {error}"));
    checked(section, number.at, value)
}

fn devices(section: &Section<'_>) -> Vec<Assignment> {
    let devices = section.texts().into_iter().filter_map(|(address, device)| {
        checked(section, address.at, cli::assignment(&format!("{}={device}", address.value)))
    });
    devices.collect()
}

/// Reads a word as the command line does.
fn choice<T: ValueEnum>(section: &Section<'_>, key: &str, word: Located<&str>) -> Option<T> {
    let found = T::from_str(word.value, false).ok();
    if found.is_none() {
        let values = T::value_variants().iter().filter_map(T::to_possible_value);
        let names: Vec<String> = values.map(|value| value.get_name().to_owned()).collect();
        let hint = format!("use one of {}", names.join(", "));
        section.problem_with_hint(word.at, format_args!("'{}' is no {key}", word.value), hint);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::LineSettings;

    const SAMPLE: &str = include_str!("../config.sample.toml");

    #[test]
    fn what_the_sample_has_as_comments_can_be_uncommented() {
        let text: String = SAMPLE
            .lines()
            .map(|line| match line.strip_prefix('#') {
                Some(rest) if !rest.starts_with(' ') => format!("{rest}\n"),
                _ => format!("{line}\n"),
            })
            .collect();
        let config = Config::from_toml(&text).expect("good");
        assert_eq!(config.line, Some(cli::Line::Is(LineSettings::default())));
        assert_eq!(config.adapter_hold, Some(Nanoseconds(16_000_000)));
        assert_eq!(config.devices, [Assignment { address: 3, device: "yosemitech-do".into() }]);
        assert_eq!(config.profiles, [PathBuf::from("my-device.toml")]);
    }

    #[test]
    fn the_keys_of_the_sample_are_those_built_in_and_all_of_them() {
        let config = Config::from_toml(SAMPLE).expect("good");
        assert_eq!(config.screen, Screen::default());
        for entry in ACTIONS {
            let line = format!("\n{} = \"{}\"", entry.name, entry.keys.join(" ").replace('"', "\\\""));
            assert!(SAMPLE.contains(&line), "{line}");
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_line_column_and_mend() {
        for (text, expected) in [
            ("adapter_hold = 16", "1:1: unknown key 'adapter_hold'; did you mean 'adapter-hold'?"),
            ("\nlines = '9600-8N1'", "2:1: unknown key 'lines'; did you mean 'line'?"),
            ("time = 'local'\n  line = '9600'", "2:10: '9600' is not a line setting"),
            ("salinity = 101", "1:12: 'salinity' is not within 0 to 100 g/kg"),
            ("pressure-kpa = 1013.25", "1:16: 'pressure-kpa' is not within 20 to 200 kPa"),
            ("adapter-hold = -1", "1:16: 'adapter-hold' is not within 0 to 10000 ms"),
            ("salinity = '35'", "1:12: 'salinity' is of type string, not a decimal number"),
            ("format = 'xml'", "1:10: 'xml' is no format; use one of text, json, csv"),
            ("show = ['frames', 'all']", "1:19: 'all' is no show; use one of frames"),
            ("[devices]\n300 = 'yosemitech-do'", "2:1: '300' is not a unit address from 1 to 247"),
            ("[devices]\n3 = 5", "2:5: '3' is of type integer, not a text"),
            ("line = ", "1:8: "),
            ("theme = 'dusk'", "1:9: 'dusk' is no theme; use one of dark"),
            ("[keys]\nfrieze = 'x'", "2:1: nothing is called 'frieze'; did you mean 'freeze'?"),
            ("[keys]\nfreeze = 'hyper-x'", "2:1: 'hyper-x' is no key"),
            ("[keys]\nfreeze = 'q'", "1:1: 'q' is to do both 'freeze' and 'quit'"),
        ] {
            let problems = Config::from_toml(text).expect_err(text);
            let said = problems[0].to_string();
            assert!(said.starts_with(expected), "{said}");
        }
    }

    #[test]
    fn all_problems_are_found_at_once() {
        let problems = Config::from_toml("format = 'xml'\nsalinity = -1\nfoo = 1\n").expect_err("three");
        assert_eq!(problems.iter().map(|problem| problem.line).collect::<Vec<_>>(), [1, 2, 3]);
    }
}
