//! The generalised Voronoi graph of a floor plan: the points that are as far from two walls.
//!
//! The exact Voronoi diagram of the wall surfaces (crate `boostvoronoi`) without the edges inside walls.

use std::collections::HashMap;
use std::fmt;

use boostvoronoi::prelude::{Builder, BvError, Cell, Diagram, SourceCategory};

use super::walls::{Segment, Walls, point};
use super::{Plan, Point};

/// Points of the diagram this close are one, in millimetres.
pub(super) const SAME_MM: f64 = 1.0;
/// Curved edges are cut into pieces no longer than this, in millimetres.
const PIECE_MM: f64 = 25.0;

/// Why a floor plan has no true map.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum VoronoiError {
    /// The diagram could not be computed.
    Diagram(String),
    /// No meet point can be reached from the start.
    NoPlace,
}

impl fmt::Display for VoronoiError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Diagram(error) => write!(f, "no Voronoi diagram: {error}"),
            Self::NoPlace => write!(f, "no meet point can be reached from the start"),
        }
    }
}

impl std::error::Error for VoronoiError {}

impl From<BvError> for VoronoiError {
    fn from(error: BvError) -> Self {
        Self::Diagram(error.to_string())
    }
}

/// A piece of the graph between two of its points.
pub(super) struct Piece {
    pub(super) ends: [usize; 2],
    pub(super) way: Vec<Point>,
    /// The smallest distance to a wall along it, in millimetres.
    pub(super) clearance_mm: f64,
}

/// The graph's points and the pieces between them.
pub(super) struct Skeleton {
    pub(super) points: Vec<Point>,
    pub(super) pieces: Vec<Piece>,
    /// The pieces at each point, in ascending order.
    at: Vec<Vec<usize>>,
    alive: Vec<bool>,
    degrees: Vec<usize>,
}

/// What a cell of the diagram belongs to.
#[derive(Clone, Copy)]
enum Site {
    Corner(Point),
    Surface(Segment),
}

impl Site {
    fn of(cell: &Cell, segments: &[Segment]) -> Self {
        let segment = segments[cell.source_index().usize()];
        match cell.source_category() {
            _ if !cell.contains_point() => Self::Surface(segment),
            SourceCategory::SegmentEnd => Self::Corner(point(segment.to)),
            _ => Self::Corner(point(segment.from)),
        }
    }

    fn distance_mm(self, to: Point) -> f64 {
        match self {
            Self::Corner(corner) => corner.distance_mm(to),
            Self::Surface(segment) => segment.distance_mm(to),
        }
    }
}

impl Skeleton {
    /// The graph in the free space of a plan. Time O(n log n) for n surfaces.
    pub(super) fn of(plan: &Plan) -> Result<Self, VoronoiError> {
        let segments = plan.walls().segments();
        let corners = segments.iter().map(|segment| [segment.from.0, segment.from.1, segment.to.0, segment.to.1]);
        let diagram = Builder::<i32>::default().with_segments(corners)?.build()?;
        let mut points = Points::default();
        let mut pieces = Vec::new();
        for edge in diagram.edges() {
            let twin = edge.twin()?;
            if edge.is_secondary() || twin.usize() < edge.id().usize() {
                continue;
            }
            let (Some(from), Some(to)) = (edge.vertex0(), diagram.edge_get_vertex1(edge.id())?) else { continue };
            let (from, to) = (diagram.vertex(from)?, diagram.vertex(to)?);
            let (from, to) = (Point::new(from.x(), from.y()), Point::new(to.x(), to.y()));
            let site =
                |edge| Ok::<_, BvError>(Site::of(diagram.cell(Diagram::edge_get_cell(&diagram, edge)?)?, segments));
            let sites = [site(edge.id())?, site(twin)?];
            let way = if edge.is_curved() { curve(sites, from, to) } else { vec![from, to] };
            let middle = way.len() / 2;
            if !plan.walls().is_free(way[middle - 1].towards(way[middle], 0.5)) {
                continue;
            }
            let ends = [points.index(from), points.index(to)];
            if ends[0] == ends[1] && from.distance_mm(to) < SAME_MM {
                continue;
            }
            pieces.push(Piece { ends, clearance_mm: clearance_mm(sites, &way), way });
        }
        let points = points.points;
        let mut at = vec![Vec::new(); points.len()];
        for (index, piece) in pieces.iter().enumerate() {
            at[piece.ends[0]].push(index);
            if piece.ends[1] != piece.ends[0] {
                at[piece.ends[1]].push(index);
            }
        }
        let alive = vec![true; pieces.len()];
        let mut skeleton = Self { degrees: vec![0; points.len()], points, pieces, at, alive };
        for piece in &skeleton.pieces {
            piece.ends.iter().for_each(|end| skeleton.degrees[*end] += 1);
        }
        Ok(skeleton)
    }

    /// How many pieces end at each point.
    pub(super) fn degrees(&self) -> &[usize] {
        &self.degrees
    }

    /// The pieces that are left.
    pub(super) fn alive(&self) -> impl Iterator<Item = &Piece> {
        self.pieces.iter().zip(&self.alive).filter(|(_, alive)| **alive).map(|(piece, _)| piece)
    }

    /// The pieces that are left at a point: their numbers, and the points at their other ends.
    pub(super) fn leaving(&self, from: usize) -> impl Iterator<Item = (usize, usize)> {
        let alive = self.at[from].iter().copied().filter(|piece| self.alive[*piece]);
        alive.map(move |piece| {
            let ends = self.pieces[piece].ends;
            (piece, if ends[0] == from { ends[1] } else { ends[0] })
        })
    }

    /// Drops a piece.
    pub(super) fn drop(&mut self, piece: usize) {
        if std::mem::replace(&mut self.alive[piece], false) {
            self.pieces[piece].ends.iter().for_each(|end| self.degrees[*end] -= 1);
        }
    }

    /// Drops the pieces that are not wanted.
    pub(super) fn retain(&mut self, mut is_wanted: impl FnMut(&Piece) -> bool) {
        for index in 0..self.pieces.len() {
            if self.alive[index] && !is_wanted(&self.pieces[index]) {
                self.drop(index);
            }
        }
    }

    /// Drops what leads to nothing: from each loose end that is none, back to where others meet.
    pub(super) fn trim(&mut self, mut is_end: impl FnMut(usize) -> bool) {
        let mut loose: Vec<usize> = (0..self.points.len()).filter(|point| self.degrees[*point] == 1).collect();
        while let Some(point) = loose.pop() {
            if self.degrees[point] != 1 || is_end(point) {
                continue;
            }
            let next = self.leaving(point).next();
            if let Some((piece, other)) = next {
                self.drop(piece);
                loose.push(other);
            }
        }
    }

    /// The connected part of each point, counted from 0; `None` where no piece ends.
    pub(super) fn parts(&self) -> Vec<Option<usize>> {
        let mut parts = vec![None; self.points.len()];
        let mut count = 0;
        for first in 0..self.points.len() {
            if parts[first].is_some() || self.degrees[first] == 0 {
                continue;
            }
            let mut reached = vec![first];
            while let Some(point) = reached.pop() {
                if parts[point].replace(count).is_none() {
                    reached.extend(self.leaving(point).map(|(_, other)| other));
                }
            }
            count += 1;
        }
        parts
    }

    /// The way along a piece that begins at a point.
    pub(super) fn way_from(&self, point: usize, piece: usize) -> Vec<Point> {
        let Piece { ends, way, .. } = &self.pieces[piece];
        if ends[0] == point { way.clone() } else { way.iter().rev().copied().collect() }
    }

    /// A point of the piece nearest to the start that can be seen from there, or of the nearest piece.
    pub(super) fn nearest(&self, start: Point, walls: &Walls) -> Option<usize> {
        let to_start = |piece: &Piece| {
            let middles = piece.way.windows(2).map(|leg| leg[0].towards(leg[1], 0.5));
            middles.map(|middle| (middle.distance_mm(start), middle)).min_by(|one, other| one.0.total_cmp(&other.0))
        };
        let mut by_distance: Vec<(f64, Point, usize)> = self
            .alive()
            .filter_map(|piece| to_start(piece).map(|(distance_mm, middle)| (distance_mm, middle, piece.ends[0])))
            .collect();
        by_distance.sort_by(|one, other| one.0.total_cmp(&other.0));
        let seen = by_distance.iter().find(|(_, middle, _)| walls.is_in_sight(start, *middle));
        seen.or(by_distance.first()).map(|(_, _, end)| *end)
    }
}

/// Points, found by their place.
#[derive(Default)]
struct Points {
    points: Vec<Point>,
    by_cell: HashMap<(i64, i64), Vec<usize>>,
}

impl Points {
    /// The index of a point, which is added when it is not there yet.
    fn index(&mut self, point: Point) -> usize {
        let cell = |at_mm: f64| (at_mm / SAME_MM).floor() as i64;
        let (x, y) = (cell(point.x_mm), cell(point.y_mm));
        let around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)));
        let known = around.filter_map(|cell| self.by_cell.get(&cell)).flatten().copied();
        let known = known.filter(|known| self.points[*known].distance_mm(point) < SAME_MM).min();
        known.unwrap_or_else(|| {
            self.points.push(point);
            self.by_cell.entry((x, y)).or_default().push(self.points.len() - 1);
            self.points.len() - 1
        })
    }
}

/// The smallest distance to the two walls beside an edge, in millimetres.
fn clearance_mm(sites: [Site; 2], way: &[Point]) -> f64 {
    let ends_mm = way.iter().map(|at| sites[0].distance_mm(*at)).fold(f64::INFINITY, f64::min);
    let [Site::Corner(one), Site::Corner(other)] = sites else { return ends_mm };
    // Between two corners the edge is nearest to both where it crosses the line through them.
    let (middle, from, to) = (one.towards(other, 0.5), way[0], way[way.len() - 1]);
    let crosses = from.distance_mm(middle).max(to.distance_mm(middle)) <= from.distance_mm(to);
    if crosses { ends_mm.min(one.distance_mm(middle)) } else { ends_mm }
}

/// The points of a curved edge: the parabola between a corner and a wall surface.
fn curve(sites: [Site; 2], from: Point, to: Point) -> Vec<Point> {
    let ([Site::Corner(corner), Site::Surface(surface)] | [Site::Surface(surface), Site::Corner(corner)]) = sites
    else {
        return vec![from, to];
    };
    let (base, end) = (point(surface.from), point(surface.to));
    let length_mm = base.distance_mm(end);
    let (along_x, along_y) = ((end.x_mm - base.x_mm) / length_mm, (end.y_mm - base.y_mm) / length_mm);
    // In the frame of the surface: along it, and across to its left.
    let in_frame = |at: Point| {
        let (x, y) = (at.x_mm - base.x_mm, at.y_mm - base.y_mm);
        (along_x * x + along_y * y, along_x * y - along_y * x)
    };
    let ((focus_mm, height_mm), (from_mm, _), (to_mm, _)) = (in_frame(corner), in_frame(from), in_frame(to));
    if height_mm.abs() < 0.1 {
        return vec![from, to];
    }
    let pieces = (from.distance_mm(to) / PIECE_MM).ceil().max(1.0);
    let inner = (1..pieces as usize).map(|piece| {
        let at_mm = from_mm + (to_mm - from_mm) * (piece as f64 / pieces);
        let across_mm = height_mm / 2.0 + (at_mm - focus_mm).powi(2) / (2.0 * height_mm);
        let (x, y) = (along_x * at_mm - along_y * across_mm, along_y * at_mm + along_x * across_mm);
        Point::new(base.x_mm + x, base.y_mm + y)
    });
    std::iter::once(from).chain(inner).chain([to]).collect()
}
