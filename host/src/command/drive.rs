//! What `simulate` and `emulate` have in common: a drive through a floor plan, mapped on this computer, and its summary.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use toposlam::reference;
use toposlam::ring::RingFrame;
use toposlam::wire::map_digest;
use toposlam_host::mapping::{FilterChoice, Mapping, Step};
use toposlam_host::picture::{Drawing, draw};
use toposlam_host::recording::fault_lines;
use toposlam_host::world::{Journal, Plan, RobotModel, SONARS, Simulation};

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

/// What the drive tells the filter besides the frames of the ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Hints {
    /// Nothing.
    None,
    /// Whether the robot turned back at the place before.
    Turn,
}

fn noise_factor(text: &str) -> Result<f64, String> {
    let factor = text.parse().map_err(|error| format!("{error}"))?;
    if (0.0..=100.0).contains(&factor) { Ok(factor) } else { Err("must be 0 to 100".to_owned()) }
}

/// A drive with what is true of it and the map that this computer makes of it.
pub(super) struct Drive {
    plan: Plan,
    simulation: Simulation,
    journal: Journal,
    mapping: Mapping<SONARS>,
    hints: Hints,
}

impl Drive {
    pub(super) fn start(arguments: &DriveArguments, filter: FilterChoice, hints: Hints) -> anyhow::Result<Self> {
        let plan = load_plan(&arguments.plan)?;
        let model = RobotModel::default().with_noise(arguments.noise);
        let simulation = Simulation::new(&plan, model, arguments.seed)?;
        let journal = Journal::new(simulation.true_map());
        let mapping = Mapping::start(reference::RING, filter)?;
        Ok(Self { plan, simulation, journal, mapping, hints })
    }

    /// Drives on by one frame and maps it; gives a step when the robot has just been at a place.
    pub(super) fn advance(&mut self) -> Option<(RingFrame<SONARS>, Option<Step>)> {
        let (frame, truth) = self.simulation.next()?;
        self.journal.drive(&truth);
        let step = self.mapping.observe(&frame, truth.turn.filter(|_| self.hints == Hints::Turn));
        if let Some(step) = &step {
            self.journal.detect(&step.place);
        }
        Some((frame, step))
    }

    pub(super) fn mapping(&self) -> &Mapping<SONARS> {
        &self.mapping
    }

    /// Prints how the drive went and how right the map is, and draws the picture if one is wanted.
    pub(super) fn summarise(&self, arguments: &DriveArguments) -> anyhow::Result<()> {
        let Self { plan, simulation, journal, mapping, .. } = self;
        let detections = journal.detections();
        println!("\n{}: {} places in {} visits", arguments.plan, detections.len(), journal.visits());
        println!("{}", journal.report());
        let nodes: Vec<Option<usize>> = detections.iter().map(|detection| detection.node).collect();
        let score = mapping.score(simulation.true_map(), &nodes);
        let (vertices, edges) = (mapping.map().vertices(), mapping.map().edges().count());
        println!("map: {vertices} vertices, {edges} edges, digest {:08x}", map_digest(mapping.map()));
        println!(
            "against the true map: exact {}, isomorphic {}, edge F1 {:.2}, located in {:.0} % of the places",
            yes_or_no(score.exact),
            yes_or_no(score.isomorphic),
            score.edge_f1,
            100.0 * score.location
        );
        for line in fault_lines(&mapping.faults()) {
            println!("fault {line}");
        }
        let Some(path) = &arguments.svg else { return Ok(()) };
        let caption = format!("{}: the map after {} places", arguments.plan, detections.len());
        let picture = draw(plan, simulation.true_map(), &Drawing::of_mapping(mapping, detections, caption));
        std::fs::write(path, picture).with_context(|| format!("writing {}", path.display()))
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
fn load_plan(name_or_file: &str) -> anyhow::Result<Plan> {
    if let Some(plan) = Plan::built_in(name_or_file) {
        return Ok(plan);
    }
    let text = std::fs::read_to_string(name_or_file)
        .with_context(|| format!("{name_or_file:?} is neither a built-in plan (ring, office, flat) nor a file"))?;
    Plan::parse(&text).with_context(|| format!("floor plan {name_or_file}"))
}
