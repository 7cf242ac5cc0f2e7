//! A push decoder: bytes in pieces of any length become messages.

use core::fmt;
use core::marker::PhantomData;

use super::frame::{CRC_BYTES, HEADER_BYTES, MAX_RAW_BYTES};
use super::{Clock, DecoderCounters, Message, Payload, Start};
use crate::checksum::CRC;

/// The result of feeding bytes to a decoder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress<'bytes, M = Message> {
    /// All bytes are consumed; no frame is complete.
    NeedsMore,
    /// One message is complete.
    Message {
        /// The header of its frame.
        header: Header,
        /// The message.
        message: M,
        /// The bytes that were not consumed: feed them next.
        rest: &'bytes [u8],
    },
    /// The bytes between two zeros were not a message. They were counted and dropped.
    Error {
        /// The error.
        error: DecodeError,
        /// The bytes that were not consumed: feed them next.
        rest: &'bytes [u8],
    },
}

/// The header of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// The sequence number of the frame.
    pub sequence: u16,
    /// How the sequence number relates to the previous ones.
    pub arrival: Arrival,
}

/// How the sequence number of a frame relates to the previous ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// The first intact frame.
    First,
    /// The next number.
    InOrder,
    /// Frames are missing before this one.
    AfterGap {
        /// The number of missing frames.
        lost: u16,
    },
    /// One of the last 64 numbers: the frame was repeated or overtaken.
    Late,
    /// The sender has restarted, or it is another one: nothing from before is valid.
    Restart,
}

/// Decodes the bytes of a serial line, in pieces of any length, into messages; on the robot, into
/// [`Request`](super::Request)s.
///
/// It never blocks and never reads beyond a complete frame. The next zero byte ends every frame, valid or not, so that
/// damage never spreads beyond a frame and its neighbour. Memory: 200 bytes.
///
/// ```
/// use toposlam::wire::{Decoder, Encoder, MAX_FRAME_BYTES, Message, Progress};
/// let mut out = [0; MAX_FRAME_BYTES];
/// let sent = Message::Edge { a: 1, b: 2, present: true };
/// let mut bytes = Encoder::new(0).encode(&sent, &mut out)?;
/// let mut decoder: Decoder = Decoder::new();
/// loop {
///     match decoder.feed(bytes) {
///         Progress::NeedsMore => break,
///         Progress::Message { message, rest, .. } => {
///             assert_eq!(message, sent);
///             bytes = rest;
///         }
///         Progress::Error { error, rest } => {
///             eprintln!("{error}");
///             bytes = rest;
///         }
///     }
/// }
/// # Ok::<(), toposlam::wire::EncodeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Decoder<M = Message> {
    raw: [u8; MAX_RAW_BYTES],
    length: usize,
    /// Remaining bytes of the COBS block.
    block_left: u8,
    /// Whether the frame has at least one byte.
    begun: bool,
    too_long: bool,
    last_sequence: Option<u16>,
    /// Whether the line was reopened after the last message.
    reopened: bool,
    /// Whether the start of the sender is known, and which. A `None` is not all zero and would move a `static` decoder out of `.bss`.
    knows_start: bool,
    start: Start,
    clocks: Clocks,
    counters: DecoderCounters,
    hands_out: PhantomData<fn() -> M>,
}

impl<M: Payload> Decoder<M> {
    /// A sequence number at most this far back is a late frame, not a restart.
    const LATE_WINDOW: u16 = 64;

    /// A decoder without input.
    pub const fn new() -> Self {
        Self {
            raw: [0; MAX_RAW_BYTES],
            length: 0,
            block_left: 0,
            begun: false,
            too_long: false,
            last_sequence: None,
            reopened: false,
            knows_start: false,
            start: Start::NONE,
            clocks: Clocks::NONE,
            counters: DecoderCounters {
                messages: 0,
                lost: 0,
                corrupt: 0,
                cut: 0,
                too_long: 0,
                unknown_version: 0,
                unknown_message: 0,
                restarts: 0,
            },
            hands_out: PhantomData,
        }
    }

    /// The counts so far.
    pub const fn counters(&self) -> DecoderCounters {
        self.counters
    }

    /// Prepares for a reopened line: drops an incomplete frame. No frame is late on a new line, so a number that does not
    /// follow the last one shows a restart.
    pub fn reconnected(&mut self) {
        self.drop_frame();
        self.begun = false;
        self.reopened = true;
    }

    /// Consumes bytes up to the end of the next frame. Call it with the rest until it returns [`Progress::NeedsMore`].
    pub fn feed<'bytes>(&mut self, bytes: &'bytes [u8]) -> Progress<'bytes, M> {
        let mut rest = bytes;
        while let Some((&byte, tail)) = rest.split_first() {
            rest = tail;
            if byte != 0 {
                self.take(byte);
                continue;
            }
            if !core::mem::take(&mut self.begun) {
                continue;
            }
            let frame = self.finish();
            self.drop_frame();
            return match frame {
                Ok((sequence, None)) => {
                    self.pass_over(sequence);
                    self.count(DecodeError::UnknownMessage);
                    Progress::Error { error: DecodeError::UnknownMessage, rest }
                }
                Ok((sequence, Some(message))) => {
                    let arrival = self.arrival(sequence, &message);
                    bump(&mut self.counters.messages, 1);
                    Progress::Message { header: Header { sequence, arrival }, message, rest }
                }
                Err(error) => {
                    self.count(error);
                    Progress::Error { error, rest }
                }
            };
        }
        Progress::NeedsMore
    }

    fn drop_frame(&mut self) {
        self.length = 0;
        self.block_left = 0;
        self.too_long = false;
    }

    /// Decodes one non-zero byte.
    fn take(&mut self, byte: u8) {
        if self.block_left > 0 {
            self.block_left -= 1;
            self.push(byte);
        } else {
            if self.begun {
                self.push(0);
            }
            self.block_left = byte.saturating_sub(1);
        }
        self.begun = true;
    }

    fn push(&mut self, byte: u8) {
        match self.raw.get_mut(self.length) {
            Some(slot) => {
                *slot = byte;
                self.length += 1;
            }
            None => self.too_long = true,
        }
    }

    /// Decodes the bytes between two zeros: the sequence number, and the message if it is known.
    fn finish(&self) -> Result<(u16, Option<M>), DecodeError> {
        if self.too_long {
            return Err(DecodeError::TooLong);
        }
        let raw = self.raw.get(..self.length).unwrap_or(&[]);
        let Some((body, crc)) = raw.split_last_chunk::<CRC_BYTES>() else {
            return Err(DecodeError::Cut);
        };
        if self.block_left > 0 {
            return Err(DecodeError::Cut);
        }
        if CRC.checksum(body) != u32::from_le_bytes(*crc) {
            return Err(DecodeError::Corrupt);
        }
        let Some(([version, low, high], payload)) = body.split_first_chunk::<HEADER_BYTES>() else {
            return Err(DecodeError::Cut);
        };
        if *version != M::VERSION {
            return Err(DecodeError::UnknownVersion { version: *version });
        }
        let sequence = u16::from_le_bytes([*low, *high]);
        match postcard::take_from_bytes::<M>(payload) {
            Ok((message, rest)) if rest.is_empty() || message.start().is_some() => Ok((sequence, Some(message))),
            _ => Ok((sequence, None)),
        }
    }

    /// Counts an unknown message as received, so that the messages of a newer sender do not look like lost frames. After a gap
    /// the number stays: the next known message reports the gap.
    fn pass_over(&mut self, sequence: u16) {
        if self.last_sequence.is_some_and(|last| last.wrapping_add(1) == sequence) {
            self.last_sequence = Some(sequence);
        }
    }

    fn arrival(&mut self, sequence: u16, message: &M) -> Arrival {
        let has_other_start = match message.start() {
            Some(start) => {
                let last = core::mem::replace(&mut self.start, start);
                core::mem::replace(&mut self.knows_start, true) && last != start
            }
            None => false,
        };
        let is_reopened = core::mem::take(&mut self.reopened);
        let mut arrival = match self.last_sequence.map(|last| sequence.wrapping_sub(last)) {
            None => Arrival::First,
            Some(_) if has_other_start => Arrival::Restart,
            Some(1) => Arrival::InOrder,
            Some(ahead @ 2..=0x7FFF) => Arrival::AfterGap { lost: ahead - 1 },
            Some(ahead) if ahead.wrapping_neg() < Self::LATE_WINDOW && !is_reopened => return Arrival::Late,
            Some(_) => Arrival::Restart,
        };
        self.last_sequence = Some(sequence);
        if let Some(clock) = message.clock()
            && self.clocks.run_backwards(clock)
        {
            arrival = Arrival::Restart;
        }
        match arrival {
            Arrival::AfterGap { lost } => bump(&mut self.counters.lost, lost.into()),
            Arrival::Restart => {
                bump(&mut self.counters.restarts, 1);
                self.clocks = Clocks::NONE;
                // The next Hello is that of the new start.
                self.knows_start = message.start().is_some();
                self.start = message.start().unwrap_or(Start::NONE);
            }
            Arrival::First | Arrival::InOrder | Arrival::Late => {}
        }
        if let Some(clock) = message.clock() {
            self.clocks.set(clock);
        }
        arrival
    }

    fn count(&mut self, error: DecodeError) {
        let counters = &mut self.counters;
        bump(
            match error {
                DecodeError::Corrupt => &mut counters.corrupt,
                DecodeError::Cut => &mut counters.cut,
                DecodeError::TooLong => &mut counters.too_long,
                DecodeError::UnknownVersion { .. } => &mut counters.unknown_version,
                DecodeError::UnknownMessage => &mut counters.unknown_message,
            },
            1,
        );
    }
}

impl<M: Payload> Default for Decoder<M> {
    fn default() -> Self {
        Self::new()
    }
}

/// The last clocks of the sender. They ascend until it restarts.
#[derive(Clone, Copy, Debug)]
struct Clocks {
    frames: Option<u32>,
    uptime_ms: Option<u32>,
}

impl Clocks {
    const NONE: Self = Self { frames: None, uptime_ms: None };

    fn run_backwards(&self, clock: Clock) -> bool {
        let (last, now) = match clock {
            Clock::Frames(now) => (self.frames, now),
            Clock::UptimeMs(now) => (self.uptime_ms, now),
        };
        last.is_some_and(|last| now.wrapping_sub(last) > u32::MAX / 2)
    }

    fn set(&mut self, clock: Clock) {
        match clock {
            Clock::Frames(now) => self.frames = Some(now),
            Clock::UptimeMs(now) => self.uptime_ms = Some(now),
        }
    }
}

fn bump(count: &mut u32, by: u32) {
    *count = count.saturating_add(by);
}

/// Why the bytes between two zeros are not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DecodeError {
    /// The CRC is wrong.
    Corrupt,
    /// The frame ends too early.
    Cut,
    /// The frame is longer than any message.
    TooLong,
    /// The frame is intact and has an unknown version.
    UnknownVersion {
        /// The version of the frame.
        version: u8,
    },
    /// The frame is intact and holds an unknown message; the sender may be newer.
    UnknownMessage,
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Corrupt => f.write_str("the CRC of the frame is wrong"),
            Self::Cut => f.write_str("the frame ends too early"),
            Self::TooLong => f.write_str("the frame is longer than any message"),
            Self::UnknownVersion { version } => {
                write!(f, "the frame has version {version}, which this listener does not know")
            }
            Self::UnknownMessage => f.write_str("the frame holds no message that this listener knows"),
        }
    }
}

impl core::error::Error for DecodeError {}
