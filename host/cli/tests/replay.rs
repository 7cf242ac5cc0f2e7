//! `toposlam replay` on recordings of several laps of a round: a simulated one, and a real one if it is present.

use std::io::Write;
use std::path::Path;
use std::process::Command;

use toposlam::ring::Echo;
use toposlam_sim::world::{Plan, RobotModel, SONARS, Simulation};

fn replayed(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_toposlam")).arg("replay").args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The numbers in the only line with this beginning and end.
fn numbers(text: &str, begins: &str, ends: &str) -> Vec<u32> {
    let fits = |line: &&str| line.trim().starts_with(begins) && line.ends_with(ends);
    let mut lines = text.lines().filter(fits);
    let (Some(line), None) = (lines.next(), lines.next()) else { panic!("no one line {begins:?}: {text}") };
    line.split(|character: char| !character.is_ascii_digit()).filter_map(|word| word.parse().ok()).collect()
}

/// Corridors of different widths around one block, so that each of the four bends has a different radius.
fn round_plan() -> Plan {
    let mut text = String::from("cell_mm 250");
    for row in 0..36 {
        text.push('\n');
        text.extend((0..40).map(|column| match (row, column) {
            (2, 20) => 'S',
            (5..26, 7..31) => '#',
            _ => '.',
        }));
    }
    Plan::parse(&text).unwrap()
}

/// Laps of the round in centimetres, with a column for each sonar and the pose, and the number of frames per lap. The first sonar
/// has no range in the first three frames.
fn laps_of_the_round(columns: &[String], laps: usize) -> (String, usize) {
    let model = RobotModel { u_turn_share: 0.0, ..RobotModel::default() };
    let simulation = Simulation::new(&round_plan(), model, 1).unwrap();
    assert_eq!(simulation.true_map().nodes.len(), 4);
    let mut rows = vec![format!("{},x,y,theta", columns.join(","))];
    // The first node that the robot passed, and when.
    let mut first = None;
    let mut lap_frames = usize::MAX;
    for (frame_index, (frame, truth)) in simulation.enumerate() {
        if let Some(node) = truth.node {
            let (first_node, first_index) = *first.get_or_insert((node, frame_index));
            // The robot stays at a node while it turns, for at most one second.
            if node == first_node && frame_index > first_index + 20 && lap_frames == usize::MAX {
                lap_frames = frame_index - first_index;
            }
        }
        if frame_index >= lap_frames.saturating_mul(laps) {
            break;
        }
        let ranges_cm = frame.echoes.map(|echo| match echo {
            Echo::Range { range_mm } => format!("{:.1}", f64::from(range_mm) / 10.0),
            Echo::Silence => "600".to_owned(),
            Echo::Dead => String::new(),
        });
        let (x_cm, y_cm) = (truth.pose.position.x_mm / 10.0, truth.pose.position.y_mm / 10.0);
        let mut row = format!("{},{x_cm:.1},{y_cm:.1},{:.4}", ranges_cm.join(","), truth.pose.heading_rad);
        if frame_index < 3 {
            row = row.split_once(',').unwrap().1.to_owned();
            row.insert(0, ',');
        }
        rows.push(row);
    }
    (rows.join("\n"), lap_frames)
}

#[test]
fn laps_of_a_round_on_the_voronoi_graph_repeat_and_their_map_is_a_cycle() {
    let columns: Vec<String> = (0..SONARS).map(|sonar| format!("s{sonar}")).collect();
    let (recording, lap_frames) = laps_of_the_round(&columns, 5);
    let directory = tempfile::tempdir().unwrap();
    let (file, ring) = (directory.path().join("round.csv"), directory.path().join("ring.toml"));
    std::fs::write(&file, recording).unwrap();
    let step_deg = 360.0 / SONARS as f64;
    let description =
        format!("sonars = {SONARS}\nunit = \"cm\"\nmax_range = 600\nstep_deg = {step_deg}\ncolumns = {columns:?}");
    std::fs::write(&ring, description).unwrap();
    let [file, ring] = [&file, &ring].map(|path| path.to_str().unwrap());

    let text = replayed(&[file, "--ring", ring, "--lap-frames", &lap_frames.to_string()]);
    for lap in 2..=5 {
        assert!(text.contains(&format!("4 of 4 places of lap 1 come again in lap {lap}:")), "{text}");
    }
    assert_eq!(text.matches("missing: none; extra: none").count(), 4, "{text}");
    assert!(text.contains("come again 16 of 16 times, 16 of them as the same vertex"), "{text}");
    assert!(text.contains("map: 4 vertices, 4 edges") && text.ends_with("the map is a cycle\n"), "{text}");
    let [_, on_graph, _] = numbers(&text, "the two nearest obstacles", "%")[..] else { panic!("{text}") };
    assert!(on_graph >= 95, "{text}");

    // The poses show the same: four spots, each passed four more times.
    let text = replayed(&[file, "--ring", ring, "--poses", "x,y,theta"]);
    assert!(text.contains("sonar s0: no range in 3 of"), "{text}");
    assert!(text.contains("20 places at 4 spots"), "{text}");
    assert!(text.contains("with the same heading: 16; detected again: 16; as the same vertex: 16"), "{text}");
    assert!(text.contains("more than 3 m apart in one vertex: 0 of"), "{text}");

    // If a lap is a fifth too long, most places are outside the tolerance.
    let text = replayed(&[file, "--ring", ring, "--lap-frames", &(lap_frames * 6 / 5).to_string()]);
    let [_, again, expected, _] = numbers(&text, "in all", "same vertex")[..] else { panic!("{text}") };
    assert!(again * 2 < expected, "{text}");
    assert!(!replayed(&[file, "--ring", ring]).contains("lap 1"));
}

#[test]
fn real_laps_along_the_walls_repeat_one_place_and_give_no_cycle() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/scitos-g5/sensor_readings_24.data");
    if !path.exists() {
        // Bypasses the capture of test output, so that the message is visible.
        let _ = writeln!(std::io::stderr(), "SKIPPED: no recording at ../shared/data/scitos-g5");
        return;
    }
    let file = path.to_str().unwrap();
    for (filter, recognises_it) in [("robust", true), ("paper", false)] {
        let text = replayed(&[file, "--ring", "scitos-g5", "--lap-frames", "910", "--filter", filter]);
        let [frames, places] = numbers(&text, "5456 frames", "places")[..] else { panic!("{text}") };
        assert_eq!(frames, 5456);
        assert!((10..=25).contains(&places), "{text}");
        let [_, on_graph, at_meet_point] = numbers(&text, "the two nearest obstacles", "%")[..] else {
            panic!("{text}")
        };
        assert!((20..50).contains(&on_graph) && (1..10).contains(&at_meet_point), "{text}");
        // One place recurs in nearly every lap, and few others do; only the robust filter recognises it in some of them, as
        // docs/replay.md states.
        let repeats = |line: &&str| line.contains(" come again in lap ") && !line.trim().starts_with("0 of ");
        let repeated = text.lines().filter(repeats);
        assert!(repeated.count() >= 4, "{text}");
        let [_, again, expected, same] = numbers(&text, "in all", "same vertex")[..] else { panic!("{text}") };
        assert!(again * 2 < expected && (same > 0) == recognises_it, "{text}");
        assert!(text.contains("the map is no cycle"), "{text}");
    }
}
