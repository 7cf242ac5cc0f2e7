//! The true map of a floor plan: what a robot of a given size with given sonars can distinguish (docs/plans.md has the definition).

use super::{Point, length_mm};

/// A place of the true map.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueNode {
    /// Where it is.
    pub position: Point,
    /// Distance to the closest obstacles, in millimetres.
    pub radius_mm: f64,
    /// How many drivable edges end here.
    pub degree: usize,
    /// Every meet point that this place stands for, its own position included.
    pub meet_points: Vec<Point>,
    /// Whether the closest obstacles are beyond the range of the sonars.
    pub is_hall: bool,
}

impl TrueNode {
    /// The distance of a point to the nearest of its meet points, in millimetres.
    pub fn distance_mm(&self, to: Point) -> f64 {
        self.meet_points.iter().map(|point| point.distance_mm(to)).fold(f64::INFINITY, f64::min)
    }
}

/// A drivable connection between two nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueEdge {
    /// The nodes at its ends.
    pub nodes: [usize; 2],
    /// The way from the first node to the second.
    pub way: Vec<Point>,
    /// The largest distance of the way from the walls, in millimetres.
    pub room_mm: f64,
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
        length_mm(&self.way)
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

/// Meet points of the Voronoi diagram that are no places of the true map, by the reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// The body does not fit there.
    pub narrow: usize,
    /// They cannot be reached from the start.
    pub unreachable: usize,
    /// They lie on branches that do not lead on.
    pub branches: usize,
    /// No three obstacles are apart in bearing, and the way does not fork.
    pub smooth: usize,
    /// They are one place with another.
    pub merged: usize,
    /// The sonars do not reach the obstacles, and the way does not fork.
    pub halls: usize,
}

/// A part of a plan that cannot be reached from the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnreachablePart {
    /// Its most open meet point.
    pub position: Point,
    /// The distance to the closest obstacles there, in millimetres.
    pub radius_mm: f64,
    /// How many meet points it has.
    pub meet_points: usize,
}

/// The true places of a floor plan and their connections, as far as they can be reached from the start.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueMap {
    /// The places.
    pub nodes: Vec<TrueNode>,
    /// The connections.
    pub edges: Vec<TrueEdge>,
    /// The meet points that are no places.
    pub dropped: Dropped,
    /// The parts where the body fits and that it cannot reach, the one with the most meet points first.
    pub unreachable: Vec<UnreachablePart>,
}

impl TrueMap {
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
        let TrueEdge { nodes, way, .. } = &self.edges[edge];
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
        let distances = self.nodes.iter().map(|node| node.distance_mm(point)).enumerate();
        distances.min_by(|one, other| one.1.total_cmp(&other.1))
    }
}
