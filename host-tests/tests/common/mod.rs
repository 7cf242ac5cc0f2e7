//! The same graph, history or set of n-grams for the reference and for the core.
//!
//! The reference uses millimetres in f64, the core steps of 2 mm; all labels are on that grid.
#![allow(dead_code, unreachable_pub, reason = "each test binary compiles this and uses its own part")]

pub mod drive;
pub mod environments;
pub mod notes;
pub mod random;
pub mod robot;
pub mod split_mix;
pub mod watched;

use toposlam::{Consistency, Direction, Evidence, Fingerprint, History, Map, NgramLength, NgramTable, VertexId};
use toposlam_host_tests::consistency::Hausdorff;
use toposlam_host_tests::graph::Graph;
use toposlam_host_tests::ngram::{Ngram, NgramSet};

/// Words of a history: 128 places.
pub const HISTORY_WORDS: usize = 4;
/// Words of a table: 2048 n-grams.
pub const TABLE_WORDS: usize = 128;

/// The fingerprint of a label on the 2 mm grid.
pub fn fingerprint(label_mm: f64) -> Fingerprint {
    let steps = label_mm / f64::from(Fingerprint::STEP_MM);
    assert!(steps.fract() == 0.0, "{label_mm} mm is not on the grid");
    Fingerprint::from_steps(steps as u16).expect("labels of tests are in range")
}

/// The vertex with a number.
pub fn vertex(number: usize) -> VertexId {
    VertexId::new(number as u8).expect("tests number vertices from 0 to 63")
}

/// The core's type for a length of n-grams.
pub fn length(n: usize) -> NgramLength {
    NgramLength::new(n as u8).expect("tests use n from 2 to 7")
}

/// The label as an n-gram of this length stores it: the core's packed n-grams drop low bits at n = 6 and 7.
pub fn in_ngram_mm(n: usize) -> impl Fn(f64) -> f64 + Copy {
    let grid_mm = f64::from(length(n).label_step_mm());
    move |label_mm| (label_mm / grid_mm).floor() * grid_mm
}

/// The core's map of a graph.
pub fn core_map<const V: usize>(graph: &Graph) -> Map<V> {
    let mut map = Map::new();
    for &label_mm in graph.labels() {
        map.add_vertex(fingerprint(label_mm)).expect("tests keep to the capacity");
    }
    for (a, b) in graph.edges() {
        map.add_edge(vertex(a), vertex(b));
    }
    map
}

/// The core's history of these labels; a full history drops the oldest.
pub fn core_history<const WORDS: usize>(history_mm: &[f64]) -> History<WORDS> {
    let mut history = History::new();
    for &label_mm in history_mm {
        history.push(fingerprint(label_mm));
    }
    history
}

/// The core's table of the n-grams of a history, extended with each observation.
pub fn core_table_of_history(history_mm: &[f64], n: usize) -> NgramTable<TABLE_WORDS> {
    let mut history = History::<HISTORY_WORDS>::new();
    let mut table = NgramTable::new(length(n));
    for &label_mm in history_mm {
        history.push(fingerprint(label_mm));
        table.extend(&history).expect("tests keep to the capacity");
    }
    table
}

/// The n-grams of a table in the reference's type.
pub fn ngrams_of<const WORDS: usize>(table: &NgramTable<WORDS>) -> NgramSet {
    let length = table.length();
    let label_mm = |step: u16| f64::from(step) * f64::from(length.label_step_mm());
    let labels = |ngram: &toposlam::Ngram| -> Vec<f64> {
        (0..length.get()).map(|index| label_mm(ngram.label(length, index))).collect()
    };
    table.ngrams().iter().map(|ngram| Ngram::new(&labels(ngram))).collect()
}

/// The distances of the core, in millimetres: both directions of Eq. 2, then each half.
pub fn core_distances_mm<const WORDS: usize, const INDICES: usize>(
    graph: &Graph,
    evidence: &impl Evidence<WORDS>,
    n: usize,
) -> [f64; 3] {
    let map = core_map::<16>(graph);
    let mut consistency = Box::new(Consistency::<16, WORDS, INDICES>::new());
    [Direction::TwoSided, Direction::MapToHistory, Direction::HistoryToMap].map(|direction| {
        let steps = consistency.distance_steps(&map, evidence, length(n), direction);
        steps.map_or(f64::INFINITY, |steps| f64::from(steps) * f64::from(length(n).label_step_mm()))
    })
}

/// The distances of the reference, in the same order.
pub fn reference_distances_mm(distance: Hausdorff) -> [f64; 3] {
    [distance.two_sided(), distance.map_to_history, distance.history_to_map]
}
