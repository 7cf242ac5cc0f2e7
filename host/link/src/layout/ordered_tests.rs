//! The layout of maps with ways: loops, parallel edges and frontiers, in the order of the ways.

use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use toposlam::wire::{VertexWays, WayId};
use toposlam::{DartMap, VertexId};

use super::{Layout, conflicts};
use crate::topology::{TopologicalMap, Vertex};

type Darts = DartMap<64, 250>;

/// The map of an edge-ordered map.
fn topology(darts: &Darts) -> TopologicalMap {
    let vertices = VertexId::first(darts.vertices().into());
    let ways = vertices.map(|vertex| VertexWays::of(darts.view(), vertex).ways.as_slice().to_vec()).collect();
    let vertices = vec![Vertex::default(); darts.vertices().into()];
    let mut map = TopologicalMap { vertices, edges: Vec::new(), ways, ..Default::default() };
    map.edges =
        map.way_edges().map(|edge| edge.ends.map(|end| end.vertex)).map(|[a, b]| (a.min(b), a.max(b))).collect();
    map.edges.sort_unstable();
    map.edges.dedup();
    map
}

/// The maps of a growing edge-ordered map of genus 0: at each step a vertex with some ways, and an edge in a face.
fn grown(vertices: u8, rng: &mut Xoshiro256PlusPlus) -> Vec<TopologicalMap> {
    let mut darts = Darts::EMPTY;
    let mut maps = Vec::new();
    for _ in 0..vertices {
        let vertex = darts.add_vertex().unwrap();
        let open: Vec<u8> = darts.frontiers().collect();
        for _ in 0..rng.random_range(1..=4) {
            // At most 250 darts.
            let _ = darts.add_way(vertex, rng.random());
        }
        if let (Some(&first), false) = (darts.ways(vertex).first(), open.is_empty()) {
            darts.join(first, open[rng.random_range(0..open.len())]);
        }
        for _ in 0..4 {
            let open: Vec<u8> = darts.frontiers().collect();
            let (a, b) = match open.len() {
                0 => break,
                count => (open[rng.random_range(0..count)], open[rng.random_range(0..count)]),
            };
            if open.len() > 3 {
                darts.join(a, b);
                if darts.genus() > 0 {
                    darts.part(a);
                }
            }
        }
        assert_eq!(darts.genus(), 0);
        maps.push(topology(&darts));
    }
    maps
}

/// Asserts that edges do not cross, vertices are apart, and all ways leave their vertex in counter-clockwise order.
fn assert_sound(map: &TopologicalMap, layout: &Layout) {
    assert!(layout.network.graph.is_ordered(), "{map:?}");
    assert_eq!(conflicts::conflicts(&layout.network.graph, &layout.points), 0, "{map:?}");
    let edges = layout.edges();
    assert_eq!(edges.len(), map.way_edges().count());
    let angle = |way: WayId| {
        let line = edges.iter().find_map(|edge| match edge.ways? {
            [from, _] if from == way => Some((edge.points[0], edge.points[1])),
            [_, to] if to == way => Some((edge.points[edge.points.len() - 1], edge.points[edge.points.len() - 2])),
            _ => None,
        });
        let stub = || layout.stubs().iter().find(|stub| stub.way == way).map(|stub| (stub.from, stub.to));
        let (from, to) = line.or_else(stub).unwrap_or_else(|| panic!("{way:?} is not drawn"));
        assert_eq!(from, layout.points()[usize::from(way.vertex)]);
        (to.y - from.y).atan2(to.x - from.x)
    };
    for vertex in 0..map.vertices.len() {
        let ids = (0..map.ways[vertex].len()).map(|way| WayId { vertex: vertex as u8, way: way as u8 });
        let angles: Vec<f64> = ids.map(angle).collect();
        let falls = angles.iter().zip(angles.iter().cycle().skip(1)).filter(|(angle, next)| next < angle);
        assert!(falls.count() <= 1, "{angles:?} at vertex {vertex} of {map:?}");
    }
}

#[test]
fn a_map_with_ways_arranged_at_once_is_drawn_in_their_order_without_crossings() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut slowest = Duration::ZERO;
    for vertices in [1, 2, 3, 5, 8, 12, 16, 16, 24, 40, 64] {
        let map = grown(vertices, &mut rng).pop().unwrap();
        let mut layout = Layout::new();
        let begun = Instant::now();
        layout.arrange(&map);
        slowest = slowest.max(begun.elapsed());
        assert_sound(&map, &layout);
    }
    println!("the slowest drawing took {slowest:?}");
}

#[test]
fn a_growing_map_with_ways_is_drawn_in_their_order_at_every_step() {
    let (mut slowest, mut longest) = (Duration::ZERO, 0.0_f64);
    for seed in 0..6 {
        let mut layout = Layout::new();
        for map in grown(18, &mut Xoshiro256PlusPlus::seed_from_u64(seed)) {
            let begun = Instant::now();
            layout.arrange(&map);
            slowest = slowest.max(begun.elapsed());
            assert_sound(&map, &layout);
            longest = longest.max(super::longest(&layout.network.graph, &layout.points));
        }
    }
    println!("the slowest update took {slowest:?}, the longest edge is {longest:.1}");
    assert!(longest < 5.0, "{longest}");
}

#[test]
fn loops_and_parallel_edges_have_bends() {
    let mut darts = Darts::EMPTY;
    for bearings in [&[0, 10_000, 20_000, 30_000][..], &[0, 10_000]] {
        let vertex = darts.add_vertex().unwrap();
        bearings.iter().for_each(|&bearing| assert!(darts.add_way(vertex, bearing).is_some()));
    }
    darts.join(0, 5);
    darts.join(1, 4);
    darts.join(2, 3);
    let map = topology(&darts);
    let mut layout = Layout::new();
    layout.arrange(&map);
    assert_sound(&map, &layout);
    let bends: Vec<usize> = layout.edges().iter().map(|edge| edge.points.len() - 2).collect();
    assert_eq!(bends, [0, 1, 2]);
}

#[test]
fn a_map_of_genus_1_is_drawn_without_an_order() {
    let mut darts = Darts::EMPTY;
    darts.add_vertex().unwrap();
    [0, 10_000, 20_000, 30_000].iter().for_each(|&bearing| assert!(darts.add_way(0, bearing).is_some()));
    darts.join(0, 2);
    darts.join(1, 3);
    let map = topology(&darts);
    let mut layout = Layout::new();
    layout.arrange(&map);
    assert!(!layout.network.graph.is_ordered());
    assert_eq!(layout.edges().iter().map(|edge| edge.points.len()).collect::<Vec<_>>(), [4, 4]);
    assert!(layout.edges().iter().flat_map(|edge| &edge.points).all(|point| point.is_known()));
}
