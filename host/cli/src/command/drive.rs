//! What `simulate` and `emulate` have in common: where the robot drives, and the summary of how that went.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use toposlam::reference::VERTICES;
use toposlam::wire::map_digest;
use toposlam::{FaultCounters, Map};
use toposlam_cli::picture::{Drawing, draw};
use toposlam_eval::mapping::score_path;
use toposlam_eval::recording::fault_lines;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Journal, Plan, RobotModel, TrueMap};

/// Where the robot drives, and how well its sonars hear.
#[derive(Args)]
pub(super) struct DriveArguments {
    /// Floor plan: ring, office, flat, or a file.
    #[arg(long, default_value = "office")]
    plan: String,
    /// Seed of the drive and of every noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Every noise of the robot, multiplied by this.
    #[arg(long, default_value_t = 1.0, value_parser = noise_factor)]
    noise: f64,
    /// Write a picture of the map over the floor plan here.
    #[arg(long)]
    svg: Option<PathBuf>,
}

pub(super) fn noise_factor(text: &str) -> Result<f64, String> {
    let factor = text.parse().map_err(|error| format!("{error}"))?;
    if (0.0..=100.0).contains(&factor) { Ok(factor) } else { Err("must be 0 to 100".to_owned()) }
}

pub(super) fn fault_rate(text: &str) -> Result<f64, String> {
    let rate = text.parse().map_err(|error| format!("{error}"))?;
    if (0.0..=1.0).contains(&rate) { Ok(rate) } else { Err("must be 0 to 1".to_owned()) }
}

impl DriveArguments {
    /// The floor plan, and the robot with its noise.
    pub(super) fn world(&self) -> anyhow::Result<(Plan, RobotModel)> {
        Ok((load_plan(&self.plan)?, RobotModel::default().with_noise(self.noise)))
    }

    /// The floor plan as it was given.
    pub(super) fn plan(&self) -> &str {
        &self.plan
    }

    /// The seed of the drive.
    pub(super) const fn seed(&self) -> u64 {
        self.seed
    }

    /// Prints how the drive went and how right the map is, and draws the picture if one is wanted.
    pub(super) fn summarise<const V: usize>(&self, drive: &Summary<'_, V>) -> anyhow::Result<()> {
        let Summary { plan, truth, journal, map, path, faults } = drive;
        let detections = journal.detections();
        println!("\n{}: {} places in {} visits", self.plan, detections.len(), journal.visits());
        println!("{}", journal.report());
        let nodes: Vec<Option<usize>> = detections.iter().map(|detection| detection.node).collect();
        let score = score_path(map, path, truth, &nodes);
        let (vertices, edges) = (map.vertices().len(), map.edges().count());
        println!("map: {vertices} vertices, {edges} edges, digest {:08x}", map_digest(map));
        println!(
            "against the true map: exact {}, isomorphic {}, edge F1 {:.2}, located in {:.0} % of the places",
            yes_or_no(score.exact),
            yes_or_no(score.isomorphic),
            score.edge_f1,
            100.0 * score.location
        );
        for line in fault_lines(faults) {
            println!("fault {line}");
        }
        let Some(file) = &self.svg else { return Ok(()) };
        let caption = format!("{}: the map after {} places", self.plan, detections.len());
        let picture = draw(plan, truth, &Drawing::of_map(map, path, detections, caption));
        std::fs::write(file, picture).with_context(|| format!("writing {}", file.display()))
    }
}

/// What a drive came to.
pub(super) struct Summary<'a, const V: usize> {
    pub(super) plan: &'a Plan,
    pub(super) truth: &'a TrueMap,
    pub(super) journal: &'a Journal,
    pub(super) map: &'a Map<V>,
    pub(super) path: Vec<Option<usize>>,
    pub(super) faults: FaultCounters,
}

impl<'a> Summary<'a, VERTICES> {
    /// That of a robot which drove by itself.
    pub(super) fn of(plan: &'a Plan, exploration: &'a Exploration<'_>) -> Self {
        Self {
            plan,
            truth: exploration.rover().true_map(),
            journal: exploration.journal(),
            map: exploration.robot().mapper().map(),
            path: exploration.path(),
            faults: exploration.faults(),
        }
    }
}

/// A bar that counts places.
pub(super) fn progress_bar(places: usize) -> anyhow::Result<ProgressBar> {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} places, {elapsed}")?;
    Ok(ProgressBar::new(places as u64).with_style(style))
}

fn yes_or_no(answer: bool) -> &'static str {
    if answer { "yes" } else { "no" }
}

/// A built-in plan by its name, or one from a file.
pub(super) fn load_plan(name_or_file: &str) -> anyhow::Result<Plan> {
    if let Some(plan) = Plan::built_in(name_or_file) {
        return Ok(plan);
    }
    let text = std::fs::read_to_string(name_or_file)
        .with_context(|| format!("{name_or_file:?} is neither a built-in plan (ring, office, flat) nor a file"))?;
    Plan::parse(&text).with_context(|| format!("floor plan {name_or_file}"))
}
