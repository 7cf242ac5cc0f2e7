//! A map from recorded ring frames: place detection and filter.
//!
//! The file has a column for each of 16 sensors, counter-clockwise from straight ahead, and a line for each ring frame.
//! A value is a range in millimetres, `silence` (no echo) or `dead` (no answer).
//!
//! ```sh
//! cargo run --release --example replay_csv                  # examples/frames.csv
//! cargo run --release --example replay_csv -- FILE.csv
//! ```

use toposlam::ring::{Echo, RingFrame, RingGeometry};
use toposlam::{FaultCounters, FaultKind, Mapper, MapperConfig, Passage, RobustFilter};

const SONARS: usize = 16;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let frames = match std::env::args().nth(1).filter(|argument| argument.ends_with(".csv")) {
        Some(file) => std::fs::read_to_string(file)?,
        None => include_str!("frames.csv").to_owned(),
    };
    let (places, faults) = map(&frames)?;
    println!("{places} places, {} ranges out of range", faults.count(FaultKind::SonarOutOfRange));
    Ok(())
}

/// Maps the frames of a file. Returns the number of places, and the faults.
fn map(frames: &str) -> Result<(u32, FaultCounters), Box<dyn std::error::Error>> {
    let mut mapper = Box::new(Mapper::<SONARS, 16, RobustFilter<10, 16, 400>>::new());
    mapper.start(&MapperConfig::for_ring(RingGeometry::even()))?;

    for line in frames.lines().skip(1) {
        // The recording does not say how the robot drove. A robot with a drive passes `Drive::passage`.
        if let Some((place, update)) = mapper.observe(&frame(line)?, Passage::UNKNOWN) {
            println!(
                "frame {:3}: place {} of radius {} mm is vertex {}{}",
                place.frame_index,
                update.place_index,
                place.fingerprint.radius_mm(),
                update.vertex,
                if update.is_new { ", new" } else { "" },
            );
        }
    }

    let map = mapper.map();
    println!("{} vertices, {} edges", map.vertices().len(), map.edges().count());
    Ok((mapper.filter().observed(), mapper.faults()))
}

/// Parses one line of the file.
fn frame(line: &str) -> Result<RingFrame<SONARS>, Box<dyn std::error::Error>> {
    let mut echoes = [Echo::Dead; SONARS];
    for (echo, value) in echoes.iter_mut().zip(line.split(',')) {
        *echo = match value {
            "silence" => Echo::Silence,
            "dead" => Echo::Dead,
            range_mm => Echo::Range { range_mm: range_mm.parse()? },
        };
    }
    Ok(RingFrame { echoes })
}

#[test]
fn the_example_finds_every_place() {
    assert_eq!(map(include_str!("frames.csv")).unwrap(), (9, FaultCounters::new()));
}
