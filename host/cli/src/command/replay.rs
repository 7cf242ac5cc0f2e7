//! `toposlam replay`: map a recording of ring ranges.

use std::fs::File;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::Args;
use toposlam::{Map, Passage, reference};
use toposlam_cli::outln;
use toposlam_eval::faults::fault_lines;
use toposlam_eval::graph::Graph;
use toposlam_eval::gvg_adherence::GvgAdherence;
use toposlam_eval::laps::{Laps, Named, Shape, Tolerance, Visit};
use toposlam_eval::mapping::Mapping;
use toposlam_eval::range_csv::{PoseColumns, Recorded, Ring};
use toposlam_eval::revisits::Revisits;
use toposlam_link::plural::count;

use super::filter::FilterArgument;
#[cfg(feature = "recording")]
use super::ring_recording::load as load_robot_recording;

/// Arguments of `toposlam replay`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// CSV file with a header line and a column of ranges for each sonar, or the recording of a robot (FILE.mcap, feature
    /// `recording`).
    recording: PathBuf,
    /// TOML file that describes the ring, or `scitos-g5` for the built-in one (docs/replay.md). Default for a FILE.mcap: sonars at
    /// equal distances, the first straight ahead.
    #[arg(long, value_name = "FILE")]
    ring: Option<PathBuf>,
    /// Columns of the CSV file with the pose of the robot from another localisation: x and y in the unit of the ranges, heading in
    /// radians. Judges revisits; the filter does not get the poses.
    #[arg(long, value_name = "X,Y,THETA")]
    poses: Option<PoseColumns>,
    /// Filter that makes the map.
    #[arg(long, value_enum, default_value_t = FilterArgument::Robust)]
    filter: FilterArgument,
    /// Frames per lap of a robot that drove the same round several times; compares the laps.
    #[arg(long, value_name = "FRAMES")]
    lap_frames: Option<NonZeroU32>,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let ring = arguments.ring.as_deref().map(load_ring).transpose()?;
    let (ring, recorded) =
        load(arguments, ring).with_context(|| format!("recording {}", arguments.recording.display()))?;
    let Recorded { frames, poses, blanks } = recorded;
    ensure!(!frames.is_empty(), "recording {}: no row of ranges", arguments.recording.display());

    // A smaller ring leaves slots of the frame without a sensor; they are dead in every frame.
    let mut mapping = Mapping::of_recording(&ring, arguments.filter.for_recording()?)?;
    for frame in &frames {
        if let Some(step) = mapping.observe(frame, Passage::UNKNOWN) {
            outln!("{step}")?;
        }
    }
    let (read, places) = (count(frames.len(), "frame", "frames"), count(mapping.steps().len(), "place", "places"));
    outln!("\n{read}, {places}")?;
    for (column, blanks) in ring.columns.iter().zip(blanks).filter(|(_, blanks)| *blanks > 0) {
        outln!("sonar {column}: no range in {blanks} of {} frames; there it is a dead sonar", frames.len())?;
    }
    outln!("{}", GvgAdherence::of(&frames, &ring.geometry(), &reference::PLACE))?;
    let path = mapping.path();
    let vertices: Vec<String> = path.iter().map(|vertex| Named(*vertex).to_string()).collect();
    outln!("by the final map the places were: {}", vertices.join(" "))?;
    let places = mapping.steps().iter().map(|step| step.place);
    let visits = places.zip(path).map(|(place, vertex)| Visit {
        frame: place.frame_index,
        radius_mm: place.fingerprint.radius_mm(),
        vertex,
    });
    let visits: Vec<Visit> = visits.collect();
    if arguments.poses.is_some() {
        outln!("{}", Revisits::of(&visits, &poses))?;
    }
    if let Some(lap_frames) = arguments.lap_frames {
        outln!("\n{}\n", Laps::compare(&visits, lap_frames, frames.len() as u32, Tolerance::of(lap_frames)))?;
    }
    print_map(mapping.map(), mapping.steps().last().is_some_and(|step| step.is_uncertain))?;
    for line in fault_lines(&mapping.faults()) {
        outln!("fault {line}")?;
    }
    Ok(())
}

fn load_ring(path: &Path) -> anyhow::Result<Ring> {
    if path.as_os_str() == "scitos-g5" {
        return Ring::parse(include_str!("../../../eval/rings/scitos-g5.toml"));
    }
    let text = std::fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
    Ring::parse(&text).with_context(|| format!("ring {}", path.display()))
}

/// The ring and the frames of the recording.
fn load(arguments: &Arguments, ring: Option<Ring>) -> anyhow::Result<(Ring, Recorded)> {
    let path = &arguments.recording;
    if path.extension().is_some_and(|extension| extension == "mcap") {
        ensure!(arguments.poses.is_none(), "--poses needs a CSV file");
        return load_robot_recording(path, ring);
    }
    let ring = ring.context("a CSV file needs --ring")?;
    let recorded = ring.read(File::open(path)?, arguments.poses.as_ref())?;
    Ok((ring, recorded))
}

#[cfg(not(feature = "recording"))]
fn load_robot_recording(_: &Path, _: Option<Ring>) -> anyhow::Result<(Ring, Recorded)> {
    Err(super::missing::no_recordings())
}

fn print_map<const V: usize>(map: &Map<V>, is_uncertain: bool) -> anyhow::Result<()> {
    let edges: Vec<_> = map.edges().collect();
    let uncertain = if is_uncertain { ", uncertain" } else { "" };
    let (vertices, edge_count) =
        (count(map.vertices().len(), "vertex", "vertices"), count(edges.len(), "edge", "edges"));
    outln!("map: {vertices}, {edge_count}{uncertain}")?;
    for (vertex, label) in map.vertices().zip(map.labels()) {
        let visits = count(map.visits(vertex), "visit", "visits");
        outln!("  vertex {vertex:2}: radius {:4} mm, {visits}", label.radius_mm())?;
    }
    let texts: Vec<String> = edges.iter().map(|(a, b)| format!("{a}-{b}")).collect();
    outln!("  edges: {}", texts.join(" "))?;
    let graph = Graph::from_edges(map.vertices().len(), edges.iter().map(|&(a, b)| (a.into(), b.into())));
    outln!("  the map is {}", Shape::of(&graph))?;
    Ok(())
}
