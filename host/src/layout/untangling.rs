//! Conflicts taken out of a picture by moving few vertices.

use super::{
    Point,
    comfort::discomfort_of,
    conflicts::{conflicts, conflicts_of},
    graph::Graph,
    placement,
};

/// How much it weighs how far a vertex is moved.
const MOVE_WEIGHT: f64 = 0.5;

/// At most so many moves are made.
const MOVES: usize = 12;

/// Moves one vertex after the other, always the one that takes most conflicts away, as long as that helps. Gives the conflicts that are
/// left.
pub(super) fn untangle(graph: &Graph, points: &mut [Point]) -> u32 {
    let mut left = conflicts(graph, points);
    for _ in 0..MOVES {
        if left == 0 {
            return 0;
        }
        let moves = (0..points.len()).filter_map(|vertex| best_move(graph, points, vertex));
        let best = moves.min_by(|one, other| one.change.cmp(&other.change).then(one.cost.total_cmp(&other.cost)));
        let Some(Move { vertex, to, change, .. }) = best else { return left };
        points[vertex] = to;
        left = left.saturating_add_signed(change);
    }
    left
}

struct Move {
    vertex: usize,
    to: Point,
    /// Negative.
    change: i32,
    cost: f64,
}

/// The best way to move a vertex that has conflicts, if any takes some away.
fn best_move(graph: &Graph, points: &[Point], vertex: usize) -> Option<Move> {
    let here = points[vertex];
    let before = conflicts_of(graph, points, vertex, here);
    if before == 0 {
        return None;
    }
    let cost = |at: Point| {
        let moved = (at - here).length();
        (conflicts_of(graph, points, vertex, at), discomfort_of(graph, points, vertex, at) + MOVE_WEIGHT * moved)
    };
    let aside = (0..16).flat_map(|step| {
        let direction = Point::towards(std::f64::consts::TAU * f64::from(step) / 16.0);
        [0.15, 0.3, 0.6].map(|distance| here + direction * distance)
    });
    let candidates =
        aside.chain(placement::around_neighbours(graph, points, vertex)).chain(placement::over_the_picture(points));
    let (to, (after, cost)) = placement::best(candidates, cost)?;
    (after < before).then(|| Move { vertex, to, change: after as i32 - before as i32, cost })
}
