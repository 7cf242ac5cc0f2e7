//! Writes a snapshot into a buffer.

use super::{CRC, CRC_BYTES, HEADER_BYTES, MAGIC, SNAPSHOT_VERSION, SnapshotError};
use crate::persist::Persist;

/// Writes a snapshot into a buffer of the caller, section by section.
#[derive(Debug)]
pub struct Writer<'a> {
    bytes: &'a mut [u8],
    len: usize,
}

impl<'a> Writer<'a> {
    /// Starts a snapshot.
    ///
    /// # Errors
    /// [`SnapshotError::Full`] when the buffer has no room for one without sections.
    pub fn new(buffer: &'a mut [u8]) -> Result<Self, SnapshotError> {
        let mut writer = Self { bytes: buffer, len: 0 };
        writer.bytes(&MAGIC)?;
        writer.u16(SNAPSHOT_VERSION)?;
        // Placeholder of the length.
        writer.u32(0)?;
        Ok(writer)
    }

    /// Writes a section. On an error the section is omitted and more sections can follow.
    ///
    /// # Errors
    /// Errors of `contents`; [`SnapshotError::Full`] if there is no room.
    pub fn section(
        &mut self,
        tag: u8,
        contents: impl FnOnce(&mut Self) -> Result<(), SnapshotError>,
    ) -> Result<(), SnapshotError> {
        let mark = self.mark();
        let written = self.try_section(tag, contents);
        if written.is_err() {
            self.rewind(mark);
        }
        written
    }

    /// Writes the section of a stage. On an error the section is omitted and more sections can follow.
    ///
    /// # Errors
    /// As [`Persist::save`].
    pub fn stage<S: Persist>(&mut self, stage: &mut S) -> Result<(), SnapshotError> {
        self.section(S::SECTION, |section| stage.save(section))
    }

    fn try_section(
        &mut self,
        tag: u8,
        contents: impl FnOnce(&mut Self) -> Result<(), SnapshotError>,
    ) -> Result<(), SnapshotError> {
        self.u8(tag)?;
        let length_at = self.mark();
        self.u32(0)?;
        let begin = self.mark();
        contents(self)?;
        let length = self.mark().saturating_sub(begin) as u32;
        self.overwrite(length_at, &length.to_le_bytes());
        Ok(())
    }

    /// Finishes the snapshot and returns its length in bytes.
    ///
    /// # Errors
    /// None; the `Result` is for the slice arithmetic.
    pub fn finish(mut self) -> Result<usize, SnapshotError> {
        let length = self.len + CRC_BYTES;
        self.overwrite(HEADER_BYTES - 4, &(length as u32).to_le_bytes());
        let crc = CRC.checksum(self.bytes.get(..self.len).ok_or(SnapshotError::Full)?);
        let to = self.bytes.get_mut(self.len..length).ok_or(SnapshotError::Full)?;
        for (to, byte) in to.iter_mut().zip(crc.to_le_bytes()) {
            *to = byte;
        }
        Ok(length)
    }

    /// Writes some bytes.
    ///
    /// # Errors
    /// [`SnapshotError::Full`] when there is no room; nothing is written then.
    #[inline(never)]
    pub fn bytes(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        let end = self.len.saturating_add(bytes.len());
        // The CRC always has room.
        if end.saturating_add(CRC_BYTES) > self.bytes.len() {
            return Err(SnapshotError::Full);
        }
        let to = self.bytes.get_mut(self.len..end).ok_or(SnapshotError::Full)?;
        for (to, &byte) in to.iter_mut().zip(bytes) {
            *to = byte;
        }
        self.len = end;
        Ok(())
    }

    /// Writes one byte.
    ///
    /// # Errors
    /// As [`Writer::bytes`].
    #[inline(never)]
    pub fn u8(&mut self, value: u8) -> Result<(), SnapshotError> {
        self.bytes(&[value])
    }

    /// Writes a number of 16 bits.
    ///
    /// # Errors
    /// As [`Writer::bytes`].
    #[inline(never)]
    pub fn u16(&mut self, value: u16) -> Result<(), SnapshotError> {
        self.bytes(&value.to_le_bytes())
    }

    /// Writes a number of 32 bits.
    ///
    /// # Errors
    /// As [`Writer::bytes`].
    #[inline(never)]
    pub fn u32(&mut self, value: u32) -> Result<(), SnapshotError> {
        self.bytes(&value.to_le_bytes())
    }

    /// Writes a number of 64 bits.
    ///
    /// # Errors
    /// As [`Writer::bytes`].
    pub fn u64(&mut self, value: u64) -> Result<(), SnapshotError> {
        self.bytes(&value.to_le_bytes())
    }

    /// Writes the bits of a float.
    ///
    /// # Errors
    /// As [`Writer::bytes`].
    pub fn f32(&mut self, value: f32) -> Result<(), SnapshotError> {
        self.u32(value.to_bits())
    }

    /// Writes as many items as fit, in order, and their number over the byte at `count_at`.
    ///
    /// # Errors
    /// Errors of `save`; [`SnapshotError::Full`] if there is no room for the first item.
    pub(crate) fn as_many_as_fit<T>(
        &mut self,
        count_at: usize,
        items: impl Iterator<Item = T>,
        mut save: impl FnMut(&mut Self, T) -> Result<(), SnapshotError>,
    ) -> Result<(), SnapshotError> {
        let mut count = 0_u8;
        for item in items {
            let mark = self.mark();
            match save(self, item) {
                Ok(()) => count = count.saturating_add(1),
                Err(SnapshotError::Full) if count > 0 => {
                    self.rewind(mark);
                    break;
                }
                Err(error) => return Err(error),
            }
        }
        self.overwrite(count_at, &[count]);
        Ok(())
    }

    /// The position of the next byte.
    pub(crate) fn mark(&self) -> usize {
        self.len
    }

    /// Removes the bytes written since a mark.
    pub(crate) fn rewind(&mut self, mark: usize) {
        self.len = self.len.min(mark);
    }

    /// Overwrites the bytes at a mark.
    pub(crate) fn overwrite(&mut self, mark: usize, bytes: &[u8]) {
        for (to, &byte) in self.bytes.iter_mut().take(self.len).skip(mark).zip(bytes) {
            *to = byte;
        }
    }
}
