//! The receiving end of the robot: bytes in, at most one command per turn of the main loop.

use crate::fault::{FaultCounters, FaultKind};
use crate::wire::decoder::Progress;
use crate::wire::{Command, Decoder, Outcome, Reply, Request};

/// Decodes the bytes of the robot's receive line, and executes at most one command per turn of the main loop.
///
/// The work is bounded at any rate of input. [`Inbox::take`] takes amortised constant time per byte (a closing zero costs the
/// CRC of its frame). Each turn decodes at most [`Inbox::BYTES_PER_TURN`] bytes and drops the rest. One request can wait for
/// its turn. Bytes that are not a request are counted as `WireCorrupt`, requests without room and bytes beyond those of a turn as
/// `CommandFlood`.
///
/// A repeated request gets the same reply and is not executed again. Memory: about 450 bytes.
///
/// ```
/// use toposlam::wire::{Command, Encoder, Inbox, MAX_FRAME_BYTES, Outcome, Reply, Request};
///
/// let mut buffer = [0; MAX_FRAME_BYTES];
/// let request = Request { id: 7, command: Command::Pause { on: true } };
/// let bytes = Encoder::new(0).encode(&request, &mut buffer)?;
///
/// let mut inbox = Inbox::new();
/// let mut paused = false;
/// for _ in 0..2 {
///     bytes.iter().for_each(|&byte| inbox.take(byte));
///     let reply = inbox.turn(|command| {
///         assert_eq!(*command, Command::Pause { on: true });
///         assert!(!paused, "it is executed once");
///         paused = true;
///         Outcome::Done
///     });
///     assert_eq!(reply, Some(Reply { request: 7, outcome: Outcome::Done }));
/// }
/// # Ok::<(), toposlam::wire::EncodeError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Inbox {
    decoder: Decoder<Request>,
    /// Whether a request waits, and which. A `None` is not all zero and would move a `static` inbox out of `.bss`.
    is_waiting: bool,
    waiting: Request,
    /// Whether a request was executed, the last one, and the reply to it.
    has_answered: bool,
    answered: (Request, Outcome),
    taken: u16,
    faults: FaultCounters,
}

impl Inbox {
    /// The most bytes that are decoded per turn: room for two of the longest frames and some noise.
    pub const BYTES_PER_TURN: u16 = 256;

    /// An empty inbox.
    pub const fn new() -> Self {
        const NONE: Request = Request { id: 0, command: Command::Info };
        Self {
            decoder: Decoder::new(),
            is_waiting: false,
            waiting: NONE,
            has_answered: false,
            answered: (NONE, Outcome::Done),
            taken: 0,
            faults: FaultCounters::new(),
        }
    }

    /// Decodes a byte of the line.
    pub fn take(&mut self, byte: u8) {
        if self.taken >= Self::BYTES_PER_TURN {
            if self.taken == Self::BYTES_PER_TURN {
                self.taken = self.taken.saturating_add(1);
                self.faults.record(FaultKind::CommandFlood);
            }
            return;
        }
        self.taken = self.taken.saturating_add(1);
        match self.decoder.feed(&[byte]) {
            Progress::NeedsMore => {}
            Progress::Error { .. } => self.faults.record(FaultKind::WireCorrupt),
            Progress::Message { message: request, .. } if !self.is_waiting => {
                self.is_waiting = true;
                self.waiting = request;
            }
            Progress::Message { message: request, .. } if self.waiting == request => {}
            Progress::Message { .. } => self.faults.record(FaultKind::CommandFlood),
        }
    }

    /// Ends a turn of the main loop: executes the waiting command, unless it repeats the last one, and returns the reply to
    /// send. The next bytes belong to the next turn.
    pub fn turn(&mut self, execute: impl FnOnce(&Command) -> Outcome) -> Option<Reply> {
        self.taken = 0;
        if !core::mem::take(&mut self.is_waiting) {
            return None;
        }
        let request = self.waiting;
        if !self.has_answered || self.answered.0 != request {
            let outcome = execute(&request.command);
            if matches!(outcome, Outcome::Refused(_)) {
                self.faults.record(FaultKind::CommandRefused);
            }
            self.has_answered = true;
            self.answered = (request, outcome);
        }
        let (_, outcome) = self.answered;
        Some(Reply { request: request.id, outcome })
    }

    /// The faults of the received bytes since the start.
    pub const fn faults(&self) -> &FaultCounters {
        &self.faults
    }
}

impl Default for Inbox {
    fn default() -> Self {
        Self::new()
    }
}
