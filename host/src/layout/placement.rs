//! A good position for one vertex while all others stay where they are.

use super::{Point, comfort::discomfort_of, conflicts::conflicts_of, geometry, graph::Graph};

const DIRECTIONS: u32 = 24;
const DISTANCES: [f64; 6] = [1.0, 0.7, 0.5, 1.4, 2.0, 3.0];

/// So many rows and columns at most lie over the picture.
const GRID: u32 = 14;

/// How much it weighs how far a vertex without neighbours is from the middle.
const TO_THE_MIDDLE: f64 = 0.1;

/// The best position for a vertex that has none, among its neighbours.
pub(super) fn place(graph: &Graph, points: &[Point], vertex: usize) -> Point {
    let Some((low, high)) = geometry::bounds(points) else { return Point::default() };
    let middle = (low + high) * 0.5;
    let is_alone = !graph.neighbours(vertex).iter().any(|&neighbour| points[neighbour].is_known());
    let cost = |at: Point| {
        let far = if is_alone { TO_THE_MIDDLE * (at - middle).squared() } else { 0.0 };
        (conflicts_of(graph, points, vertex, at), discomfort_of(graph, points, vertex, at) + far)
    };
    let close = if is_alone { None } else { best(around_neighbours(graph, points, vertex), cost) };
    match close {
        Some((at, (0, _))) => at,
        // An edge of more than 1 is better than one that crosses.
        close => {
            let anywhere = best(over_the_picture(points), cost);
            let better = close.into_iter().chain(anywhere).min_by(|one, other| compare(&one.1, &other.1));
            better.map_or(middle, |(at, _)| at)
        }
    }
}

/// Positions around the neighbours that have one, at the distance of a good edge and others.
pub(super) fn around_neighbours(graph: &Graph, points: &[Point], vertex: usize) -> impl Iterator<Item = Point> {
    let neighbours = graph.neighbours(vertex).iter().map(|&neighbour| points[neighbour]);
    let known: Vec<Point> = neighbours.filter(|point| point.is_known()).collect();
    let middle = (known.len() > 1).then(|| geometry::mean(known.iter().copied()));
    known.into_iter().chain(middle).flat_map(around)
}

fn around(centre: Point) -> impl Iterator<Item = Point> {
    let directions = (0..DIRECTIONS).map(|step| std::f64::consts::TAU * f64::from(step) / f64::from(DIRECTIONS));
    directions.flat_map(move |angle| DISTANCES.map(|distance| centre + Point::towards(angle) * distance))
}

/// Positions all over the picture and a little beyond.
pub(super) fn over_the_picture(points: &[Point]) -> impl Iterator<Item = Point> {
    let (low, high) = geometry::bounds(points).unwrap_or_default();
    let margin = Point::new(1.5, 1.5);
    let (low, size) = (low - margin, high - low + margin * 2.0);
    let lines = |length: f64| ((length / 0.5).ceil() as u32).clamp(2, GRID);
    let (columns, rows) = (lines(size.x), lines(size.y));
    let at = move |step: u32, lines: u32, length: f64| length * f64::from(step) / f64::from(lines - 1);
    (0..rows).flat_map(move |row| {
        (0..columns).map(move |column| low + Point::new(at(column, columns, size.x), at(row, rows, size.y)))
    })
}

/// The candidate of the lowest cost, the first of several.
pub(super) fn best(
    candidates: impl Iterator<Item = Point>,
    cost: impl Fn(Point) -> (u32, f64),
) -> Option<(Point, (u32, f64))> {
    candidates.map(|at| (at, cost(at))).min_by(|one, other| compare(&one.1, &other.1))
}

/// Conflicts first.
fn compare(one: &(u32, f64), other: &(u32, f64)) -> std::cmp::Ordering {
    one.0.cmp(&other.0).then(one.1.total_cmp(&other.1))
}
