//! The behaviour of the ordered filter: recovery, long runs, localisation, and invalid input.

mod bad_input;
mod building;
mod localisation;
mod long_runs;
mod outliers;
#[path = "../common/split_mix.rs"]
mod split_mix;

use building::{Building, HOUSE, RING, Robot};
use toposlam::{
    DartId, Darts, Exit, FaultKind, Filter, Fingerprint, Observation, OrderedConfig, OrderedFilter, VertexId, Ways,
};

type Mapper = OrderedFilter<6, 16, 80, 96>;

fn started(seed: u64) -> Box<Mapper> {
    let mut filter = Box::new(Mapper::new());
    filter.start(OrderedConfig::DEFAULT.with_noise_mm(15), seed).unwrap();
    filter
}

/// Whether a map has as many vertices, edges and frontiers as a building that was driven completely.
fn is_complete(building: &Building, map: Darts<'_>) -> bool {
    let counts = (map.vertices().len(), map.edges().count(), map.frontiers().count());
    counts == (building.ways.len(), building.darts() / 2, 0)
}

/// Asserts that the published map, its graph, and what is said of it fit together.
fn check<const N: usize, const V: usize, const D: usize, const T: usize>(filter: &OrderedFilter<N, V, D, T>) {
    let (map, darts) = (filter.map(), filter.darts().unwrap());
    assert!(map.vertices().eq(darts.vertices()));
    let mut edges: Vec<(VertexId, VertexId)> = Vec::new();
    for (a, b) in darts.edges() {
        let [a, b] = [a, b].map(|dart| darts.vertex(dart).unwrap());
        edges.push((a.min(b), a.max(b)));
    }
    edges.sort_unstable();
    edges.dedup();
    assert!(map.edges().eq(edges), "the graph has the edges of the map with ways");
    for dart in darts.darts() {
        let vertex = darts.vertex(dart).unwrap();
        assert!(darts.ways(vertex).any(|way| way == dart), "a dart is a way of its vertex");
        assert!(darts.partner(dart).is_none_or(|partner| darts.partner(partner) == Some(dart)));
    }
    let ways: usize = darts.vertices().map(|vertex| darts.ways(vertex).len()).sum();
    assert_eq!(ways, darts.darts().len());
    for vertex in darts.vertices() {
        let bearings: Vec<u16> = darts.ways(vertex).map(|way| darts.bearing(way).unwrap()).collect();
        assert!(bearings.is_sorted(), "ways are ordered counter-clockwise: {bearings:?}");
        assert!(filter.remapped(vertex).is_none_or(|now| map.contains(now)));
    }
    let belief: u32 = VertexId::first(V).map(|vertex| filter.vertex_probability_q16(vertex)).sum();
    assert!(belief <= 65536 + V as u32, "{belief}");
    assert!(filter.map_probability_q16() <= 65536);
    let path: Vec<Option<DartId>> = filter.path().collect();
    assert!(path.iter().flatten().all(|&dart| darts.vertex(dart).is_some()));
    for (ago, came_by) in path.iter().rev().enumerate() {
        assert_eq!(filter.recent(ago), came_by.and_then(|dart| darts.vertex(dart)));
    }
    assert_eq!(path.last().copied().flatten(), filter.arrival());
}
