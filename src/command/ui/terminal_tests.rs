//! A panic leaves the terminal as it was. The test runs itself again in a pty, and panics there.

use std::io::Read;
use std::num::NonZero;

use portable_pty::{CommandBuilder, PtySize, native_pty_system};

use super::Screen;

/// Says that this is the run in the pty.
const INSIDE: &str = "RTUTAP_TEST_INSIDE";

#[test]
fn a_panic_gives_the_terminal_back_and_then_is_said() {
    if std::env::var_os(INSIDE).is_some() {
        let _screen = Screen::open(true).expect("a terminal");
        panic!("the reason");
    }
    let some = |count| NonZero::new(count).expect("not none");
    let size = PtySize { rows: 24, cols: 80, pixel_width: 0, pixel_height: 0 };
    let pair = native_pty_system().openpty(size).expect("a pty");
    let mut command = CommandBuilder::new(std::env::current_exe().expect("this test"));
    let name = "command::ui::terminal::tests::a_panic_gives_the_terminal_back_and_then_is_said";
    command.args(["--exact", name, "--nocapture", "--test-threads=1"]);
    command.env(INSIDE, "1");
    command.env("RUST_BACKTRACE", "0");
    let mut child = pair.slave.spawn_command(command).expect("this test");
    drop(pair.slave);
    let mut reader = pair.master.try_clone_reader().expect("the other side");
    let mut output = Vec::new();
    // Ends with an error where the last writer is gone.
    let _ = reader.read_to_end(&mut output);
    assert!(!child.wait().expect("it ends").success());
    let mut parser = vt100::Parser::new(some(24), some(80), 0);
    parser.process(&output);
    let screen = parser.screen();
    assert!(!screen.alternate_screen() && !screen.hide_cursor());
    assert_eq!(screen.mouse_protocol_mode(), vt100::MouseProtocolMode::None);
    assert!(screen.contents().contains("the reason"), "{}", screen.contents());
    let output = String::from_utf8_lossy(&output);
    let (entered, left) = (output.find("\x1b[?1049h"), output.find("\x1b[?1049l"));
    assert!(entered.is_some() && entered < left && left < output.find("the reason"), "in that order");
}
