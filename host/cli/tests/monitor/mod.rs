//! `toposlam monitor` with `toposlam robot`: headless, and in a pseudo terminal.

mod terminal;

use std::io::Write;
use std::ops::ControlFlow;
use std::process::{Command, Stdio};

use serde_json::Value;
use terminal::PseudoTerminal;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam_cli::monitor::screen;
use toposlam_link::link::Options;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

use super::program::{Robot, TOPOSLAM, complaint, printed, toposlam};

/// The stream of a robot until it has detected the given number of places.
fn recording(places: usize) -> Vec<u8> {
    let plan = Plan::built_in("ring").unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
    let mut said = Vec::new();
    while exploration.places() < places {
        exploration.advance();
        said.extend_from_slice(&exploration.board().sent);
    }
    said
}

#[test]
fn headless_json_prints_an_object_per_line_and_stops_at_the_event_limit() {
    let robot = Robot::start("127.0.0.1:0", "50");
    let text = printed(&toposlam(&["monitor", &robot.line, "--headless", "--json", "--events", "100"]));
    let events: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(events.len(), 101, "{text}");
    assert_eq!((&events[0]["event"], &events[0]["line"]), (&"Connected".into(), &robot.line.as_str().into()));
    let drives = events.iter().filter(|event| event["event"] == "Velocity" && event["heading_mrad"].is_i64());
    assert!(drives.count() > 10, "{text}");
}

#[test]
fn headless_reads_the_standard_input_to_its_end() {
    let mut monitor = Command::new(TOPOSLAM)
        .args(["monitor", "-", "--headless"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = monitor.stdin.take().unwrap();
    let said = recording(5);
    let writing = std::thread::spawn(move || input.write_all(&said).unwrap());
    let text = printed(&monitor.wait_with_output().unwrap());
    writing.join().unwrap();
    assert!(text.starts_with("connected to -\n") && text.ends_with("the input has ended\n"), "{text}");
    assert_eq!(text.lines().filter(|line| line.starts_with("place ")).count(), 5, "{text}");
    assert!(text.lines().any(|line| line.starts_with("hello: protocol version")), "{text}");
}

#[test]
fn headless_fails_after_a_timeout_and_the_screen_without_a_terminal() {
    // No robot listens at port 1 of this computer.
    let alone = ["monitor", "tcp:127.0.0.1:1", "--headless", "--json", "--seconds", "0.1"];
    let output = toposlam(&alone);
    assert!(complaint(&output).contains("0 of 1 events"));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(said["event"], "Disconnected");
    assert!(complaint(&toposlam(&["monitor", "tcp:127.0.0.1:1"])).contains("no terminal"));
}

#[test]
fn the_screen_shows_a_robot_reconnects_and_restores_the_terminal() {
    let robot = Robot::start("127.0.0.1:0", "50");
    let Some(mut terminal) = PseudoTerminal::running(&format!("{TOPOSLAM} monitor {}", robot.line)) else { return };
    for text in ["connected", "its rivals", "at vertex", "as the robot has it"] {
        terminal.wait_for(text);
    }
    assert!(terminal.is_taken());
    terminal.press("?");
    terminal.wait_for("any key goes back");
    terminal.press(" p");
    terminal.wait_for("pause: done");
    terminal.press("g250\r");
    terminal.wait_for("go to 250: refused: the map has no such vertex");
    let address = robot.address();
    drop(robot);
    terminal.wait_for("trying again");
    let _robot = Robot::start(&address, "50");
    terminal.wait_until("the line is open again", |text| !text.contains("What is shown is as it was"));
    terminal.press("i");
    terminal.wait_for("info: toposlam");
    terminal.press("q");
    assert_eq!(terminal.end(), Some(0));
}

#[test]
fn control_c_and_signals_restore_the_terminal() {
    let nobody = format!("{TOPOSLAM} monitor tcp:127.0.0.1:1");
    let Some(mut terminal) = PseudoTerminal::running(&nobody) else { return };
    terminal.wait_for("trying again");
    terminal.press("\u{3}");
    assert_eq!(terminal.end(), Some(0));

    let directory = tempfile::tempdir().unwrap();
    let number = directory.path().join("process");
    let numbered = format!("sh -c 'echo $$ > {}; exec {nobody}'", number.display());
    let Some(mut terminal) = PseudoTerminal::running(&numbered) else { return };
    terminal.wait_for("trying again");
    let number = std::fs::read_to_string(number).unwrap();
    assert!(Command::new("kill").args(["-TERM", number.trim()]).status().unwrap().success());
    assert_eq!(terminal.end(), Some(0));
}

#[test]
fn keys_come_from_the_terminal_when_the_robot_is_the_standard_input() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.bytes");
    std::fs::write(&file, recording(5)).unwrap();
    let Some(mut terminal) = PseudoTerminal::running(&format!("cat {} | {TOPOSLAM} monitor -", file.display())) else {
        return;
    };
    terminal.wait_for("the input has ended");
    terminal.wait_for("at vertex");
    terminal.press("e");
    terminal.wait_for("the standard input takes no commands");
    terminal.press("q");
    assert_eq!(terminal.end(), Some(0));
}

#[test]
fn a_panic_restores_the_terminal_and_is_readable() {
    let this = std::env::current_exe().unwrap();
    let name = "monitor::panics_on_the_screen";
    let command = format!("{} --ignored --exact --nocapture {name}", this.display());
    let Some(mut terminal) = PseudoTerminal::running(&command) else { return };
    terminal.wait_for("1 passed");
    assert!(terminal.text().contains("a panic on purpose"), "{}", terminal.text());
    assert_eq!(terminal.end(), Some(0));
}

#[test]
#[ignore = "the test above runs it in a pseudo terminal"]
#[should_panic(expected = "a panic on purpose")]
fn panics_on_the_screen() {
    let show = |_: &_| -> ControlFlow<()> { panic!("a panic on purpose") };
    screen::run("tcp:127.0.0.1:1", 0, Options::default(), show).unwrap();
}
