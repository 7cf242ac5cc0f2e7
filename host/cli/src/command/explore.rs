//! `toposlam explore`: the rates of exact maps and of reached goals over many explorations of a simulated robot.

use anyhow::ensure;
use clap::Args;
use toposlam::Filter;
use toposlam::drive::GoalStatus;
use toposlam::persist::Persist;
use toposlam::reference::{SONARS, ordered, paper, robust};
use toposlam::robot::RobotConfig;
use toposlam::wire::{Command, FilterSettings};
use toposlam_eval::mapping::score_exploration;
use toposlam_eval::parallel;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::injector::FaultRates;
use toposlam_sim::world::{HintReport, Plan, Report, ReportedHints, RobotModel};

use super::drive::{fault_rate, load_plan, noise_factor, number_in, start};
use super::filter::FilterArgument;

/// Timeout of a goal, in ring frames.
const FRAMES_PER_JOURNEY: u64 = 20_000;

/// Arguments of `toposlam explore`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Floor plans: names of built-in plans, or files (docs/plans.md).
    #[arg(long, value_name = "PLAN,...", value_delimiter = ',', default_value = "office,ring,flat")]
    plans: Vec<String>,
    /// Start of the robot, in metres in the frame of the only plan [default: the start of the plan, or its most open place].
    #[arg(long, value_name = "X,Y", value_parser = start, allow_hyphen_values = true)]
    start: Option<(f64, f64)>,
    /// Factors on every noise of the robot, 0 to 100.
    #[arg(long, value_name = "FACTOR,...", value_delimiter = ',', default_value = "1,2", value_parser = noise_factor)]
    noises: Vec<f64>,
    /// Runs for each plan and noise; run i has seed i, from 1.
    #[arg(long, default_value_t = 100)]
    runs: usize,
    /// Places per exploration.
    #[arg(long, default_value_t = 300)]
    places: usize,
    /// Filter that makes the map.
    #[arg(long, value_enum, default_value_t = FilterArgument::Ordered)]
    filter: FilterArgument,
    /// Goals after each exploration that ended with the exact map.
    #[arg(long, alias = "journeys", default_value_t = 5)]
    goals: u64,
    /// Bit mask of dead sonars, 0 to 65535; bit 0 is the sonar straight ahead.
    #[arg(long, value_name = "MASK", default_value_t = 0)]
    dead_sonars: u16,
    /// Probability that an echo is missed, 0 to 1 [default: 0.02 times the noise factor].
    #[arg(long, value_name = "P", value_parser = fault_rate)]
    missed: Option<f64>,
    /// Largest angle of incidence at which a wall returns an echo, in degrees, 0 to 90 [default: 25].
    #[arg(long, value_name = "DEGREES", value_parser = degrees)]
    specular_limit_deg: Option<f64>,
    /// Fault rate of the ring and the line, 0 to 1: the probability that a sonar echo is lost. Every other rate is proportional to it
    /// (docs/faults.md).
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = fault_rate)]
    faults: f64,
}

/// The result of one run.
struct Run {
    report: Report,
    hints: HintReport,
    exact: bool,
    visited_all: bool,
    complete: bool,
    locations: f64,
    times_lost: u32,
    bumps: u32,
    frames: u64,
    journeys: Journeys,
}

/// Goals after an exploration.
#[derive(Clone, Copy, Default)]
struct Journeys {
    /// Goals that were commanded.
    asked: u64,
    /// Goals that were reached at the true place.
    arrived: u64,
    /// Goals that the robot reported as reached at another place.
    elsewhere: u64,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    ensure!(arguments.runs > 0, "--runs must be at least 1");
    ensure!(arguments.start.is_none() || arguments.plans.len() == 1, "--start needs exactly one plan");
    println!(
        "| Plan | Noise | Exact maps | Visited all | Complete | Located | Found / missed / doubled / phantom | Radius error, median / 90 % \
         | Degree seen / right | Way lost | Bumps | Frames per place | Goals reached / commanded / reached elsewhere |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    let mut rows = Vec::new();
    for name in &arguments.plans {
        let plan = load_plan(name, arguments.start)?;
        let one = |arguments: &Arguments, plan: &Plan, noise: f64, seed: u64| match arguments.filter {
            FilterArgument::Ordered => one::<{ ordered::VERTICES }, ordered::Filter>(
                arguments,
                plan,
                noise,
                seed,
                &ordered::ROBOT,
                &mut [0; ordered::SNAPSHOT_BYTES],
            ),
            FilterArgument::Robust => one::<{ robust::VERTICES }, robust::Filter>(
                arguments,
                plan,
                noise,
                seed,
                &robust::ROBOT,
                &mut [0; robust::SNAPSHOT_BYTES],
            ),
            FilterArgument::Paper => one::<{ paper::VERTICES }, paper::Filter>(
                arguments,
                plan,
                noise,
                seed,
                &paper::ROBOT,
                &mut [0; paper::SNAPSHOT_BYTES],
            ),
        };
        for &noise in &arguments.noises {
            let runs = parallel::map(arguments.runs, 0, |run| one(arguments, &plan, noise, run as u64 + 1))?;
            let runs: Result<Vec<Run>, _> = runs.into_iter().collect();
            let runs = runs?;
            print_row(name, noise, &runs, arguments.places);
            rows.push(hint_row(name, noise, &runs));
        }
    }
    println!(
        "\n| Plan | Noise | Exits wrong / unknown | Ways missed / false, of the true ones | Ways unknown | Bearing error, \
         sd / 90 % | Travel time error, sd / 90 %; each direction apart, sd |"
    );
    println!("|---|---|---|---|---|---|---|");
    rows.iter().for_each(|row| println!("{row}"));
    Ok(())
}

/// An angle of incidence.
fn degrees(text: &str) -> Result<f64, String> {
    number_in(text, 0.0..=90.0)
}

fn one<const V: usize, F>(
    arguments: &Arguments,
    plan: &Plan,
    noise: f64,
    seed: u64,
    config: &RobotConfig<SONARS, F::Config>,
    buffer: &mut [u8],
) -> anyhow::Result<Run>
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    let mut model = RobotModel::default().with_noise(noise);
    model.sonar.dead_sonars = arguments.dead_sonars;
    model.sonar.missed_share = arguments.missed.unwrap_or(model.sonar.missed_share);
    if let Some(limit_deg) = arguments.specular_limit_deg {
        model.sonar.specular_limit_rad = limit_deg.to_radians();
    }
    let mut exploration = Exploration::<V, F>::with_robot(plan, model, seed, config, buffer)?;
    if arguments.faults > 0.0 {
        exploration.set_faults(FaultRates::scaled(arguments.faults), seed);
    }
    let most_frames = arguments.places as u64 * 2000;
    while exploration.places() < arguments.places && exploration.frames() < most_frames {
        exploration.advance();
    }
    let score = score_exploration(&exploration);
    let seen: std::collections::BTreeSet<usize> = exploration.nodes().iter().copied().flatten().collect();
    let reported: Vec<ReportedHints> = exploration.steps().iter().map(|step| step.reported).collect();
    let mut run = Run {
        report: exploration.ground_truth().report(),
        hints: exploration.ground_truth().hint_report(&reported),
        exact: score.exact,
        complete: exploration.robot().drive().is_complete(),
        visited_all: seen.len() == exploration.rover().true_map().nodes.len(),
        locations: score.location,
        times_lost: exploration.times_lost(),
        bumps: exploration.rover().bumps(),
        frames: exploration.frames(),
        journeys: Journeys::default(),
    };
    if run.exact && run.visited_all {
        run.journeys = travel(&mut exploration, arguments.goals, seed);
    }
    Ok(run)
}

/// Commands the robot to vertices of its map over its line, and compares where it stops with the ground truth.
fn travel<const V: usize, F>(exploration: &mut Exploration<'_, V, F>, journeys: u64, seed: u64) -> Journeys
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

/// The error rates of the hints.
fn hint_row(name: &str, noise: f64, runs: &[Run]) -> String {
    let mut all = HintReport::default();
    runs.iter().for_each(|run| all.add(&run.hints));
    let percent = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
    let deviation =
        |errors: &[f64]| (errors.iter().map(|error| error * error).sum::<f64>() / errors.len().max(1) as f64).sqrt();
    let rank = |errors: &[f64]| {
        let mut sizes: Vec<f64> = errors.iter().map(|error| error.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.get((0.9 * sizes.len() as f64) as usize).copied().unwrap_or(0.0)
    };
    let HintReport { exits, places, ways, bearing_errors_rad, travel_errors, one_way_travel_errors, .. } = &all;
    format!(
        "| {name} | {noise} | {:.2} / {:.2} % | {:.2} / {:.2} % | {:.2} % | {:.0} / {:.0} mrad | {:.1} / {:.1} %; {:.1} % |",
        percent(exits.1, exits.0),
        percent(exits.2, exits.0 + exits.2),
        percent(ways.1, ways.0),
        percent(ways.2, ways.0),
        percent(places.1, places.0 + places.1),
        1000.0 * deviation(bearing_errors_rad),
        1000.0 * rank(bearing_errors_rad),
        100.0 * deviation(travel_errors),
        100.0 * rank(travel_errors),
        100.0 * deviation(one_way_travel_errors),
    )
}

fn print_row(name: &str, noise: f64, runs: &[Run], places: usize) {
    let share = |count: usize| 100.0 * count as f64 / runs.len() as f64;
    let sum = |of: fn(&Run) -> usize| runs.iter().map(of).sum::<usize>();
    let mut errors_mm: Vec<f64> =
        runs.iter().flat_map(|run| run.report.radius_errors_mm.iter().map(|error_mm| error_mm.abs())).collect();
    errors_mm.sort_by(f64::total_cmp);
    let rank = |share: f64| errors_mm.get((share * errors_mm.len() as f64) as usize).copied().unwrap_or(0.0);
    let located = runs.iter().map(|run| run.locations).sum::<f64>() / runs.len() as f64;
    let frames = runs.iter().map(|run| run.frames).sum::<u64>() / (runs.len() * places) as u64;
    let journeys = |of: fn(&Journeys) -> u64| runs.iter().map(|run| of(&run.journeys)).sum::<u64>();
    println!(
        "| {name} | {noise} | {:.0} % | {:.0} % | {:.0} % | {:.1} % | {} / {} / {} / {} | {:.0} / {:.0} mm | {} / {} | {} | {} | {frames} | {} / {} / {} |",
        share(runs.iter().filter(|run| run.exact).count()),
        share(runs.iter().filter(|run| run.visited_all).count()),
        share(runs.iter().filter(|run| run.complete).count()),
        100.0 * located,
        sum(|run| run.report.found),
        sum(|run| run.report.missed),
        sum(|run| run.report.doubled),
        sum(|run| run.report.phantom),
        rank(0.5),
        rank(0.9),
        sum(|run| run.report.degrees.0),
        sum(|run| run.report.degrees.1),
        sum(|run| run.times_lost as usize),
        sum(|run| run.bumps as usize),
        journeys(|journeys| journeys.arrived),
        journeys(|journeys| journeys.asked),
        journeys(|journeys| journeys.elsewhere),
    );
}
