//! `toposlam replay`: map a recording of ring ranges.

use std::fs::File;
use std::num::NonZeroU32;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use toposlam::{Map, Passage, reference};
use toposlam_eval::faults::fault_lines;
use toposlam_eval::graph::Graph;
use toposlam_eval::gvg_adherence::GvgAdherence;
use toposlam_eval::laps::{Laps, Named, Shape, Tolerance, Visit};
use toposlam_eval::mapping::Mapping;
use toposlam_eval::range_csv::Ring;

use super::filter::FilterArgument;

/// Arguments of `toposlam replay`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// CSV file with a header line and a column of ranges for each sonar.
    recording: PathBuf,
    /// TOML file that describes the ring, or `scitos-g5` for the built-in one (docs/replay.md).
    #[arg(long, value_name = "FILE")]
    ring: PathBuf,
    /// Filter that makes the map.
    #[arg(long, value_enum, default_value_t = FilterArgument::Robust)]
    filter: FilterArgument,
    /// Frames per lap of a robot that drove the same round several times; compares the laps.
    #[arg(long, value_name = "FRAMES")]
    lap_frames: Option<NonZeroU32>,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let ring = if arguments.ring.as_os_str() == "scitos-g5" {
        Ring::parse(include_str!("../../../eval/rings/scitos-g5.toml"))?
    } else {
        let text = std::fs::read_to_string(&arguments.ring);
        let text = text.with_context(|| format!("reading {}", arguments.ring.display()))?;
        Ring::parse(&text).with_context(|| format!("ring {}", arguments.ring.display()))?
    };
    let recording = File::open(&arguments.recording);
    let recording = recording.with_context(|| format!("opening {}", arguments.recording.display()))?;
    let frames = ring.read(recording).with_context(|| format!("recording {}", arguments.recording.display()))?;

    // A smaller ring leaves slots of the frame without a sensor; they are dead in every frame.
    let mut mapping = Mapping::of_recording(&ring, arguments.filter.for_recording()?)?;
    for frame in &frames {
        if let Some(step) = mapping.observe(frame, Passage::UNKNOWN) {
            println!("{step}");
        }
    }
    println!("\n{} frames, {} places", frames.len(), mapping.steps().len());
    println!("{}", GvgAdherence::of(&frames, &ring.geometry(), &reference::PLACE));
    let path = mapping.path();
    let vertices: Vec<String> = path.iter().map(|vertex| Named(*vertex).to_string()).collect();
    println!("by the final map the places were: {}", vertices.join(" "));
    if let Some(lap_frames) = arguments.lap_frames {
        let places = mapping.steps().iter().map(|step| step.place);
        let visits = places.zip(path).map(|(place, vertex)| Visit {
            frame: place.frame_index,
            radius_mm: place.fingerprint.radius_mm(),
            vertex,
        });
        let visits: Vec<Visit> = visits.collect();
        println!("\n{}\n", Laps::compare(&visits, lap_frames, frames.len() as u32, Tolerance::of(lap_frames)));
    }
    print_map(mapping.map());
    for line in fault_lines(&mapping.faults()) {
        println!("fault {line}");
    }
    Ok(())
}

fn print_map<const V: usize>(map: &Map<V>) {
    let edges: Vec<_> = map.edges().collect();
    println!("map: {} vertices, {} edges", map.vertices().len(), edges.len());
    for (vertex, label) in map.vertices().zip(map.labels()) {
        println!("  vertex {vertex:2}: radius {:4} mm, {} visits", label.radius_mm(), map.visits(vertex));
    }
    let texts: Vec<String> = edges.iter().map(|(a, b)| format!("{a}-{b}")).collect();
    println!("  edges: {}", texts.join(" "));
    let graph = Graph::from_edges(map.vertices().len(), edges.iter().map(|&(a, b)| (a.into(), b.into())));
    println!("  the map is {}", Shape::of(&graph));
}
