//! How many names stay with their places. Every vertex gets a name after 60 places of an exploration, and after 300 places each name is
//! at its place, lost, or at another place.
//!
//! `cargo run --release --package toposlam-cli --example names -- RUNS PLAN...`

use std::collections::HashMap;

use anyhow::{Context, ensure};
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::wire::{Name, Names};
use toposlam::{Filter, VertexId};
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel};

const NAMED_AT: usize = 60;
const PLACES: usize = 300;
const FRAMES_MAX: u64 = 300_000;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (runs, plans) = arguments.split_first().context("the number of runs is missing")?;
    let runs: u64 = runs.parse()?;
    ensure!(!plans.is_empty(), "the plans are missing");
    println!("| Plan | Names | At their place | Lost | At another place |\n|---|---|---|---|---|");
    for name in plans {
        let plan = Plan::built_in(name).with_context(|| format!("{name} is no built-in plan"))?;
        let mut counts = [0; 4];
        for seed in 1..=runs {
            for (sum, count) in counts.iter_mut().zip(run(&plan, seed)?) {
                *sum += count;
            }
        }
        let [names, right, lost, wrong] = counts;
        println!("| {name} | {names} | {right} | {lost} | {wrong} |");
    }
    Ok(())
}

/// The names that were given, and how many are at their place, lost, and at another place.
fn run(plan: &Plan, seed: u64) -> anyhow::Result<[usize; 4]> {
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration: Exploration<'_> = Exploration::start(plan, RobotModel::default(), seed, &mut buffer)?;
    let mut names: Option<Names<64>> = None;
    let mut place_of: HashMap<String, usize> = HashMap::new();
    while exploration.places() < PLACES && exploration.frames() < FRAMES_MAX {
        if exploration.advance().is_none() {
            continue;
        }
        let filter = exploration.robot().mapper().filter();
        if let Some(names) = &mut names {
            names.remap(|vertex| filter.remapped(VertexId::new(vertex)?).map(u8::from));
            names.truncate(filter.map().vertices().len());
        } else if exploration.places() == NAMED_AT {
            let mut given = Names::new();
            for (vertex, place) in places(&exploration) {
                let text = format!("place {vertex}");
                given.set(vertex, Name::new(&text)?).map_err(|refusal| anyhow::anyhow!("{refusal}"))?;
                place_of.insert(text, place);
            }
            names = Some(given);
        }
    }
    let now = places(&exploration);
    let kept: Vec<(u8, String)> =
        names.iter().flat_map(Names::iter).map(|(vertex, name)| (vertex, name.to_string())).collect();
    let right = kept.iter().filter(|(vertex, name)| now.get(vertex) == place_of.get(name)).count();
    Ok([place_of.len(), right, place_of.len() - kept.len(), kept.len() - right])
}

/// The place of the floor plan at which each vertex was visited most.
fn places(exploration: &Exploration<'_>) -> HashMap<u8, usize> {
    let mut visits: HashMap<u8, HashMap<usize, usize>> = HashMap::new();
    for (vertex, detection) in exploration.path().into_iter().zip(exploration.ground_truth().detections()) {
        if let (Some(vertex), Some(node)) = (vertex, detection.node) {
            *visits.entry(vertex as u8).or_default().entry(node).or_default() += 1;
        }
    }
    let most = |nodes: HashMap<usize, usize>| nodes.into_iter().max_by_key(|&(node, count)| (count, node));
    visits.into_iter().filter_map(|(vertex, nodes)| Some((vertex, most(nodes)?.0))).collect()
}
