//! `toposlam simulate --on-rails`: the robot is led along the true Voronoi graph, so that the detector and the filters stand alone.

use clap::{Args, ValueEnum};
use toposlam::reference;
use toposlam_eval::mapping::Mapping;
use toposlam_sim::world::{Journal, Simulation};

use super::drive::{DriveArguments, Summary, progress_bar};
use super::filter::FilterArgument;

/// How a robot on rails is mapped.
#[derive(Args)]
pub(super) struct OnRails {
    /// Lead the robot along the true Voronoi graph at random, instead of letting it drive.
    #[arg(long)]
    pub(super) on_rails: bool,
    /// The filter that makes the map of a robot on rails.
    #[arg(long, value_enum, default_value_t = FilterArgument::Robust, requires = "on_rails")]
    filter: FilterArgument,
    /// What the filter is told of a robot on rails besides the frames of the ring.
    #[arg(long, value_enum, default_value_t = Hints::Turn, requires = "on_rails")]
    hints: Hints,
}

/// What the drive tells the filter besides the frames of the ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Hints {
    /// Nothing.
    None,
    /// Whether the robot turned back at the place before.
    Turn,
}

pub(super) fn run(drive: &DriveArguments, rails: &OnRails, places: usize, frames: u64) -> anyhow::Result<()> {
    let (plan, model) = drive.world()?;
    let mut simulation = Simulation::new(&plan, model, drive.seed())?;
    let mut journal = Journal::new(simulation.true_map());
    let mut mapping = Mapping::start(reference::RING, rails.filter.into())?;
    let progress = progress_bar(places)?;
    let mut driven = 0;
    while mapping.steps().len() < places && (frames == 0 || driven < frames) {
        let Some((frame, truth)) = simulation.next() else { break };
        driven += 1;
        journal.drive(&truth);
        if let Some(step) = mapping.observe(&frame, truth.turn.filter(|_| rails.hints == Hints::Turn)) {
            journal.detect(&step.place);
            progress.suspend(|| println!("{step}"));
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    drive.summarise(&Summary {
        plan: &plan,
        truth: simulation.true_map(),
        journal: &journal,
        map: mapping.map(),
        path: mapping.path(),
        faults: mapping.faults(),
    })
}
