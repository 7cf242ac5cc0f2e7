//! `record` and `play` as run by a user: how a recording ends, and that it can be replayed as a robot.

#![cfg(feature = "recording")]

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use toposlam_link::recording::{Recording, TimedFrame};

fn toposlam(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_toposlam"));
    command.args(arguments);
    command
}

fn printed(arguments: &[&str]) -> String {
    let output = toposlam(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// A process that is killed at the end of the test.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The name of the line in the first line of a program's output: `… tcp:HOST:PORT`.
fn address(output: impl Read) -> String {
    let mut text = String::new();
    BufReader::new(output).read_line(&mut text).unwrap();
    text.split_whitespace().last().unwrap().to_owned()
}

/// A simulated robot at high speed, and its line.
fn robot() -> (Process, String) {
    let mut robot = toposlam(&["robot", "--listen", "127.0.0.1:0", "--plan", "flat", "--speed", "50"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let line = address(robot.stdout.take().unwrap());
    (Process(robot), line)
}

fn frames(file: &Path) -> (Vec<TimedFrame>, bool) {
    let mut recording = Recording::open(file).unwrap();
    let frames = recording.by_ref().map(Result::unwrap).collect();
    (frames, recording.is_cut())
}

fn bytes(frames: &[TimedFrame]) -> Vec<u8> {
    frames.iter().flat_map(|frame| frame.bytes.clone()).collect()
}

#[test]
fn a_played_recording_sends_the_bytes_of_the_robot() {
    let directory = tempfile::tempdir().unwrap();
    let [first, second] = ["first.mcap", "second.mcap"].map(|name| directory.path().join(name));
    let (_robot, line) = robot();
    let text = printed(&["record", &line, first.to_str().unwrap(), "--places", "4"]);
    assert!(text.contains("4 places"), "{text}");

    let mut play = toposlam(&["play", first.to_str().unwrap(), "--listen", "127.0.0.1:0", "--speed", "100"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let line = address(play.stderr.take().unwrap());
    printed(&["record", &line, second.to_str().unwrap()]);
    let mut summary = String::new();
    play.stdout.take().unwrap().read_to_string(&mut summary).unwrap();
    assert!(play.wait().unwrap().success());

    let (frames_of_first, is_cut) = frames(&first);
    assert!(!is_cut && !frames(&second).1);
    assert!(bytes(&frames_of_first) == bytes(&frames(&second).0));
    assert_eq!(printed(&["play", first.to_str().unwrap()]), summary);
    assert!(summary.contains("0 damaged") && summary.contains("map: "), "{summary}");

    let raw = directory.path().join("raw");
    printed(&["play", first.to_str().unwrap(), "--output", raw.to_str().unwrap(), "--fast"]);
    assert!(std::fs::read(raw).unwrap() == bytes(&frames_of_first));
    let again = toposlam(&["record", &line, first.to_str().unwrap()]).output().unwrap();
    assert!(!again.status.success(), "record must not overwrite a file or accept a missing line");
    assert_eq!(frames(&first).0, frames_of_first);
}

#[test]
fn a_recording_of_a_robot_is_mapped_again_from_its_ring_frames() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.mcap");
    let (_robot, line) = robot();
    printed(&["record", &line, file.to_str().unwrap(), "--places", "6"]);
    let text = printed(&["replay", file.to_str().unwrap()]);
    // The recording may begin after the first place and end during the last.
    let places: usize =
        text.lines().find_map(|line| line.split_once(" frames, ")?.1.strip_suffix(" places")?.parse().ok()).unwrap();
    assert!((5..=8).contains(&places), "{text}");
    let refused = toposlam(&["replay", file.to_str().unwrap(), "--ring", "scitos-g5"]).output().unwrap();
    assert!(String::from_utf8_lossy(&refused.stderr).contains("the ring has 24 sonars, the recording 16"));
}

#[cfg(unix)]
#[test]
fn ctrl_c_finishes_a_recording_and_a_kill_leaves_it_readable() {
    let directory = tempfile::tempdir().unwrap();
    let (_robot, line) = robot();
    for (signal, is_finished) in [("-INT", true), ("-KILL", false)] {
        let file = directory.path().join(format!("{signal}.mcap"));
        let mut record = toposlam(&["record", &line, file.to_str().unwrap()]).stdout(Stdio::piped()).spawn().unwrap();
        // A chunk is written when it is complete; the file header alone is shorter than this.
        while !std::fs::metadata(&file).is_ok_and(|file| file.len() > 100_000) {
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        assert!(Command::new("kill").args([signal, &record.id().to_string()]).status().unwrap().success());
        assert_eq!(record.wait().unwrap().success(), is_finished);
        let (frames, is_cut) = frames(&file);
        assert_eq!(is_cut, !is_finished);
        assert!(!frames.is_empty());
    }
}

#[test]
fn a_played_recording_answers_what_it_can_keeps_its_map_and_refuses_the_rest_in_words() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("flat.mcap");
    let file = file.to_str().unwrap();
    let (_robot, line) = robot();
    printed(&["record", &line, file, "--places", "4"]);
    let mut play = toposlam(&["play", file, "--listen", "127.0.0.1:0", "--speed", "1000", "--wait"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let line = address(play.stderr.take().unwrap());
    let _play = Process(play);
    assert!(printed(&["command", &line, "info"]).contains("toposlam "));
    // Played to its end, the recording keeps the last map.
    let recorded = printed(&["export", file, "--format", "graphml"]);
    let deadline = std::time::Instant::now() + std::time::Duration::from_secs(60);
    while printed(&["export", &line, "--format", "graphml"]) != recorded {
        assert!(std::time::Instant::now() < deadline, "{recorded}");
    }
    for arguments in [&["explore"][..], &["go-to", "1"], &["reset"], &["set", "noise-mm", "40"], &["get"]] {
        let output = toposlam(&[&["command", &line], arguments].concat()).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && text.contains("it is a recording, not a robot"), "{arguments:?}: {text}");
    }
    printed(&["command", &line, "pause", "on"]);
    assert!(printed(&["command", &line, "info"]).contains("paused"));
}

#[test]
fn an_empty_recording_is_an_error() {
    let directory = tempfile::tempdir().unwrap();
    let [empty, without] = ["empty.mcap", "without.mcap"].map(|name| directory.path().join(name));
    std::fs::write(&empty, b"").unwrap();
    toposlam_link::recording::Recorder::create(&without).unwrap().finish().unwrap();
    for file in [empty, without] {
        let output = toposlam(&["play", file.to_str().unwrap()]).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && text.contains(file.to_str().unwrap()), "{text}");
    }
}
