//! Conflicts taken out of a picture by moving few vertices.

use super::{
    Point,
    comfort::discomfort_of,
    conflicts::{conflicts, conflicts_of},
    graph::Graph,
    placement::{self, Found, Search},
};

/// How much it weighs how far a vertex is moved.
const MOVE_WEIGHT: f64 = 0.5;

/// At most so many moves are made, and none when there are more conflicts.
const MOVES: usize = 12;
const HOPELESS: u32 = 60;

/// Moves one vertex after the other, always the one that takes most conflicts away, as long as that helps. Gives the conflicts that are
/// left.
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
        let Some((vertex, less, found)) = best else { return left };
        points[vertex] = found.at;
        left -= less;
    }
    left
}

/// The best way to move a vertex that has conflicts, if any takes some away, and how much.
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
