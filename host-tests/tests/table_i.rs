//! Table I and Fig. 1(b) of the paper: one history, its 24 3-grams, and the smallest map that explains it.

mod common;

use common::{HISTORY_WORDS, core_distances_mm, core_history, core_table_of_history, ngrams_of};
use std::collections::BTreeSet;
use toposlam_host_tests::consistency::{hausdorff, is_consistent};
use toposlam_host_tests::graph::Graph;
use toposlam_host_tests::ngram::{Ngram, NgramSet, grams_of_graph, grams_of_history};

const HISTORY: &str = "ABCAEDABEACBEDABC";

/// The 24 3-grams in the order and the orientation in which Table I prints them.
const TABLE_I: [&str; 24] = [
    "ABA", "ABC", "EBA", "ADA", "EDA", "BAB", "DAB", "BCB", "ACB", "BEB", "DEB", "BEA", "CBC", "CBE", "CAC", "CAE",
    "DAD", "DED", "AED", "EBE", "EDE", "EAE", "ACA", "AEA",
];

/// Fig. 1(b): the two aliases labelled A are vertices 0 and 3.
const FIGURE_1B: (&str, [(usize, usize); 7]) = ("ABCADE", [(0, 1), (0, 4), (3, 2), (3, 5), (1, 2), (1, 5), (4, 5)]);

/// The five views as labels 200 mm apart, on the 2 mm grid.
fn labels_mm(views: &str) -> Vec<f64> {
    views.bytes().map(|view| 1000.0 + 200.0 * f64::from(view - b'A')).collect()
}

fn table_i() -> NgramSet {
    TABLE_I.iter().map(|views| Ngram::new(&labels_mm(views))).collect()
}

#[test]
fn the_reference_extracts_the_24_3_grams_of_table_i() {
    assert_eq!(table_i().len(), 24);
    assert_eq!(grams_of_history(&labels_mm(HISTORY), 3), table_i());
}

#[test]
fn the_core_extracts_the_24_3_grams_of_table_i() {
    let table = core_table_of_history(&labels_mm(HISTORY), 3);
    assert_eq!(table.len(), 24);
    assert_eq!(ngrams_of(&table), table_i());
}

#[test]
fn the_map_of_figure_1b_is_3_consistent_with_the_history() {
    let figure = Graph::with(&labels_mm(FIGURE_1B.0), &FIGURE_1B.1);
    assert!(is_consistent(&grams_of_graph(&figure, 3), &table_i()));
    let history = core_history::<HISTORY_WORDS>(&labels_mm(HISTORY));
    assert_eq!(core_distances_mm::<_, 1>(&figure, &history, 3), [0.0; 3]);
}

#[test]
fn no_map_of_five_vertices_or_fewer_is_3_consistent_with_the_history() {
    for vertices in 1..=5 {
        assert_eq!(consistent_maps(vertices).len(), 0, "{vertices} vertices");
    }
}

#[test]
fn exactly_one_map_of_six_vertices_is_3_consistent_with_the_history() {
    let consistent = consistent_maps(6);
    let distinct: BTreeSet<_> = consistent.iter().map(canonical).collect();
    assert_eq!(distinct, BTreeSet::from([canonical(&Graph::with(&labels_mm(FIGURE_1B.0), &FIGURE_1B.1))]));
}

/// Every map of `vertices` vertices that is 3-consistent with the history, up to the order of the vertices' labels.
///
/// An edge between two views that the history never shows in succession gives the 3-gram (x, y, x), which is not in
/// Table I: no map with such an edge is consistent, and none is tried. Every other set of edges is, for every labelling.
/// Reference and core must agree on each.
fn consistent_maps(vertices: usize) -> Vec<Graph> {
    let history = core_history::<1>(&labels_mm(HISTORY));
    let grams = table_i();
    let mut consistent = Vec::new();
    for labels in labellings(vertices) {
        let may_be_adjacent = |&(a, b): &(usize, usize)| {
            let turn = Ngram::new(&[labels[a], labels[b], labels[a]]);
            grams.contains(&turn)
        };
        let pairs = (0..vertices).flat_map(|a| (a..vertices).map(move |b| (a, b)));
        let possible: Vec<_> = pairs.filter(may_be_adjacent).collect();
        for subset in 0_u32..1 << possible.len() {
            let chosen = possible.iter().enumerate().filter(|(bit, _)| subset >> bit & 1 == 1);
            let graph = Graph::with(&labels, &chosen.map(|(_, &edge)| edge).collect::<Vec<_>>());
            let grams_of_map = grams_of_graph(&graph, 3);
            let agrees = is_consistent(&grams_of_map, &grams);
            let [two_sided, ..] = core_distances_mm::<_, 1>(&graph, &history, 3);
            assert_eq!(two_sided == 0.0, agrees, "core and reference differ on {graph:?}");
            if agrees {
                assert_eq!(hausdorff(&grams_of_map, &grams).two_sided(), 0.0);
                consistent.push(graph);
            }
        }
    }
    consistent
}

/// Every labelling of `vertices` vertices with the five views, in ascending order of the views: the others only number the
/// vertices differently. From six vertices on only those that use all five views, because every view occurs in Table I
/// and a map without it cannot have those n-grams.
fn labellings(vertices: usize) -> Vec<Vec<f64>> {
    let views = labels_mm("ABCDE");
    let mut labellings: Vec<Vec<f64>> = vec![Vec::new()];
    for _ in 0..vertices {
        let extend = |labels: &Vec<f64>| {
            let least = labels.last().copied().unwrap_or(0.0);
            let larger = views.iter().filter(move |&&label| label >= least);
            larger.map(|&label| [labels.as_slice(), &[label]].concat()).collect::<Vec<_>>()
        };
        labellings = labellings.iter().flat_map(extend).collect();
    }
    labellings.retain(|labels| vertices <= 5 || views.iter().all(|view| labels.contains(view)));
    labellings
}

/// The smallest of all ways to write a graph down: equal for two graphs exactly when they are isomorphic.
fn canonical(graph: &Graph) -> (Vec<u64>, Vec<(usize, usize)>) {
    let written = |order: Vec<usize>| {
        let mut labels = vec![0; order.len()];
        for (vertex, &position) in order.iter().enumerate() {
            labels[position] = graph.label(vertex) as u64;
        }
        let renumber = |(a, b): (usize, usize)| (order[a].min(order[b]), order[a].max(order[b]));
        let mut edges: Vec<_> = graph.edges().into_iter().map(renumber).collect();
        edges.sort();
        (labels, edges)
    };
    permutations(graph.vertices()).into_iter().map(written).min().expect("there is at least one order")
}

fn permutations(length: usize) -> Vec<Vec<usize>> {
    if length == 0 {
        return vec![Vec::new()];
    }
    let shorter = permutations(length - 1);
    let insert = |order: &Vec<usize>| {
        (0..length).map(|at| [&order[..at], &[length - 1], &order[at..]].concat()).collect::<Vec<_>>()
    };
    shorter.iter().flat_map(insert).collect()
}
