//! Encodes messages and requests as frames: COBS( version | sequence | postcard payload | CRC-32 ) and a closing zero.

use core::fmt;

use super::{Echoes, Payload};
use crate::checksum::CRC;

/// The version of the frames, raised by every change that breaks old listeners; the first byte of every frame. In frames to
/// the robot its top bit is set, so that an echoing line gives no commands.
pub const FRAME_VERSION: u8 = 2;

/// The version and the sequence number.
pub(super) const HEADER_BYTES: usize = 3;
pub(super) const CRC_BYTES: usize = 4;

/// The payload of the largest message, a `Ring`: number of the message, frame index, number of echoes, echoes.
const MAX_PAYLOAD_BYTES: usize = 1 + 5 + 1 + 3 * Echoes::MAX;

/// The largest frame before COBS.
pub(super) const MAX_RAW_BYTES: usize = HEADER_BYTES + MAX_PAYLOAD_BYTES + CRC_BYTES;

/// The largest frame on the wire: COBS adds one byte, and a zero closes the frame.
pub const MAX_FRAME_BYTES: usize = MAX_RAW_BYTES + 2;

const _: () = assert!(MAX_RAW_BYTES < 254, "the short COBS encoder has no block of 254 bytes");

/// Encodes messages or requests as numbered frames.
///
/// A frame that the transmit queue refuses keeps its number, so that the listener detects the gap. Send one zero byte before
/// the first frame, so that noise from the start does not corrupt it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Encoder {
    sequence: u16,
}

impl Encoder {
    /// An encoder whose first frame has this sequence number (0 after a start).
    pub const fn new(first_sequence: u16) -> Self {
        Self { sequence: first_sequence }
    }

    /// Encodes one message or request into `out` and returns the frame, closing zero included.
    ///
    /// A buffer of [`MAX_FRAME_BYTES`] always suffices. Cost: linear in the length; the frame before COBS is on the stack.
    ///
    /// # Errors
    /// [`EncodeError::OutputTooShort`] if the frame does not fit into `out`; the sequence number is not used up.
    pub fn encode<'out>(&mut self, message: &impl Payload, out: &'out mut [u8]) -> Result<&'out [u8], EncodeError> {
        let mut raw = [0; MAX_RAW_BYTES];
        let length = fill_raw(self.sequence, message, &mut raw).ok_or(EncodeError::MessageTooLong)?;
        let raw = raw.get(..length).ok_or(EncodeError::MessageTooLong)?;
        let written = cobs(raw, out).ok_or(EncodeError::OutputTooShort)?;
        self.sequence = self.sequence.wrapping_add(1);
        out.get(..written).ok_or(EncodeError::OutputTooShort)
    }
}

/// Writes header, payload and CRC; returns their length.
fn fill_raw<M: Payload>(sequence: u16, message: &M, raw: &mut [u8; MAX_RAW_BYTES]) -> Option<usize> {
    let [version, low, high, rest @ ..] = raw;
    *version = M::VERSION;
    [*low, *high] = sequence.to_le_bytes();
    let payload = postcard::to_slice(message, rest.get_mut(..MAX_PAYLOAD_BYTES)?).ok()?.len();
    let end = HEADER_BYTES + payload;
    let crc = CRC.checksum(raw.get(..end)?).to_le_bytes();
    for (slot, byte) in raw.iter_mut().skip(end).zip(crc) {
        *slot = byte;
    }
    Some(end + CRC_BYTES)
}

/// Encodes fewer than 254 bytes without zeros and appends a zero; returns the length.
fn cobs(raw: &[u8], out: &mut [u8]) -> Option<usize> {
    let mut slots = out.iter_mut();
    let mut written = 0;
    let mut put = |byte| {
        *slots.next()? = byte;
        written += 1;
        Some(())
    };
    for block in raw.split(|&byte| byte == 0) {
        put(u8::try_from(block.len() + 1).ok()?)?;
        for &byte in block {
            put(byte)?;
        }
    }
    put(0)?;
    Some(written)
}

/// Why a message was not encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EncodeError {
    /// The output buffer is shorter than the frame.
    OutputTooShort,
    /// The message is longer than a frame can be.
    MessageTooLong,
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OutputTooShort => "the output buffer is shorter than the frame",
            Self::MessageTooLong => "the message is longer than a frame can be",
        })
    }
}

impl core::error::Error for EncodeError {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Message;

    #[test]
    fn cobs_gives_the_published_examples() {
        for (raw, stuffed) in [
            (&[][..], &[1, 0][..]),
            (&[0], &[1, 1, 0]),
            (&[0, 0], &[1, 1, 1, 0]),
            (&[0x11, 0x22, 0, 0x33], &[3, 0x11, 0x22, 2, 0x33, 0]),
            (&[0x11, 0, 0, 0], &[2, 0x11, 1, 1, 1, 0]),
        ] {
            let mut out = [0xEE; 8];
            assert_eq!(cobs(raw, &mut out), Some(stuffed.len()));
            assert_eq!(&out[..stuffed.len()], stuffed);
        }
    }

    #[test]
    fn a_short_buffer_is_refused_without_using_a_sequence_number() {
        let message = Message::Edge { a: 1, b: 2, present: true };
        let mut out = [0; MAX_FRAME_BYTES];
        let frame = Encoder::new(7).encode(&message, &mut out).unwrap().to_vec();
        let mut encoder = Encoder::new(7);
        for short in 0..frame.len() {
            assert_eq!(encoder.encode(&message, &mut vec![0; short]), Err(EncodeError::OutputTooShort));
        }
        assert_eq!(encoder.encode(&message, &mut vec![0; frame.len()]), Ok(&frame[..]));
        assert_ne!(encoder.encode(&message, &mut vec![0; frame.len()]), Ok(&frame[..]), "the next number");
    }
}
