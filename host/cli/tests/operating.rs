//! What an operator does to a live robot and with files: settings, snapshots, goals, and files that exist already.

mod program;

use std::path::Path;
use std::process::{Command, Output, Stdio};

use program::{Robot, TOPOSLAM, complaint, printed, toposlam};

/// A robot on a free port.
fn robot(speed: &str) -> Robot {
    Robot::start("127.0.0.1:0", speed)
}

impl Robot {
    fn command(&self, arguments: &[&str]) -> Output {
        toposlam(&[&["command", &self.line], arguments].concat())
    }

    /// Waits for a map of this many vertices.
    fn wait_for_vertices(&self, least: usize) {
        loop {
            let map = printed(&self.command(&["map"]));
            if map.lines().filter(|line| line.starts_with("  vertex")).count() >= least {
                return;
            }
        }
    }
}

fn path<'a>(directory: &'a tempfile::TempDir, name: &str) -> &'a str {
    let file = directory.path().join(name);
    Box::leak(file.to_str().unwrap().to_owned().into_boxed_str())
}

#[test]
fn every_setting_is_read_and_a_value_out_of_range_names_the_range() {
    let robot = robot("20");
    let settings = printed(&robot.command(&["get"]));
    for name in ["noise-mm ", "equidistance-mm ", "leave-mm ", "speed-permille 1000", "snapshot-every-places "] {
        assert!(settings.lines().any(|line| line.starts_with(name)), "{name}: {settings}");
    }
    let info = printed(&robot.command(&["info"]));
    assert!(info.contains("maps") && info.contains(settings.trim_end()), "{info}");
    printed(&robot.command(&["set", "noise-mm", "77"]));
    assert_eq!(printed(&robot.command(&["get", "noise-mm"])), "noise-mm 77\n");
    let text = complaint(&robot.command(&["set", "noise-mm", "0"]));
    assert!(text.contains("noise-mm 0 is out of its range, 1 to 1000"), "{text}");
    let text = complaint(&robot.command(&["get", "moves"]));
    assert!(text.contains("the robot has no such setting"), "{text}");
}

#[test]
fn restore_says_what_it_changes_and_can_keep_the_settings() {
    let directory = tempfile::tempdir().unwrap();
    let file = path(&directory, "robot.snapshot");
    let robot = robot("100");
    robot.wait_for_vertices(2);
    printed(&robot.command(&["set", "noise-mm", "77"]));
    printed(&robot.command(&["snapshot", file]));
    assert!(complaint(&robot.command(&["snapshot", file])).contains("exists; --force replaces it"));
    printed(&robot.command(&["snapshot", file, "--force"]));
    for arguments in [&["set", "noise-mm", "50"][..], &["localise-only", "on"]] {
        printed(&robot.command(arguments));
    }
    let text = printed(&robot.command(&["restore", file, "--keep-settings"]));
    for expected in ["kept, the snapshot has: noise-mm 77, was 50", "kept, the snapshot has: localise-only off, was on"]
    {
        assert!(text.contains(expected), "{text}");
    }
    assert_eq!(printed(&robot.command(&["get", "noise-mm"])), "noise-mm 50\n");
    assert!(printed(&robot.command(&["info"])).contains("keeps the map and localises"));
    let text = printed(&robot.command(&["restore", file]));
    assert!(
        text.contains("changed: noise-mm 77, was 50") && text.contains("changed: localise-only off, was on"),
        "{text}"
    );
    assert_eq!(printed(&robot.command(&["get", "noise-mm"])), "noise-mm 77\n");
    // A setting that is changed later, and a reset, do not bring back the value of before.
    printed(&robot.command(&["set", "speed-permille", "900"]));
    printed(&robot.command(&["reset"]));
    assert_eq!(printed(&robot.command(&["get", "noise-mm"])), "noise-mm 77\n");
}

#[test]
fn go_to_waits_for_the_arrival_and_its_exit_status_says_how_it_ended() {
    let robot = robot("200");
    robot.wait_for_vertices(3);
    let output = robot.command(&["go-to", "0", "--wait", "--wait-s", "60"]);
    assert!(printed(&output).contains("at vertex 0"));
    printed(&robot.command(&["pause", "on"]));
    let output = robot.command(&["go-to", "1", "--wait", "--wait-s", "0.5"]);
    assert_eq!(output.status.code(), Some(4), "{}", complaint(&output));
    let text = complaint(&output);
    assert!(text.contains("is paused, and drives after") && text.contains("after 0.5 s, and is paused"), "{text}");
    let waiting = Command::new(TOPOSLAM)
        .args(["command", &robot.line, "go-to", "1", "--wait", "--wait-s", "60"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_secs(1));
    printed(&robot.command(&["go-to", "2"]));
    let output = waiting.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", complaint(&output));
    assert!(complaint(&robot.command(&["go-to", "60", "--wait"])).contains("no such vertex"));
}

#[test]
fn no_command_overwrites_a_file_without_force() {
    let directory = tempfile::tempdir().unwrap();
    let svg = path(&directory, "map.svg");
    std::fs::write(svg, "precious").unwrap();
    let commands: [&[&str]; 3] = [
        &["plan", "plus", "--svg", svg],
        &["simulate", "--plan", "plus", "--places", "2", "--svg", svg],
        &["simulate", "--plan", "plus", "--places", "2", "--animate", svg],
    ];
    for arguments in commands {
        assert!(complaint(&toposlam(arguments)).contains("map.svg exists; --force replaces it"), "{arguments:?}");
        assert_eq!(std::fs::read_to_string(svg).unwrap(), "precious");
    }
    printed(&toposlam(&[commands[0], &["--force"]].concat()));
    assert!(std::fs::read_to_string(svg).unwrap().contains("<svg"));
}

#[test]
fn the_recording_in_the_repository_has_a_whole_map() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/office.bin");
    let output = toposlam(&["export", file, "--format", "graphml"]);
    assert!(printed(&output).matches("<node ").count() > 6);
    assert!(!String::from_utf8_lossy(&output.stderr).contains("incomplete"));
}

#[test]
fn the_version_names_the_program_and_a_fleet_of_an_impossible_size_is_refused() {
    assert!(printed(&toposlam(&["--version"])).starts_with("toposlam "));
    assert!(complaint(&toposlam(&["fleet", "--simulate", "0"])).contains("0 is not in 1.."));
    let text = complaint(&toposlam(&["fleet", "--simulate", "3000000"]));
    assert!(text.contains("the operating system allows"), "{text}");
}

#[cfg(target_os = "linux")]
#[test]
fn file_names_need_not_be_utf_8() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let directory = tempfile::tempdir().unwrap();
    let named = |name: &[u8]| directory.path().join(OsStr::from_bytes(name));
    let (plan, svg, stream) = (named(b"pl\xffan.txt"), named(b"m\xffap.svg"), named(b"st\xffream.bin"));
    std::fs::write(&plan, "cell_mm 500\n#########\n#.......#\n#.#####.#\n#.......#\n#########\n").unwrap();
    let run = |arguments: &[&OsStr]| Command::new(TOPOSLAM).args(arguments).output().unwrap();
    printed(&run(&["plan".as_ref(), plan.as_ref(), "--svg".as_ref(), svg.as_ref()]));
    assert!(Path::new(&svg).is_file());
    let robot = robot("100");
    robot.wait_for_vertices(2);
    let mut line = std::net::TcpStream::connect(robot.address()).unwrap();
    let mut bytes = vec![0; 20_000];
    std::io::Read::read_exact(&mut line, &mut bytes).unwrap();
    std::fs::write(&stream, &bytes).unwrap();
    let text = printed(&run(&["export".as_ref(), stream.as_ref(), "--format".as_ref(), "json".as_ref()]));
    assert!(text.contains("\"vertices\""), "{text}");
    // Two streams in one file are two starts, and the map is that of the last one.
    std::fs::write(&stream, [&bytes[..], &bytes].concat()).unwrap();
    let output = run(&["export".as_ref(), stream.as_ref(), "--format".as_ref(), "json".as_ref()]);
    assert_eq!(printed(&output), text);
    assert!(String::from_utf8_lossy(&output.stderr).contains("1 restart of the robot;"));
}

#[test]
fn a_place_has_a_name_until_it_is_cleared_and_go_to_takes_it() {
    let directory = tempfile::tempdir().unwrap();
    let (snapshot, json) = (path(&directory, "robot.snapshot"), path(&directory, "map.json"));
    let robot = robot("100");
    robot.wait_for_vertices(4);
    printed(&robot.command(&["localise-only", "on"]));
    assert!(printed(&robot.command(&["name"])).is_empty());
    printed(&robot.command(&["name", "1", "Küche"]));
    printed(&robot.command(&["name", "2", "hall"]));
    for (arguments, why) in [
        (&["name", "0", "hall"][..], "another vertex has this name"),
        (&["name", "60", "roof"], "the map has no such vertex"),
        (&["name", "0", "a name of 17 byte"], "a name has at most 16 bytes"),
        (&["name", "0", "3"], "a name is not a number"),
        (&["name", "0"], "--clear clears the name"),
        (&["go-to", "cellar"], "no vertex has the name `cellar`"),
    ] {
        let text = complaint(&robot.command(arguments));
        assert!(text.contains(why), "{arguments:?}: {text}");
    }
    assert_eq!(printed(&robot.command(&["name"])), "1 Küche\n2 hall\n");
    assert!(printed(&robot.command(&["map"])).contains("visits, Küche"));
    assert!(printed(&robot.command(&["go-to", "hall", "--wait"])).contains("at vertex 2 hall"));
    // A snapshot and every export have the names.
    printed(&robot.command(&["snapshot", snapshot]));
    for source in [&robot.line, snapshot] {
        printed(&toposlam(&["export", source, "--format", "json", "--output", json, "--force"]));
        for (format, expected) in [
            ("graphml", "<data key=\"name\">Küche</data>"),
            ("dot", "name = \"Küche\""),
            ("geojson", "\"name\": \"Küche\""),
            ("json", "\"name\": \"Küche\""),
            ("svg", "Küche"),
        ] {
            let text = printed(&toposlam(&["export", json, "--format", format]));
            assert!(text.contains(expected), "{format}: {text}");
        }
    }
    printed(&robot.command(&["name", "hall", "lobby"]));
    printed(&robot.command(&["name", "Küche", "--clear"]));
    assert_eq!(printed(&robot.command(&["name"])), "2 lobby\n");
    printed(&robot.command(&["restore", snapshot]));
    assert_eq!(printed(&robot.command(&["name"])), "1 Küche\n2 hall\n");
    printed(&robot.command(&["reset"]));
    assert!(printed(&robot.command(&["name"])).is_empty());
}

/// GraphML and GeoJSON of `export` are a known map for a robot, with its names.
#[test]
fn a_robot_localises_on_an_exported_map_of_every_format_that_is_read() {
    let directory = tempfile::tempdir().unwrap();
    let robot = robot("100");
    robot.wait_for_vertices(3);
    printed(&robot.command(&["localise-only", "on"]));
    printed(&robot.command(&["name", "1", "hall"]));
    let map = path(&directory, "map.json");
    printed(&toposlam(&["export", &robot.line, "--format", "json", "--output", map]));
    let known = path(&directory, "known.snapshot");
    let expected = printed(&toposlam(&["export", map, "--format", "dot"]));
    for format in ["json", "graphml", "geojson"] {
        let file = path(&directory, format);
        printed(&toposlam(&["export", map, "--format", format, "--output", file]));
        assert_eq!(printed(&toposlam(&["export", file, "--format", "dot"])), expected, "{format}");
        printed(&toposlam(&["export", file, "--format", "snapshot", "--output", known, "--force"]));
        let text = printed(&robot.command(&["restore", known]));
        assert!(!text.contains("localise-only off"), "{format}: {text}");
        assert_eq!(printed(&robot.command(&["name"])), "1 hall\n", "{format}");
    }
}
