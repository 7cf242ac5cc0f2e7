//! What the drive does: its velocity commands, and the status of a goal.

use serde::{Deserialize, Serialize};

use super::Remapped;
use super::code::codes;

/// The velocity command of one ring frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Velocity {
    /// The number of the ring frame since the start, from 0; it wraps.
    pub frame_index: u32,
    /// The direction of travel in milliradians, counter-clockwise from the zero of the ring's bearings.
    pub heading_mrad: i16,
    /// The speed in thousandths of full speed; negative is backwards, 0 is standstill.
    pub speed_permille: i16,
    /// The number of the drive's state, a [`DriveState`](crate::drive::DriveState).
    pub state: u8,
}

/// The status of a [`GoTo`](super::Command::GoTo) goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GoalStatus {
    /// The vertex to reach.
    pub vertex: u8,
    /// Whether the robot has reached it.
    pub state: GoalState,
}

impl GoalStatus {
    /// The same goal under the new vertex ids; `None` if the vertex was removed.
    pub(in crate::wire) fn remapped(self, remapped: &Remapped) -> Option<Self> {
        Some(Self { vertex: remapped.now(self.vertex)?, ..self })
    }
}

codes! {
    /// The state of a goal. Every state but [`GoalState::Active`] is final.
    GoalState {
        /// A state that this version does not know.
        Other => "in an unknown state",
        /// The robot is on its way.
        Active = 1 => "active",
        /// The robot is at the vertex.
        Reached = 2 => "reached",
        /// The map changed: no path leads to the vertex any more.
        NoRoute = 3 => "failed: no path leads there any more",
        /// The map changed: the vertex was removed.
        VertexRemoved = 4 => "failed: the vertex was removed",
        /// The robot visited many more places than the map has vertices and did not reach the vertex.
        TimedOut = 5 => "failed: timed out",
        /// Another command replaced the goal.
        Replaced = 6 => "replaced by another command",
    }
}
