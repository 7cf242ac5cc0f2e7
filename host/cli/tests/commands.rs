//! The command line: output, files and errors.

mod monitor;
mod program;

use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;

use toposlam::wire::{
    self, Chunk, Encoder, Inbox, Info, MAX_FRAME_BYTES, Message, Outcome, Refusal, ResetCause, Row, Version, crc32,
};

use program::{complaint, printed, toposlam};

#[test]
fn simulate_prints_a_line_for_each_place_and_draws_the_map() {
    let directory = tempfile::tempdir().unwrap();
    let svg = directory.path().join("map.svg");
    let text = printed(&toposlam(&["simulate", "--plan", "ring", "--places", "8", "--svg", svg.to_str().unwrap()]));
    assert_eq!(text.lines().filter(|line| line.starts_with("place ")).count(), 8);
    assert!(text.contains("ring: 8 places in 8 visits"), "{text}");
    assert!(std::fs::read_to_string(svg).unwrap().contains("ring: the map after 8 places"));
}

#[test]
fn plan_lists_the_places_of_a_map_draws_them_and_warns() {
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    // Two rooms of 3 m by 2 m, apart by a wall of 0.2 m.
    let pixel = |x: u32, y: u32| if (2..42).contains(&y) && (2..62).contains(&(x % 64)) { 255 } else { 0 };
    let pixels = (0..44).flat_map(|y| (0..128).map(move |x| pixel(x, y)));
    std::fs::write(file("map.pgm"), b"P5 128 44 255\n".iter().copied().chain(pixels).collect::<Vec<u8>>()).unwrap();
    std::fs::write(file("map.yaml"), "image: map.pgm\nresolution: 0.05\norigin: [-1, 2, 0]\n").unwrap();
    let (map, svg) = (file("map.yaml"), file("plan.svg"));
    let text = printed(&toposlam(&["plan", &map, "--svg", &svg, "--start", "4.5,3"]));
    assert!(text.contains("6.40 m by 2.20 m, 8 wall surfaces, start 4.50,3.00"), "{text}");
    assert!(text.contains("place   0 at     3.30,3.10    radius  1000 mm, degree 1"), "{text}");
    assert!(text.contains("edge   0 -   1, 1.00 m") && text.contains("unreachable: 2 meet points"), "{text}");
    assert!(!text.contains("warning"), "{text}");
    assert!(std::fs::read_to_string(&svg).unwrap().contains("2 places, 1 edge"));
    let text = printed(&toposlam(&["plan", &map, "--start", "-0.85,3"]));
    assert!(text.contains("warning: the body does not fit at the start"), "{text}");
    // Nine by nine corridors 2 m wide.
    let cell = |x: u32, y: u32| if x % 12 < 4 || y % 12 < 4 { '.' } else { '#' };
    let rows: Vec<String> = (0..100).map(|y| (0..100).map(|x| cell(x, y)).collect()).collect();
    std::fs::write(file("grid.txt"), format!("cell_mm 500\n{}\n", rows.join("\n"))).unwrap();
    assert!(printed(&toposlam(&["plan", &file("grid.txt")])).contains("warning: 81 places"));
    assert!(complaint(&toposlam(&["plan", &map, "--start", "-2,3"])).contains("in a wall"));
    std::fs::write(file("map.yaml"), "image: map.pgm\nresolution: -0.05\n").unwrap();
    let error = complaint(&toposlam(&["plan", &map]));
    assert!(error.contains("map.yaml: line 2: resolution must be a number of metres from 0.01 to 1"), "{error}");
}

#[test]
fn explore_prints_a_row_for_each_plan_and_noise_and_for_each_run() {
    let short = ["explore", "--plans", "flat", "--noises", "1", "--runs", "2", "--places", "6", "--goals", "0"];
    let with = |more: &[&str]| printed(&toposlam(&[&short[..], more].concat()));
    let text = with(&["--runs-table", "--seed", "7"]);
    assert!(text.starts_with("| Plan | Noise | Exact maps | Visited all | Complete |"), "{text}");
    assert!(text.contains("\n| flat | 1 | 7 | ") && text.contains("\n| flat | 1 | 8 | "), "{text}");
    let report: serde_json::Value = serde_json::from_str(&with(&["--format", "json"])).unwrap();
    let row = &report["rows"][0];
    assert_eq!((&row["plan"], &row["runs"], &row["complete"]), (&"flat".into(), &2.into(), &0.0.into()));
    for key in ["exact", "located", "edge_f1", "found", "missed", "doubled", "phantom", "lost", "wall_frames"] {
        assert!(row[key].is_number(), "{key}: {row}");
    }
}

#[test]
fn another_ring_is_compared_with_the_reference_ring() {
    let directory = tempfile::tempdir().unwrap();
    let ring = directory.path().join("eight.toml");
    std::fs::write(&ring, "sonars = 8\ncone_deg = 45\n").unwrap();
    let ring = ring.to_str().unwrap();
    let text = printed(&toposlam(&["simulate", "--plan", "plus", "--places", "4", "--ring", ring]));
    assert!(text.contains("against the true map: exact ") && text.contains("the reference robot: exact "), "{text}");
    let short = ["--plans", "plus", "--noises", "1", "--runs", "1", "--places", "4", "--goals", "0"];
    let text = printed(&toposlam(&[&["explore", "--ring", ring][..], &short].concat()));
    assert!(text.contains("\n| eight | plus | 1 | "), "{text}");
    std::fs::write(ring, "sonars = 9\n").unwrap();
    let error = complaint(&toposlam(&["simulate", "--ring", ring]));
    assert!(error.contains("sonars must be 4, 5, 8, 12, 16 or 24, not 9"), "{error}");
}

#[test]
fn a_map_without_a_place_is_not_exact() {
    let text = printed(&toposlam(&["simulate", "--frames", "5"]));
    assert!(
        text.contains("against the true map: exact no, isomorphic no, complete no, whole plan driven no"),
        "{text}"
    );
}

#[test]
fn a_fleet_of_another_process_is_monitored_without_loss() {
    let text = printed(&toposlam(&["fleet", "--simulate", "3", "--seconds", "1", "--speed", "0"]));
    assert!(text.contains("3 connected, 0 closed, 0 failed"), "{text}");
    assert!(text.lines().any(|line| line.starts_with("in all: ") && line.ends_with("; 0 frames lost, 0 damaged")));
    assert!(!text.contains(" 0 messages, 0 bytes"), "{text}");
}

#[test]
fn the_same_seed_gives_the_same_drive_and_another_seed_another() {
    let drive = |seed| printed(&toposlam(&["simulate", "--plan", "ring", "--places", "5", "--seed", seed]));
    assert_eq!(drive("3"), drive("3"));
    assert_ne!(drive("3"), drive("4"));
}

#[test]
fn replay_maps_a_recording() {
    let directory = tempfile::tempdir().unwrap();
    let ring = directory.path().join("ring.toml");
    let columns: Vec<String> = (0..8).map(|sonar| format!("s{sonar}")).collect();
    let header = columns.join(",");
    std::fs::write(&ring, format!("sonars = 8\nunit = \"mm\"\nmax_range = 6000\nstep_deg = 45\ncolumns = {columns:?}"))
        .unwrap();
    // Back and forth between the ends of a corridor, one 1.6 m wide and one 2.4 m.
    let mut recording = header;
    for beside_mm in [800, 1200, 800] {
        for step in -50_i32..=50 {
            let ahead_mm = beside_mm + 30 * step.abs();
            recording += &format!("\n{ahead_mm},6000,{beside_mm},6000,6000,6000,{beside_mm},6000");
        }
    }
    let file = directory.path().join("corridor.csv");
    std::fs::write(&file, recording).unwrap();
    let text = printed(&toposlam(&["replay", file.to_str().unwrap(), "--ring", ring.to_str().unwrap()]));
    assert!(text.contains("303 frames, 3 places"), "{text}");
    assert!(text.contains("the places were: 0 1 0"), "{text}");
    assert!(text.contains("map: 2 vertices, 1 edge"), "{text}");
    assert!(text.contains("edges: 0-1"), "{text}");
}

#[test]
fn unreadable_files_and_missing_programs_are_named_in_the_error() {
    assert!(complaint(&toposlam(&["simulate", "--plan", "castle"])).contains("castle"));
    assert!(complaint(&toposlam(&["replay", "nowhere.csv", "--ring", "scitos-g5"])).contains("nowhere.csv"));
    assert!(complaint(&toposlam(&["emulate", "--elf", "nowhere.elf"])).contains("nowhere.elf"));
    let no_image = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    let arguments = ["emulate", "--qemu", "no-such-emulator", "--elf", no_image.to_str().unwrap()];
    assert!(complaint(&toposlam(&arguments)).contains("no-such-emulator"));
}

/// Serves one client on a local port; returns the name of the line and, after the client has disconnected, the received
/// commands.
fn robot(
    mut answer: impl FnMut(&wire::Command) -> Outcome + Send + 'static,
) -> (String, std::thread::JoinHandle<Vec<wire::Command>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("tcp:{}", listener.local_addr().unwrap());
    let answering = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let (mut inbox, mut encoder) = (Inbox::new(), Encoder::default());
        let (mut commands, mut bytes) = (Vec::new(), [0; 256]);
        loop {
            let count = stream.read(&mut bytes).unwrap_or(0);
            if count == 0 {
                return commands;
            }
            bytes[..count].iter().for_each(|&byte| inbox.take(byte));
            let reply = inbox.turn(|command| {
                commands.push(*command);
                answer(command)
            });
            let row = Row { vertex: 0, radius_mm: 1172, visits: 12, neighbours: 1 };
            // CRC-32 of the map with this one vertex, see docs/wire.md.
            let digest =
                crc32(&[&[1][..], &1172_u16.to_le_bytes(), &12_u32.to_le_bytes(), &1_u64.to_le_bytes()].concat());
            let map = [Message::Row(row), Message::Map { vertices: 1, edges: 1, digest }];
            for message in reply.map(Message::Reply).into_iter().chain(map) {
                let frame = encoder.encode(&message, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec();
                // A client that has its reply does not wait for the rest.
                if stream.write_all(&frame).is_err() {
                    return commands;
                }
            }
        }
    });
    (line, answering)
}

#[test]
fn command_sends_commands_and_prints_the_replies() {
    let info = Info {
        version: Version { major: 1, minor: 2, patch: 3 },
        boot: 17,
        reset_cause: ResetCause::BrownOut,
        uptime_ms: 61_500,
        paused: false,
        localise_only: true,
        goal: Some(3),
        stored_bytes: 2048,
        stored_places_ago: 7,
    };
    let (line, answering) = robot(move |_| Outcome::Info(info));
    let text = printed(&toposlam(&["command", &line, "info"]));
    for expected in ["toposlam 1.2.3", "start 17: the supply voltage fell too low", "61.5 s", "vertex 3", "2048 bytes"]
    {
        assert!(text.contains(expected), "{text}");
    }
    assert_eq!(answering.join().unwrap(), [wire::Command::Info, wire::Command::GetSettings]);

    let hall = wire::Name::new("hall").unwrap();
    for (arguments, command, text) in [
        (&["reset"][..], wire::Command::Reset, "the map is deleted, and the robot maps again"),
        (&["set", "noise-mm", "40"], wire::Command::SetConfig(wire::Setting::NoiseMm(40)), "noise-mm 40 is set"),
        (&["localise-only", "on"], wire::Command::LocaliseOnly { on: true }, "the robot keeps the map and localises"),
        (&["go-to", "3"], wire::Command::GoTo { vertex: 3 }, "the robot is on its way to vertex 3"),
        (&["name", "3", "hall"], wire::Command::Name { vertex: 3, name: hall }, "vertex 3 is named hall"),
        (&["explore"], wire::Command::Explore, "the robot explores"),
        (&["pause", "off"], wire::Command::Pause { on: false }, "the robot continues"),
    ] {
        let (line, answering) = robot(|_| Outcome::Done);
        assert_eq!(printed(&toposlam(&[&["command", &line], arguments].concat())), format!("{text}\n"));
        assert_eq!(answering.join().unwrap()[0], command);
    }

    let (line, answering) = robot(|_| Outcome::Done);
    let text = printed(&toposlam(&["command", &line, "map"]));
    assert!(text.contains("map: 1 vertex, 1 edge") && text.contains("radius 1172 mm, 12 visits"), "{text}");
    assert_eq!(answering.join().unwrap(), [wire::Command::GetMap]);
}

#[test]
fn command_saves_and_restores_a_snapshot() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.snapshot");
    let file = file.to_str().unwrap();
    let snapshot: Vec<u8> = (0..100).collect();
    let taken = snapshot.clone();
    let (line, _) = robot(move |command| {
        let &wire::Command::GetSnapshot { offset } = command else { return Refusal::Unsupported.into() };
        let bytes = Chunk::new(taken[usize::from(offset)..].iter().copied());
        Outcome::Snapshot { total: 100, offset, bytes }
    });
    assert_eq!(printed(&toposlam(&["command", &line, "snapshot", file])), "100 bytes\n");
    assert_eq!(std::fs::read(file).unwrap(), snapshot);

    let (line, answering) = robot(|_| Outcome::Done);
    let output = toposlam(&["command", &line, "restore", file]);
    assert_eq!(printed(&output), "100 bytes restored\n");
    assert!(String::from_utf8_lossy(&output.stderr).contains("does not report its settings"));
    let expected = [
        wire::Command::Info,
        wire::Command::RestoreBegin { length: 100, crc: crc32(&snapshot) },
        wire::Command::RestoreChunk { offset: 0, bytes: Chunk::new(0..64) },
        wire::Command::RestoreChunk { offset: 64, bytes: Chunk::new(64..100) },
        wire::Command::RestoreCommit,
    ];
    assert_eq!(answering.join().unwrap(), expected);
}

#[test]
fn command_reports_why_it_failed() {
    let (line, _) = robot(|_| Refusal::UnknownVertex.into());
    let text = complaint(&toposlam(&["command", &line, "go-to", "99"]));
    assert!(text.contains("the map has no such vertex"), "{text}");
    let text = complaint(&toposlam(&["command", "no-such-port", "info"]));
    assert!(text.contains("no-such-port: no such file or serial port"), "{text}");
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("tcp:{}", listener.local_addr().unwrap());
    let silent = ["command", "--timeout-ms", "10", "--attempts", "2", &line, "info"];
    let text = complaint(&toposlam(&silent));
    assert!(text.contains("no reply to 2 requests"), "{text}");
    let text = complaint(&toposlam(&["command", &line, "set", "no-such-setting", "1"]));
    assert!(text.contains("noise-mm"), "the settings are listed: {text}");
}

#[test]
fn export_writes_the_map_of_a_stream_and_reports_its_gaps() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("robot.bin");
    let name = file.to_str().unwrap();
    let mut encoder = Encoder::default();
    let mut frame = |message| encoder.encode(&message, &mut [0; MAX_FRAME_BYTES]).unwrap().to_vec();
    let edge = frame(Message::Edge { a: 0, b: 1, present: true });
    std::fs::write(&file, &edge).unwrap();
    let output = toposlam(&["export", name, "--format", "graphml"]);
    assert!(printed(&output).contains("<edge source=\"0\" target=\"1\"/>"));
    assert!(String::from_utf8_lossy(&output.stderr).contains("the map is incomplete"));

    std::fs::write(&file, b"no robot").unwrap();
    assert!(complaint(&toposlam(&["export", name, "--format", "svg"])).contains("no message of a robot"));
    assert!(complaint(&toposlam(&["export", name, "--format", "png"])).contains("graphml, dot, geojson, json, svg"));
    assert!(complaint(&toposlam(&["export", name, "--format", "geojson", "--edge-m", "0"])).contains("0.1 to 1000"));
}

#[cfg(not(all(any(feature = "mqtt", feature = "zenoh"), feature = "recording")))]
#[test]
fn a_command_omitted_from_the_build_names_its_feature() {
    for (command, feature, is_built) in [
        ("record", "recording", cfg!(feature = "recording")),
        ("play", "recording", cfg!(feature = "recording")),
        ("publish", "mqtt", cfg!(any(feature = "mqtt", feature = "zenoh"))),
    ] {
        if !is_built {
            let text = complaint(&toposlam(&[command, "tcp:127.0.0.1:7070", "--seconds", "3"]));
            let expected = format!("--features {feature} -- {command} tcp:127.0.0.1:7070 --seconds 3");
            assert!(text.contains(&expected), "{text}");
            let text = complaint(&toposlam(&[command, "--help"]));
            assert!(text.contains(&format!("--features {feature} -- {command} --help")), "{text}");
        }
    }
}
