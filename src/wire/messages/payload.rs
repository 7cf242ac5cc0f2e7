//! What a frame can hold: a message from the robot, or a request to it.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Message, Request};
use crate::wire::FRAME_VERSION;

/// What a frame can hold: [`Message`] and [`Request`], and nothing else.
pub trait Payload: Serialize + DeserializeOwned + sealed::Sealed {
    /// The first byte of the frame: the frame version, and which way the frame goes.
    const VERSION: u8;

    /// The number of the sender's start, when it introduces itself.
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
