//! `toposlam simulate`: a simulated robot explores a floor plan by its own drive.

use clap::Args;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam_sim::exploration::Exploration;

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
    #[command(flatten)]
    rails: OnRails,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { drive, places, frames, rails } = arguments;
    if rails.on_rails {
        return rails::run(drive, rails, *places, *frames);
    }
    let (plan, model) = drive.world()?;
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, model, drive.seed(), &mut buffer)?;
    let progress = progress_bar(*places)?;
    while exploration.places() < *places && (*frames == 0 || exploration.frames() < *frames) {
        if exploration.advance().is_some()
            && let Some(step) = exploration.steps().last()
        {
            progress.suspend(|| println!("{step}"));
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    drive.summarise(&Summary::of(&plan, &exploration))?;
    println!("{} ring frames, stopped by a wall in {}", exploration.frames(), exploration.rover().bumps());
    Ok(())
}
