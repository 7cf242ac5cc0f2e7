//! Positions for drawing a map, which itself has no coordinates, stable from one update to the next.
//!
//! Edges of a planar graph do not cross, and no vertex lies on another or on an edge of others. The ways of a vertex, if they are
//! known, are drawn in their counter-clockwise order; so the drawing of a map of genus 0 has no crossings. A vertex keeps its
//! position as long as that holds; a new vertex is placed beside its neighbours.
//!
//! ```
//! use toposlam_link::layout::Layout;
//! use toposlam_link::topology::{TopologicalMap, Vertex};
//!
//! let mut layout = Layout::new();
//! let mut map = TopologicalMap { vertices: vec![Vertex::default(); 3], edges: vec![(0, 1), (1, 2)], ..Default::default() };
//! layout.arrange(&map);
//! let before = layout.points().to_vec();
//! map.vertices.push(Vertex::default());
//! map.edges = vec![(0, 1), (0, 3), (1, 2), (2, 3)];
//! layout.arrange(&map);
//! assert_eq!(layout.points()[..3], before);
//! ```

mod barycentres;
mod comfort;
mod conflicts;
mod drawing;
mod embedding;
mod geometry;
mod graph;
mod network;
mod placement;
mod redrawing;
mod reduction;
mod rotation;
mod smoothing;
mod stubs;
mod triangulation;
mod untangling;

use toposlam::wire::{Arrival, Header, Message, Remapped, WayId};

use self::network::Network;
use crate::topology::TopologicalMap;

/// A position in the drawing, in units of about one edge length. `y` points up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Horizontal, to the right.
    pub x: f64,
    /// Vertical, upwards.
    pub y: f64,
}

/// The longest edge of a map with ways that does not make vertices move.
const LONGEST: f64 = 2.0;
/// Sweeps of smoothing to shorten edges.
const SWEEPS: u32 = 16;

fn longest(graph: &graph::Graph, points: &[Point]) -> f64 {
    graph.edges().iter().map(|&(a, b)| (points[a] - points[b]).length()).fold(0.0, f64::max)
}

/// Positions for the vertices of a growing map.
///
/// Deterministic: the same maps in the same order give the same layout.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    network: Network,
    /// The positions of the vertices, then of the bends.
    points: Vec<Point>,
    vertices: usize,
    stubs: Vec<Stub>,
}

/// The drawing of an edge.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeLine {
    /// The vertices that it joins.
    pub ends: [u8; 2],
    /// The ways that it joins, if the map has ways.
    pub ways: Option<[WayId; 2]>,
    /// The first vertex, the bends and the second vertex. A self-loop of a map without ways has its vertex alone.
    pub points: Vec<Point>,
}

/// The drawing of a frontier, a way that nobody has driven: a short line from its vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stub {
    /// The way.
    pub way: WayId,
    /// The position of the vertex.
    pub from: Point,
    /// The end of the line.
    pub to: Point,
}

impl Layout {
    /// A layout without vertices.
    pub fn new() -> Self {
        Self::default()
    }

    /// Gives every vertex of the map a position; existing positions are kept where possible.
    ///
    /// Edges of a planar map do not cross. Any two vertices are at least 0.35 apart, and a vertex is at least 0.12 from
    /// an edge that does not end at it; on a map that is not planar both hold as far as possible. Labels, and self-loops of a
    /// map without ways, have no influence. Cost: negligible if the graph is unchanged.
    pub fn arrange(&mut self, map: &TopologicalMap) {
        let before = std::mem::replace(&mut self.network, Network::of(map));
        let graph = &self.network.graph;
        let is_same =
            *graph == before.graph && self.network.bends == before.bends && self.vertices == map.vertices.len();
        if !is_same || !self.points.iter().all(|point| point.is_known()) {
            let bends = self.points.split_off(self.vertices.min(self.points.len()));
            let place = |bend| before.bends.iter().position(|other| other == bend).and_then(|index| bends.get(index));
            self.vertices = map.vertices.len();
            self.points.resize(self.vertices, Point::UNKNOWN);
            self.points.extend(self.network.bends.iter().map(|bend| place(bend).copied().unwrap_or(Point::UNKNOWN)));
            self.rearrange();
        }
        self.stubs = stubs::stubs(map, &self.network, &self.points);
    }

    fn rearrange(&mut self) {
        let graph = &self.network.graph;
        let before = self.points.clone();
        let is_blank = !before.iter().any(|point| point.is_known());
        if is_blank && before.len() > 2 {
            self.points = redrawing::redraw(graph, &before);
            return;
        }
        self.place_new();
        let graph = &self.network.graph;
        let left = untangling::untangle(graph, &mut self.points);
        if left == 0 {
            self.shorten(&before);
            return;
        }
        let points = redrawing::redraw(graph, &before);
        let redrawn = conflicts::conflicts(graph, &points);
        // On a non-planar map a few fewer crossings do not justify a jump of the drawing.
        let is_worth_it = redrawn == 0 || 2 * redrawn < left || left > conflicts::crossings(graph, &self.points);
        if redrawn < left && is_worth_it {
            self.points = points;
        }
    }

    /// The order of the ways leaves little room for a new vertex, so that edges become long. Then the vertices move, and if
    /// that does not suffice, the map is redrawn.
    fn shorten(&mut self, before: &[Point]) {
        let graph = &self.network.graph;
        if !graph.is_ordered() || longest(graph, &self.points) <= LONGEST {
            return;
        }
        let all: Vec<usize> = (0..graph.vertices()).collect();
        smoothing::smooth(graph, &mut self.points, &all, before, SWEEPS);
        if longest(graph, &self.points) > LONGEST {
            let mut points = redrawing::redraw(graph, &vec![Point::UNKNOWN; all.len()]);
            redrawing::lay_over(&mut points, before, true);
            let is_sound = conflicts::conflicts(graph, &points) == 0;
            if is_sound && longest(graph, &points) < longest(graph, &self.points) {
                self.points = points;
            }
        }
    }

    /// Applies a message that changes vertex numbers: renumbers the vertices, or clears the drawing after a restart of
    /// the robot.
    pub fn apply(&mut self, header: Header, message: &Message) {
        match header.arrival {
            Arrival::Late => return,
            Arrival::Restart => *self = Self::new(),
            Arrival::First | Arrival::InOrder | Arrival::AfterGap { .. } => {}
        }
        if let Message::Remapped(renamed) = message {
            self.rename(renamed);
        }
    }

    /// Renumbers the vertices; each keeps its position.
    ///
    /// Of merged vertices the first one's position is kept. Call [`Layout::arrange`] afterwards: until then a vertex
    /// without a position is at NaN.
    pub fn rename(&mut self, renamed: &Remapped) {
        let mut points = Vec::new();
        for (before, &point) in (0..=u8::MAX).zip(self.points()) {
            let Some(now) = renamed.now(before).map(usize::from) else { continue };
            if now >= points.len() {
                points.resize(now + 1, Point::UNKNOWN);
            }
            if !points[now].is_known() {
                points[now] = point;
            }
        }
        self.vertices = points.len();
        self.points = points;
        self.network = Network::default();
        self.stubs.clear();
    }

    /// The position of every vertex.
    pub fn points(&self) -> &[Point] {
        &self.points[..self.vertices]
    }

    /// The drawing of every edge, in the order of [`TopologicalMap::all_edges`].
    pub fn edges(&self) -> Vec<EdgeLine> {
        let line = |path: &network::Path| {
            let points = path.nodes.iter().map(|&node| self.points[node]).collect();
            EdgeLine { ends: path.ends, ways: path.ways, points }
        };
        self.network.paths.iter().map(line).collect()
    }

    /// The drawing of every frontier.
    pub fn stubs(&self) -> &[Stub] {
        &self.stubs
    }

    /// Places the vertices that have no position, in descending order of placed neighbours.
    fn place_new(&mut self) {
        loop {
            let graph = &self.network.graph;
            let known = |vertex: usize| {
                graph.neighbours(vertex).iter().filter(|&&neighbour| self.points[neighbour].is_known()).count()
            };
            let waiting = (0..self.points.len()).rev().filter(|&vertex| !self.points[vertex].is_known());
            let Some(vertex) = waiting.max_by_key(|&vertex| known(vertex)) else { break };
            self.points[vertex] = placement::place(graph, &self.points, vertex);
        }
    }
}

#[cfg(test)]
mod exploration_tests;
#[cfg(test)]
mod ordered_tests;
#[cfg(test)]
mod tests;
