//! Options and summary shared by `simulate` and `emulate`.

use std::ops::RangeInclusive;
use std::path::{Display, Path, PathBuf};

use anyhow::{Context, ensure};
use clap::Args;
use toposlam::persist::Persist;
use toposlam::reference::SONARS;
use toposlam::wire::{FilterSettings, map_digest};
use toposlam::{Darts, FaultCounters, Filter, Map};
use toposlam_cli::picture::{Drawing, draw};
use toposlam_cli::{outln, output};
use toposlam_eval::faults::fault_lines;
use toposlam_eval::mapping::{has_driven_ways, is_whole, score_path};
use toposlam_link::plural::count;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::hardware::Hardware;
use toposlam_sim::world::{GroundTruth, Plan, RobotModel, TrueMap};

/// The floor plan, the seed and the noise.
#[derive(Args)]
pub(super) struct DriveArguments {
    /// Floor plan: the name of a built-in plan, or a file (docs/plans.md).
    #[arg(long, default_value = "office")]
    plan: PathBuf,
    /// Start of the robot, in metres in the frame of the plan [default: the start of the plan, or its most open place].
    #[arg(long, value_name = "X,Y", value_parser = start, allow_hyphen_values = true)]
    start: Option<(f64, f64)>,
    /// Seed of the drive and of all noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Factor on every noise of the robot, 0 to 100.
    #[arg(long, default_value_t = 1.0, value_parser = noise_factor)]
    noise: f64,
    /// Write the map over the floor plan to an SVG file.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

/// A number within a range, both ends included.
pub(super) fn number_in(text: &str, range: RangeInclusive<f64>) -> Result<f64, String> {
    let allowed = format!("expected a number from {} to {}", range.start(), range.end());
    text.parse().ok().filter(|number| range.contains(number)).ok_or(allowed)
}

pub(super) fn noise_factor(text: &str) -> Result<f64, String> {
    number_in(text, 0.0..=100.0)
}

pub(super) fn fault_rate(text: &str) -> Result<f64, String> {
    number_in(text, 0.0..=1.0)
}

impl DriveArguments {
    /// The floor plan, and the robot with its noise.
    pub(super) fn world(&self) -> anyhow::Result<(Plan, RobotModel)> {
        self.world_for_ring(SONARS)
    }

    /// The floor plan, and a robot with this many sonars and its noise.
    pub(super) fn world_for_ring(&self, sonars: usize) -> anyhow::Result<(Plan, RobotModel)> {
        Ok((load_plan(&self.plan, self.start)?, RobotModel::for_ring(sonars).with_noise(self.noise)))
    }

    /// The floor plan, and a robot of this hardware with its noise.
    pub(super) fn world_for(&self, hardware: &Hardware) -> anyhow::Result<(Plan, RobotModel)> {
        Ok((load_plan(&self.plan, self.start)?, hardware.model().with_noise(self.noise)))
    }

    /// Fails if a file that will be written exists, before the drive.
    pub(super) fn check_files(&self, others: &[&Option<PathBuf>]) -> anyhow::Result<()> {
        let files = others.iter().copied().chain([&self.svg]).flatten();
        files.into_iter().try_for_each(|file| output::check(file, self.force))
    }

    /// Whether existing files are replaced.
    pub(super) const fn force(&self) -> bool {
        self.force
    }

    /// The floor plan argument.
    pub(super) fn plan(&self) -> Display<'_> {
        self.plan.display()
    }

    /// The seed of the drive.
    pub(super) const fn seed(&self) -> u64 {
        self.seed
    }

    /// Prints the detected places and the scores of the map, and writes the SVG file if `--svg` is given.
    pub(super) fn summarise<const V: usize>(&self, drive: &Summary<'_, V>) -> anyhow::Result<()> {
        let Summary { plan, truth, ground_truth, map, darts, is_uncertain, path, faults, .. } = drive;
        let detections = ground_truth.detections();
        let (places, visits) =
            (count(detections.len(), "place", "places"), count(ground_truth.visits(), "visit", "visits"));
        outln!("\n{}: {places} in {visits}", self.plan())?;
        outln!("{}", ground_truth.report())?;
        let (vertices, edges) = (map.vertices().len(), map.edges().count());
        let uncertain = if *is_uncertain { ", uncertain" } else { "" };
        let (vertices, edges) = (count(vertices, "vertex", "vertices"), count(edges, "edge", "edges"));
        outln!("map: {vertices}, {edges}, digest {:08x}{uncertain}", map_digest(map, *darts))?;
        if let Some(darts) = darts {
            outln!("frontiers: {}", darts.frontiers().count())?;
        }
        outln!("against the true map: {}", drive.against_truth())?;
        for line in fault_lines(faults) {
            outln!("fault {line}")?;
        }
        let Some(file) = &self.svg else { return Ok(()) };
        let caption = format!("{}: the map after {places}", self.plan());
        let picture = draw(plan, truth, &Drawing::of_map(map, path, detections, caption));
        output::write_file(file, picture, self.force)
    }
}

/// The result of a drive.
pub(super) struct Summary<'a, const V: usize> {
    pub(super) plan: &'a Plan,
    pub(super) truth: &'a TrueMap,
    pub(super) ground_truth: &'a GroundTruth,
    pub(super) map: &'a Map<V>,
    /// The ways of the map, if the filter knows them.
    pub(super) darts: Option<Darts<'a>>,
    /// Whether the filter holds the map for uncertain.
    pub(super) is_uncertain: bool,
    /// Whether the drive holds the map for complete.
    pub(super) is_complete: bool,
    pub(super) path: Vec<Option<usize>>,
    pub(super) faults: FaultCounters,
}

impl<'a, const V: usize> Summary<'a, V> {
    /// Summarises an exploration.
    pub(super) fn of<F, const S: usize>(plan: &'a Plan, exploration: &'a Exploration<'_, V, F, S>) -> Self
    where
        F: Filter<V, Config: FilterSettings> + Persist,
    {
        Self {
            plan,
            truth: exploration.rover().true_map(),
            ground_truth: exploration.ground_truth(),
            map: exploration.robot().mapper().map(),
            darts: exploration.robot().mapper().filter().darts(),
            is_uncertain: exploration.robot().mapper().filter().is_uncertain(),
            is_complete: exploration.robot().drive().is_complete(),
            path: exploration.path(),
            faults: exploration.faults(),
        }
    }
}

impl<const V: usize> Summary<'_, V> {
    /// How right the map is.
    pub(super) fn against_truth(&self) -> String {
        let Self { truth, ground_truth, map, darts, is_complete, path, .. } = self;
        let nodes: Vec<Option<usize>> = ground_truth.detections().iter().map(|detection| detection.node).collect();
        let score = score_path(map, path, truth, &nodes);
        let exact = darts.map(|darts| has_driven_ways(darts, ground_truth));
        format!(
            "exact {}, isomorphic {}, complete {}, whole plan driven {}, edge F1 {:.2}, located in {:.0} % of the places",
            yes_or_no(exact.unwrap_or(score.exact)),
            yes_or_no(exact.unwrap_or(score.isomorphic)),
            yes_or_no(*is_complete),
            yes_or_no(is_whole(ground_truth)),
            score.edge_f1,
            100.0 * score.location
        )
    }
}

fn yes_or_no(answer: bool) -> &'static str {
    if answer { "yes" } else { "no" }
}

/// A built-in plan by its name, or a plan from a file, with another start if one is given.
pub(super) fn load_plan(file: &Path, start: Option<(f64, f64)>) -> anyhow::Result<Plan> {
    let plan = match file.to_str().and_then(Plan::built_in) {
        Some(plan) => plan,
        None => {
            let names = Plan::BUILT_IN.map(|(name, _)| name).join(", ");
            ensure!(file.exists(), "{file:?} is neither a built-in floor plan ({names}) nor a readable file");
            Plan::load(file).context("floor plan")?
        }
    };
    let Some((x_m, y_m)) = start else { return Ok(plan) };
    let plan = plan.with_start_m(x_m, y_m);
    ensure!(!plan.is_wall_at(plan.start()), "--start {x_m},{y_m} is in a wall of {} or outside it", file.display());
    Ok(plan)
}

/// A point in metres, as `x,y`.
pub(super) fn start(text: &str) -> Result<(f64, f64), String> {
    let numbers = text.split_once(',').and_then(|(x, y)| Some((x.trim().parse().ok()?, y.trim().parse().ok()?)));
    let is_finite = |(x, y): &(f64, f64)| x.is_finite() && y.is_finite();
    numbers.filter(is_finite).ok_or_else(|| "must be x,y in metres".to_owned())
}
