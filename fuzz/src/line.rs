//! The bytes of a serial line: noise, and frames with a valid CRC, so that a fuzzer reaches the code behind the check.

use arbitrary::Arbitrary;
use toposlam::wire::{Encoder, FRAME_VERSION, MAX_FRAME_BYTES, Payload, crc32};

/// The longest payload of a frame: longer than any message, short enough for one COBS block.
const LONGEST_PAYLOAD: usize = 240;

/// One piece of the line's bytes.
#[derive(Arbitrary, Debug)]
pub enum Piece<'a> {
    /// Arbitrary bytes.
    Bytes(&'a [u8]),
    /// A frame with a valid CRC.
    Frame(Frame<'a>),
    /// A frame with one byte changed by the line.
    Damaged {
        /// The frame as it was sent.
        frame: Frame<'a>,
        /// The index of the byte, modulo the length.
        at: u8,
        /// The value that is xored to it.
        with: u8,
    },
}

/// A frame with a valid CRC and an arbitrary payload.
#[derive(Arbitrary, Debug)]
pub struct Frame<'a> {
    /// The direction.
    pub way: Way,
    /// The offset of its sequence number from the next one.
    pub skip: Option<i16>,
    /// The payload.
    pub payload: &'a [u8],
}

/// The direction of a frame, given by its first byte.
#[derive(Arbitrary, Clone, Copy, Debug)]
pub enum Way {
    /// A message.
    FromRobot,
    /// A request.
    ToRobot,
    /// An arbitrary frame version.
    Unknown(u8),
}

/// Produces the bytes of a line and numbers the frames.
#[derive(Default)]
pub struct Line {
    sequence: u16,
}

impl Line {
    /// The bytes of a piece.
    pub fn carry(&mut self, piece: &Piece<'_>) -> Vec<u8> {
        match piece {
            Piece::Bytes(bytes) => bytes.to_vec(),
            Piece::Frame(frame) => self.frame(frame),
            Piece::Damaged { frame, at, with } => {
                let mut bytes = self.frame(frame);
                damage(&mut bytes, *at, *with);
                bytes
            }
        }
    }

    /// The frame of a message or request with the next sequence number.
    pub fn say(&mut self, message: &impl Payload) -> Vec<u8> {
        let mut buffer = [0; MAX_FRAME_BYTES];
        let frame = Encoder::new(self.sequence).encode(message, &mut buffer).expect("every message fits");
        self.sequence = self.sequence.wrapping_add(1);
        frame.to_vec()
    }

    fn frame(&mut self, frame: &Frame<'_>) -> Vec<u8> {
        let sequence = self.sequence.wrapping_add_signed(frame.skip.unwrap_or(0));
        self.sequence = sequence.wrapping_add(1);
        let version = match frame.way {
            Way::FromRobot => FRAME_VERSION,
            Way::ToRobot => FRAME_VERSION | 0x80,
            Way::Unknown(version) => version,
        };
        let mut raw = vec![version];
        raw.extend(sequence.to_le_bytes());
        raw.extend(frame.payload.iter().take(LONGEST_PAYLOAD));
        raw.extend(crc32(&raw).to_le_bytes());
        let mut bytes = Vec::new();
        for block in raw.split(|&byte| byte == 0) {
            bytes.push(block.len() as u8 + 1);
            bytes.extend(block);
        }
        bytes.push(0);
        bytes
    }
}

/// Changes one byte; the index is taken modulo the length.
pub fn damage(bytes: &mut [u8], at: u8, with: u8) {
    let length = bytes.len();
    if let Some(byte) = bytes.get_mut(usize::from(at) % length.max(1)) {
        *byte ^= with;
    }
}
