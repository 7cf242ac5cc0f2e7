//! How often the maps of two robots, each in its own half of a building, are merged exactly (docs/merge.md).
//!
//! Each pair has a building of a family (docs/evaluation.md). One robot keeps to the places nearest to a place drawn at random, the
//! other to those nearest to the place farthest from it; the halves overlap. A way out of its half is a frontier to a robot.
//!
//! ```sh
//! cargo run --release --package toposlam-cli --example merge_pairs -- 50 1,100,16,24,2-3,3-6,0.03-0.06,general
//! ```

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::env;

use anyhow::Context;
use rand::RngExt;
use toposlam::reference::{self, FILTER};
use toposlam::{Filter, Observation};
use toposlam_eval::corridors::{Bearings, Corridors};
use toposlam_eval::environment::Environment;
use toposlam_eval::family::Family;
use toposlam_eval::hints::Hints;
use toposlam_eval::parallel;
use toposlam_eval::rotation::{RotationSystem, partner};
use toposlam_eval::walk::{PathRng, Walk, observe, path_rng, quantise};
use toposlam_link::merge::{MergeError, Merged, merge};
use toposlam_link::topology::TopologicalMap;

/// The share of the places of the building in each half.
const SHARE: f64 = 0.6;
/// Places on the path of a robot.
const LENGTH: usize = 100;
/// What a robot with a ring perceives (docs/evaluation.md). Without hints that are missing or wrong most maps are exact.
const HINTS: &str = "ways,travel=0.1,bearing_mrad=100";
const FINGERPRINT_BITS: u32 = 12;
/// Between two places.
const REFINEMENT_STEPS: u32 = 4;

/// A map, the place of the building that each of its vertices is, and whether the map is exact.
struct Half {
    map: TopologicalMap,
    place_of: BTreeMap<u8, usize>,
    is_exact: bool,
}

/// The places in the order of their distance from one, in corridors.
fn by_distance(environment: &Environment, from: usize) -> Vec<usize> {
    let (mut order, mut seen) = (vec![from], BTreeSet::from([from]));
    let mut open = VecDeque::from([from]);
    while let Some(place) = open.pop_front() {
        for &next in &environment.neighbours()[place] {
            if seen.insert(next) {
                order.push(next);
                open.push_back(next);
            }
        }
    }
    order
}

/// A path in a half: half of the ways are drawn from those not driven yet.
fn walk(environment: &Environment, half: &BTreeSet<usize>, start: usize, rng: &mut PathRng) -> Walk {
    let (mut places, mut exits, mut driven) = (vec![start], Vec::new(), BTreeSet::new());
    while places.len() < LENGTH {
        let here = places[places.len() - 1];
        let all = environment.exits()[here].iter().copied();
        let inside: Vec<usize> = all.filter(|&exit| half.contains(&environment.place_of(partner(exit)))).collect();
        let new: Vec<usize> = inside.iter().copied().filter(|exit| !driven.contains(&(exit / 2))).collect();
        let choice = if new.is_empty() || rng.random_bool(0.5) { &inside } else { &new };
        let exit = choice[rng.random_range(0..choice.len())];
        driven.insert(exit / 2);
        exits.push(exit);
        places.push(environment.place_of(partner(exit)));
    }
    Walk { places, origin: exits[0], exits, exhaustive: false }
}

fn explore(
    environment: &Environment,
    corridors: &Corridors,
    half: &BTreeSet<usize>,
    start: usize,
    rng: &mut PathRng,
) -> anyhow::Result<Half> {
    let walk = walk(environment, half, start, rng);
    let hints = HINTS.parse::<Hints>()?.draw(environment, Some(corridors), &walk, rng);
    let mut filter = Box::new(reference::Filter::new());
    filter.start(FILTER, rng.random())?;
    for (step, (&place, hint)) in walk.places.iter().zip(&hints).enumerate() {
        let fingerprint = quantise(observe(&environment.places()[place], rng), FINGERPRINT_BITS);
        let observation = Observation { ways: hint.ways, ..Observation::new(fingerprint) };
        filter.observe(if step == 0 {
            Observation { starts_sequence: true, ..observation }
        } else {
            Observation { exit: hint.exit, travel_frames: hint.travel_frames, ..observation }
        });
        (0..REFINEMENT_STEPS).for_each(|_| filter.refine());
    }
    let mut votes: BTreeMap<u8, BTreeMap<usize, usize>> = BTreeMap::new();
    for (ago, &place) in walk.places.iter().rev().enumerate() {
        if let Some(vertex) = filter.recent(ago) {
            *votes.entry(vertex.into()).or_default().entry(place).or_default() += 1;
        }
    }
    let most = |votes: &BTreeMap<usize, usize>| votes.iter().max_by_key(|(_, count)| **count).map(|(place, _)| *place);
    let visited: Vec<usize> = walk.places.iter().copied().collect::<BTreeSet<_>>().into_iter().collect();
    let driven: BTreeSet<usize> = walk.exits.iter().map(|exit| exit / 2).collect();
    let truth = corridors.rotation().part(&visited, |corridor| driven.contains(&corridor));
    Ok(Half {
        map: TopologicalMap::of(&*filter),
        place_of: votes.iter().filter_map(|(vertex, votes)| Some((*vertex, most(votes)?))).collect(),
        is_exact: filter.darts().is_some_and(|darts| RotationSystem::from(darts).is_isomorphic_to(&truth)),
    })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// The common vertices are the places that both robots visited.
    Exact,
    /// Common vertices are missing, and all that were found are right.
    Incomplete,
    /// Different places were merged.
    Wrong,
    Refused,
}

fn judge(halves: &[Half; 2], merged: &Result<Merged, MergeError>) -> Outcome {
    let Ok(merged) = merged else { return Outcome::Refused };
    let place = |half: usize, vertex: u8| halves[half].place_of.get(&vertex);
    if merged.common.iter().any(|&(a, b)| place(0, a).is_none() || place(0, a) != place(1, b)) {
        return Outcome::Wrong;
    }
    let places = |half: usize| halves[half].place_of.values().collect::<BTreeSet<_>>();
    if places(0).intersection(&places(1)).count() == merged.common.len() { Outcome::Exact } else { Outcome::Incomplete }
}

fn main() -> anyhow::Result<()> {
    let mut arguments = env::args().skip(1);
    let pairs: usize = arguments.next().context("number of pairs, then families")?.parse()?;
    let is_verbose = env::var_os("MERGE_VERBOSE").is_some();
    println!("pairs of exact maps: merged exactly, incompletely, wrong, refused; the same of pairs with a wrong map");
    for text in arguments {
        let family: Family = text.parse()?;
        for bearings in [Bearings::Spread, Bearings::RightAngles] {
            let results = parallel::map(pairs, 0, |pair| -> anyhow::Result<(bool, Outcome)> {
                let environment = family.environment(pair % family.count)?;
                let mut rng = path_rng(family.seed, pair as u64);
                let corridors = Corridors::draw(&environment, bearings, &mut rng)?;
                let count = environment.places().len();
                let size = (SHARE * count as f64).ceil() as usize;
                let first = by_distance(&environment, rng.random_range(0..count));
                let second = by_distance(&environment, first[count - 1]);
                let mut half = |order: &[usize]| {
                    let inside = order[..size].iter().copied().collect();
                    explore(&environment, &corridors, &inside, order[0], &mut rng)
                };
                let halves = [half(&first)?, half(&second)?];
                let merged = merge(&halves[0].map, &halves[1].map);
                let outcome = judge(&halves, &merged);
                let is_exact = halves.iter().all(|half| half.is_exact);
                if is_verbose {
                    let sizes = halves.each_ref().map(|half| half.map.vertices.len());
                    let text = match &merged {
                        Ok(merged) => merged.parts.iter().map(|part| format!("{part} | ")).collect(),
                        Err(error) => error.to_string(),
                    };
                    eprintln!("{pair} {sizes:?} of {count} {is_exact} {outcome:?}: {text}");
                }
                Ok((is_exact, outcome))
            })?;
            let results: Vec<(bool, Outcome)> = results.into_iter().collect::<anyhow::Result<_>>()?;
            let count = |exact: bool, outcome| results.iter().filter(|&&it| it == (exact, outcome)).count();
            let counts = |exact| {
                [Outcome::Exact, Outcome::Incomplete, Outcome::Wrong, Outcome::Refused].map(|it| count(exact, it))
            };
            let (exact, other) = (counts(true), counts(false));
            println!(
                "{text}, {}: {} pairs {exact:?}; {} {other:?}",
                bearings.name(),
                exact.iter().sum::<usize>(),
                other.iter().sum::<usize>()
            );
        }
    }
    Ok(())
}
