//! A picture made more pleasant step by step, without a conflict more than it has.

use super::{Point, comfort::discomfort_of, conflicts::conflicts_of, geometry, graph::Graph};

/// How strongly a vertex is drawn to its anchor.
const ANCHOR_WEIGHT: f64 = 0.5;

/// When no vertex moves by more than this in a sweep, the picture is done.
const AT_REST: f64 = 0.02;

/// Moves some vertices to where they are more comfortable, sweep by sweep.
///
/// A vertex whose `anchors` position is known is drawn there. Cost of a sweep: O(movable · (vertices + edges) · degree).
pub(super) fn smooth(graph: &Graph, points: &mut [Point], movable: &[usize], anchors: &[Point], sweeps: usize) {
    let mut steps = vec![0.5; points.len()];
    for _ in 0..sweeps {
        let mut farthest: f64 = 0.0;
        for &vertex in movable {
            let moved = step(graph, points, vertex, anchors[vertex], &mut steps[vertex]);
            farthest = farthest.max(moved).max(if moved > 0.0 { 0.0 } else { steps[vertex].min(AT_REST) });
        }
        if farthest <= AT_REST {
            return;
        }
    }
}

/// Moves one vertex if that helps; gives how far.
fn step(graph: &Graph, points: &mut [Point], vertex: usize, anchor: Point, length: &mut f64) -> f64 {
    let here = points[vertex];
    let cost = |at: Point| {
        let away = (at - anchor).squared();
        discomfort_of(graph, points, vertex, at) + if anchor.is_known() { ANCHOR_WEIGHT * away } else { 0.0 }
    };
    let cost_here = cost(here);
    let mut better: Vec<(f64, Point)> = Vec::new();
    for at in candidates(graph, points, vertex, anchor, *length) {
        let cost = cost(at);
        if cost < cost_here - 1e-9 {
            better.push((cost, at));
        }
    }
    better.sort_by(|one, other| one.0.total_cmp(&other.0));
    if better.is_empty() {
        *length *= 0.5;
        return 0.0;
    }
    let conflicts = conflicts_of(graph, points, vertex, here);
    let chosen = better.iter().find(|(_, at)| conflicts_of(graph, points, vertex, *at) <= conflicts);
    let Some(&(_, at)) = chosen else {
        *length *= 0.5;
        return 0.0;
    };
    points[vertex] = at;
    (at - here).length()
}

/// Ways towards the anchor and towards the neighbours, and short ways in all directions.
fn candidates(
    graph: &Graph,
    points: &[Point],
    vertex: usize,
    anchor: Point,
    length: f64,
) -> impl Iterator<Item = Point> {
    let here = points[vertex];
    let near = geometry::mean(graph.neighbours(vertex).iter().map(|&neighbour| {
        let away = here - points[neighbour];
        points[neighbour] + away * (1.0 / away.length().max(1e-9))
    }));
    let near = if graph.neighbours(vertex).is_empty() { here } else { near };
    let goals = [anchor, near].into_iter().filter(|goal| goal.is_known());
    let ways = goals.flat_map(move |goal| [1.0, 0.5, 0.25].map(|share| here + (goal - here) * share));
    let around = (0..8).map(move |direction| here + Point::towards(f64::from(direction) * 0.785_398) * length);
    ways.chain(around)
}
