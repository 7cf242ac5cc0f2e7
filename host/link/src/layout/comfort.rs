//! Cost of a drawing: prefers edges of length 1, wide angles, and space around vertices and edges.

use super::{Point, conflicts::EDGE_CLEARANCE, geometry, graph::Graph};

/// Weight of the repulsion between vertices.
const REPULSION: f64 = 0.15;

/// Preferred minimum distance of a vertex from edges of others.
const MARGIN: f64 = 0.6;
const MARGIN_WEIGHT: f64 = 2.0;
const HIDING_WEIGHT: f64 = 5.0;

/// Weight of the angles between edges.
const ANGLE_WEIGHT: f64 = 0.3;
const PLEASANT_COSINE: f64 = -0.7;

/// Cost of all terms that depend on `vertex`, at a given point.
///
/// The sum stops above `limit`.
pub(super) fn discomfort_of(graph: &Graph, points: &[Point], vertex: usize, at: Point, limit: f64) -> f64 {
    let mut discomfort = 0.0;
    let mut add = |cost: f64| {
        // A vertex without a position has no cost.
        if !cost.is_nan() {
            discomfort += cost;
        }
        discomfort > limit
    };
    let neighbours = graph.neighbours(vertex);
    for &neighbour in neighbours {
        let stretch = (points[neighbour] - at).length() - 1.0;
        add(stretch * stretch);
    }
    for &point in points[..vertex].iter().chain(&points[vertex + 1..]) {
        if add(REPULSION / (point - at).squared().max(1e-3)) {
            return f64::INFINITY;
        }
    }
    for &(a, b) in graph.edges().iter().filter(|&&(a, b)| a != vertex && b != vertex) {
        add(crowding(at, (points[a], points[b])));
    }
    for (index, &neighbour) in neighbours.iter().enumerate() {
        let along = points[neighbour] - at;
        for &other in &neighbours[..index] {
            add(narrowness(along, points[other] - at));
        }
        for &other in graph.neighbours(neighbour).iter().filter(|&&other| other != vertex) {
            add(narrowness(at - points[neighbour], points[other] - points[neighbour]));
        }
        for (other, &point) in points.iter().enumerate() {
            if other != vertex && other != neighbour && add(crowding(point, (at, points[neighbour]))) {
                return f64::INFINITY;
            }
        }
    }
    discomfort
}

/// Cost of the angle between two edges at a vertex: largest for a narrow angle, zero at about 135°.
///
/// A straight angle has a small cost too, because an edge that closes a straight row to a cycle lies on all its
/// vertices.
fn narrowness(first: Point, second: Point) -> f64 {
    let cosine = first.dot(second) / (first.squared() * second.squared()).sqrt();
    let share = (cosine - PLEASANT_COSINE).abs() / (1.0 - PLEASANT_COSINE);
    ANGLE_WEIGHT * share * share
}

/// Increases towards an edge, and steeply within the minimum clearance.
fn crowding(point: Point, edge: (Point, Point)) -> f64 {
    if !geometry::may_be_near(point, edge, MARGIN) {
        return 0.0;
    }
    let distance = geometry::squared_distance(point, edge).sqrt();
    if distance < MARGIN {
        let lack = MARGIN - distance;
        MARGIN_WEIGHT * lack * lack + HIDING_WEIGHT * (EDGE_CLEARANCE / distance.max(1e-9) - 1.0).max(0.0)
    } else {
        0.0
    }
}
