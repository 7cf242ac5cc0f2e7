//! Output that fails: a reader that closes it ends a command quietly, a full device is an error, and nothing panics.

#![cfg(unix)]

use std::io::Read;
use std::process::{Command, Stdio};

/// Commands that print much, at once or slowly.
const COMMANDS: &[&[&str]] = &[
    &["simulate", "--places", "30"],
    &["simulate", "--places", "30", "--on-graph"],
    &["plan", "office"],
    &["explore", "--plans", "plus", "--runs", "1", "--places", "4", "--goals", "0", "--noises", "1", "--runs-table"],
    &["evaluate", "--environment", "../eval/environments/table-i.toml", "--paths", "1", "--lengths", "5"],
    &["fleet", "--simulate", "2", "--seconds", "2", "--speed", "0"],
    &["robot", "--listen", "127.0.0.1:0", "--places", "1", "--speed", "1000"],
    &["serve", "tcp:127.0.0.1:1", "--listen", "127.0.0.1:0"],
];

fn toposlam(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_toposlam"));
    command.args(arguments).stdin(Stdio::null()).stderr(Stdio::piped());
    command
}

#[test]
fn a_closed_output_ends_every_command_quietly() {
    for arguments in COMMANDS.iter().filter(|arguments| !["robot", "serve"].contains(&arguments[0])) {
        let mut child = toposlam(arguments).stdout(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {complaint}");
        assert!(!complaint.contains("panicked") && !complaint.contains("Error"), "{arguments:?}: {complaint}");
    }
}

#[test]
fn a_reader_that_stops_after_one_line_ends_a_simulation_early() {
    let mut child =
        toposlam(&["simulate", "--places", "100000", "--frames", "0"]).stdout(Stdio::piped()).spawn().unwrap();
    let mut output = child.stdout.take().unwrap();
    output.read_exact(&mut [0; 20]).unwrap();
    drop(output);
    assert!(child.wait().unwrap().success());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_an_error_that_names_the_output() {
    for arguments in COMMANDS {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = toposlam(arguments).stdout(full).output().unwrap();
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {complaint}");
        assert!(complaint.contains("writing the standard output"), "{arguments:?}: {complaint}");
        assert!(complaint.contains("No space left"), "{arguments:?}: {complaint}");
    }
    // A standard error that fails as well changes nothing but the message.
    let full = || std::fs::File::options().write(true).open("/dev/full").unwrap();
    let status = toposlam(&["plan", "office"]).stdout(full()).stderr(full()).status().unwrap();
    assert_eq!(status.code(), Some(1));
}
