//! Improves a drawing step by step without adding conflicts.

use super::{
    Point,
    comfort::discomfort_of,
    conflicts::{conflicts_of, crossings_of},
    geometry,
    graph::Graph,
};

/// Weight of the attraction of a vertex to its anchor.
const ANCHOR_WEIGHT: f64 = 0.5;

/// Length of the first and of the last steps.
const FIRST_STEP: f64 = 0.5;
const LAST_STEP: f64 = 0.03;

/// Moves the given vertices to positions of lower cost, sweep by sweep, until none moves.
///
/// A vertex is attracted to its position in `anchors`, if that is known. Cost of a sweep: O(movable · (vertices +
/// edges) · degree).
pub(super) fn smooth(graph: &Graph, points: &mut [Point], movable: &[usize], anchors: &[Point], sweeps: u32) {
    let mut steps = vec![FIRST_STEP; points.len()];
    for sweep in 0..sweeps {
        let mut rest = true;
        for &vertex in movable {
            if steps[vertex] < LAST_STEP {
                continue;
            }
            rest = false;
            match step(graph, points, vertex, anchors[vertex], steps[vertex], sweep) {
                Some(at) => {
                    points[vertex] = at;
                    // The best positions of its neighbours may change.
                    let woken = |step: f64| step.max(2.0 * LAST_STEP);
                    graph.neighbours(vertex).iter().for_each(|&neighbour| steps[neighbour] = woken(steps[neighbour]));
                }
                None => steps[vertex] *= 0.5,
            }
        }
        if rest {
            return;
        }
    }
}

/// A position of lower cost for a vertex.
fn step(graph: &Graph, points: &[Point], vertex: usize, anchor: Point, length: f64, sweep: u32) -> Option<Point> {
    let here = points[vertex];
    let cost = |at: Point, limit: f64| {
        let away = if anchor.is_known() { ANCHOR_WEIGHT * (at - anchor).squared() } else { 0.0 };
        away + discomfort_of(graph, points, vertex, at, limit - away)
    };
    let mut least = cost(here, f64::INFINITY) - 1e-6;
    let (mut crossings, mut conflicts) = (None, None);
    let mut best = None;
    for at in candidates(graph, points, vertex, anchor, length, sweep) {
        let cost = cost(at, least);
        if cost >= least {
            continue;
        }
        let crossings = *crossings.get_or_insert_with(|| crossings_of(graph, points, vertex, here, u32::MAX));
        let conflicts = *conflicts.get_or_insert_with(|| conflicts_of(graph, points, vertex, here, u32::MAX));
        if crossings_of(graph, points, vertex, at, crossings) <= crossings
            && conflicts_of(graph, points, vertex, at, conflicts) <= conflicts
        {
            (least, best) = (cost, Some(at));
        }
    }
    best
}

/// Steps towards the anchor and the neighbours, and short steps in four directions that alternate between sweeps.
fn candidates(
    graph: &Graph,
    points: &[Point],
    vertex: usize,
    anchor: Point,
    length: f64,
    sweep: u32,
) -> impl Iterator<Item = Point> {
    let here = points[vertex];
    let near = geometry::mean(graph.neighbours(vertex).iter().map(|&neighbour| {
        let away = here - points[neighbour];
        points[neighbour] + away * (1.0 / away.length().max(1e-9))
    }));
    let near = if graph.neighbours(vertex).is_empty() { Point::UNKNOWN } else { near };
    let goals = [anchor, near].into_iter().filter(|goal| goal.is_known());
    let ways = goals.flat_map(move |goal| [1.0, 0.5, 0.2].map(|share| here + (goal - here) * share));
    let around = (0..4).map(move |quarter| {
        let eighth = f64::from(2 * quarter + sweep % 2);
        here + Point::towards(eighth * std::f64::consts::FRAC_PI_4) * length
    });
    ways.chain(around)
}
