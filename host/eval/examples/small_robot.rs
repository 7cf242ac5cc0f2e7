//! What the small robot maps in the built-in plans, with its ring of eight sonars or with sixteen.
//!
//! `cargo run --release -p toposlam-eval --example small_robot -- [RUNS] [PLACES] [NOISE]`
//!
//! Run i has seed i, from 1.

use toposlam::reference::small::{self, Filter, VERTICES};
use toposlam_eval::mapping::score_path;
use toposlam_eval::parallel;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

/// The result of one run.
struct Run {
    exact: bool,
    complete: bool,
    located: f64,
    edge_f1: f64,
    times_lost: u32,
    frames: u64,
}

fn explore<const SONARS: usize>(plan: &Plan, seed: u64, places: usize, noise: f64) -> Result<Run, String> {
    let model = RobotModel::for_ring(SONARS).with_noise(noise);
    let mut exploration =
        Exploration::<VERTICES, Filter, SONARS>::with_robot(plan, model, seed, &small::robot(), &mut [])
            .map_err(|error| error.to_string())?;
    while exploration.places() < places && exploration.frames() < 2000 * places as u64 {
        exploration.advance();
    }
    let map = exploration.robot().mapper().map();
    let score = score_path(map, &exploration.path(), exploration.rover().true_map(), exploration.nodes());
    Ok(Run {
        exact: score.exact,
        complete: exploration.robot().drive().is_complete(),
        located: score.location,
        edge_f1: score.edge_f1,
        times_lost: exploration.times_lost(),
        frames: exploration.frames(),
    })
}

fn print_row<const SONARS: usize>(name: &str, runs: usize, places: usize, noise: f64) -> anyhow::Result<()> {
    let plan = Plan::built_in(name).ok_or_else(|| anyhow::anyhow!("no plan {name}"))?;
    let results = parallel::map(runs, 0, |run| explore::<SONARS>(&plan, run as u64 + 1, places, noise))?;
    let results = results.into_iter().collect::<Result<Vec<_>, _>>().map_err(anyhow::Error::msg)?;
    let mean = |value: fn(&Run) -> f64| results.iter().map(value).sum::<f64>() / runs as f64;
    println!(
        "| {SONARS} | {name} | {:.0} % | {:.0} % | {:.1} % | {:.2} | {:.1} | {:.0} |",
        100.0 * mean(|run| f64::from(u8::from(run.exact))),
        100.0 * mean(|run| f64::from(u8::from(run.complete))),
        100.0 * mean(|run| run.located),
        mean(|run| run.edge_f1),
        mean(|run| f64::from(run.times_lost)),
        mean(|run| run.frames as f64) / places as f64,
    );
    Ok(())
}

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let runs = arguments.next().map_or(Ok(20), |runs| runs.parse())?;
    let places = arguments.next().map_or(Ok(60), |places| places.parse())?;
    let noise = arguments.next().map_or(Ok(1.0), |noise| noise.parse())?;
    println!("{runs} runs of {places} places, noise {noise}");
    println!("| Sonars | Plan | Exact maps | Complete | Located | Edge F1 | Times lost | Frames per place |");
    println!("|---|---|---|---|---|---|---|---|");
    for name in ["office", "ring", "flat"] {
        print_row::<{ small::SONARS }>(name, runs, places, noise)?;
        print_row::<16>(name, runs, places, noise)?;
    }
    Ok(())
}
