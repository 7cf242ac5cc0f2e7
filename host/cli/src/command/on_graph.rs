//! `toposlam simulate --on-graph`: the robot follows the true Voronoi graph, to test detector and filters without the
//! drive.

use clap::{Args, ValueEnum};
use toposlam::Passage;
use toposlam::reference::SONARS;
use toposlam_cli::progress::Progress;
use toposlam_eval::mapping::{FilterChoice, Mapping};
use toposlam_sim::world::{GroundTruth, Simulation};

use super::drive::{DriveArguments, Summary};
use super::filter::FilterArgument;

/// The options of a robot that follows the Voronoi graph.
#[derive(Args)]
pub(super) struct OnGraph {
    /// Move the robot along the true Voronoi graph at random; its own drive is not used.
    #[arg(long, alias = "on-rails")]
    pub(super) on_graph: bool,
    /// Hints that the filter gets besides the ring frames.
    #[arg(long, value_enum, default_value_t = Hints::Turn, requires = "on_graph")]
    hints: Hints,
}

/// The hints that the filter gets besides the ring frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Hints {
    /// Nothing.
    None,
    /// Whether the robot turned back at the place before.
    Turn,
}

pub(super) fn run(
    drive: &DriveArguments,
    options: &OnGraph,
    filter: FilterArgument,
    places: usize,
    frames: u64,
) -> anyhow::Result<()> {
    match filter {
        FilterArgument::Ordered => map(drive, options, places, frames, Mapping::ordered()?),
        FilterArgument::Robust => map(drive, options, places, frames, Mapping::reference(FilterChoice::Robust)?),
        FilterArgument::Paper => map(drive, options, places, frames, Mapping::reference(FilterChoice::Paper)?),
    }
}

fn map<const V: usize>(
    drive: &DriveArguments,
    options: &OnGraph,
    places: usize,
    frames: u64,
    mut mapping: Mapping<SONARS, V>,
) -> anyhow::Result<()> {
    let (plan, model) = drive.world()?;
    let mut simulation = Simulation::new(&plan, model, drive.seed())?;
    let mut ground_truth = GroundTruth::new(simulation.true_map());
    let progress = Progress::new("", places, "places");
    let mut driven = 0;
    while mapping.steps().len() < places && (frames == 0 || driven < frames) {
        let Some((frame, truth)) = simulation.next() else { break };
        driven += 1;
        ground_truth.drive(&truth);
        if let Some(step) =
            mapping.observe(&frame, if options.hints == Hints::Turn { truth.passage() } else { Passage::UNKNOWN })
        {
            ground_truth.detect(&step.place);
            progress.println(step)?;
            progress.increment();
        }
    }
    drop(progress);
    drive.summarise(&Summary {
        plan: &plan,
        truth: simulation.true_map(),
        ground_truth: &ground_truth,
        map: mapping.map(),
        darts: mapping.darts(),
        is_uncertain: mapping.steps().last().is_some_and(|step| step.is_uncertain),
        is_complete: false,
        path: mapping.path(),
        faults: mapping.faults(),
    })
}
