//! Random graphs, histories and sets of n-grams for the property tests, all labels on the core's 2 mm grid.

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};
use toposlam::Fingerprint;
use toposlam_host_tests::graph::Graph;

/// A number of cases, the same in every run.
pub fn cases(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(0x7090_51A0), failure_persistence: None, ..Config::default() }
}

/// A label in millimetres from a number of steps.
pub fn label_mm(steps: u16) -> f64 {
    f64::from(steps.min(Fingerprint::MAX.steps())) * f64::from(Fingerprint::STEP_MM)
}

/// Labels, either uniform or from a few categories with noise, which gives aliases.
fn label() -> impl Strategy<Value = f64> {
    let noise = prop_oneof![3 => Just(0), 1 => 0_u16..20];
    let category = (0_u16..5, noise).prop_map(|(category, noise)| 500 + 60 * category + noise);
    let steps = prop_oneof![4 => category, 1 => 0..=Fingerprint::MAX.steps()];
    steps.prop_map(label_mm)
}

/// A graph of up to 12 vertices: connected or not, possibly with isolated vertices and self-loops.
pub fn graph() -> impl Strategy<Value = Graph> {
    let labels = vec(label(), 0..=12);
    let edges = vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 0..=16);
    (labels, edges).prop_map(|(labels, edges)| {
        if labels.is_empty() {
            return Graph::new();
        }
        let edges: Vec<_> = edges.iter().map(|(a, b)| (a.index(labels.len()), b.index(labels.len()))).collect();
        Graph::with(&labels, &edges)
    })
}

/// A dense graph: a place has dozens of neighbours.
fn dense_graph() -> impl Strategy<Value = Graph> {
    let indices = || any::<prop::sample::Index>();
    (vec(label(), 5..=8), vec((indices(), indices()), 12..=24)).prop_map(|(labels, edges)| {
        let edges: Vec<_> = edges.iter().map(|(a, b)| (a.index(labels.len()), b.index(labels.len()))).collect();
        Graph::with(&labels, &edges)
    })
}

/// A graph with distinct labels, dense or with a hub, and the index of an n-gram that an exploration missed.
pub fn graph_and_what_is_missing() -> impl Strategy<Value = (Graph, Vec<prop::sample::Index>)> {
    let indices = || any::<prop::sample::Index>();
    let noise_steps = vec(0_u16..10, 5..=6);
    let edges = vec((indices(), indices()), 8..=28);
    (noise_steps, edges, any::<bool>(), vec(indices(), 0..=2)).prop_map(|(noise_steps, edges, has_hub, missing)| {
        let label = |(vertex, noise): (usize, &u16)| label_mm(500 + 37 * (5 * vertex % 9) as u16 + noise);
        let labels: Vec<f64> = noise_steps.iter().enumerate().map(label).collect();
        let any_edges = edges.iter().map(|(a, b)| (a.index(labels.len()), b.index(labels.len())));
        let edges: Vec<_> = match has_hub {
            true => (1..labels.len()).map(|leaf| (0, leaf)).chain(any_edges.take(6)).collect(),
            false => any_edges.collect(),
        };
        (Graph::with(&labels, &edges), missing)
    })
}

/// A noisy walk on a graph; at a vertex without a neighbour it continues at a random one.
fn walk_on(graph: impl Strategy<Value = Graph>, longest: usize) -> impl Strategy<Value = (Graph, Vec<f64>)> {
    let noise_mm = prop_oneof![Just(0.0), (-10_i16..=10).prop_map(|steps| 2.0 * f64::from(steps))];
    (graph, vec((any::<prop::sample::Index>(), noise_mm), 0..=longest)).prop_map(|(graph, steps)| {
        let mut place: Option<usize> = None;
        let mut history = Vec::new();
        for (choice, noise_mm) in steps {
            let ways: Vec<usize> = match place {
                Some(place) if !graph.neighbours(place).is_empty() => graph.neighbours(place).iter().copied().collect(),
                _ => (0..graph.vertices()).collect(),
            };
            if ways.is_empty() {
                break;
            }
            let next = ways[choice.index(ways.len())];
            history.push((graph.label(next) + noise_mm).clamp(0.0, label_mm(Fingerprint::MAX.steps())));
            place = Some(next);
        }
        (graph, history)
    })
}

/// A graph and a noisy walk on it.
pub fn graph_and_its_history(longest: usize) -> impl Strategy<Value = (Graph, Vec<f64>)> {
    walk_on(graph(), longest)
}

/// A dense graph and a noisy walk on it.
pub fn dense_graph_and_its_history(longest: usize) -> impl Strategy<Value = (Graph, Vec<f64>)> {
    walk_on(dense_graph(), longest)
}

/// A history of arbitrary labels.
pub fn history(longest: usize) -> impl Strategy<Value = Vec<f64>> {
    vec(label(), 0..=longest)
}

/// A graph, and a history that is a walk on it or is unrelated.
pub fn graph_and_history(longest: usize) -> impl Strategy<Value = (Graph, Vec<f64>)> {
    prop_oneof![2 => graph_and_its_history(longest), 1 => (graph(), history(longest))]
}

/// Arbitrary sequences of n labels.
pub fn sequences(n: usize, most: usize) -> impl Strategy<Value = Vec<Vec<f64>>> {
    vec(vec(label(), n), 0..=most)
}
