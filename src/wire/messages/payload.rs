//! The payload of a frame: a message from the robot, or a request to it.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Message, Request, ResetCause};
use crate::wire::FRAME_VERSION;

/// The payload of a frame: a [`Message`] or a [`Request`].
pub trait Payload: Serialize + DeserializeOwned + sealed::Sealed {
    /// The first byte of the frame: the frame version and the direction.
    const VERSION: u8;

    /// The start of the sender, in a `Hello`. It is the one payload that may grow: its unknown last fields are ignored.
    fn start(&self) -> Option<Start>;

    /// The clock of the sender, in a message with one.
    fn clock(&self) -> Option<Clock>;
}

/// What distinguishes a start of a robot from the other starts, and from those of other robots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Start {
    /// The session id.
    pub session: u32,
    /// The number of the start; 0 if the robot does not count them.
    pub boot: u32,
    /// Why the robot started.
    pub reset_cause: ResetCause,
    /// The seed of the random draws.
    pub seed: u64,
}

impl Start {
    /// All zero.
    pub(in crate::wire) const NONE: Self = Self { session: 0, boot: 0, reset_cause: ResetCause::Unknown, seed: 0 };
}

/// A number that ascends from the start of a robot on. It wraps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// The number of the ring frame.
    Frames(u32),
    /// The time since the start, in milliseconds.
    UptimeMs(u32),
}

impl Payload for Message {
    const VERSION: u8 = FRAME_VERSION;

    fn start(&self) -> Option<Start> {
        if let Self::Hello(hello) = self { Some(hello.start()) } else { None }
    }

    fn clock(&self) -> Option<Clock> {
        match self {
            Self::Ring { frame_index, .. } => Some(Clock::Frames(*frame_index)),
            Self::Velocity(velocity) => Some(Clock::Frames(velocity.frame_index)),
            Self::Health(health) => Some(Clock::UptimeMs(health.uptime_ms)),
            _ => None,
        }
    }
}

impl Payload for Request {
    const VERSION: u8 = FRAME_VERSION | 1 << 7;

    fn start(&self) -> Option<Start> {
        None
    }

    fn clock(&self) -> Option<Clock> {
        None
    }
}

mod sealed {
    pub trait Sealed {}

    impl Sealed for super::Message {}
    impl Sealed for super::Request {}
}
