//! The ways to explain a place: where the robot left the place before and where it came to.

use super::model::{LN_PART, Model};
use crate::map::{Bearing, DartSet, VertexId, VertexSet};

/// In a path: a place that is not on the map, or no place.
pub(crate) const OFF_MAP: u8 = 254;

/// As an exit: a way that no visit has shown.
pub(super) const UNSEEN: u8 = 253;

/// Where the robot got to from the place before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// The other end of the edge it took.
    Known,
    /// A new vertex, by its first way.
    New,
    /// This way of a vertex that is on the map.
    At(u8),
    /// A way with this bearing of a vertex that is on the map, which no visit has shown.
    Unseen(u8, Bearing),
    /// Back to the vertex that the robot left, by the way by which it left it.
    Back,
    /// By this way, beyond a vertex at the other end of the edge that was not detected.
    Beyond(u8),
    /// No place: the robot is on the edge that it took. Whether a place on this edge was none before.
    Spurious(bool),
    /// A place that has no vertex on the map, and for which the map has no room.
    OffMap,
}

/// One way to explain the newest place: the way by which the robot left, [`NONE`] at the first place of a sequence and [`UNSEEN`] for
/// a way that no visit has shown, and where it got to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Choice {
    pub(super) exit: u8,
    pub(super) target: Target,
}

/// What the robot reported of the exit by which it left a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ReportedExit {
    Unknown,
    /// This way.
    Way(u8),
    /// A way that no visit has shown.
    Unseen,
    /// Any but this one, by which it came.
    NotBack(u8),
    /// It is the edge on which the robot is: the place before was none. The logarithm of the travel time until there; 0 if it is unknown.
    Before(u16),
}

impl ReportedExit {
    /// ln P of leaving by one of `ways` ways, and of the report: each way is as likely as another.
    pub(super) fn ln(self, model: &Model, exit: u8, ways: usize) -> f32 {
        let report = match self {
            Self::Unknown => 0.0,
            Self::Way(way) if way == exit => model.right_exit,
            Self::Unseen if exit == UNSEEN => model.right_exit,
            Self::Way(_) | Self::Unseen => model.ln_wrong_exit(ways.saturating_sub(1)),
            Self::NotBack(came_by) if came_by != exit => model.right_exit,
            Self::NotBack(_) => model.ln_wrong_exit(1),
            Self::Before(_) => return 0.0,
        };
        report - model.ln_of(ways)
    }
}

/// What an edge from one frontier to another does to the map.
#[derive(Clone, Copy)]
pub(super) struct Closures {
    /// The darts in the face of the first frontier.
    pub(super) face: DartSet,
    /// The vertices that edges connect with it.
    pub(super) connected: VertexSet,
    /// How many frontiers the map has.
    pub(super) frontiers: u8,
}

impl Closures {
    pub(super) const NONE: Self = Self { face: DartSet::EMPTY, connected: VertexSet::EMPTY, frontiers: 0 };

    /// What an edge to a vertex gains if it connects two parts of the map.
    pub(super) fn connect(&self, vertex: u8) -> f32 {
        let is_connected = VertexId::new(vertex).is_some_and(|vertex| self.connected.contains(vertex));
        if is_connected { 0.0 } else { -LN_PART }
    }

    /// Whether an edge to a frontier leaves the genus as it is.
    pub(super) fn keep_genus(&self, exit: u8, frontier: u8, vertex: u8) -> bool {
        exit == UNSEEN
            || self.face.contains(frontier)
            || VertexId::new(vertex).is_none_or(|vertex| !self.connected.contains(vertex))
    }
}

/// What a choice gains: the logarithms of the labels' evidence and of all else.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Gain {
    pub(super) labels: f32,
    pub(super) rest: f32,
}

impl Gain {
    pub(super) fn total(self) -> f32 {
        self.labels + self.rest
    }
}
