//! The expected behaviour of the inbox and of the staging buffer.

use toposlam::wire::{Command, Decoder, Inbox, Outcome, Progress, Refusal, Request, crc32};

use super::STAGING_BYTES;

/// The specified state of an inbox and of a staging buffer.
#[derive(Default)]
pub(crate) struct Expected {
    pub(crate) decoder: Decoder<Request>,
    pub(crate) answered: Option<(Request, Outcome)>,
    pub(crate) staged: Staged,
    pub(crate) corrupt: u32,
    pub(crate) flood: u32,
    pub(crate) refused: u32,
}

impl Expected {
    /// The request to execute after the bytes of one turn.
    pub(crate) fn receive(&mut self, bytes: &[u8]) -> Option<Request> {
        let most = usize::from(Inbox::BYTES_PER_TURN);
        self.flood += u32::from(bytes.len() > most);
        let mut rest = &bytes[..bytes.len().min(most)];
        let mut due = None;
        loop {
            match self.decoder.feed(rest) {
                Progress::NeedsMore => return due,
                Progress::Error { rest: behind, .. } => {
                    self.corrupt += 1;
                    rest = behind;
                }
                Progress::Message { message, rest: behind, .. } => {
                    self.flood += u32::from(*due.get_or_insert(message) != message);
                    rest = behind;
                }
            }
        }
    }

    /// At most one request is executed, unless it repeats the last one; its reply holds the outcome.
    pub(crate) fn judge(
        &mut self,
        due: Option<Request>,
        executed: Option<(Command, Outcome)>,
        reply: Option<(u16, Outcome)>,
    ) {
        assert_eq!(reply.map(|(id, _)| id), due.map(|request| request.id));
        let (Some(request), Some((_, outcome))) = (due, reply) else {
            assert_eq!(executed, None);
            return;
        };
        match (self.answered, executed) {
            (Some(answered), None) => assert_eq!((request, outcome), answered, "the same request gets the same reply"),
            (answered, executed) => {
                assert_eq!(executed, Some((request.command, outcome)));
                assert!(answered.is_none_or(|(last, _)| last != request), "{request:?} was executed twice");
                self.refused += u32::from(matches!(outcome, Outcome::Refused(_)));
                self.answered = Some((request, outcome));
            }
        }
    }
}

/// The contents of a staging buffer.
#[derive(Debug, Default)]
pub(crate) enum Staged {
    #[default]
    Nothing,
    Outgoing,
    Incoming {
        length: u16,
        crc: u32,
        received: Vec<u8>,
    },
}

impl Staged {
    pub(crate) fn begin(&mut self, length: u16, crc: u32) -> Result<(), Refusal> {
        if usize::from(length) > STAGING_BYTES {
            return Err(Refusal::TooLong);
        }
        *self = Self::Incoming { length, crc, received: Vec::new() };
        Ok(())
    }

    pub(crate) fn chunk(&mut self, offset: u16, bytes: &[u8]) -> Result<(), Refusal> {
        let Self::Incoming { length, received, .. } = self else { return Err(Refusal::NotNow) };
        let (offset, end) = (usize::from(offset), usize::from(offset) + bytes.len());
        if offset > received.len() {
            return Err(Refusal::MissingChunk);
        }
        if end > usize::from(*length) {
            return Err(Refusal::OutOfRange);
        }
        received.resize(received.len().max(end), 0);
        received[offset..end].copy_from_slice(bytes);
        Ok(())
    }

    pub(crate) fn commit(&self) -> Result<&[u8], Refusal> {
        match self {
            Self::Incoming { length, received, .. } if received.len() < usize::from(*length) => {
                Err(Refusal::MissingChunk)
            }
            Self::Incoming { crc, received, .. } if crc32(received) == *crc => Ok(received),
            Self::Incoming { .. } => Err(Refusal::BadCrc),
            _ => Err(Refusal::NotNow),
        }
    }
}
