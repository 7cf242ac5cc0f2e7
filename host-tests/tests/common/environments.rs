//! Small environments for the tests of the robust filter.

use toposlam_eval::environment::{Environment, Place};

/// Six rooms, two of them with equal labels: Fig. 1(b) of the paper.
pub fn six_rooms() -> Environment {
    include_str!("../../../host/eval/environments/table-i.toml").parse().expect("a shipped environment")
}

/// Eleven places with the labels of Table II, among them aliases within the noise.
pub fn floor() -> Environment {
    include_str!("../../../host/eval/environments/wean-surrogate-sd.toml").parse().expect("a shipped environment")
}

/// A ring of eight places that repeats a sequence of three labels: a b c d a b c e.
pub fn ring_with_a_repeated_part() -> Environment {
    ring(&[900.0, 1300.0, 1700.0, 2100.0, 900.0, 1300.0, 1700.0, 2500.0])
}

/// A ring of five places with a chord, all labels different.
pub fn easy() -> Environment {
    let mut edges = ring_edges(5);
    edges.push([0, 2]);
    with(&[900.0, 1300.0, 1700.0, 2100.0, 2500.0], &edges)
}

fn ring(labels: &[f64]) -> Environment {
    with(labels, &ring_edges(labels.len() as u32))
}

fn ring_edges(places: u32) -> Vec<[u32; 2]> {
    (0..places).map(|place| [place, (place + 1) % places]).collect()
}

fn with(labels: &[f64], edges: &[[u32; 2]]) -> Environment {
    let places = (0..).zip(labels).map(|(id, &mean_mm)| Place { id, mean_mm, sd_mm: 20.0 });
    Environment::new("of a test".into(), places.collect(), edges).expect("a connected environment")
}
