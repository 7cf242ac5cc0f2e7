//! Removes conflicts from a drawing by moving few vertices.

use super::{
    Point,
    comfort::discomfort_of,
    conflicts::{conflicts, conflicts_of},
    graph::Graph,
    placement::{self, Found, Search},
};

/// Weight of the distance that a vertex moves.
const MOVE_WEIGHT: f64 = 0.5;

/// Maximum number of moves; with more conflicts than this, none is made.
const MOVES: usize = 12;
const HOPELESS: u32 = 60;

/// Moves one vertex at a time, always the one that removes most conflicts, until no move helps. Returns the number of
/// remaining conflicts.
pub(super) fn untangle(graph: &Graph, points: &mut [Point]) -> u32 {
    let mut left = conflicts(graph, points);
    for _ in 0..MOVES {
        if left == 0 || left > HOPELESS {
            return left;
        }
        let moves = (0..points.len()).filter_map(|vertex| best_move(graph, points, vertex));
        let best = moves.min_by(|(_, one_less, one), (_, other_less, other)| {
            other_less.cmp(one_less).then(one.cost.total_cmp(&other.cost))
        });
        let Some((vertex, _, found)) = best else { return left };
        let stay = std::mem::replace(&mut points[vertex], found.at);
        // What a move removes by the count of its vertex may exceed what the drawing has: the drawing decides.
        let now = conflicts(graph, points);
        if now >= left {
            points[vertex] = stay;
            return left;
        }
        left = now;
    }
    left
}

/// The move of a vertex that removes most conflicts, and their number, if any move helps.
fn best_move(graph: &Graph, points: &[Point], vertex: usize) -> Option<(usize, u32, Found)> {
    let here = points[vertex];
    let before = conflicts_of(graph, points, vertex, here, u32::MAX);
    if before == 0 {
        return None;
    }
    let cost = |at: Point| discomfort_of(graph, points, vertex, at, f64::INFINITY) + MOVE_WEIGHT * (at - here).length();
    let aside = (0..16).flat_map(|step| {
        let direction = Point::towards(std::f64::consts::TAU * f64::from(step) / 16.0);
        [0.15, 0.3, 0.6].map(|distance| here + direction * distance)
    });
    let candidates =
        aside.chain(placement::around_neighbours(graph, points, vertex)).chain(placement::over_the_picture(points));
    let stay = Found { at: here, conflicts: before - 1, cost: f64::INFINITY };
    let found = Search { graph, points, vertex, cost }.best(candidates, Some(stay))?;
    (found.at != here).then(|| (vertex, before - found.conflicts, found))
}
