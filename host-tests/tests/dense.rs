//! Eq. 2 on dense maps, where the core processes the arms of walks at a vertex in blocks: the distance equals that of the
//! enumerating reference, whichever walk is missing from the evidence.

mod common;

use common::{core_history, core_map, fingerprint, length, reference_distances_mm};
use std::collections::HashMap;
use toposlam::{Consistency, Direction, Evidence, Ngram, NgramTable};
use toposlam_host_tests::consistency::hausdorff;
use toposlam_host_tests::graph::Graph;
use toposlam_host_tests::ngram::{self, NgramSet, grams_of_graph, grams_of_history};

/// Capacity of the maps.
const VERTICES: usize = 24;

/// Labels at least 40 mm apart that do not increase with the vertex.
fn labels_mm(vertices: usize) -> Vec<f64> {
    (0..vertices).map(|vertex| 500.0 + 40.0 * (7 * vertex % vertices) as f64).collect()
}

/// A hub and its leaves.
fn star(vertices: usize, hub: usize) -> Graph {
    let edges: Vec<_> = (0..vertices).filter(|&leaf| leaf != hub).map(|leaf| (leaf, hub)).collect();
    Graph::with(&labels_mm(vertices), &edges)
}

/// Two adjacent hubs, each adjacent to all other vertices.
fn two_hubs(vertices: usize) -> Graph {
    let edges: Vec<_> = (2..vertices).flat_map(|leaf| [(0, leaf), (1, leaf)]).chain([(0, 1)]).collect();
    Graph::with(&labels_mm(vertices), &edges)
}

/// A complete graph.
fn complete(vertices: usize) -> Graph {
    let edges: Vec<_> = (0..vertices).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
    Graph::with(&labels_mm(vertices), &edges)
}

fn assert_agrees<const WORDS: usize, const INDICES: usize>(
    graph: &Graph,
    evidence: &impl Evidence<WORDS>,
    n: usize,
    (of_graph, of_evidence): (&NgramSet, &NgramSet),
    missing: &ngram::Ngram,
) {
    let enumerated_mm = reference_distances_mm(hausdorff(of_graph, of_evidence));
    let map = core_map::<VERTICES>(graph);
    let mut consistency = Box::new(Consistency::<VERTICES, WORDS, INDICES>::new());
    let directions = [Direction::TwoSided, Direction::MapToHistory, Direction::HistoryToMap];
    let computed_mm = directions.map(|direction| {
        let steps = consistency.distance_steps(&map, evidence, length(n), direction).expect("nothing is empty");
        f64::from(steps) * f64::from(length(n).label_step_mm())
    });
    assert_eq!(computed_mm, enumerated_mm, "n = {n}, without {missing:?}");
}

/// Removes every `stride`-th n-gram of a graph in turn from a table of all n-grams, and compares the distances.
fn check_tables_without_one_walk<const WORDS: usize>(graph: &Graph, n: usize, stride: usize) {
    let of_graph = grams_of_graph(graph, n);
    for missing in of_graph.iter().step_by(stride) {
        let mut explored = of_graph.clone();
        explored.remove(missing);
        let mut table = Box::new(NgramTable::<WORDS>::new(length(n)));
        for ngram in &explored {
            let fingerprints: Vec<_> = ngram.labels().iter().map(|&label_mm| fingerprint(label_mm)).collect();
            table.insert(Ngram::new(length(n), &fingerprints).unwrap()).unwrap();
        }
        assert_agrees::<WORDS, 7>(graph, &*table, n, (&of_graph, &explored), missing);
    }
}

/// A long drive that prefers the walks it used least, and uses one given walk of n vertices only where it has no alternative.
fn drive_without(graph: &Graph, missing: &ngram::Ngram, n: usize, places: usize) -> Vec<f64> {
    let mut times = HashMap::new();
    let mut drive = vec![0];
    let labels = |walk: &[usize]| walk.iter().map(|&vertex| graph.label(vertex)).collect::<Vec<_>>();
    while drive.len() < places {
        let walk_to = |next: &usize| [&drive[drive.len().saturating_sub(n - 1)..], &[*next]].concat();
        let walks = graph.neighbours(drive[drive.len() - 1]).iter().map(walk_to);
        let cost =
            |walk: &Vec<usize>| (ngram::Ngram::new(&labels(walk)) == *missing, times.get(walk).copied().unwrap_or(0));
        let walk = walks.min_by_key(cost).expect("every vertex has a neighbour");
        drive.push(walk[walk.len() - 1]);
        let reversed: Vec<usize> = walk.iter().rev().copied().collect();
        *times.entry(walk).or_insert(0) += 1;
        *times.entry(reversed).or_insert(0) += 1;
    }
    labels(&drive)
}

/// Drives without every `stride`-th n-gram of a graph in turn, and compares the distances.
fn check_histories_without_one_walk<const WORDS: usize>(graph: &Graph, n: usize, stride: usize) {
    let of_graph = grams_of_graph(graph, n);
    let mut lacking = 0;
    for missing in of_graph.iter().step_by(stride) {
        let history_mm = drive_without(graph, missing, n, 32 * WORDS);
        let of_history = grams_of_history(&history_mm, n);
        let mut lack = of_graph.difference(&of_history);
        // The U-turns of other walks may contain a walk that turns back.
        if lack.next().is_some_and(|first| first == missing) {
            assert_eq!(lack.next(), None, "the drive is long enough");
            lacking += 1;
        }
        let history = Box::new(core_history::<WORDS>(&history_mm));
        assert_agrees::<WORDS, 1>(graph, &*history, n, (&of_graph, &of_history), missing);
    }
    assert!(lacking > 2, "{lacking}");
}

#[test]
fn any_missing_walk_of_3_over_a_hub_is_found_in_tables() {
    check_tables_without_one_walk::<16>(&star(20, 0), 3, 1);
    check_tables_without_one_walk::<16>(&star(20, 19), 3, 1);
}

#[test]
fn a_missing_walk_of_4_between_two_hubs_is_found_in_tables() {
    check_tables_without_one_walk::<256>(&two_hubs(20), 4, 97);
}

#[test]
fn a_missing_walk_of_5_over_a_hub_is_found_in_tables() {
    check_tables_without_one_walk::<256>(&star(19, 0), 5, 397);
    check_tables_without_one_walk::<256>(&star(19, 18), 5, 499);
}

#[test]
fn a_missing_walk_of_3_in_a_complete_map_is_found_in_tables() {
    check_tables_without_one_walk::<64>(&complete(12), 3, 37);
    check_tables_without_one_walk::<256>(&complete(18), 3, 199);
}

#[test]
fn a_missing_walk_of_3_is_found_in_histories() {
    check_histories_without_one_walk::<32>(&star(19, 0), 3, 3);
    check_histories_without_one_walk::<32>(&star(19, 18), 3, 5);
    check_histories_without_one_walk::<256>(&complete(18), 3, 199);
}

#[test]
fn a_missing_walk_of_4_is_found_in_histories() {
    check_histories_without_one_walk::<512>(&two_hubs(19), 4, 397);
}

#[test]
fn a_missing_walk_of_5_is_found_in_histories() {
    check_histories_without_one_walk::<512>(&star(19, 0), 5, 397);
}
