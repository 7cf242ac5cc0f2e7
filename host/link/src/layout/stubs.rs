//! Stubs of the frontiers: short lines between the edges of their vertex, in the order of the ways.

use std::f64::consts::TAU;

use toposlam::wire::WayId;

use super::{Point, Stub, geometry, network::Network};
use crate::topology::TopologicalMap;

/// The lengths to try, the first that crosses no edge is taken.
const LENGTHS: [f64; 3] = [0.35, 0.25, 0.15];

pub(super) fn stubs(map: &TopologicalMap, network: &Network, points: &[Point]) -> Vec<Stub> {
    map.frontiers()
        .map(|way| {
            let from = points[usize::from(way.vertex)];
            let along = Point::towards(direction(map, network, points, way));
            let is_free = |length: &f64| {
                let segment = (from, from + along * *length);
                let others = network
                    .graph
                    .edges()
                    .iter()
                    .filter(|&&(a, b)| a != usize::from(way.vertex) && b != usize::from(way.vertex));
                others.clone().all(|&(a, b)| !geometry::cross(segment, (points[a], points[b])))
            };
            let length = LENGTHS.into_iter().find(is_free).unwrap_or(LENGTHS[LENGTHS.len() - 1]);
            Stub { way, from, to: from + along * length }
        })
        .collect()
}

/// The direction of a frontier: between the drawn edges beside it, divided as their bearings are.
fn direction(map: &TopologicalMap, network: &Network, points: &[Point], way: WayId) -> f64 {
    let ways = &map.ways[usize::from(way.vertex)];
    let bearing = |position: usize| f64::from(ways[position].bearing_mrad) / 1000.0;
    let here = usize::from(way.way);
    // The drawn edge at a position, and its direction.
    let drawn = |position: &usize| {
        let [at, next] = network.first_step(WayId { vertex: way.vertex, way: *position as u8 })?;
        let along = points[next] - points[at];
        Some((*position, along.y.atan2(along.x)))
    };
    let around = |step: usize| (here + step) % ways.len();
    let after = (1..ways.len()).map(around).find_map(|position| drawn(&position));
    let before = (1..ways.len()).rev().map(around).find_map(|position| drawn(&position));
    let (Some((before, from)), Some((after, to))) = (before, after) else { return bearing(here) };
    let part = |from: f64, to: f64| (to - from).rem_euclid(TAU);
    if before == after {
        return from + part(bearing(before), bearing(here));
    }
    let whole = part(bearing(before), bearing(after));
    // Ways of the same bearing share the gap evenly.
    let share = if whole > 0.0 { part(bearing(before), bearing(here)) / whole } else { 0.5 };
    from + part(from, to) * share.clamp(0.05, 0.95)
}
