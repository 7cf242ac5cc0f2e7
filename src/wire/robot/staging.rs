//! The robot's one buffer for snapshots that cross the line, either way.

use crate::wire::digest::crc32;
use crate::wire::{Chunk, Outcome, Refusal};

/// A snapshot on its way out, or on its way in, in a buffer of the caller's. One drops the other.
///
/// Incoming pieces come in order and may come again, so a sender that hears no reply repeats the piece and goes on. A piece
/// that is refused leaves what was received as it was. Cost: a piece is copied once; [`Staging::commit`] takes the CRC of
/// the whole.
#[derive(Debug)]
pub struct Staging<'buffer> {
    buffer: Option<&'buffer mut [u8]>,
    holds: Holds,
}

#[derive(Clone, Copy, Debug)]
enum Holds {
    Nothing,
    /// A snapshot that was taken.
    Outgoing {
        length: u16,
    },
    /// The first bytes of a snapshot to be restored.
    Incoming {
        length: u16,
        crc: u32,
        received: u16,
    },
}

impl<'buffer> Staging<'buffer> {
    /// Nothing in a buffer; a snapshot that is longer, or longer than 65535 bytes, is refused.
    pub const fn new(buffer: &'buffer mut [u8]) -> Self {
        Self { buffer: Some(buffer), holds: Holds::Nothing }
    }

    /// Without a buffer every snapshot is too long.
    pub const fn without_buffer() -> Self {
        Self { buffer: None, holds: Holds::Nothing }
    }

    fn buffer(&self) -> &[u8] {
        self.buffer.as_deref().unwrap_or(&[])
    }

    fn buffer_mut(&mut self) -> &mut [u8] {
        self.buffer.as_deref_mut().unwrap_or(&mut [])
    }

    /// Takes a snapshot, and drops what the buffer held: `write` gets the buffer and tells how many bytes it wrote, `None` when it could not.
    ///
    /// # Errors
    /// [`Refusal::TooLong`] when it could not, or says that it wrote more than there is room for.
    pub fn take(&mut self, write: impl FnOnce(&mut [u8]) -> Option<usize>) -> Result<(), Refusal> {
        self.holds = Holds::Nothing;
        let length =
            write(self.buffer_mut()).filter(|&length| length <= self.buffer().len()).ok_or(Refusal::TooLong)?;
        self.holds = Holds::Outgoing { length: u16::try_from(length).map_err(|_| Refusal::TooLong)? };
        Ok(())
    }

    /// The whole snapshot that was taken; nothing when none was.
    pub fn taken(&self) -> &[u8] {
        let length = if let Holds::Outgoing { length } = self.holds { length } else { 0 };
        self.buffer().get(..usize::from(length)).unwrap_or(&[])
    }

    /// The piece of the snapshot that was taken from a byte on; an [`Outcome::Snapshot`], empty at the end.
    ///
    /// # Errors
    /// [`Refusal::NotNow`] when none was taken, [`Refusal::OutOfRange`] beyond its end.
    pub fn piece(&self, offset: u16) -> Result<Outcome, Refusal> {
        let Holds::Outgoing { length: total } = self.holds else { return Err(Refusal::NotNow) };
        let rest = self.buffer().get(usize::from(offset)..usize::from(total)).ok_or(Refusal::OutOfRange)?;
        Ok(Outcome::Snapshot { total, offset, bytes: Chunk::new(rest.iter().copied()) })
    }

    /// Gets ready for a snapshot of so many bytes with this CRC-32 ISO-HDLC.
    ///
    /// # Errors
    /// [`Refusal::TooLong`] when the buffer is shorter.
    pub fn begin(&mut self, length: u16, crc: u32) -> Result<(), Refusal> {
        if usize::from(length) > self.buffer().len() {
            return Err(Refusal::TooLong);
        }
        self.holds = Holds::Incoming { length, crc, received: 0 };
        Ok(())
    }

    /// Takes a piece of it.
    ///
    /// # Errors
    /// [`Refusal::NotNow`] before [`Staging::begin`], [`Refusal::MissingChunk`] when bytes before the piece were not
    /// received, and [`Refusal::OutOfRange`] when it reaches beyond the end.
    pub fn chunk(&mut self, offset: u16, bytes: &[u8]) -> Result<(), Refusal> {
        let Holds::Incoming { length, received, .. } = &mut self.holds else { return Err(Refusal::NotNow) };
        if offset > *received {
            return Err(Refusal::MissingChunk);
        }
        let end = usize::from(offset).saturating_add(bytes.len());
        let end = u16::try_from(end).ok().filter(|end| end <= length).ok_or(Refusal::OutOfRange)?;
        *received = end.max(*received);
        let slots = self.buffer_mut().get_mut(usize::from(offset)..usize::from(end)).ok_or(Refusal::OutOfRange)?;
        for (slot, &byte) in slots.iter_mut().zip(bytes) {
            *slot = byte;
        }
        Ok(())
    }

    /// The whole snapshot, when every byte was received and their CRC is the one that was told.
    ///
    /// # Errors
    /// [`Refusal::NotNow`] before [`Staging::begin`], [`Refusal::MissingChunk`] and [`Refusal::BadCrc`].
    pub fn commit(&self) -> Result<&[u8], Refusal> {
        let Holds::Incoming { length, crc, received } = self.holds else { return Err(Refusal::NotNow) };
        if received < length {
            return Err(Refusal::MissingChunk);
        }
        let bytes = self.buffer().get(..usize::from(length)).ok_or(Refusal::MissingChunk)?;
        if crc32(bytes) == crc { Ok(bytes) } else { Err(Refusal::BadCrc) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes a snapshot of 1, 2, 3, ….
    fn write(length: usize) -> impl FnOnce(&mut [u8]) -> Option<usize> {
        move |buffer| {
            for (slot, byte) in buffer.get_mut(..length)?.iter_mut().zip(1..) {
                *slot = byte;
            }
            Some(length)
        }
    }

    fn bytes(outcome: Result<Outcome, Refusal>) -> Vec<u8> {
        match outcome {
            Ok(Outcome::Snapshot { bytes, .. }) => bytes.as_slice().to_vec(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_snapshot_goes_out_in_pieces_as_often_as_it_is_asked_for() {
        let mut buffer = [0; 100];
        let mut staging = Staging::new(&mut buffer);
        assert_eq!(staging.piece(0), Err(Refusal::NotNow));
        staging.take(write(70)).unwrap();
        for _ in 0..2 {
            assert_eq!(bytes(staging.piece(0)), (1..=64).collect::<Vec<u8>>());
            assert_eq!(bytes(staging.piece(64)), (65..=70).collect::<Vec<u8>>());
            assert_eq!(bytes(staging.piece(70)), []);
        }
        assert_eq!(staging.piece(71), Err(Refusal::OutOfRange));
        assert_eq!(staging.take(write(101)), Err(Refusal::TooLong));
        assert_eq!(staging.take(|_| Some(101)), Err(Refusal::TooLong));
        assert_eq!(staging.piece(0), Err(Refusal::NotNow));
    }

    #[test]
    fn a_snapshot_comes_in_in_order_and_pieces_may_repeat_and_overlap() {
        let snapshot: Vec<u8> = (0..100).collect();
        let mut buffer = [0; 100];
        let mut staging = Staging::new(&mut buffer);
        staging.begin(100, crc32(&snapshot)).unwrap();
        for (from, to) in [(0, 40), (0, 40), (20, 60), (60, 100), (10, 30)] {
            staging.chunk(from, &snapshot[usize::from(from)..to]).unwrap();
        }
        assert_eq!(staging.commit(), Ok(&snapshot[..]));
        assert_eq!(staging.commit(), Ok(&snapshot[..]), "again after a lost reply");
    }

    #[test]
    fn what_is_refused_leaves_what_was_received() {
        let snapshot = [7; 10];
        let mut buffer = [0; 16];
        let mut staging = Staging::new(&mut buffer);
        assert_eq!(staging.chunk(0, &snapshot), Err(Refusal::NotNow));
        assert_eq!(staging.commit(), Err(Refusal::NotNow));
        staging.begin(10, crc32(&snapshot)).unwrap();
        assert_eq!(staging.begin(17, 0), Err(Refusal::TooLong));
        staging.chunk(0, &snapshot[..5]).unwrap();
        assert_eq!(staging.chunk(6, &snapshot[6..]), Err(Refusal::MissingChunk));
        assert_eq!(staging.chunk(5, &snapshot[..6]), Err(Refusal::OutOfRange));
        assert_eq!(staging.chunk(u16::MAX, &snapshot), Err(Refusal::MissingChunk));
        assert_eq!(staging.commit(), Err(Refusal::MissingChunk));
        staging.chunk(5, &snapshot[5..]).unwrap();
        assert_eq!(staging.commit(), Ok(&snapshot[..]));
        staging.chunk(3, &[8]).unwrap();
        assert_eq!(staging.commit(), Err(Refusal::BadCrc));
    }

    #[test]
    fn the_way_out_and_the_way_in_drop_each_other() {
        let mut buffer = [0; 16];
        let mut staging = Staging::new(&mut buffer);
        staging.begin(0, 0).unwrap();
        assert_eq!(staging.commit(), Ok(&[][..]), "the CRC of nothing is 0");
        staging.take(write(5)).unwrap();
        assert_eq!(staging.commit(), Err(Refusal::NotNow));
        staging.begin(5, 0).unwrap();
        assert_eq!(staging.piece(0), Err(Refusal::NotNow));
    }
}
