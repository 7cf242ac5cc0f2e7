//! What the drive does, for viewers and for a simulator that drives as it is told.

use serde::{Deserialize, Serialize};

use super::Renamed;
use super::code::codes;

/// Where the drive steers after a ring frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Drive {
    /// The number of the ring frame since the start, from 0; it wraps.
    pub frame_index: u32,
    /// The direction of travel from where the ring's bearings count from, counter-clockwise, in milliradians.
    pub heading_mrad: i16,
    /// The speed in thousandths of the full speed; negative is backwards, 0 stands still.
    pub speed_permille: i16,
    /// The number of what the drive is doing.
    pub state: u8,
}

/// How the way to a vertex goes that the robot was told to go to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Journey {
    /// The vertex to go to.
    pub vertex: u8,
    /// How that goes.
    pub state: JourneyState,
}

impl Journey {
    /// The same under new numbers; `None` when the vertex is gone.
    pub(in crate::wire) fn renamed(self, renamed: &Renamed) -> Option<Self> {
        Some(Self { vertex: renamed.now(self.vertex)?, ..self })
    }
}

codes! {
    /// How a way to a vertex goes. All states but [`JourneyState::Underway`] are its end.
    JourneyState {
        /// A state that is not known here.
        Other => "in a state that is not known here",
        /// The robot is on its way.
        Underway = 1 => "under way",
        /// The robot is there.
        Arrived = 2 => "arrived",
        /// The map changed, and no way leads there any more.
        NoRoute = 3 => "failed: no way leads there any more",
        /// The map changed, and the vertex is gone.
        VertexGone = 4 => "failed: the vertex is gone",
        /// The robot came to other places than the way has, again and again.
        Lost = 5 => "failed: the robot lost its way",
        /// Another command ended it.
        Replaced = 6 => "ended by another command",
    }
}
