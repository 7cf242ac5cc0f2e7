//! `toposlam simulate`: a simulated robot explores a floor plan with its own drive.

use std::fmt::Display;
use std::path::PathBuf;

use anyhow::ensure;
use clap::Args;
use toposlam::Filter;
use toposlam::persist::Persist;
use toposlam::wire::FilterSettings;
use toposlam_cli::picture::{Drawing, Step, animate};
use toposlam_cli::progress::Progress;
use toposlam_cli::{outln, output};
use toposlam_link::plural::count;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::hardware::Hardware;
use toposlam_sim::world::{Detection, Plan, RobotModel};

use super::drive::{DriveArguments, Summary};
use super::filter::FilterArgument;
use super::hardware::{HardwareArguments, for_filter_and_ring};
use super::on_graph::{self, OnGraph};

/// A robot that finds no place in this many ring frames is stuck: 33 minutes, in which it drives 600 m.
const STUCK_FRAMES: u64 = 20_000;

/// Arguments of `toposlam simulate`.
#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    drive: DriveArguments,
    /// Stop after this many detected places.
    #[arg(long, default_value_t = 100)]
    places: usize,
    /// Stop after this many ring frames (10 per second); 0 for no limit. A robot that finds no place in 20000 of them is stuck, and the
    /// command fails.
    #[arg(long, default_value_t = 1_000_000)]
    frames: u64,
    /// Write the growing map over the floor plan to an animated SVG file.
    #[arg(long, value_name = "FILE", conflicts_with = "on_graph")]
    animate: Option<PathBuf>,
    /// Filter that makes the map.
    #[arg(long, value_enum, default_value_t = FilterArgument::Ordered)]
    filter: FilterArgument,
    #[command(flatten)]
    hardware: HardwareArguments,
    #[command(flatten)]
    on_graph: OnGraph,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { drive, places, frames, filter, on_graph, .. } = arguments;
    drive.check_files(&[&arguments.animate])?;
    if on_graph.on_graph {
        return on_graph::run(drive, on_graph, *filter, *places, *frames);
    }
    let hardware = arguments.hardware.load()?;
    let (plan, model) = drive.world_for(&hardware)?;
    for_filter_and_ring!(filter, hardware.ring.sonars, explore(arguments, &plan, (&model, &hardware), false))?;
    let reference = Hardware::reference();
    if hardware != reference {
        let (_, model) = drive.world_for(&reference)?;
        for_filter_and_ring!(filter, reference.ring.sonars, explore(arguments, &plan, (&model, &reference), true))?;
    }
    Ok(())
}

/// Explores until the last place. The reference robot, which is compared with another one, prints no more than how exact its map is.
fn explore<const V: usize, F, const S: usize>(
    arguments: &Arguments,
    plan: &Plan,
    (model, hardware): (&RobotModel, &Hardware),
    is_reference: bool,
    filter: F::Config,
    buffer: &mut [u8],
) -> anyhow::Result<()>
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    let Arguments { drive, places, frames, animate: animation, .. } = arguments;
    let (config, body, seed) = (hardware.configured::<S, _>(filter), hardware.body.body, drive.seed());
    let mut exploration = Exploration::<V, F, S>::with_body(plan, *model, body, seed, &config, buffer)?;
    if is_reference {
        let mut newest = 0;
        while exploration.places() < *places
            && (*frames == 0 || exploration.frames() < *frames)
            && exploration.frames() - newest < STUCK_FRAMES
        {
            if exploration.advance().is_some() {
                newest = exploration.frames();
            }
        }
        outln!("the reference robot: {}", Summary::of(plan, &exploration).against_truth())?;
        return Ok(());
    }
    let progress = Progress::new("", *places, "places");
    let (mut way, mut steps) = (Vec::new(), Vec::new());
    let mut newest = exploration.frames();
    let is_stuck = |exploration: &Exploration<'_, V, F, S>, newest| exploration.frames() - newest >= STUCK_FRAMES;
    while exploration.places() < *places
        && (*frames == 0 || exploration.frames() < *frames)
        && !is_stuck(&exploration, newest)
    {
        if exploration.advance().is_some()
            && let Some(step) = exploration.steps().last()
        {
            newest = exploration.frames();
            progress.println(step)?;
            progress.increment();
            if animation.is_some() {
                steps.push(map_now(drive.plan(), &exploration, way.len()));
            }
        }
        if animation.is_some() {
            way.push(exploration.rover().position());
        }
    }
    drop(progress);
    drive.summarise(&Summary::of(plan, &exploration))?;
    if let Some(file) = animation {
        let picture = animate(plan, &way, &steps);
        output::write_file(file, picture, arguments.drive.force())?;
    }
    outln!("{} ring frames, stopped by a wall in {}", exploration.frames(), exploration.rover().bumps())?;
    ensure!(
        !is_stuck(&exploration, newest),
        "the robot is stuck at {:.2},{:.2}: {} of {places} places, and none in the last {STUCK_FRAMES} ring frames; `toposlam plan` lists what a \
         robot can reach and where it has little room",
        plan.in_file_m(exploration.rover().position()).0,
        plan.in_file_m(exploration.rover().position()).1,
        exploration.places()
    );
    Ok(())
}

/// The current map, with each vertex at the true node of the majority of its visits.
fn map_now<const V: usize, F, const S: usize>(
    plan: impl Display,
    exploration: &Exploration<'_, V, F, S>,
    driven: usize,
) -> Step
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    let truth = exploration.rover().true_map();
    let detections: Vec<Detection> = exploration
        .ground_truth()
        .detections()
        .iter()
        .map(|detection| {
            let node = detection.node.and_then(|node| truth.nodes.get(node));
            Detection { position: node.map_or(detection.position, |node| node.position), ..*detection }
        })
        .collect();
    let caption = format!("{plan}: the map after {}", count(detections.len(), "place", "places"));
    let map = exploration.robot().mapper().map();
    Step { drawing: Drawing::of_map(map, &exploration.path(), &detections, caption), driven }
}
