//! What a serial line carries: noise, and frames whose checksum is right, so that a fuzzer gets behind it.

use arbitrary::Arbitrary;
use toposlam::wire::{Encoder, FRAME_VERSION, MAX_FRAME_BYTES, Payload, crc32};

/// The longest payload put into a frame: longer than any message, short enough for one block of COBS.
const LONGEST_PAYLOAD: usize = 240;

/// One piece of what the line carries.
#[derive(Arbitrary, Debug)]
pub enum Piece<'a> {
    /// Bytes as they are.
    Bytes(&'a [u8]),
    /// A frame with a right checksum.
    Frame(Frame<'a>),
    /// The same with one byte changed on the way.
    Damaged {
        /// The frame as it was sent.
        frame: Frame<'a>,
        /// Which byte, counted round and round.
        at: u8,
        /// What it is xored with.
        with: u8,
    },
}

/// A frame with a right checksum, whatever its payload.
#[derive(Arbitrary, Debug)]
pub struct Frame<'a> {
    /// Which way it goes.
    pub way: Way,
    /// By how much its number is off the one that is due.
    pub skip: Option<i16>,
    /// What it carries.
    pub payload: &'a [u8],
}

/// Which way a frame goes, and so its first byte.
#[derive(Arbitrary, Clone, Copy, Debug)]
pub enum Way {
    /// A message.
    FromRobot,
    /// A request.
    ToRobot,
    /// A version that need not exist.
    Unknown(u8),
}

/// Makes the bytes of a line, and numbers the frames.
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

    /// The frame of a message or request that is due next.
    pub fn say(&mut self, message: &impl Payload) -> Vec<u8> {
        let mut buffer = [0; MAX_FRAME_BYTES];
        let frame = Encoder::new(self.sequence).encode(message, &mut buffer).expect("there is room for every message");
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

/// Changes one byte, counted round and round.
pub fn damage(bytes: &mut [u8], at: u8, with: u8) {
    let length = bytes.len();
    if let Some(byte) = bytes.get_mut(usize::from(at) % length.max(1)) {
        *byte ^= with;
    }
}
