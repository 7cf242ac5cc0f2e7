//! What makes a picture pleasant: edges about 1 long, wide angles, and room around vertices and edges.

use super::{Point, geometry, graph::Graph};

/// Vertices push each other away with this weight.
const REPULSION: f64 = 0.15;

/// A vertex is kept this far from edges of others, where there is room.
const MARGIN: f64 = 0.6;
const MARGIN_WEIGHT: f64 = 2.0;

/// How much narrow angles between edges weigh.
const ANGLE: f64 = 0.3;

/// How unpleasant the picture is by what depends on `vertex`, when that is at a point.
pub(super) fn discomfort_of(graph: &Graph, points: &[Point], vertex: usize, at: Point) -> f64 {
    let mut discomfort = 0.0;
    let mut add = |cost: f64| {
        // What has no position costs nothing.
        if !cost.is_nan() {
            discomfort += cost;
        }
    };
    let neighbours = graph.neighbours(vertex);
    for (index, &neighbour) in neighbours.iter().enumerate() {
        let along = points[neighbour] - at;
        let stretch = along.length() - 1.0;
        add(stretch * stretch);
        for &other in &neighbours[..index] {
            add(narrowness(along, points[other] - at));
        }
        for &other in graph.neighbours(neighbour).iter().filter(|&&other| other != vertex) {
            add(narrowness(at - points[neighbour], points[other] - points[neighbour]));
        }
    }
    for (other, &point) in points.iter().enumerate() {
        if other == vertex {
            continue;
        }
        add(REPULSION / (point - at).squared().max(1e-3));
        for &neighbour in neighbours.iter().filter(|&&neighbour| neighbour != other) {
            add(crowding(point, (at, points[neighbour])));
        }
    }
    for &(a, b) in graph.edges().iter().filter(|&&(a, b)| a != vertex && b != vertex) {
        add(crowding(at, (points[a], points[b])));
    }
    discomfort
}

/// 0 for opposite directions, up to the weight for equal ones.
fn narrowness(first: Point, second: Point) -> f64 {
    let cosine = first.dot(second) / (first.squared() * second.squared()).sqrt();
    let share = 0.5 * (1.0 + cosine);
    ANGLE * share * share
}

fn crowding(point: Point, edge: (Point, Point)) -> f64 {
    let squared = geometry::squared_distance(point, edge);
    if squared > MARGIN * MARGIN {
        return 0.0;
    }
    let lack = MARGIN - squared.sqrt();
    MARGIN_WEIGHT * lack * lack
}
