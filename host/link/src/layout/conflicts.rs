//! Conflicts in a drawing: crossing edges, vertices too close to each other, vertices on edges of others, and neighbours in the
//! wrong order.

use super::{Point, geometry, graph::Graph};

/// Minimum distance between two vertices.
pub(super) const VERTEX_CLEARANCE: f64 = 0.35;

/// Minimum distance of a vertex from an edge that does not end at it.
pub(super) const EDGE_CLEARANCE: f64 = 0.12;

/// Weight of an overlap, or of neighbours in the wrong order, relative to a crossing.
const HIDING: u32 = 5;

/// Weighted number of conflicts of `vertex` at a point with the rest of the drawing; 0 if there are none.
///
/// Counting stops above `limit`.
pub(super) fn conflicts_of(graph: &Graph, points: &[Point], vertex: usize, at: Point, limit: u32) -> u32 {
    let mut conflicts = 0;
    for &point in points[..vertex].iter().chain(&points[vertex + 1..]) {
        conflicts += hiding_vertex(point, at);
    }
    let neighbours = graph.neighbours(vertex);
    conflicts += disorder_of(graph, points, vertex, at);
    for &(a, b) in graph.edges().iter().filter(|&&(a, b)| a != vertex && b != vertex) {
        if conflicts > limit {
            return conflicts;
        }
        let edge = (points[a], points[b]);
        conflicts += hiding_edge(at, edge);
        for &neighbour in neighbours.iter().filter(|&&neighbour| neighbour != a && neighbour != b) {
            conflicts += u32::from(geometry::cross((at, points[neighbour]), edge));
        }
    }
    for &neighbour in neighbours {
        if conflicts > limit {
            return conflicts;
        }
        let edge = (at, points[neighbour]);
        for (other, &point) in points.iter().enumerate() {
            if other != vertex && other != neighbour {
                conflicts += hiding_edge(point, edge);
            }
        }
    }
    conflicts
}

/// Number of edges that the edges of `vertex` at a point cross, and of vertices whose neighbours it puts in the wrong order,
/// weighted. Counting stops above `limit`.
pub(super) fn crossings_of(graph: &Graph, points: &[Point], vertex: usize, at: Point, limit: u32) -> u32 {
    let mut crossings = disorder_of(graph, points, vertex, at);
    for &(a, b) in graph.edges().iter().filter(|&&(a, b)| a != vertex && b != vertex) {
        for &neighbour in graph.neighbours(vertex).iter().filter(|&&neighbour| neighbour != a && neighbour != b) {
            crossings += u32::from(geometry::cross((at, points[neighbour]), (points[a], points[b])));
        }
        if crossings > limit {
            break;
        }
    }
    crossings
}

/// Weighted number of conflicts of a whole drawing; 0 if there are none.
pub(super) fn conflicts(graph: &Graph, points: &[Point]) -> u32 {
    let edges = graph.edges();
    let mut conflicts = crossings(graph, points);
    for (vertex, &point) in points.iter().enumerate() {
        conflicts += disorder(graph, vertex, |other| points[other]);
        for &other in &points[..vertex] {
            conflicts += hiding_vertex(point, other);
        }
        for &(a, b) in edges.iter().filter(|&&(a, b)| a != vertex && b != vertex) {
            conflicts += hiding_edge(point, (points[a], points[b]));
        }
    }
    conflicts
}

/// Number of pairs of edges that cross.
pub(super) fn crossings(graph: &Graph, points: &[Point]) -> u32 {
    let segment = |(a, b): (usize, usize)| (points[a], points[b]);
    let mut crossings = 0;
    for (index, &(a, b)) in graph.edges().iter().enumerate() {
        for &(c, d) in &graph.edges()[..index] {
            let apart = a != c && a != d && b != c && b != d;
            crossings += u32::from(apart && geometry::cross(segment((a, b)), segment((c, d))));
        }
    }
    crossings
}

/// Growth factor that removes all overlaps, with a small margin; at least 1.
pub(super) fn growth(graph: &Graph, points: &[Point]) -> f64 {
    let mut growth: f64 = 1.0;
    for (vertex, &point) in points.iter().enumerate() {
        for &other in &points[..vertex] {
            growth = growth.max(VERTEX_CLEARANCE / (point - other).length());
        }
        for &(a, b) in graph.edges().iter().filter(|&&(a, b)| a != vertex && b != vertex) {
            growth = growth.max(EDGE_CLEARANCE / geometry::squared_distance(point, (points[a], points[b])).sqrt());
        }
    }
    if growth > 1.0 { growth * (1.0 + 1e-9) } else { growth }
}

fn hiding_vertex(point: Point, other: Point) -> u32 {
    hiding((point - other).squared() < VERTEX_CLEARANCE * VERTEX_CLEARANCE)
}

fn hiding_edge(point: Point, edge: (Point, Point)) -> u32 {
    hiding(
        geometry::may_be_near(point, edge, EDGE_CLEARANCE)
            && geometry::squared_distance(point, edge) < EDGE_CLEARANCE * EDGE_CLEARANCE,
    )
}

/// The disorder of a vertex at a point, and of its neighbours.
fn disorder_of(graph: &Graph, points: &[Point], vertex: usize, at: Point) -> u32 {
    let point = |other: usize| if other == vertex { at } else { points[other] };
    std::iter::once(&vertex).chain(graph.neighbours(vertex)).map(|&of| disorder(graph, of, point)).sum()
}

/// Whether the known neighbours of a vertex are not drawn in their counter-clockwise order, weighted.
fn disorder(graph: &Graph, vertex: usize, point: impl Fn(usize) -> Point) -> u32 {
    let neighbours = graph.neighbours(vertex);
    if !graph.is_ordered() || neighbours.len() < 3 {
        return 0;
    }
    let centre = point(vertex);
    let angles = neighbours.iter().map(|&other| point(other) - centre).filter(|along| along.is_known());
    let angles: Vec<f64> = angles.map(|along| along.y.atan2(along.x)).collect();
    let falls = angles.iter().zip(angles.iter().cycle().skip(1)).filter(|(angle, next)| next < angle).count();
    hiding(falls > 1)
}

const fn hiding(is_hidden: bool) -> u32 {
    if is_hidden { HIDING } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_a_vertex_removes_exactly_its_conflicts() {
        let mut graph = Graph::new(6);
        [(0, 1), (2, 3), (4, 5)].into_iter().for_each(|(a, b)| graph.connect(a, b));
        let at = |x, y| Point::new(x, y);
        let mut points = vec![at(0.0, 0.0), at(2.0, 0.0), at(1.0, -1.0), at(1.0, 1.0), at(0.5, 0.05), at(0.5, 3.0)];
        let everything = conflicts(&graph, &points);
        assert_eq!(everything, 1 + HIDING);
        assert_eq!(conflicts_of(&graph, &points, 3, points[3], 9), 1);
        let better = conflicts_of(&graph, &points, 1, at(-2.0, 0.0), 9);
        assert_eq!(everything - conflicts_of(&graph, &points, 1, points[1], 9) + better, 0);
        points[1] = at(-2.0, 0.0);
        assert_eq!(conflicts(&graph, &points), 0);
    }
}
