//! Random planar graphs: the minimum spanning tree of random points, and short edges without crossings.

use super::{graph::Graph, walk::PathRng};
use rand::RngExt;

/// Largest degree of a vertex for edges beyond the tree: the largest degree of an observation.
const MAX_DEGREE: usize = 7;

/// A point of the unit square.
pub(super) type Point = (f64, f64);

/// Draws a connected planar graph with straight edges between random points of the unit square.
///
/// It holds the minimum spanning tree of the points, and then the shortest edges that cross no earlier edge, until
/// there are `edges`. It is a tree when `edges` is below the size of the tree, and a triangulation when more `edges` are
/// requested than fit. The points are the positions of the vertices.
pub(super) fn draw_planar(vertices: usize, edges: usize, rng: &mut PathRng) -> (Graph, Vec<Point>) {
    let points: Vec<Point> = (0..vertices).map(|_| (rng.random(), rng.random())).collect();
    let mut pairs: Vec<(usize, usize)> = (0..vertices).flat_map(|a| (a + 1..vertices).map(move |b| (a, b))).collect();
    pairs.sort_by(|&left, &right| length(&points, left).total_cmp(&length(&points, right)));

    let mut graph = Graph::new(vertices);
    // The tree: no edge between vertices of one component. Minimum spanning trees in the plane have no crossings.
    let mut component: Vec<usize> = (0..vertices).collect();
    for &(a, b) in &pairs {
        let (kept, joined) = (component[a], component[b]);
        if kept != joined {
            graph.add_edge(a, b);
            component.iter_mut().filter(|of| **of == joined).for_each(|of| *of = kept);
        }
    }
    let mut degrees: Vec<usize> = graph.neighbours().iter().map(Vec::len).collect();
    for &(a, b) in &pairs {
        let has_room = graph.edges().len() < edges && degrees[a].max(degrees[b]) < MAX_DEGREE;
        if has_room && !graph.edges().iter().any(|&edge| cross(&points, edge, (a, b))) && graph.add_edge(a, b) {
            degrees[a] += 1;
            degrees[b] += 1;
        }
    }
    (graph, points)
}

fn length(points: &[Point], (a, b): (usize, usize)) -> f64 {
    (points[a].0 - points[b].0).hypot(points[a].1 - points[b].1)
}

/// Whether two edges have a point in common that is not an end of both.
fn cross(points: &[Point], first: (usize, usize), second: (usize, usize)) -> bool {
    if [second.0, second.1].iter().any(|&end| end == first.0 || end == first.1) {
        return false;
    }
    let parted = |(a, b): (usize, usize), (c, d): (usize, usize)| side(points, a, b, c) != side(points, a, b, d);
    parted(first, second) && parted(second, first)
}

/// Whether `c` lies to the left of the line from `a` to `b`.
fn side(points: &[Point], a: usize, b: usize, c: usize) -> bool {
    let (a, b, c) = (points[a], points[b], points[c]);
    (b.0 - a.0) * (c.1 - a.1) > (b.1 - a.1) * (c.0 - a.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walk::path_rng;

    #[test]
    fn crossing_edges_are_detected() {
        let points = [(0.0, 0.0), (1.0, 1.0), (0.0, 1.0), (1.0, 0.0), (3.0, 0.0)];
        assert!(cross(&points, (0, 1), (2, 3)));
        assert!(!cross(&points, (0, 2), (1, 3)));
        assert!(!cross(&points, (0, 1), (1, 2)), "a common end is no crossing");
        assert!(!cross(&points, (0, 1), (3, 4)));
    }

    #[test]
    fn a_graph_is_connected_and_has_the_requested_or_largest_possible_number_of_edges() {
        let mut rng = path_rng(5, 0);
        for (vertices, edges, drawn) in [(12, 15, 15..=15), (12, 3, 11..=11), (12, 99, 20..=30)] {
            for _ in 0..20 {
                let (graph, _) = draw_planar(vertices, edges, &mut rng);
                assert!(drawn.contains(&graph.edges().len()), "{} of {edges}", graph.edges().len());
                assert!(graph.is_connected());
            }
        }
    }
}
