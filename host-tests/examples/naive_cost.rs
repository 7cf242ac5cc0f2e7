//! Counts what the filter would cost if it compared all n-grams, place by place on the input of the bench image.
//!
//! ```sh
//! cargo run --release -p toposlam-host-tests --example naive_cost -- [--direction DIRECTION] [--bench-log FILE]
//! ```
//!
//! The naive implementation weighs all N · (K + 1) predictions, equal particles each for itself. For each prediction it
//! lists the n-grams of the predicted map and of the history, distinct up to reversal, and compares each with each, once
//! for every half of Eq. 2 that the direction takes. Listing them, which it would have to do as well, is not counted.
//! The comparisons are counted, not made: their number follows from the sizes of the two sets.

use std::collections::VecDeque;
use std::process::exit;

use toposlam::reference;
use toposlam::reference::paper::{self, PARTICLES, VERTICES};
use toposlam::{Direction, Filter, Fingerprint, History, Map, Particle, VertexId};
use toposlam_host_tests::graph::Graph;
use toposlam_host_tests::ngram::{grams_of_graph, grams_of_history};

const PLACES_MM: [u16; 400] = include!("../../src/bin/bench/places.rs");
const N: usize = paper::FILTER.ngram_length as usize;
const _: () = assert!(N <= 5, "n labels of 12 bits are packed into 64 bits");

/// How many n-grams a labelled graph has, distinct up to reversal: the labels of all its walks of n vertices.
fn ngrams(labels: &[Fingerprint], neighbours: &[Vec<usize>]) -> u64 {
    let mut found = Vec::new();
    for start in 0..labels.len() {
        walk_on(&mut vec![start], labels, neighbours, &mut found);
    }
    found.sort_unstable();
    found.dedup();
    found.len() as u64
}

fn walk_on(walk: &mut Vec<usize>, labels: &[Fingerprint], neighbours: &[Vec<usize>], found: &mut Vec<u64>) {
    if walk.len() == N {
        let pack = |packed: u64, &vertex: &usize| packed << 12 | u64::from(labels[vertex].steps());
        let (forward, backward) = (walk.iter().fold(0, pack), walk.iter().rev().fold(0, pack));
        // The reversal is a walk as well.
        if forward <= backward {
            found.push(forward);
        }
        return;
    }
    for &next in &neighbours[walk[walk.len() - 1]] {
        walk.push(next);
        walk_on(walk, labels, neighbours, found);
        walk.pop();
    }
}

fn ngrams_of_map(map: &Map<VERTICES>) -> u64 {
    let row = |vertex| map.neighbours(vertex).iter().map(usize::from).collect();
    ngrams(map.labels(), &map.vertices().map(row).collect::<Vec<_>>())
}

/// The history is a line along which the robot may have turned back at any place.
fn ngrams_of_history(history: &VecDeque<Fingerprint>) -> u64 {
    let labels: Vec<_> = history.iter().copied().collect();
    let last = labels.len() - 1;
    let beside = |place: usize| place.checked_sub(1).into_iter().chain((place < last).then_some(place + 1)).collect();
    ngrams(&labels, &(0..labels.len()).map(beside).collect::<Vec<_>>())
}

/// The maps that the filter predicts from a particle: one for each vertex, and one for a new vertex while there is room.
fn predictions(particle: &Particle<VERTICES>, observation: Fingerprint) -> impl Iterator<Item = Map<VERTICES>> + '_ {
    let vertices = particle.map.vertices().len();
    let candidates = (vertices + 1).min(VERTICES);
    VertexId::first(candidates).map(move |vertex| {
        let mut map = particle.map;
        if particle.map.contains(vertex) {
            map.observe(vertex, observation);
        } else {
            map.add_vertex(observation).expect("there is room");
        }
        if vertices > 0 {
            map.add_edge(particle.at, vertex);
        }
        map
    })
}

/// The counts are those of the reference's own enumeration.
fn check_against_the_reference(map: &Map<VERTICES>, history: &VecDeque<Fingerprint>, counts: (u64, u64)) {
    let radius_mm = |label: &Fingerprint| f64::from(label.radius_mm());
    let labels_mm: Vec<_> = map.labels().iter().map(radius_mm).collect();
    let edges: Vec<_> = map.edges().map(|(a, b)| (usize::from(a), usize::from(b))).collect();
    let of_map = grams_of_graph(&Graph::with(&labels_mm, &edges), N).len();
    let history_mm: Vec<_> = history.iter().map(radius_mm).collect();
    assert_eq!((of_map as u64, grams_of_history(&history_mm, N).len() as u64), counts);
}

/// What one place would cost.
#[derive(Clone, Copy)]
struct Place {
    predictions: u64,
    ngrams_of_history: u64,
    ngrams_of_largest_prediction: u64,
    comparisons: u64,
}

fn count(direction: Direction) -> Vec<Place> {
    let halves = if direction == Direction::TwoSided { 2 } else { 1 };
    let mut filter = Box::new(paper::Filter::new());
    filter.start(paper::FILTER.with_direction(direction), reference::SEED).expect("the reference settings are valid");
    let mut history = VecDeque::new();
    let mut places = Vec::new();
    for radius_mm in PLACES_MM {
        let observation = Fingerprint::from_radius_mm(radius_mm).expect("the input is in range");
        history.push_back(observation);
        if history.len() > History::<{ paper::HISTORY_WORDS }>::CAPACITY {
            history.pop_front();
        }
        let ngrams_of_history = ngrams_of_history(&history);
        let mut place = Place { predictions: 0, ngrams_of_history, ngrams_of_largest_prediction: 0, comparisons: 0 };
        // Before the first place there is no particle; its predictions have one vertex and no n-gram.
        for particle in filter.particles() {
            for map in predictions(particle, observation) {
                let ngrams_of_prediction = ngrams_of_map(&map);
                let multiplicity = u64::from(particle.multiplicity);
                place.predictions += multiplicity;
                place.ngrams_of_largest_prediction = place.ngrams_of_largest_prediction.max(ngrams_of_prediction);
                place.comparisons += multiplicity * halves * ngrams_of_prediction * ngrams_of_history;
            }
        }
        filter.observe(observation);
        if places.len() % 100 == 99 {
            check_against_the_reference(filter.map(), &history, (ngrams_of_map(filter.map()), ngrams_of_history));
        }
        places.push(place);
    }
    places
}

/// Median and largest.
fn median_and_worst(values: impl Iterator<Item = u64>) -> [u64; 2] {
    let mut values: Vec<u64> = values.collect();
    values.sort_unstable();
    [values[values.len() / 2], values[values.len() - 1]]
}

/// The value of a line `name: value` of the bench image's output.
fn logged(log: &str, name: &str) -> Option<u64> {
    log.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':')?.trim().parse().ok())
}

fn usage(problem: &str) -> ! {
    eprintln!("{problem}\nusage: naive_cost [--direction two-sided|map-to-history|history-to-map] [--bench-log FILE]");
    exit(2);
}

fn main() {
    let (mut direction, mut name, mut bench_log) = (Direction::TwoSided, "two-sided".to_owned(), None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let value = arguments.next().unwrap_or_else(|| usage(&format!("{argument} needs a value")));
        match argument.as_str() {
            "--direction" => {
                direction = match value.as_str() {
                    "two-sided" => Direction::TwoSided,
                    "map-to-history" => Direction::MapToHistory,
                    "history-to-map" => Direction::HistoryToMap,
                    _ => usage(&format!("no such direction: {value}")),
                };
                name = value;
            }
            "--bench-log" => {
                let log = std::fs::read_to_string(&value).unwrap_or_else(|error| usage(&format!("{value}: {error}")));
                bench_log = Some(log);
            }
            _ => usage(&format!("no such option: {argument}")),
        }
    }

    let places = count(direction);
    let of = |value: fn(&Place) -> u64| median_and_worst(places.iter().map(value));
    let comparisons = of(|place| place.comparisons);
    println!("direction: {name}, N = {PARTICLES}, n = {N}, V = {VERTICES}, {} places", places.len());
    println!("Per place, median and worst:");
    let print = |what: &str, [median, worst]: [u64; 2]| println!("  {what:<58} {median:>14} {worst:>14}");
    print("predictions, N x (K + 1)", of(|place| place.predictions));
    print("n-grams of the history", of(|place| place.ngrams_of_history));
    print("n-grams of the prediction that has most", of(|place| place.ngrams_of_largest_prediction));
    print("n-gram comparisons of the naive enumeration", comparisons);
    print("label comparisons of the naive enumeration", comparisons.map(|count| N as u64 * count));
    let Some(log) = bench_log else { return };
    let key = |quantile: &str| format!("{}_instructions_per_place_{quantile}", name.replace('-', "_"));
    let instructions = ["median", "worst"].map(|quantile| {
        let key = key(quantile);
        logged(&log, &key).unwrap_or_else(|| usage(&format!("the bench log has no {key}")))
    });
    print("instructions of the whole filter update (bench log)", instructions);
    println!(
        "n-gram comparisons of the naive enumeration for each instruction of this filter, its whole update included:"
    );
    for (quantile, (naive, own)) in ["median", "worst"].iter().zip(comparisons.into_iter().zip(instructions)) {
        println!("naive_ratio_{quantile}: {:.1}", naive as f64 / own.max(1) as f64);
    }
}
