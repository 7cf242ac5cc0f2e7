//! The true map of a floor plan: its generalised Voronoi graph.
//!
//! The exact Voronoi diagram of the wall surfaces (crate `boostvoronoi`) is reduced to what a robot can drive. Edges
//! inside walls are removed, and so are edges that end in a concave corner, where no robot fits. A remaining point
//! where three or more obstacles were equidistant is a node, even when only one or two edges remain (the end of a
//! corridor, a bend).

use std::fmt;

use boostvoronoi::prelude::{Builder, BvError, Diagram, EdgeIndex, SourceCategory};

use super::plan::Face;
use super::{Plan, Point};

/// Points of the diagram this close are merged, in millimetres.
const SAME_MM: f64 = 1.0;
/// Curved edges are split into segments no longer than this, in millimetres.
const PIECE_MM: f64 = 25.0;

/// A place of the true map: a meet point of the generalised Voronoi graph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueNode {
    /// Position of the node.
    pub position: Point,
    /// Distance to the closest obstacles, in millimetres.
    pub radius_mm: f64,
    /// Number of drivable edges that end here.
    pub degree: usize,
}

/// A drivable connection between two nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueEdge {
    /// The nodes at its ends.
    pub nodes: [usize; 2],
    /// Polyline from the first node to the second.
    pub way: Vec<Point>,
}

/// One end of an edge at one of its nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueWay {
    /// The edge.
    pub edge: usize,
    /// Whether the node is the second of the edge.
    pub is_reversed: bool,
    /// Direction of the point where the edge leaves the disc of the node, counter-clockwise from the x axis, in radians.
    pub bearing_rad: f64,
}

impl TrueWay {
    /// The edge and the end, for comparison.
    pub const fn dart(&self) -> (usize, bool) {
        (self.edge, self.is_reversed)
    }
}

impl TrueEdge {
    /// Length of the polyline, in millimetres.
    pub fn length_mm(&self) -> f64 {
        self.way.windows(2).map(|ends| ends[0].distance_mm(ends[1])).sum()
    }

    /// The point at this fraction of the polyline.
    pub fn point_at(&self, share: f64) -> Point {
        let mut left_mm = share * self.length_mm();
        for ends in self.way.windows(2) {
            let leg_mm = ends[0].distance_mm(ends[1]);
            if left_mm <= leg_mm {
                return ends[0].towards(ends[1], if leg_mm > 0.0 { left_mm / leg_mm } else { 0.0 });
            }
            left_mm -= leg_mm;
        }
        self.way.last().copied().unwrap_or_default()
    }
}

/// The true places of a floor plan and their connections, as far as they are reachable from the start.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueMap {
    /// The places.
    pub nodes: Vec<TrueNode>,
    /// The connections.
    pub edges: Vec<TrueEdge>,
}

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

/// A segment of the diagram between two of its points.
struct Piece {
    ends: [usize; 2],
    way: Vec<Point>,
}

/// The points of the diagram and the segments between them, in free space.
#[derive(Default)]
struct Skeleton {
    points: Vec<Point>,
    pieces: Vec<Piece>,
}

impl TrueMap {
    /// Computes the true map of a plan.
    ///
    /// # Errors
    /// When the diagram cannot be computed, or no meet point is reachable from the start.
    pub fn of(plan: &Plan) -> Result<Self, VoronoiError> {
        let faces = plan.faces();
        let mut skeleton = Skeleton::of(plan, &faces)?;
        let equidistant = skeleton.degrees();
        let radius_mm = |point: Point| faces.iter().map(|face| face.distance_mm(point)).fold(f64::MAX, f64::min);
        let in_corner: Vec<bool> = skeleton.points.iter().map(|point| radius_mm(*point) < SAME_MM).collect();
        skeleton.pieces.retain(|piece| piece.ends.iter().all(|end| !in_corner[*end]));
        skeleton.prune(&equidistant);
        skeleton.keep_reachable(plan.start());
        let drivable = skeleton.degrees();
        let mut node_of = vec![None; skeleton.points.len()];
        let mut nodes = Vec::new();
        for (index, position) in skeleton.points.iter().copied().enumerate() {
            if drivable[index] > 0 && equidistant[index] > 2 {
                node_of[index] = Some(nodes.len());
                nodes.push(TrueNode { position, radius_mm: radius_mm(position), degree: drivable[index] });
            }
        }
        if nodes.is_empty() {
            return Err(VoronoiError::NoPlace);
        }
        Ok(Self { edges: skeleton.chains(&node_of), nodes })
    }

    /// The ways of a node, counter-clockwise by their bearing from its position. A loop is two of them.
    pub fn ways(&self, node: usize) -> Vec<TrueWay> {
        let mut ways = Vec::new();
        for (edge, true_edge) in self.edges.iter().enumerate() {
            for is_reversed in [false, true] {
                if true_edge.nodes[usize::from(is_reversed)] == node {
                    ways.push(self.way(edge, is_reversed));
                }
            }
        }
        ways.sort_by(|one, other| one.bearing_rad.total_cmp(&other.bearing_rad));
        ways
    }

    /// One end of an edge: the first node is that of the way, or the second if it is reversed.
    pub fn way(&self, edge: usize, is_reversed: bool) -> TrueWay {
        let TrueEdge { nodes, way } = &self.edges[edge];
        let node = &self.nodes[nodes[usize::from(is_reversed)]];
        let mut points: Vec<Point> = way.clone();
        if is_reversed {
            points.reverse();
        }
        let is_outside = |point: &&Point| node.position.distance_mm(**point) >= node.radius_mm;
        let aim = points.iter().find(is_outside).or(points.last()).copied().unwrap_or_default();
        TrueWay { edge, is_reversed, bearing_rad: node.position.direction_to(aim) }
    }

    /// The node nearest to a point, and its distance in millimetres.
    pub fn nearest_node(&self, point: Point) -> Option<(usize, f64)> {
        let distances = self.nodes.iter().map(|node| node.position.distance_mm(point)).enumerate();
        distances.min_by(|one, other| one.1.total_cmp(&other.1))
    }
}

impl Skeleton {
    fn of(plan: &Plan, faces: &[Face]) -> Result<Self, VoronoiError> {
        let segments = faces.iter().map(|face| [face.from.0, face.from.1, face.to.0, face.to.1]);
        let diagram = Builder::<i32>::default().with_segments(segments)?.build()?;
        let mut skeleton = Self::default();
        for edge in diagram.edges() {
            let twin = edge.twin()?;
            if edge.is_secondary() || twin.usize() < edge.id().usize() {
                continue;
            }
            let (Some(from), Some(to)) = (edge.vertex0(), diagram.edge_get_vertex1(edge.id())?) else { continue };
            let (from, to) = (diagram.vertex(from)?, diagram.vertex(to)?);
            let (from, to) = (Point::new(from.x(), from.y()), Point::new(to.x(), to.y()));
            let way = match edge.is_curved() {
                true => curve(&diagram, faces, edge.id(), twin, from, to)?,
                false => vec![from, to],
            };
            let middle = way.len() / 2;
            if from.distance_mm(to) < SAME_MM || plan.is_wall_at(way[middle - 1].towards(way[middle], 0.5)) {
                continue;
            }
            let ends = [skeleton.point(from), skeleton.point(to)];
            skeleton.pieces.push(Piece { ends, way });
        }
        Ok(skeleton)
    }

    /// Index of a point, which is inserted when it is new.
    fn point(&mut self, point: Point) -> usize {
        let known = self.points.iter().position(|known| known.distance_mm(point) < SAME_MM);
        known.unwrap_or_else(|| {
            self.points.push(point);
            self.points.len() - 1
        })
    }

    /// Number of segments that end at each point.
    fn degrees(&self) -> Vec<usize> {
        let mut degrees = vec![0; self.points.len()];
        self.pieces.iter().flat_map(|piece| piece.ends).for_each(|end| degrees[end] += 1);
        degrees
    }

    /// Removes the branches that lead from a meet point only to removed concave corners.
    fn prune(&mut self, equidistant: &[usize]) {
        loop {
            let degrees = self.degrees();
            let before = self.pieces.len();
            self.pieces.retain(|piece| piece.ends.iter().all(|end| degrees[*end] > 1 || equidistant[*end] > 2));
            if self.pieces.len() == before {
                return;
            }
        }
    }

    /// Removes everything that is not connected to the segment nearest to a point.
    fn keep_reachable(&mut self, start: Point) {
        let to_start = |piece: &&Piece| {
            let distances = piece.way.windows(2).map(|leg| leg[0].towards(leg[1], 0.5).distance_mm(start));
            distances.fold(f64::MAX, f64::min)
        };
        let nearest = self.pieces.iter().min_by(|one, other| to_start(one).total_cmp(&to_start(other)));
        let Some(mut reached) = nearest.map(|piece| vec![piece.ends[0]]) else { return };
        let mut seen = vec![false; self.points.len()];
        while let Some(point) = reached.pop() {
            if !std::mem::replace(&mut seen[point], true) {
                let touching = self.pieces.iter().filter(|piece| piece.ends.contains(&point));
                reached.extend(touching.flat_map(|piece| piece.ends));
            }
        }
        self.pieces.retain(|piece| seen[piece.ends[0]]);
    }

    /// The chains of segments from node to node.
    fn chains(&self, node_of: &[Option<usize>]) -> Vec<TrueEdge> {
        let mut used = vec![false; self.pieces.len()];
        let mut edges = Vec::new();
        for first in 0..self.points.len() {
            let Some(first_node) = node_of[first] else { continue };
            while let Some(mut way) = self.leave(first, &mut used) {
                let mut at = way.1;
                let last_node = loop {
                    if let Some(node) = node_of[at] {
                        break Some(node);
                    }
                    let Some((more, next)) = self.leave(at, &mut used) else { break None };
                    way.0.extend_from_slice(&more[1..]);
                    at = next;
                };
                if let Some(last_node) = last_node {
                    edges.push(TrueEdge { nodes: [first_node, last_node], way: way.0 });
                }
            }
        }
        edges
    }

    /// Takes an unused segment at a point and returns its polyline and the point at its other end.
    fn leave(&self, point: usize, used: &mut [bool]) -> Option<(Vec<Point>, usize)> {
        let index = (0..self.pieces.len()).find(|index| !used[*index] && self.pieces[*index].ends.contains(&point))?;
        used[index] = true;
        let Piece { ends, way } = &self.pieces[index];
        if ends[0] == point {
            Some((way.clone(), ends[1]))
        } else {
            Some((way.iter().rev().copied().collect(), ends[0]))
        }
    }
}

/// The points of a curved edge: the parabola between a corner and an axis-parallel wall surface.
fn curve(
    diagram: &Diagram,
    faces: &[Face],
    edge: EdgeIndex,
    twin: EdgeIndex,
    from: Point,
    to: Point,
) -> Result<Vec<Point>, BvError> {
    let (one, other) = (diagram.cell(diagram.edge_get_cell(edge)?)?, diagram.cell(diagram.edge_get_cell(twin)?)?);
    let (corner, surface) = if one.contains_point() { (one, other) } else { (other, one) };
    let (surface, face) = (faces[surface.source_index().usize()], faces[corner.source_index().usize()]);
    let corner = match corner.source_category() {
        SourceCategory::SegmentEnd => face.to,
        _ => face.from,
    };
    let corner = Point::new(f64::from(corner.0), f64::from(corner.1));
    let level = surface.from.1 == surface.to.1;
    let height = |along: f64| {
        let (focus, across, line) = match level {
            true => (corner.x_mm, corner.y_mm, f64::from(surface.from.1)),
            false => (corner.y_mm, corner.x_mm, f64::from(surface.from.0)),
        };
        (line + across) / 2.0 + (along - focus).powi(2) / (2.0 * (across - line))
    };
    let pieces = (from.distance_mm(to) / PIECE_MM).ceil().max(1.0);
    let inner = (1..pieces as usize).map(|piece| {
        let chord = from.towards(to, piece as f64 / pieces);
        match level {
            true => Point::new(chord.x_mm, height(chord.x_mm)),
            false => Point::new(height(chord.y_mm), chord.y_mm),
        }
    });
    Ok(std::iter::once(from).chain(inner).chain([to]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(rows: &[&str]) -> Plan {
        Plan::parse(&format!("cell_mm 500\n{}", rows.join("\n"))).unwrap()
    }

    #[test]
    fn a_corridor_has_a_dead_end_at_each_end() {
        let map =
            TrueMap::of(&plan(&["..............", ".S............", "..............", ".............."])).unwrap();
        assert_eq!((map.nodes.len(), map.edges.len()), (2, 1));
        for node in &map.nodes {
            assert!((node.radius_mm - 1000.0).abs() < 1.0, "{node:?}");
            assert_eq!(node.degree, 1);
        }
    }

    #[test]
    fn a_junction_has_the_radius_of_the_disc_between_wall_and_corners() {
        let stem = "######....######";
        let bar = "................";
        let map = TrueMap::of(&plan(&[bar, bar, bar, bar, stem, stem, stem, stem, stem, "######.S..######"])).unwrap();
        assert_eq!((map.nodes.len(), map.edges.len()), (4, 3));
        let junction = map.nodes.iter().find(|node| node.degree == 3).unwrap();
        // A disc that touches a wall at distance w and two corners 2c apart: (w² + c²) / 2w.
        assert!((junction.radius_mm - 1250.0).abs() < 1.0, "{junction:?}");
        assert!((junction.position.x_mm - 4000.0).abs() < 1.0 && (junction.position.y_mm - 3750.0).abs() < 1.0);
    }

    #[test]
    fn every_point_of_an_edge_is_equidistant_from_two_obstacles() {
        for (name, text) in Plan::BUILT_IN {
            let plan = Plan::parse(text).unwrap();
            let map = TrueMap::of(&plan).unwrap();
            let faces = plan.faces();
            for point in map.edges.iter().flat_map(|edge| &edge.way) {
                let mut distances: Vec<f64> = faces.iter().map(|face| face.distance_mm(*point)).collect();
                distances.sort_by(f64::total_cmp);
                assert!(distances[1] - distances[0] < 1.0, "{name}: {point:?}");
            }
        }
    }
}
