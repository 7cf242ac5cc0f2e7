//! `toposlam replay`: map a recording of ring ranges.

use std::fs::File;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use toposlam::Map;
use toposlam_host::mapping::Mapping;
use toposlam_host::recording::{Ring, fault_lines};

use super::filter::FilterArgument;

/// Arguments of `toposlam replay`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// The recording: CSV with a header line and a column for each sonar.
    recording: PathBuf,
    /// The ring's description (TOML); the one of the SCITOS G5 robot is built in as `scitos-g5`.
    #[arg(long)]
    ring: PathBuf,
    /// The filter that makes the map.
    #[arg(long, value_enum, default_value_t = FilterArgument::Robust)]
    filter: FilterArgument,
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

    // A smaller ring leaves slots of the frame without a sensor; they are dead in every frame.
    let mut mapping = Mapping::start(ring.geometry(), arguments.filter.into())?;
    for frame in &frames {
        if let Some(step) = mapping.observe(frame, None) {
            println!("{step}");
        }
    }
    println!("\n{} frames, {} places", frames.len(), mapping.steps().len());
    let path: Vec<String> = mapping
        .path()
        .into_iter()
        .map(|vertex| vertex.map_or_else(|| "-".to_owned(), |vertex| vertex.to_string()))
        .collect();
    println!("by the final map the places were: {}", path.join(" "));
    print_map(mapping.map());
    for line in fault_lines(&mapping.faults()) {
        println!("fault {line}");
    }
    Ok(())
}

fn print_map<const V: usize>(map: &Map<V>) {
    let edges: Vec<(u8, u8)> = map.edges().collect();
    println!("map: {} vertices, {} edges", map.vertices(), edges.len());
    for (vertex, label) in (0..map.vertices()).zip(map.labels()) {
        println!("  vertex {vertex:2}: radius {:4} mm, {} visits", label.radius_mm(), map.visits(vertex));
    }
    let edges: Vec<String> = edges.iter().map(|(a, b)| format!("{a}-{b}")).collect();
    println!("  edges: {}", edges.join(" "));
}
