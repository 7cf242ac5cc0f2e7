//! Messages received from the emulated firmware.

use std::ops::ControlFlow;

use toposlam::wire::{Decoder, MapReplica, Message, Progress};

/// The decoder, the map replica and the places of the firmware.
pub(super) struct Received {
    pub(super) decoder: Decoder,
    pub(super) replica: MapReplica<64>,
    pub(super) places: Vec<(u32, u16)>,
}

impl Received {
    pub(super) const fn new() -> Self {
        Self { decoder: Decoder::new(), replica: MapReplica::new(), places: Vec::new() }
    }

    /// Decodes bytes of the line, and passes every message to the callback.
    pub(super) fn feed(
        &mut self,
        bytes: &[u8],
        mut on_message: impl FnMut(Message) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut rest = bytes;
        loop {
            rest = match self.decoder.feed(rest) {
                Progress::NeedsMore => return ControlFlow::Continue(()),
                Progress::Error { rest, .. } => rest,
                Progress::Message { header, message, rest } => {
                    self.replica.apply(header, &message);
                    if let Message::Place { place_index, radius_mm, .. } = message {
                        self.places.push((place_index, radius_mm));
                    }
                    on_message(message)?;
                    rest
                }
            };
        }
    }
}
