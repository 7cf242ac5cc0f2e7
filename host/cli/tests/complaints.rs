//! What commands say about input that is wrong, and how they end.

mod program;

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use program::{Robot, TOPOSLAM, complaint, printed, toposlam};
use toposlam::wire::{Encoder, Hello, MAX_FRAME_BYTES, Message, ResetCause};

const OFFICE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/office.bin");

fn path<'a>(directory: &'a tempfile::TempDir, name: &str) -> &'a str {
    let file = directory.path().join(name);
    Box::leak(file.to_str().unwrap().to_owned().into_boxed_str())
}

/// Exports `bytes` in a file.
fn export(bytes: &[u8]) -> std::process::Output {
    let directory = tempfile::tempdir().unwrap();
    let file = path(&directory, "source");
    std::fs::write(file, bytes).unwrap();
    toposlam(&["export", file, "--format", "json"])
}

#[test]
fn a_source_that_holds_no_map_is_named_as_what_it_is() {
    let directory = tempfile::tempdir().unwrap();
    let (map, snapshot) = (path(&directory, "map.json"), path(&directory, "map.snapshot"));
    printed(&toposlam(&["export", OFFICE, "--format", "json", "--output", map]));
    printed(&toposlam(&["export", map, "--format", "snapshot", "--output", snapshot]));
    let good = std::fs::read(snapshot).unwrap();
    let mut damaged = good.clone();
    damaged[good.len() / 2] ^= 4;
    for (bytes, why) in [
        (&damaged[..], "the CRC is wrong"),
        (&good[..good.len() - 7], "the snapshot is cut short"),
        (b"{\"type\": \"Feature\"}", "not a map of toposlam"),
        (b"{", "not JSON"),
        (b"<svg/>", "the root element is not graphml"),
        (b"\x89PNG\r\n\x1a\n", "no message of a robot, and no map"),
        (b"", "no message of a robot, and no map"),
    ] {
        let text = complaint(&export(bytes));
        assert!(text.contains(why) && !text.contains("incomplete"), "{why}: {text}");
    }
    for command in [
        &["export", "no-such-file.json", "--format", "json"][..],
        &["monitor", "no-such-file.bin", "--headless", "--seconds", "1"],
    ] {
        let output = toposlam(command);
        let text = complaint(&output) + &String::from_utf8_lossy(&output.stdout);
        assert!(text.contains("no such file or serial port"), "{command:?}: {text}");
    }
}

#[test]
fn export_and_merge_refuse_an_existing_output_before_they_read_the_source() {
    let directory = tempfile::tempdir().unwrap();
    let output = path(&directory, "map.json");
    std::fs::write(output, "precious").unwrap();
    // Nothing listens there.
    for command in
        [&["export", "tcp:127.0.0.1:1", "--format", "json"][..], &["merge", "tcp:127.0.0.1:1", "tcp:127.0.0.1:1"]]
    {
        let text = complaint(&toposlam(&[command, &["--output", output]].concat()));
        assert!(text.contains("exists; --force replaces it"), "{text}");
    }
}

#[test]
fn a_plan_error_names_its_cause_once_and_a_byte_order_mark_is_no_error() {
    let directory = tempfile::tempdir().unwrap();
    let plan = path(&directory, "plan.txt");
    let cells = "cell_mm 250\n########\n#..S...#\n#......#\n########\n";
    std::fs::write(plan, format!("\u{feff}{cells}")).unwrap();
    printed(&toposlam(&["plan", plan]));
    std::fs::write(plan, "cell_mm 250\n###X##\n").unwrap();
    let text = complaint(&toposlam(&["plan", plan]));
    assert_eq!(text.matches("'X' is none of").count(), 1, "{text}");
}

#[test]
fn plan_warns_of_places_with_little_room_for_the_body() {
    let directory = tempfile::tempdir().unwrap();
    let plan = path(&directory, "narrow.txt");
    // Corridors of 400 mm around a block, for a body of 300 mm.
    std::fs::write(plan, "cell_mm 400\n#######\n#S....#\n#.###.#\n#.....#\n#######\n").unwrap();
    let text = printed(&toposlam(&["plan", plan]));
    assert!(text.contains("warning: place 0 leaves"), "{text}");
    assert!(!printed(&toposlam(&["plan", "office"])).contains("leaves"));
}

#[test]
fn a_simulated_robot_that_is_stuck_ends_the_command_with_the_reason() {
    let directory = tempfile::tempdir().unwrap();
    let plan = path(&directory, "closet.txt");
    // The robot cannot turn or drive.
    std::fs::write(plan, "cell_mm 100\n#####\n#...#\n#.S.#\n#...#\n#####\n").unwrap();
    let text = complaint(&toposlam(&["simulate", "--plan", plan, "--places", "50"]));
    assert!(text.contains("the robot is stuck at") && text.contains("of 50 places"), "{text}");
}

#[test]
fn a_recording_without_a_row_of_ranges_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let (ring, csv) = (path(&directory, "ring.toml"), path(&directory, "ranges.csv"));
    std::fs::write(ring, "sonars = 4\nunit = \"mm\"\nmax_range = 4000\nstep_deg = 90\nfirst_bearing_deg = 0\ncolumns = [\"a\", \"b\", \"c\", \"d\"]\n").unwrap();
    std::fs::write(csv, "a,b,c,d\n").unwrap();
    let text = complaint(&toposlam(&["replay", csv, "--ring", ring]));
    assert!(text.contains("no row of ranges"), "{text}");
}

#[test]
fn a_fleet_of_which_no_robot_answers_fails() {
    let directory = tempfile::tempdir().unwrap();
    let lines = path(&directory, "robots.txt");
    std::fs::write(lines, "tcp:127.0.0.1:1 kitchen\ntcp:127.0.0.1:1 hall\n").unwrap();
    let text = complaint(&toposlam(&["fleet", lines, "--seconds", "1"]));
    assert!(text.contains("no robot has sent a message"), "{text}");
    assert!(text.contains("kitchen failed"), "{text}");
}

/// Two robots in one plan; whether their maps are certain to be of one building depends on how far they are.
#[test]
fn a_fleet_keeps_the_maps_of_its_robots_by_building() {
    let directory = tempfile::tempdir().unwrap();
    let (lines, maps) = (path(&directory, "robots.txt"), path(&directory, "maps"));
    let robots = [Robot::start("127.0.0.1:0", "200"), Robot::start("127.0.0.1:0", "200")];
    std::fs::write(lines, format!("{} kitchen\n{} hall\n", robots[0].line, robots[1].line)).unwrap();
    let text = loop {
        let text = printed(&toposlam(&["fleet", lines, "--seconds", "3", "--maps", maps, "--force"]));
        if text.contains("kitchen") && text.contains("hall") {
            break text;
        }
    };
    assert!(text.contains("building 1: ") && text.contains(" from "), "{text}");
    let file = format!("{maps}/building-1.json");
    assert!(printed(&toposlam(&["export", &file, "--format", "graphml"])).contains("<node "));
    assert!(complaint(&toposlam(&["fleet", lines, "--maps", maps])).contains("--force replaces"));
}

#[cfg(target_os = "linux")]
#[test]
fn help_and_version_to_a_full_device_are_errors() {
    for arguments in [&["--help"][..], &["--version"], &["command", "--help"]] {
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = Command::new(TOPOSLAM).args(arguments).stdout(full).output().unwrap();
        assert!(complaint(&output).contains("writing the standard output"), "{arguments:?}");
        assert!(!printed(&toposlam(arguments)).is_empty());
    }
}

#[cfg(unix)]
#[test]
fn a_line_that_is_not_utf_8_is_refused_in_words() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let line = OsStr::from_bytes(b"/dev/tty\xff");
    for (before, after) in [(&["command"][..], &["info"][..]), (&["monitor"], &["--headless"]), (&["serve"], &[])] {
        let output = Command::new(TOPOSLAM).args(before).arg(line).args(after).output().unwrap();
        let text = complaint(&output);
        assert!(text.contains("UTF-8"), "{before:?}: {text}");
    }
}

/// The headless monitor of a line on which two robots send, and one restarts.
#[test]
fn the_headless_monitor_reports_restarts_and_several_robots() {
    let capacities = toposlam::wire::Capacities {
        vertices: 16,
        hypotheses: 10,
        history: 400,
        ngram_length: 5,
        fingerprint_step_mm: 2,
        sonars: 16,
    };
    let hello = |session| {
        let hello = Hello { session, ..Hello::new(0, ResetCause::PowerOn, 1, capacities) };
        Encoder::new(0).encode(&Message::Hello(hello), &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec()
    };
    let monitored = |sessions: &[u32], json: bool| {
        let mut arguments = vec!["monitor", "-", "--headless"];
        arguments.extend(json.then_some("--json"));
        let mut child =
            Command::new(TOPOSLAM).args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let bytes: Vec<u8> = sessions.iter().flat_map(|&session| hello(session)).collect();
        child.stdin.take().unwrap().write_all(&bytes).unwrap();
        printed(&child.wait_with_output().unwrap())
    };
    let (words, json) = (monitored(&[1, 2], false), monitored(&[1, 2], true));
    assert!(words.contains("the robot has restarted") && json.contains("\"restart\":true"), "{words}{json}");
    assert!(!words.contains("several robots") && !json.contains("Several"), "{words}{json}");
    let (words, json) = (monitored(&[1, 2, 1, 2], false), monitored(&[1, 2, 1, 2], true));
    assert_eq!(words.matches("warning: several robots send on this line").count(), 1, "{words}");
    assert_eq!(json.matches("\"event\":\"Several\"").count(), 1, "{json}");
}

#[test]
fn info_and_confirmations_are_plain_sentences() {
    let robot = Robot::start("127.0.0.1:0", "50");
    let text = printed(&toposlam(&["command", &robot.line, "info"]));
    assert!(!text.contains("for an unknown reason"), "{text}");
    assert!(text.contains("started: "), "{text}");
    let text = printed(&toposlam(&["command", &format!("tcp:{}", robot.address()), "pause", "on"]));
    assert_eq!(text, "the robot is paused\n");
}

#[test]
fn a_file_as_a_line_is_refused_as_a_file() {
    assert!(Path::new(OFFICE).is_file());
    let text = complaint(&toposlam(&["command", OFFICE, "info"]));
    assert!(text.contains("not a serial port"), "{text}");
}
