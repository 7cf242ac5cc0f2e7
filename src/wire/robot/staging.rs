//! The robot's buffer for snapshots that are transferred over the line, in either direction.

use crate::wire::digest::crc32;
use crate::wire::{Chunk, Outcome, Refusal};

/// A snapshot that is sent or received in chunks, in the caller's buffer. Starting one drops the other.
///
/// Chunks are received in order and may be repeated, so a sender without a reply repeats the chunk. A refused chunk changes
/// nothing. Cost: each chunk is copied once; [`Staging::commit`] computes the CRC of the whole snapshot.
#[derive(Debug)]
pub struct Staging<'buffer> {
    buffer: Option<&'buffer mut [u8]>,
    holds: Holds,
}

#[derive(Clone, Copy, Debug)]
enum Holds {
    Nothing,
    /// A snapshot to be sent.
    Outgoing {
        length: u16,
    },
    /// The first bytes of a snapshot that is received.
    Incoming {
        length: u16,
        crc: u32,
        received: u16,
    },
}

impl<'buffer> Staging<'buffer> {
    /// An empty buffer. Longer snapshots, and those above 65535 bytes, are refused.
    pub const fn new(buffer: &'buffer mut [u8]) -> Self {
        Self { buffer: Some(buffer), holds: Holds::Nothing }
    }

    /// No buffer: every snapshot is too long.
    pub const fn without_buffer() -> Self {
        Self { buffer: None, holds: Holds::Nothing }
    }

    fn buffer(&self) -> &[u8] {
        self.buffer.as_deref().unwrap_or(&[])
    }

    fn buffer_mut(&mut self) -> &mut [u8] {
        self.buffer.as_deref_mut().unwrap_or(&mut [])
    }

    /// Takes a snapshot to be sent and drops the previous contents. `write` gets the buffer and returns the length, `None` if
    /// the snapshot does not fit.
    ///
    /// # Errors
    /// [`Refusal::TooLong`] if the snapshot does not fit.
    pub fn take(&mut self, write: impl FnOnce(&mut [u8]) -> Option<usize>) -> Result<(), Refusal> {
        self.holds = Holds::Nothing;
        let length =
            write(self.buffer_mut()).filter(|&length| length <= self.buffer().len()).ok_or(Refusal::TooLong)?;
        self.holds = Holds::Outgoing { length: u16::try_from(length).map_err(|_| Refusal::TooLong)? };
        Ok(())
    }

    /// The snapshot to be sent; empty if there is none.
    pub fn taken(&self) -> &[u8] {
        let length = if let Holds::Outgoing { length } = self.holds { length } else { 0 };
        self.buffer().get(..usize::from(length)).unwrap_or(&[])
    }

    /// The chunk of the snapshot from an offset on, as an [`Outcome::Snapshot`]; empty at the end.
    ///
    /// # Errors
    /// [`Refusal::NotNow`] if no snapshot was taken, [`Refusal::OutOfRange`] beyond its end.
    pub fn outgoing_chunk(&self, offset: u16) -> Result<Outcome, Refusal> {
        let Holds::Outgoing { length: total } = self.holds else { return Err(Refusal::NotNow) };
        let rest = self.buffer().get(usize::from(offset)..usize::from(total)).ok_or(Refusal::OutOfRange)?;
        Ok(Outcome::Snapshot { total, offset, bytes: Chunk::new(rest.iter().copied()) })
    }

    /// Starts to receive a snapshot of this length with this CRC-32 ISO-HDLC.
    ///
    /// # Errors
    /// [`Refusal::TooLong`] if the buffer is shorter.
    pub fn begin(&mut self, length: u16, crc: u32) -> Result<(), Refusal> {
        if usize::from(length) > self.buffer().len() {
            return Err(Refusal::TooLong);
        }
        self.holds = Holds::Incoming { length, crc, received: 0 };
        Ok(())
    }

    /// Receives a chunk.
    ///
    /// # Errors
    /// [`Refusal::NotNow`] before [`Staging::begin`], [`Refusal::MissingChunk`] if bytes before the chunk are missing, and
    /// [`Refusal::OutOfRange`] beyond the announced length.
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

    /// The whole snapshot, if every byte was received and the CRC is the announced one.
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
    fn a_snapshot_is_sent_in_chunks_any_number_of_times() {
        let mut buffer = [0; 100];
        let mut staging = Staging::new(&mut buffer);
        assert_eq!(staging.outgoing_chunk(0), Err(Refusal::NotNow));
        staging.take(write(70)).unwrap();
        for _ in 0..2 {
            assert_eq!(bytes(staging.outgoing_chunk(0)), (1..=64).collect::<Vec<u8>>());
            assert_eq!(bytes(staging.outgoing_chunk(64)), (65..=70).collect::<Vec<u8>>());
            assert_eq!(bytes(staging.outgoing_chunk(70)), []);
        }
        assert_eq!(staging.outgoing_chunk(71), Err(Refusal::OutOfRange));
        assert_eq!(staging.take(write(101)), Err(Refusal::TooLong));
        assert_eq!(staging.take(|_| Some(101)), Err(Refusal::TooLong));
        assert_eq!(staging.outgoing_chunk(0), Err(Refusal::NotNow));
    }

    #[test]
    fn a_snapshot_is_received_in_order_and_chunks_may_repeat_and_overlap() {
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
    fn a_refusal_preserves_the_received_bytes() {
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
    fn sending_and_receiving_drop_each_other() {
        let mut buffer = [0; 16];
        let mut staging = Staging::new(&mut buffer);
        staging.begin(0, 0).unwrap();
        assert_eq!(staging.commit(), Ok(&[][..]), "the CRC of nothing is 0");
        staging.take(write(5)).unwrap();
        assert_eq!(staging.commit(), Err(Refusal::NotNow));
        staging.begin(5, 0).unwrap();
        assert_eq!(staging.outgoing_chunk(0), Err(Refusal::NotNow));
    }
}
