//! `toposlam simulate`: drive a simulated robot through a floor plan.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use toposlam::reference;
use toposlam::ring::RingFrame;
use toposlam::wire::map_digest;
use toposlam_host::mapping::Mapping;
use toposlam_host::picture::{Drawing, draw};
use toposlam_host::recording::fault_lines;
use toposlam_host::world::{Journal, Plan, RobotModel, SONARS, Simulation, Truth};

/// Arguments of `toposlam simulate`.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Floor plan: ring, office, flat, or a file.
    #[arg(long, default_value = "office")]
    plan: String,
    /// Drive until this many places were detected.
    #[arg(long, default_value_t = 100)]
    places: usize,
    /// Stop after this many frames at the latest (10 a second); 0: no limit.
    #[arg(long, default_value_t = 1_000_000)]
    frames: u32,
    /// Seed of the drive and of every noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Every noise of the robot, multiplied by this.
    #[arg(long, default_value_t = 1.0, value_parser = noise_factor)]
    noise: f64,
    /// Write a picture here.
    #[arg(long)]
    svg: Option<PathBuf>,
}

pub(super) fn noise_factor(text: &str) -> Result<f64, String> {
    let factor = text.parse().map_err(|error| format!("{error}"))?;
    if (0.0..=100.0).contains(&factor) { Ok(factor) } else { Err("must be 0 to 100".to_owned()) }
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let plan = load_plan(&arguments.plan)?;
    let model = RobotModel::default().with_noise(arguments.noise);
    let mut simulation = Simulation::new(&plan, model, arguments.seed)?;
    let mut journal = Journal::new(simulation.true_map());
    let mut mapping = Mapping::start(&reference::MAPPER)?;
    let mut detections = Vec::new();

    let progress = ProgressBar::new(arguments.places as u64)
        .with_style(ProgressStyle::with_template("{bar:40} {pos}/{len} places, {elapsed}")?);
    let frames = if arguments.frames == 0 { usize::MAX } else { arguments.frames as usize };
    drive(simulation.by_ref().take(frames), |frame, truth| {
        journal.drive(truth);
        if let Some(step) = mapping.observe(frame) {
            detections.push(journal.detect(&step.place));
            progress.suspend(|| println!("{step}"));
            progress.inc(1);
        }
        detections.len() < arguments.places
    });
    progress.finish_and_clear();

    println!("\n{}: {} places in {} visits\n{}", arguments.plan, detections.len(), journal.visits(), journal.report());
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
    if let Some(path) = &arguments.svg {
        let drawing = Drawing::of_mapping(
            &mapping,
            &detections,
            format!("{}: the map after {} places", arguments.plan, nodes.len()),
        );
        let picture = draw(&plan, simulation.true_map(), &drawing);
        std::fs::write(path, picture).with_context(|| format!("writing {}", path.display()))?;
    }
    Ok(())
}

fn yes_or_no(answer: bool) -> &'static str {
    if answer { "yes" } else { "no" }
}

/// Hands every frame on, with what is true in it, until `on_frame` says to stop.
fn drive(
    frames: impl Iterator<Item = (RingFrame<SONARS>, Truth)>,
    mut on_frame: impl FnMut(&RingFrame<SONARS>, &Truth) -> bool,
) {
    for (frame, truth) in frames {
        if !on_frame(&frame, &truth) {
            break;
        }
    }
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
