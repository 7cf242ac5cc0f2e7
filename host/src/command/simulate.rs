//! `toposlam simulate`: drive a simulated robot through a floor plan.

use clap::Args;

use super::drive::{Drive, DriveArguments, Hints, progress_bar};
use super::filter::FilterArgument;

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
    /// The filter that makes the map.
    #[arg(long, value_enum, default_value_t = FilterArgument::Robust)]
    filter: FilterArgument,
    /// What the drive tells the filter besides the frames of the ring.
    #[arg(long, value_enum, default_value_t = Hints::Turn)]
    hints: Hints,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut drive = Drive::start(&arguments.drive, arguments.filter.into(), arguments.hints)?;
    let progress = progress_bar(arguments.places)?;
    let mut frames = 0;
    while drive.mapping().steps().len() < arguments.places && (arguments.frames == 0 || frames < arguments.frames) {
        let Some((_, step)) = drive.advance() else { break };
        frames += 1;
        if let Some(step) = step {
            progress.suspend(|| println!("{step}"));
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    drive.summarise(&arguments.drive)
}
