//! Properties of the layout of any map.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use toposlam::wire::{List, Remapped};

use super::{Layout, Point, conflicts, graph::Graph};
use crate::topology::{TopologicalMap, Vertex};

type Edges = BTreeSet<(u8, u8)>;

fn map(vertices: u8, edges: impl IntoIterator<Item = (u8, u8)>) -> TopologicalMap {
    let edges: Edges = edges.into_iter().map(|(a, b)| (a.min(b), a.max(b))).collect();
    TopologicalMap {
        vertices: vec![Vertex::default(); vertices.into()],
        edges: edges.into_iter().collect(),
        ..TopologicalMap::default()
    }
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

/// A random planar map: adds random edges while the map stays planar.
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

/// The map as a random walk discovers it, update by update. Vertices are numbered in order of discovery.
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
fn a_planar_map_arranged_at_once_is_drawn_without_conflicts() {
    for map in samples() {
        let mut layout = Layout::new();
        layout.arrange(&map);
        assert!(is_sound(&map, layout.points()), "{map:?} {:?}", layout.points());
    }
}

/// A map without its last vertices.
fn first_vertices(map: &TopologicalMap, count: usize) -> TopologicalMap {
    let edges = map.edges.iter().copied().filter(|&(a, b)| usize::from(a.max(b)) < count);
    self::map(count as u8, edges)
}

#[test]
fn a_growing_planar_map_is_drawn_without_conflicts_at_every_step() {
    let mut slowest = Duration::ZERO;
    for (seed, sample) in (0..).zip(samples()) {
        let mut layout = Layout::new();
        for map in explored(&sample, &mut rng(seed)) {
            let begun = Instant::now();
            layout.arrange(&map);
            slowest = slowest.max(begun.elapsed());
            assert!(is_sound(&map, layout.points()), "{map:?} {:?}", layout.points());
        }
    }
    println!("the slowest update, of up to 64 vertices, took {slowest:?}");
}

#[test]
fn a_vertex_keeps_its_position_without_conflicts() {
    let (mut updates, mut moved) = (0, 0);
    for (seed, sample) in (0..).zip(samples().iter().filter(|map| map.vertices.len() <= 16)) {
        let mut layout = Layout::new();
        for map in explored(sample, &mut rng(seed)) {
            let before = layout.points().to_vec();
            layout.arrange(&map);
            if is_sound(&first_vertices(&map, before.len()), &before) {
                updates += 1;
                moved += usize::from(before != layout.points()[..before.len()]);
            }
        }
    }
    // In rare cases there is no room for a vertex between several others.
    assert!(updates > 200 && 50 * moved <= updates, "{moved} of {updates}");
}

#[test]
fn an_unchanged_or_shrinking_map_keeps_its_layout() {
    let sample = random_planar(16, 24, &mut rng(3));
    let mut layout = Layout::new();
    layout.arrange(&sample);
    let points = layout.points().to_vec();
    layout.arrange(&sample);
    assert_eq!(layout.points(), points);
    let mut less = sample.clone();
    less.edges.retain(|&(a, b)| (a + b) % 3 > 0);
    less.edges.push((4, 4));
    layout.arrange(&less);
    assert_eq!(layout.points(), points);
    layout.arrange(&first_vertices(&less, 12));
    assert_eq!(layout.points(), &points[..12]);
    layout.arrange(&map(0, []));
    assert!(layout.points().is_empty());
}

#[test]
fn a_renumbered_vertex_keeps_its_position() {
    let mut layout = Layout::new();
    layout.arrange(&map(5, [(0, 1), (1, 2), (2, 3), (3, 4)]));
    let points = layout.points().to_vec();
    // 1 is removed, 3 and 4 are merged.
    layout.rename(&Remapped { place_index: 7, vertices: List::new([2, u8::MAX, 0, 1, 1]) });
    layout.arrange(&map(4, [(0, 1), (0, 2), (2, 3)]));
    assert_eq!(layout.points()[..3], [points[2], points[3], points[0]]);
    assert!(is_sound(&map(4, [(0, 1), (0, 2), (2, 3)]), layout.points()));
}

#[test]
fn random_merges_cause_no_conflicts() {
    let mut rng = rng(5);
    for _ in 0..20 {
        let mut map = random_tree(14, &mut rng);
        let mut layout = Layout::new();
        layout.arrange(&map);
        while map.vertices.len() > 3 {
            // Merging a leaf with its parent leaves a tree.
            let last = map.vertices.len() as u8 - 1;
            let gone = (0..=last).find(|&vertex| map.neighbours()[usize::from(vertex)].len() == 1).unwrap();
            let parent = map.neighbours()[usize::from(gone)][0] as u8;
            let name = |vertex: u8| if vertex > gone { vertex - 1 } else { vertex };
            let names = (0..=last).map(|vertex| name(if vertex == gone { parent } else { vertex }));
            let edges = map.edges.iter().filter(|&&(a, b)| a != gone && b != gone);
            let edges: Vec<_> = edges.map(|&(a, b)| (name(a), name(b))).collect();
            layout.rename(&Remapped { place_index: 0, vertices: List::new(names) });
            map = self::map(last, edges);
            layout.arrange(&map);
            assert!(is_sound(&map, layout.points()), "{map:?}");
        }
    }
}

#[test]
fn the_same_maps_give_the_same_layout() {
    let maps = explored(&random_planar(16, 22, &mut rng(9)), &mut rng(9));
    let picture = || {
        let mut layout = Layout::new();
        maps.iter().for_each(|map| layout.arrange(map));
        layout.points().to_vec()
    };
    assert_eq!(picture(), picture());
}

#[test]
fn the_mean_edge_length_is_about_one() {
    for (seed, sample) in [(0, grid(4, 4)), (1, grid(4, 3)), (2, wheel(7)), (3, random_tree(16, &mut rng(4)))] {
        let mut layout = Layout::new();
        let maps = explored(&sample, &mut rng(seed));
        maps.iter().for_each(|map| layout.arrange(map));
        let graph = Graph::of(&maps[maps.len() - 1]);
        let length = |&(a, b): &(usize, usize)| (layout.points()[a] - layout.points()[b]).length();
        let mean = graph.edges().iter().map(length).sum::<f64>() / graph.edges().len() as f64;
        assert!((0.7..2.5).contains(&mean), "{mean} {sample:?}");
    }
}

#[test]
fn a_non_planar_map_has_few_crossings_and_no_overlaps() {
    let complete = |vertices: u8| map(vertices, (0..vertices).flat_map(|a| (0..a).map(move |b| (b, a))));
    let petersen = map(10, (0..5).flat_map(|i| [(i, (i + 1) % 5), (i, i + 5), (i + 5, 5 + (i + 2) % 5)]));
    let houses_and_wells = map(6, (0..3).flat_map(|house| (3..6).map(move |well| (house, well))));
    for (map, fewest) in [(complete(5), 1), (complete(6), 3), (petersen, 2), (houses_and_wells, 1)] {
        let mut at_once = Layout::new();
        at_once.arrange(&map);
        let mut grown = Layout::new();
        let maps = explored(&map, &mut rng(2));
        maps.iter().for_each(|map| grown.arrange(map));
        for (map, layout) in [(&map, at_once), (&maps[maps.len() - 1], grown)] {
            let graph = Graph::of(map);
            let crossings = conflicts::crossings(&graph, layout.points());
            assert!((fewest..=3 * fewest).contains(&crossings), "{crossings}, not {fewest}");
            assert_eq!(conflicts::conflicts(&graph, layout.points()), crossings);
        }
    }
}
