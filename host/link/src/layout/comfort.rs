//! What makes a picture pleasant: edges about 1 long, wide angles, and room around vertices and edges.

use super::{Point, conflicts::EDGE_CLEARANCE, geometry, graph::Graph};

/// Vertices push each other away with this weight.
const REPULSION: f64 = 0.15;

/// A vertex is kept this far from edges of others, where there is room.
const MARGIN: f64 = 0.6;
const MARGIN_WEIGHT: f64 = 2.0;
const HIDING_WEIGHT: f64 = 5.0;

/// How much angles between edges weigh.
const ANGLE_WEIGHT: f64 = 0.3;
const PLEASANT_COSINE: f64 = -0.7;

/// How unpleasant the picture is by what depends on `vertex`, when that is at a point.
///
/// Adding up ends when it is more than `limit`.
pub(super) fn discomfort_of(graph: &Graph, points: &[Point], vertex: usize, at: Point, limit: f64) -> f64 {
    let mut discomfort = 0.0;
    let mut add = |cost: f64| {
        // What has no position costs nothing.
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

/// What the angle between two edges at a vertex costs: most when it is narrow, nothing at some 135°.
///
/// Straight on costs a little too, because an edge that closes the round of a straight row lies on all the vertices of it.
fn narrowness(first: Point, second: Point) -> f64 {
    let cosine = first.dot(second) / (first.squared() * second.squared()).sqrt();
    let share = (cosine - PLEASANT_COSINE).abs() / (1.0 - PLEASANT_COSINE);
    ANGLE_WEIGHT * share * share
}

/// Grows towards an edge, and without end when it comes too close.
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
