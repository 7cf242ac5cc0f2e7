//! `toposlam simulate`: a simulated robot explores a floor plan by its own drive.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam_cli::picture::{Drawing, Step, animate};
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::Detection;

use super::drive::{DriveArguments, Summary, progress_bar};
use super::rails::{self, OnRails};

/// Arguments of `toposlam simulate`.
#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    drive: DriveArguments,
    /// Drive until this many places were detected.
    #[arg(long, default_value_t = 100)]
    places: usize,
    /// Stop after this many frames at the latest (10 a second); 0: no limit.
    #[arg(long, default_value_t = 1_000_000)]
    frames: u64,
    /// Write the map as it grows, over the floor plan, as an animated SVG.
    #[arg(long, value_name = "FILE", conflicts_with = "on_rails")]
    animate: Option<PathBuf>,
    #[command(flatten)]
    rails: OnRails,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { drive, places, frames, animate: animation, rails } = arguments;
    if rails.on_rails {
        return rails::run(drive, rails, *places, *frames);
    }
    let (plan, model) = drive.world()?;
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, model, drive.seed(), &mut buffer)?;
    let progress = progress_bar(*places)?;
    let (mut way, mut steps) = (Vec::new(), Vec::new());
    while exploration.places() < *places && (*frames == 0 || exploration.frames() < *frames) {
        if exploration.advance().is_some()
            && let Some(step) = exploration.steps().last()
        {
            progress.suspend(|| println!("{step}"));
            progress.inc(1);
            if animation.is_some() {
                steps.push(map_now(drive.plan(), &exploration, way.len()));
            }
        }
        way.push(exploration.rover().position());
    }
    progress.finish_and_clear();
    drive.summarise(&Summary::of(&plan, &exploration))?;
    if let Some(file) = animation {
        let picture = animate(&plan, &way, &steps);
        std::fs::write(file, picture).with_context(|| format!("writing {}", file.display()))?;
    }
    println!("{} ring frames, stopped by a wall in {}", exploration.frames(), exploration.rover().bumps());
    Ok(())
}

/// The map now, each vertex at the true node that it was mostly visited at.
fn map_now(plan: &str, exploration: &Exploration<'_>, driven: usize) -> Step {
    let truth = exploration.rover().true_map();
    let detections: Vec<Detection> = exploration
        .journal()
        .detections()
        .iter()
        .map(|detection| {
            let node = detection.node.and_then(|node| truth.nodes.get(node));
            Detection { position: node.map_or(detection.position, |node| node.position), ..*detection }
        })
        .collect();
    let caption = format!("{plan}: the map after {} places", detections.len());
    let map = exploration.robot().mapper().map();
    Step { drawing: Drawing::of_map(map, &exploration.path(), &detections, caption), driven }
}
