//! One exploration, and the goals after it.

use std::collections::BTreeSet;

use toposlam::Filter;
use toposlam::drive::GoalStatus;
use toposlam::persist::Persist;
use toposlam::wire::{Command, FilterSettings};
use toposlam_cli::progress::Progress;
use toposlam_eval::mapping::{is_whole, score_exploration};
use toposlam_eval::score::MapScore;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::hardware::Hardware;
use toposlam_sim::injector::FaultRates;
use toposlam_sim::world::{HintReport, Plan, Report, ReportedHints, RobotModel};

use super::Arguments;

/// Timeout of a goal, in ring frames.
const FRAMES_PER_JOURNEY: u64 = 20_000;
/// A robot that detects no place for this many frames is stuck, and the run ends.
const FRAMES_PER_PLACE: u64 = 20_000;

/// The result of one run.
pub(super) struct Run {
    pub(super) seed: u64,
    pub(super) report: Report,
    pub(super) hints: HintReport,
    pub(super) score: MapScore,
    pub(super) visited_all: bool,
    /// Whether the drive holds its map for complete.
    pub(super) complete: bool,
    /// Whether the map is exact and the robot visited all places and drove all edges of the plan.
    pub(super) exact_and_whole: bool,
    pub(super) stuck: bool,
    pub(super) places: usize,
    pub(super) lost: u32,
    pub(super) wall_frames: u32,
    pub(super) frames: u64,
    pub(super) journeys: Journeys,
}

/// Goals after an exploration.
#[derive(Clone, Copy, Default)]
pub(super) struct Journeys {
    /// Goals that were commanded.
    pub(super) asked: u64,
    /// Goals that were reached at the true place.
    pub(super) arrived: u64,
    /// Goals that the robot reported as reached at another place.
    pub(super) elsewhere: u64,
}

/// Explores until the robot has detected the places of a run, or is stuck.
pub(super) fn explore<const V: usize, F, const S: usize>(
    arguments: &Arguments,
    plan: &Plan,
    (model, hardware): (&RobotModel, &Hardware),
    seed: u64,
    progress: &Progress,
    filter: F::Config,
    buffer: &mut [u8],
) -> anyhow::Result<Run>
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    let config = hardware.configured::<S, _>(filter);
    let mut exploration = Exploration::<V, F, S>::with_body(plan, *model, hardware.body.body, seed, &config, buffer)?;
    if arguments.faults > 0.0 {
        exploration.set_faults(FaultRates::scaled(arguments.faults), seed);
    }
    let most_frames = arguments.places as u64 * 2000;
    let mut last_place = 0;
    let mut stuck = false;
    while exploration.places() < arguments.places && !stuck {
        if exploration.advance().is_some() {
            last_place = exploration.frames();
            progress.increment();
        }
        stuck = exploration.frames() - last_place >= FRAMES_PER_PLACE || exploration.frames() >= most_frames;
    }
    let score = score_exploration(&exploration);
    let seen: BTreeSet<usize> = exploration.nodes().iter().copied().flatten().collect();
    let reported: Vec<ReportedHints> = exploration.steps().iter().map(|step| step.reported).collect();
    let ground_truth = exploration.ground_truth();
    let mut run = Run {
        seed,
        report: ground_truth.report(),
        hints: ground_truth.hint_report(&reported),
        score,
        visited_all: seen.len() == ground_truth.true_map().nodes.len(),
        complete: exploration.robot().drive().is_complete(),
        exact_and_whole: score.exact && is_whole(ground_truth),
        stuck,
        places: exploration.places(),
        lost: exploration.times_lost(),
        wall_frames: exploration.rover().bumps(),
        frames: exploration.frames(),
        journeys: Journeys::default(),
    };
    if run.score.exact && run.visited_all {
        run.journeys = travel(&mut exploration, arguments.goals, seed);
    }
    Ok(run)
}

/// Commands the robot to vertices of its map over its line, and compares where it stops with the ground truth.
fn travel<const V: usize, F, const S: usize>(
    exploration: &mut Exploration<'_, V, F, S>,
    journeys: u64,
    seed: u64,
) -> Journeys
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    let mut outcome = Journeys::default();
    for number in 0..journeys {
        let vertices = exploration.robot().mapper().map().vertices().len() as u64;
        let here = exploration.steps().last().map(|step| u8::from(step.update.vertex));
        // Any other vertex, chosen by the seed.
        let vertex = ((seed + 7 * number) % vertices.max(1)) as u8;
        if Some(vertex) == here {
            continue;
        }
        // On an exact map all places of a vertex belong to the same node.
        let places = exploration.path().into_iter().zip(exploration.nodes().iter().copied());
        let truth = places.rev().find(|(taken_for, _)| *taken_for == Some(vertex.into())).and_then(|(_, node)| node);
        exploration.command(Command::GoTo { vertex });
        exploration.advance();
        outcome.asked += 1;
        let begun = exploration.frames();
        while exploration.is_underway() && exploration.frames() < begun + FRAMES_PER_JOURNEY {
            exploration.advance();
        }
        if exploration.robot().drive().goal_status() == GoalStatus::Reached {
            let node = exploration.nodes().last().copied().flatten();
            outcome.arrived += u64::from(node == truth);
            outcome.elsewhere += u64::from(node != truth);
        }
    }
    outcome
}
