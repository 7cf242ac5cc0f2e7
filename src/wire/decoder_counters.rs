//! The counts of a decoder.

/// The counts of a decoder; every count saturates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DecoderCounters {
    /// Decoded messages.
    pub messages: u32,
    /// Frames that are missing according to the sequence numbers (a frame that arrived corrupt is one of them).
    pub lost: u32,
    /// Well-formed frames with a wrong CRC.
    pub corrupt: u32,
    /// Truncated frames.
    pub cut: u32,
    /// Frames longer than any message.
    pub too_long: u32,
    /// Intact frames of another frame version.
    pub unknown_version: u32,
    /// Intact frames with an unknown message.
    pub unknown_message: u32,
    /// Restarts of the sender.
    pub restarts: u32,
}

impl DecoderCounters {
    /// Damaged frames: corrupt, truncated and too long ones.
    #[must_use]
    pub const fn damaged(&self) -> u32 {
        self.corrupt.saturating_add(self.cut).saturating_add(self.too_long)
    }

    /// Intact frames that this version does not decode.
    #[must_use]
    pub const fn unknown(&self) -> u32 {
        self.unknown_version.saturating_add(self.unknown_message)
    }
}
