//! `rtutap verify`: says what is wrong with the traffic, and who is to blame.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::bus::{self, Wanted};
use super::failure::Failure;
use super::live::{self, Job, Status};
use super::message;
use super::output::{self, Output};
use super::session::{Origin, Setup, Sink};
use crate::analyze::plan::Plan;
use crate::analyze::verify::rule;
use crate::cli::{self, VerifyFormat};
use crate::device::Profiles;
use crate::pipeline::Event;
use crate::report::TimeStyle;
use crate::report::audit::{Audit, Judgement, explain};
use crate::source::{Clock, Place, Spec, SystemClock};
use crate::time::SECOND;

/// Runs the command.
pub(super) fn run(args: &cli::Verify, verbose: bool) -> Result<(), Failure> {
    if let Some(code) = args.explain.as_deref().and_then(rule) {
        let mut output = Output::stdout();
        output.buffer.extend_from_slice(explain(code).as_bytes());
        return output.flush();
    }
    let sources = sources(args)?;
    let inputs: &[PathBuf] = if sources.is_some() { &[] } else { &args.inputs };
    let profiles = bus::profiles(&args.equipment.profiles, inputs)?;
    let plan = args.expect.as_deref().map(|path| plan(path, &profiles)).transpose()?;
    let judgement = Judgement {
        ignored: args.ignore.clone(),
        severities: args.severities.clone(),
        parties: args.party.iter().copied().map(Into::into).collect(),
        fail_on: args.fail_on.unwrap_or(cli::FailOn::Error).severity(),
    };
    let mut audit = Audit::new(judgement, plan);
    let ended = match sources {
        Some(sources) => {
            let (heard, ended) = listen(args, sources, audit, &profiles)?;
            audit = heard;
            ended.and_then(|()| silence(&audit))
        }
        None => read(args, &mut audit, &profiles),
    };
    audit.finish();
    if audit.is_silent() && ended.is_err() {
        return ended;
    }
    // What was found before something went wrong is shown first.
    print(&audit, args, verbose)?;
    ended?;
    if audit.fails() { Err(Failure::Findings) } else { Ok(()) }
}

/// Refuses to judge live sources of which nothing was heard; names those that were silent beside others.
fn silence(audit: &Audit) -> Result<(), Failure> {
    if audit.is_silent() {
        let hint = "is the master polling? Check A, B and ground where the tap is connected, and that this is its port";
        return Err(Failure::hinted("no traffic: not a byte was heard, so nothing can be judged", hint));
    }
    audit
        .silent()
        .for_each(|bus| message::warning(format_args!("no traffic on {bus}: not a byte was heard")));
    Ok(())
}

/// Reads what a master is expected to do.
fn plan(path: &Path, profiles: &Profiles) -> Result<Plan, Failure> {
    #[expect(clippy::disallowed_methods, reason = "plans are files")]
    let text = std::fs::read_to_string(path).map_err(|error| Failure::reading(path, &error))?;
    Plan::from_toml(&text, profiles).map_err(|problems| {
        let lines: Vec<String> =
            problems.iter().map(|problem| format!("{}:{problem}", path.display())).collect();
        Failure::hinted(lines.join("\n"), "'rtutap info --plan' writes a plan from a recording")
    })
}

/// Returns the live sources, when what was given are such.
///
/// # Errors
/// When recordings and sources are mixed.
fn sources(args: &cli::Verify) -> Result<Option<Vec<Spec>>, Failure> {
    let given: Vec<(&Path, Option<Spec>)> =
        args.inputs.iter().map(|input| (input.as_path(), source(input))).collect();
    let live = given.iter().filter(|(_, spec)| spec.is_some()).count();
    if live == 0 {
        if args.duration.is_some() {
            return Err(Failure::hinted(
                "--duration is for live sources",
                "recordings are read to their end",
            ));
        }
        return Ok(None);
    }
    if let Some((file, _)) = given.iter().find(|(_, spec)| spec.is_none()) {
        let message = format!("'{}' is a recording, and others are live sources", file.display());
        return Err(Failure::hinted(message, "verify recordings, or listen to sources"));
    }
    Ok(Some(given.into_iter().filter_map(|(_, spec)| spec).collect()))
}

/// Tells a live source from a recording: a terminal device, a server, or a COM port.
fn source(input: &Path) -> Option<Spec> {
    if input.is_file() {
        return None;
    }
    let spec: Spec = input.to_str()?.parse().ok()?;
    let is_live = match &spec.place {
        Place::Tcp { .. } => true,
        Place::StandardInput => false,
        Place::Serial(name) => is_port(name),
    };
    is_live.then_some(spec)
}

fn is_port(name: &str) -> bool {
    let number = name.get(..3).filter(|head| head.eq_ignore_ascii_case("com")).and_then(|_| name.get(3..));
    if number.is_some_and(|number| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())) {
        return true;
    }
    // A link, as in /dev/serial/by-id, leads to the device.
    let device = Path::new(name).canonicalize().unwrap_or_else(|_| name.into());
    let device = device.to_string_lossy();
    ["/dev/tty", "/dev/pts/", "/dev/cu.", "/dev/serial/"].iter().any(|prefix| device.starts_with(prefix))
        || device.starts_with(r"\\.\COM")
}

/// Reads recordings.
fn read(args: &cli::Verify, audit: &mut Audit, profiles: &Arc<Profiles>) -> Result<(), Failure> {
    let bus = cli::Bus {
        inputs: args.inputs.clone(),
        line: args.line,
        input_format: args.input_format,
        adapter_hold: args.adapter_hold,
        equipment: args.equipment.clone(),
    };
    bus::check(&bus)?;
    let wanted = Wanted { findings: true, ..Wanted::default() };
    bus::read(&bus, profiles, wanted, audit, |_, _| {})
}

/// Listens to live sources until they end or it is told to stop.
fn listen(
    args: &cli::Verify,
    sources: Vec<Spec>,
    audit: Audit,
    profiles: &Arc<Profiles>,
) -> Result<(Audit, Result<(), Failure>), Failure> {
    let line = args.line;
    let live =
        cli::Live { sources, line, adapter_hold: args.adapter_hold, equipment: args.equipment.clone() };
    bus::check_devices(&live.equipment)?;
    let clock: Arc<dyn Clock> = Arc::new(SystemClock);
    let setup = Setup { findings: true, ..live::setup(&live, profiles, false, true)? };
    let opened = live::open(&live, &clock)?;
    if output::stderr_is_terminal() {
        message::note(listening(args));
    }
    let stop = live::stop_flag()?;
    let report = live::run(Job {
        screen: None,
        setup: &setup,
        sources: opened,
        anchor: live::anchor(&*clock),
        clock,
        rows: None,
        recording: None,
        info: None,
        audit: Some(audit),
        status: Status::new(true, true),
        stop,
        duration_ns: args.duration.and_then(|duration| u64::try_from(duration.0).ok()),
    })?;
    let gone = || Failure::new("the report was lost");
    Ok((report.audit.ok_or_else(gone)?, report.ended))
}

/// Says what is listened to, and for how long.
fn listening(args: &cli::Verify) -> String {
    let sources: Vec<String> = args.inputs.iter().map(|it| it.display().to_string()).collect();
    let length = match args.duration {
        Some(duration) => format!("for {} s", duration.0 as f64 / SECOND as f64),
        None => "until Ctrl-C".to_owned(),
    };
    format!("listening on {} {length}; the report comes at the end", sources.join(", "))
}

fn print(audit: &Audit, args: &cli::Verify, verbose: bool) -> Result<(), Failure> {
    let (mut output, report) = match args.format {
        VerifyFormat::Text => {
            let (output, colour) = Output::terminal();
            let time: TimeStyle = args.time.unwrap_or_default().into();
            (output, audit.to_text(time, colour, verbose).into_bytes())
        }
        VerifyFormat::Json => (Output::stdout(), audit.to_json()),
        VerifyFormat::Junit => (Output::stdout(), audit.to_junit().into_bytes()),
    };
    output.buffer.extend_from_slice(&report);
    output.flush()
}

impl Sink for Audit {
    const RECEIVES: bool = false;

    fn begin(&mut self, origin: &Origin) -> Result<(), Failure> {
        let settings = &origin.settings;
        Audit::begin(self, &settings.name, settings.line, settings.adapter_hold_ns.is_some());
        Ok(())
    }

    fn event(&mut self, bus: &str, event: &Event<'_>) {
        Audit::event(self, bus, event);
    }

    fn pause(&mut self, _settled_frame: u64, _waits: bool) -> Result<(), Failure> {
        Ok(())
    }
}
