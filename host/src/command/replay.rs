//! `toposlam replay`: map a recording of ring ranges.

use std::fs::File;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use toposlam::place::{Place, PlaceConfig};
use toposlam_host::recording::{Ring, fault_lines};

/// Arguments of `toposlam replay`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// The recording: CSV with a header line and a column for each sonar.
    recording: PathBuf,
    /// The ring's description (TOML); the one of the SCITOS G5 robot is built in as `scitos-g5`.
    #[arg(long)]
    ring: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let ring = if arguments.ring.as_os_str() == "scitos-g5" {
        Ring::parse(include_str!("../../rings/scitos-g5.toml"))?
    } else {
        let text = std::fs::read_to_string(&arguments.ring);
        let text = text.with_context(|| format!("reading {}", arguments.ring.display()))?;
        Ring::parse(&text).with_context(|| format!("ring {}", arguments.ring.display()))?
    };
    let recording = File::open(&arguments.recording);
    let recording = recording.with_context(|| format!("opening {}", arguments.recording.display()))?;
    let frames = ring.read(recording).with_context(|| format!("recording {}", arguments.recording.display()))?;
    let (places, faults) = ring.replay(&frames, PlaceConfig::DEFAULT)?;
    println!("{} frames, {} places", frames.len(), places.len());
    for place in &places {
        on_place(place);
        let degree = place.degree.map_or("?".to_owned(), |degree| degree.to_string());
        println!(
            "frame {:5}: radius {:4} mm, spread {:3} mm, degree {degree}",
            place.frame_index,
            place.fingerprint.radius_mm(),
            place.spread_mm
        );
    }
    for line in fault_lines(&faults) {
        println!("fault {line}");
    }
    Ok(())
}

/// Where each detected place is handed on.
fn on_place(_place: &Place) {}
