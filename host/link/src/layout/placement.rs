//! Finds a good position for one vertex while all others are fixed.

use super::{Point, comfort::discomfort_of, conflicts::conflicts_of, geometry, graph::Graph};

const DIRECTIONS: u32 = 24;
const DISTANCES: [f64; 6] = [1.0, 0.7, 0.5, 1.4, 2.0, 3.0];

/// Maximum number of rows and columns of the search grid over the drawing.
const GRID: u32 = 14;

/// Weight of the distance from the centre for a vertex without neighbours.
const TO_THE_MIDDLE: f64 = 0.1;

/// The best position for a vertex without a position, given its neighbours.
pub(super) fn place(graph: &Graph, points: &[Point], vertex: usize) -> Point {
    let Some((low, high)) = geometry::bounds(points) else { return Point::default() };
    let middle = (low + high) * 0.5;
    let is_alone = !graph.neighbours(vertex).iter().any(|&neighbour| points[neighbour].is_known());
    let cost = |at: Point| {
        let far = if is_alone { TO_THE_MIDDLE * (at - middle).squared() } else { 0.0 };
        discomfort_of(graph, points, vertex, at, f64::INFINITY) + far
    };
    let search = Search { graph, points, vertex, cost };
    let close = if is_alone { None } else { search.best(around_neighbours(graph, points, vertex), None) };
    match close {
        Some(close) if close.conflicts == 0 => close.at,
        // An edge longer than 1 is better than a crossing.
        close => search.best(over_the_picture(points), close).map_or(middle, |found| found.at),
    }
}

/// A search for the best position of a vertex.
pub(super) struct Search<'picture, COST> {
    pub(super) graph: &'picture Graph,
    pub(super) points: &'picture [Point],
    pub(super) vertex: usize,
    /// Decides between positions with equal numbers of conflicts.
    pub(super) cost: COST,
}

/// A position with its conflicts and cost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub(super) at: Point,
    pub(super) conflicts: u32,
    pub(super) cost: f64,
}

impl<COST: Fn(Point) -> f64> Search<'_, COST> {
    /// The best of the given positions and the previous result: fewest conflicts first, then least cost.
    pub(super) fn best(&self, candidates: impl Iterator<Item = Point>, before: Option<Found>) -> Option<Found> {
        let mut best = before;
        for at in candidates {
            let limit = best.map_or(u32::MAX, |best| best.conflicts);
            let conflicts = conflicts_of(self.graph, self.points, self.vertex, at, limit);
            if conflicts > limit {
                continue;
            }
            let cost = (self.cost)(at);
            if best.is_none_or(|best| conflicts < best.conflicts || cost < best.cost) {
                best = Some(Found { at, conflicts, cost });
            }
        }
        best
    }
}

/// Positions around the neighbours, at the preferred edge length and at others.
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

/// Positions over the whole drawing and a little beyond.
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
