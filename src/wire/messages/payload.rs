//! The payload of a frame: a message from the robot, or a request to it.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Message, Request};
use crate::wire::FRAME_VERSION;

/// The payload of a frame: a [`Message`] or a [`Request`].
pub trait Payload: Serialize + DeserializeOwned + sealed::Sealed {
    /// The first byte of the frame: the frame version and the direction.
    const VERSION: u8;

    /// The number of the sender's start, in a `Hello`.
    fn boot(&self) -> Option<u32>;
}

impl Payload for Message {
    const VERSION: u8 = FRAME_VERSION;

    fn boot(&self) -> Option<u32> {
        if let Self::Hello(hello) = self { Some(hello.boot) } else { None }
    }
}

impl Payload for Request {
    const VERSION: u8 = FRAME_VERSION | 1 << 7;

    fn boot(&self) -> Option<u32> {
        None
    }
}

mod sealed {
    pub trait Sealed {}

    impl Sealed for super::Message {}
    impl Sealed for super::Request {}
}
