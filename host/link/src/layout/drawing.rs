//! Straight-line planar drawing on integer coordinates by the shift method of de Fraysseix, Pach and Pollack.

use super::{Point, triangulation::Triangulation};

/// Positions of all vertices as integers: `x` from 0 to 2·vertices − 4, `y` from 0 to vertices − 2.
///
/// Cost: O(vertices²).
pub(super) fn draw(triangulation: &Triangulation) -> Vec<Point> {
    let vertices = triangulation.graph.vertices();
    let [left, right, _] = triangulation.outer;
    let mut positions = vec![(0_i64, 0_i64); vertices];
    // The upper boundary of the drawing from left to right; the vertices below a boundary vertex shift with it.
    let mut boundary = vec![(left, vec![left]), (right, vec![right])];
    for Step { vertex, below } in steps(triangulation) {
        let index = |of: usize| boundary.iter().position(|(other, _)| *other == of).unwrap_or(0);
        let (from, to) = (index(below[0]), index(below[below.len() - 1]));
        for (place, (_, moving)) in boundary.iter().enumerate().skip(from + 1) {
            let shift = if place < to { 1 } else { 2 };
            moving.iter().for_each(|&moved| positions[moved].0 += shift);
        }
        let ((x1, y1), (x2, y2)) = (positions[boundary[from].0], positions[boundary[to].0]);
        // The intersection of a diagonal up to the right with one up to the left. The ends are an even distance apart.
        positions[vertex] = ((x1 + x2 + y2 - y1) / 2, (x2 - x1 + y2 + y1) / 2);
        let covered: Vec<usize> =
            boundary[from + 1..to].iter().flat_map(|(_, moving)| moving.iter().copied()).collect();
        let moving = std::iter::once(vertex).chain(covered).collect();
        boundary.splice(from + 1..to, [(vertex, moving)]);
    }
    positions.into_iter().map(|(x, y)| Point::new(x as f64, y as f64)).collect()
}

/// The next vertex to draw, and the part of the boundary that it covers, from left to right.
struct Step {
    vertex: usize,
    below: Vec<usize>,
}

/// The canonical order without its first two vertices: each vertex covers part of the boundary of the previous ones.
fn steps(triangulation: &Triangulation) -> Vec<Step> {
    let graph = &triangulation.graph;
    let [left, right, top] = triangulation.outer;
    let mut boundary = vec![left, top, right];
    let mut on_boundary = vec![false; graph.vertices()];
    boundary.iter().for_each(|&vertex| on_boundary[vertex] = true);
    let mut steps = Vec::new();
    // In reverse order: a boundary vertex whose only neighbours on the boundary are the two beside it can be removed.
    while boundary.len() > 2 {
        let is_free =
            |&index: &usize| graph.neighbours(boundary[index]).iter().filter(|&&other| on_boundary[other]).count() == 2;
        let Some(index) = (1..boundary.len() - 1).find(is_free) else {
            unreachable!("a triangulation has a canonical order")
        };
        let vertex = boundary[index];
        let mut below = vec![boundary[index - 1]];
        while let Some(&last) = below.last().filter(|&&last| last != boundary[index + 1]) {
            below.push(triangulation.third(last, vertex));
        }
        on_boundary[vertex] = false;
        below.iter().for_each(|&uncovered| on_boundary[uncovered] = true);
        boundary.splice(index..=index, below[1..below.len() - 1].iter().copied());
        steps.push(Step { vertex, below });
    }
    steps.reverse();
    steps
}
