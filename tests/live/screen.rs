//! The terminal UI of the real program, in a terminal that is a pty.

use std::path::Path;

use rtutap::simulate::Adapter;
use rustix::process::Signal;

use crate::bus::{Bus, info, reads};
use crate::terminal::Terminal;

fn home() -> tempfile::TempDir {
    tempfile::tempdir().expect("a directory")
}

/// Returns the path that was printed last.
fn printed_path(terminal: &Terminal) -> String {
    let contents = terminal.contents().replace('\n', "");
    let (_, rest) = contents.rsplit_once("recorded in '").expect("a path was printed");
    rest.split('\'').next().expect("it ends").to_owned()
}

#[test]
fn it_starts_resizes_filters_and_quits() {
    let home = home();
    let mut terminal = Terminal::start(&["demo"], home.path());
    terminal.wait_until("the UI has the terminal", vt100::Screen::alternate_screen);
    terminal.wait_for("get-measurement");
    terminal.resize(12, 40);
    terminal.wait_until("it fits", |screen| {
        let lines: Vec<String> = screen.rows(0, 40).collect();
        lines.len() == 12 && lines[0].contains("1 Traffic  2  3  4") && lines[11].contains("following")
    });
    terminal.resize(24, 100);
    terminal.wait_for("3 Health");
    terminal.press("/addr == 3 &&& cmd");
    terminal.wait_for("column 13:");
    terminal.press("\x15addr == 3\r");
    terminal.wait_until("only address 3 is listed", |screen| {
        let rows: Vec<String> = screen.rows(0, 100).skip(3).take(8).collect();
        rows.iter().any(|row| row.contains("sonde")) && !rows.iter().any(|row| row.contains(" do  "))
    });
    terminal.press("q");
    let status = terminal.wait();
    assert!(status.success(), "{}", terminal.contents());
    terminal.assert_restored();
}

#[test]
fn every_signal_gives_the_terminal_back_and_keeps_the_session() {
    for signal in [Signal::TERM, Signal::INT, Signal::HUP] {
        let (home, mut bus) = (home(), Bus::new());
        let mut terminal = Terminal::start(&["listen", &bus.path, "--line", "9600-8N1"], home.path());
        terminal.wait_for("nothing was received yet");
        bus.wait_for_listener();
        bus.say(&[0x01, 0x03, 0x26, 0x00, 0x00, 0x04, 0x4F, 0x41]);
        terminal.wait_for("no response");
        terminal.wait_for("REC");
        terminal.signal(signal);
        assert!(terminal.wait().success(), "{}", terminal.contents());
        terminal.assert_restored();
        let path = printed_path(&terminal);
        assert!(Path::new(&path).starts_with(home.path()), "{path}");
        assert_eq!(info(&[Path::new(&path)])["bytes"], 8);
    }
}

#[test]
fn suspended_by_key_or_signal_it_gives_the_terminal_back_until_the_shell_goes_on() {
    let home = home();
    let mut terminal = Terminal::start_in_shell(
        &["replay", "captures/installation.mcap"],
        "echo stopped once; read go; fg; echo stopped twice; read go; fg; echo over",
        home.path(),
    );
    let is_shown =
        |screen: &vt100::Screen| screen.alternate_screen() && screen.contents().contains("Traffic");
    terminal.wait_until("the recording is shown", is_shown);
    terminal.press("\x1a");
    terminal.wait_until("the shell is back", |screen| screen.contents().contains("stopped once"));
    terminal.press("\n");
    terminal.wait_until("the recording is shown again", is_shown);
    terminal.signal_child(Signal::TSTP);
    terminal.wait_until("the shell is back", |screen| screen.contents().contains("stopped twice"));
    terminal.press("\n");
    terminal.wait_until("the recording is shown again", is_shown);
    terminal.press("q");
    terminal.wait();
    assert!(terminal.contents().contains("over"), "{}", terminal.contents());
    terminal.assert_restored();
}

#[test]
fn a_session_is_kept_unless_that_is_refused_and_notes_with_it() {
    let (home, mut bus) = (home(), Bus::new());
    let mut terminal = Terminal::start(&["listen", &bus.path, "--line", "9600-8N1"], home.path());
    terminal.wait_for("REC");
    bus.wait_for_listener();
    bus.say(&[0x01, 0x03, 0x26, 0x00, 0x00, 0x04, 0x4F, 0x41]);
    terminal.wait_for("no response");
    terminal.press("acable moved\r");
    terminal.wait_for("note");
    // It is stopped, and started again in another file.
    terminal.press("r");
    terminal.wait_for("not recorded");
    terminal.press("r");
    terminal.wait_for("REC");
    bus.say(&[0x01, 0x03, 0x26, 0x00, 0x00, 0x04, 0x4F, 0x41]);
    terminal.wait_for("3 rows");
    terminal.press("q");
    assert!(terminal.wait().success());
    assert!(terminal.contents().contains("2 files"), "{}", terminal.contents());
    let kept = home.path().join("rtutap").read_dir().expect("a directory");
    let mut files: Vec<_> = kept.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    assert_eq!(files.len(), 2);
    for file in &files {
        assert_eq!((&info(&[file])["bytes"], &info(&[file])["complete"]), (&8.into(), &true.into()));
    }
    let has_note = |file: &Path| {
        let bytes = std::fs::read(file).expect("a recording");
        let messages = mcap::MessageStream::new(&bytes).expect("MCAP");
        let notes = messages
            .map(|message| message.expect("whole"))
            .filter(|message| message.channel.topic == "/notes");
        notes.map(|note| String::from_utf8_lossy(&note.data).contains("cable moved")).collect::<Vec<_>>()
    };
    assert_eq!((has_note(&files[0]), has_note(&files[1])), (vec![true], vec![]));
}

#[test]
fn what_passes_the_filter_of_a_live_session_is_exported_while_it_goes_on() {
    let (home, mut bus) = (home(), Bus::new());
    let mut terminal = Terminal::start(&["listen", &bus.path, "--line", "9600-8N1"], home.path());
    terminal.wait_for("REC");
    bus.wait_for_listener();
    bus.say(&[0x01, 0x03, 0x26, 0x00, 0x00, 0x04, 0x4F, 0x41]);
    terminal.wait_for("no response");
    bus.say(&[0x02, 0x03, 0x26, 0x00, 0x00, 0x05, 0x8E, 0xB2]);
    terminal.wait_for("2 rows");
    terminal.press("/addr == 2\r");
    terminal.wait_for("1 of 2 rows");
    let path = home.path().join("part.jsonl");
    terminal.press(&format!("w{}\r", path.display()));
    terminal.wait_for("exported to");
    let rows = std::fs::read_to_string(&path).expect("an export");
    let rows: Vec<serde_json::Value> =
        rows.lines().map(|row| serde_json::from_str(row).expect("JSON")).collect();
    let transactions = rows.iter().filter(|row| row["type"] == "transaction");
    assert_eq!(transactions.map(|row| row["address"].clone()).collect::<Vec<_>>(), [2]);
    bus.say(&[0x02, 0x03, 0x26, 0x00, 0x00, 0x05, 0x8E, 0xB2]);
    terminal.wait_for("2 of 3 rows");
    terminal.press("q");
    assert!(terminal.wait().success());
    assert_eq!(info(&[Path::new(&printed_path(&terminal))])["bytes"], 24);
}

#[test]
fn with_no_record_nothing_is_kept() {
    let (home, mut bus) = (home(), Bus::new());
    let args = ["listen", &bus.path, "--line", "9600-8N1", "--no-record"];
    let mut terminal = Terminal::start(&args, home.path());
    terminal.wait_for("not recorded");
    bus.wait_for_listener();
    bus.say(&[0x01, 0x03, 0x26, 0x00, 0x00, 0x04, 0x4F, 0x41]);
    terminal.wait_for("no response");
    terminal.press("q");
    assert!(terminal.wait().success());
    let kept = home.path().join("rtutap").read_dir().expect("a directory").count();
    assert_eq!(kept, 0);
}

#[test]
fn an_adapter_that_is_lost_is_shown_until_it_is_back() {
    let (home, bus) = (home(), Bus::new());
    let device = home.path().join("adapter");
    std::os::unix::fs::symlink(&bus.path, &device).expect("a link");
    let name = device.to_str().expect("UTF-8").to_owned();
    let mut terminal = Terminal::start(&["listen", &name, "--line", "9600-8N1", "--no-record"], home.path());
    terminal.wait_for("nothing was received yet");
    bus.wait_for_listener();
    drop(bus);
    terminal.wait_for("gone for");
    let again = Bus::new();
    std::fs::remove_file(&device).expect("a link");
    std::os::unix::fs::symlink(&again.path, &device).expect("a link");
    terminal.wait_until("it is back", |screen| !screen.contents().contains("gone for"));
    terminal.press("q");
    assert!(terminal.wait().success());
    terminal.assert_restored();
}

#[test]
fn lines_are_printed_where_there_is_no_terminal_or_a_format_is_asked_for() {
    let home = home();
    let mut terminal = Terminal::start(&["demo", "--format", "text", "--duration", "1"], home.path());
    assert!(terminal.wait().success());
    assert!(terminal.contents().contains("transactions"), "{}", terminal.contents());
    assert!(!crate::bus::printed(&["demo", "--duration", "1"]).contains('\x1b'));
}

#[test]
fn without_colour_bold_and_reverse_stay() {
    let home = home();
    let program = std::env::var("RTUTAP_BIN").unwrap_or_else(|_| env!("CARGO_BIN_EXE_rtutap").to_owned());
    let mut command = portable_pty::CommandBuilder::new(program);
    command.args(["demo"]);
    command.env("TERM", "xterm-256color");
    command.env("NO_COLOR", "1");
    command.env("XDG_STATE_HOME", home.path());
    let mut terminal = Terminal::run(command);
    terminal.wait_for("get-measurement");
    let cells: Vec<_> = (0..24)
        .flat_map(|row| (0..100).map(move |column| (row, column)))
        .filter_map(|(row, column)| terminal.screen().cell(row, column).cloned())
        .collect();
    assert!(cells.iter().all(|cell| cell.fgcolor() == vt100::Color::Default));
    assert!(cells.iter().any(vt100::Cell::inverse) && cells.iter().any(vt100::Cell::bold));
}

#[test]
#[ignore = "takes a minute of an idle machine"]
fn a_line_at_115200_baud_without_a_pause_costs_little_and_keys_are_answered() {
    use std::time::{Duration, Instant};
    let (home, mut bus) = (home(), Bus::new());
    let path = home.path().join("a.mcap");
    let args = ["listen", &bus.path, "--line", "115200-8N1", "--record", path.to_str().expect("UTF-8")];
    let mut terminal = Terminal::start(&args, home.path());
    terminal.wait_for("nothing was received yet");
    bus.wait_for_listener();
    let bytes: Vec<u8> =
        reads("installation", Adapter::Uart, 1, 30_000).into_iter().flat_map(|read| read.bytes).collect();
    // 62 bytes take 5.4 ms.
    let seconds = 60;
    let batches: Vec<Vec<u8>> = bytes
        .iter()
        .copied()
        .cycle()
        .take(11_520 * seconds)
        .collect::<Vec<u8>>()
        .chunks(62)
        .map(<[u8]>::to_vec)
        .collect();
    let count: usize = batches.iter().map(Vec::len).sum();
    let (begun, before) = (Instant::now(), crate::cost::processor_time(terminal.pid()));
    let speaker = std::thread::spawn(move || {
        for (at, batch) in batches.iter().enumerate() {
            let due = Duration::from_nanos(5_381_944).saturating_mul(u32::try_from(at).expect("few"));
            std::thread::sleep(due.saturating_sub(begun.elapsed()));
            bus.say(batch);
        }
        bus
    });
    let mut answers = Vec::new();
    while !speaker.is_finished() {
        for (key, shown) in [("2", "ADDR DEVICE        VALUES"), ("3", "LOAD"), ("1", "COMMAND")] {
            terminal.press(key);
            answers.push(terminal.wait_for(shown));
            std::thread::sleep(Duration::from_millis(200));
        }
    }
    let spent = crate::cost::processor_time(terminal.pid()) - before;
    let elapsed = begun.elapsed();
    let status = std::fs::read_to_string(format!("/proc/{}/status", terminal.pid())).expect("a process");
    let memory = status.lines().find(|line| line.starts_with("VmHWM")).expect("memory").to_owned();
    let _bus = speaker.join().expect("said all");
    terminal.press("q");
    assert!(terminal.wait().success());
    answers.sort();
    let load = spent.as_secs_f64() / elapsed.as_secs_f64() * 100.0;
    println!(
        "{load:.1} % of a core, {memory}, keys: median {:?}, most {:?}",
        answers[answers.len() / 2],
        answers[answers.len() - 1]
    );
    let info = info(&[&path]);
    assert_eq!(info["bytes"], count);
    assert_eq!(info["complete"], true);
    assert!(load < 15.0, "{load}");
    assert!(answers[answers.len() - 1] < Duration::from_millis(50), "{answers:?}");
}
