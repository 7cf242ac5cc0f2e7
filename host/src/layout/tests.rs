//! What holds of the picture of any map.

use std::collections::BTreeSet;

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{Layout, Point, conflicts, graph::Graph};
use crate::topology::{TopologicalMap, Vertex};

type Edges = BTreeSet<(u8, u8)>;

fn map(vertices: u8, edges: impl IntoIterator<Item = (u8, u8)>) -> TopologicalMap {
    let edges: Edges = edges.into_iter().map(|(a, b)| (a.min(b), a.max(b))).collect();
    TopologicalMap { vertices: vec![Vertex::default(); vertices.into()], edges: edges.into_iter().collect() }
}

fn is_sound(map: &TopologicalMap, points: &[Point]) -> bool {
    points.len() == map.vertices.len()
        && points.iter().all(|point| point.is_known())
        && conflicts::conflicts(&Graph::of(map), points) == 0
}

fn grid(columns: u8, rows: u8) -> TopologicalMap {
    let at = move |column, row| row * columns + column;
    let across = (0..rows).flat_map(|row| (1..columns).map(move |column| (at(column - 1, row), at(column, row))));
    let up = (1..rows).flat_map(|row| (0..columns).map(move |column| (at(column, row - 1), at(column, row))));
    map(columns * rows, across.chain(up))
}

fn wheel(rim: u8) -> TopologicalMap {
    map(rim + 1, (0..rim).flat_map(|i| [(i, (i + 1) % rim), (i, rim)]))
}

fn random_tree(vertices: u8, rng: &mut Xoshiro256PlusPlus) -> TopologicalMap {
    map(vertices, (1..vertices).map(|child| (rng.random_range(0..child), child)).collect::<Vec<_>>())
}

/// A random planar map: random edges, as long as it stays planar.
fn random_planar(vertices: u8, edges: usize, rng: &mut Xoshiro256PlusPlus) -> TopologicalMap {
    let points: Vec<Point> = (0..vertices).map(|_| Point::new(rng.random(), rng.random())).collect();
    let mut pairs: Vec<(u8, u8)> = (0..vertices).flat_map(|a| (0..a).map(move |b| (b, a))).collect();
    let length = |&(a, b): &(u8, u8)| (points[usize::from(a)] - points[usize::from(b)]).squared();
    pairs.sort_by(|one, other| length(one).total_cmp(&length(other)));
    let mut graph = Graph::new(vertices.into());
    for (a, b) in pairs {
        graph.connect(a.into(), b.into());
        if conflicts::crossings(&graph, &points) > 0 || graph.edges().len() > edges {
            graph.disconnect_last();
        }
    }
    map(vertices, graph.edges().iter().map(|&(a, b)| (a as u8, b as u8)))
}

/// The map as a robot that walks at random comes to know it, update by update; vertices are numbered as they are found.
fn explored(map: &TopologicalMap, rng: &mut Xoshiro256PlusPlus) -> Vec<TopologicalMap> {
    let neighbours = map.neighbours();
    let (mut here, mut names) = (0, vec![0]);
    let mut edges = Edges::new();
    let mut maps = Vec::new();
    for _ in 0..20 * map.edges.len() {
        if neighbours[here].is_empty() {
            break;
        }
        let there = neighbours[here][rng.random_range(0..neighbours[here].len())];
        if !names.contains(&there) {
            names.push(there);
        }
        let name = |vertex: usize| names.iter().position(|&other| other == vertex).unwrap() as u8;
        let edge = (name(here).min(name(there)), name(here).max(name(there)));
        if edges.insert(edge) {
            maps.push(self::map(names.len() as u8, edges.iter().copied()));
        }
        here = there;
    }
    maps
}

fn rng(seed: u64) -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(seed)
}

fn samples() -> Vec<TopologicalMap> {
    let mut rng = rng(1);
    let mut samples = vec![
        map(0, []),
        map(1, [(0, 0)]),
        map(2, [(0, 1)]),
        map(5, []),
        map(4, (0..4).flat_map(|a| (0..a).map(move |b| (b, a)))),
        map(12, (1..12).map(|leaf| (0, leaf))),
        map(16, (0..16).map(|i| (i, (i + 1) % 16))),
        map(9, [(0, 1), (1, 2), (0, 2), (3, 4), (4, 5), (3, 5), (3, 3), (6, 7)]),
        grid(4, 4),
        grid(8, 2),
        grid(8, 8),
        wheel(7),
        wheel(20),
    ];
    for vertices in [6, 10, 16, 16, 30, 64] {
        samples.push(random_tree(vertices, &mut rng));
        samples.push(random_planar(vertices, usize::from(vertices) * 4 / 3, &mut rng));
        samples.push(random_planar(vertices, usize::from(vertices) * 3, &mut rng));
    }
    samples
}

#[test]
fn a_planar_map_that_comes_at_once_is_drawn_without_conflicts() {
    for map in samples() {
        let mut layout = Layout::new();
        layout.arrange(&map);
        assert!(is_sound(&map, layout.points()), "{map:?} {:?}", layout.points());
    }
}

#[test]
fn a_planar_map_that_grows_is_drawn_without_conflicts_at_every_step() {
    for (seed, sample) in (0..).zip(samples().iter().filter(|map| map.vertices.len() <= 30)) {
        let mut layout = Layout::new();
        for map in explored(sample, &mut rng(seed)) {
            layout.arrange(&map);
            assert!(is_sound(&map, layout.points()), "{map:?} {:?}", layout.points());
        }
    }
}
