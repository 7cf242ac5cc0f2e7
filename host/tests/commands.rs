//! The command as a person meets it: what it prints, what it writes, and how it fails.

use std::path::Path;
use std::process::{Command, Output};

fn toposlam(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_toposlam")).args(arguments).output().unwrap()
}

fn printed(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn complaint(output: &Output) -> String {
    assert!(!output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stderr.clone()).unwrap()
}

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
    // To and fro between the ends of a corridor, one 1.6 m wide and one 2.4 m.
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
    assert!(text.contains("map: 2 vertices, 1 edges"), "{text}");
    assert!(text.contains("edges: 0-1"), "{text}");
}

#[test]
fn what_cannot_be_read_or_started_is_named_and_fails() {
    assert!(complaint(&toposlam(&["simulate", "--plan", "castle"])).contains("castle"));
    assert!(complaint(&toposlam(&["replay", "nowhere.csv", "--ring", "scitos-g5"])).contains("nowhere.csv"));
    assert!(complaint(&toposlam(&["emulate", "--elf", "nowhere.elf"])).contains("nowhere.elf"));
    let no_image = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    let arguments = ["emulate", "--qemu", "no-such-emulator", "--elf", no_image.to_str().unwrap()];
    assert!(complaint(&toposlam(&arguments)).contains("no-such-emulator"));
}
