//! Reads a snapshot from a byte string.

use super::{CRC, CRC_BYTES, HEADER_BYTES, MAGIC, SNAPSHOT_VERSION, SnapshotError};
use crate::persist::Persist;

/// A snapshot with a valid CRC and version.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<'a> {
    sections: Reader<'a>,
    length: usize,
}

impl<'a> Snapshot<'a> {
    /// Opens a snapshot; bytes after its end are ignored.
    ///
    /// # Errors
    /// [`SnapshotError::TooShort`], [`SnapshotError::Corrupt`], [`SnapshotError::Version`], or [`SnapshotError::Contents`]
    /// if the lengths of the sections do not match the length of the snapshot.
    #[inline(never)]
    pub fn open(bytes: &'a [u8]) -> Result<Self, SnapshotError> {
        let mut header = Reader { bytes };
        if header.bytes(MAGIC.len())? != MAGIC {
            return Err(SnapshotError::Corrupt);
        }
        let found = header.u16()?;
        let length = header.u32()? as usize;
        let Some(end) = length.checked_sub(CRC_BYTES).filter(|&end| end >= HEADER_BYTES) else {
            return Err(SnapshotError::Corrupt);
        };
        let whole = bytes.get(..end).ok_or(SnapshotError::TooShort)?;
        let mut behind = Reader { bytes: bytes.get(end..).unwrap_or(&[]) };
        if behind.u32()? != CRC.checksum(whole) {
            return Err(SnapshotError::Corrupt);
        }
        if found != SNAPSHOT_VERSION {
            return Err(SnapshotError::Version { found });
        }
        let sections = Reader { bytes: whole.get(HEADER_BYTES..).unwrap_or(&[]) };
        let mut rest = sections;
        while !rest.bytes.is_empty() {
            rest.section().map_err(|_| SnapshotError::Contents)?;
        }
        Ok(Self { sections, length })
    }

    /// The first section with a tag.
    pub fn section(&self, tag: u8) -> Option<Reader<'a>> {
        let mut rest = self.sections;
        loop {
            let (found, contents) = rest.section().ok()?;
            if found == tag {
                return Some(contents);
            }
        }
    }

    /// Restores a stage from its section.
    ///
    /// # Errors
    /// [`SnapshotError::Contents`] if the snapshot has no such section; else as [`Persist::restore`].
    pub fn restore<S: Persist>(&self, stage: &mut S) -> Result<(), SnapshotError> {
        stage.restore(self.section(S::SECTION).ok_or(SnapshotError::Contents)?)
    }

    /// The length of the whole snapshot in bytes.
    pub const fn length(&self) -> usize {
        self.length
    }
}

/// Reads the contents of a section from front to back.
#[derive(Clone, Copy, Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    fn section(&mut self) -> Result<(u8, Self), SnapshotError> {
        let tag = self.u8()?;
        let length = self.u32()? as usize;
        Ok((tag, Self { bytes: self.bytes(length)? }))
    }

    /// Reads `count` bytes.
    ///
    /// # Errors
    /// [`SnapshotError::TooShort`] if fewer are left.
    #[inline(never)]
    pub fn bytes(&mut self, count: usize) -> Result<&'a [u8], SnapshotError> {
        let (read, rest) = self.bytes.split_at_checked(count).ok_or(SnapshotError::TooShort)?;
        self.bytes = rest;
        Ok(read)
    }

    fn array<const BYTES: usize>(&mut self) -> Result<[u8; BYTES], SnapshotError> {
        let (read, rest) = self.bytes.split_first_chunk().ok_or(SnapshotError::TooShort)?;
        self.bytes = rest;
        Ok(*read)
    }

    /// Reads one byte.
    ///
    /// # Errors
    /// As [`Reader::bytes`].
    #[inline(never)]
    pub fn u8(&mut self) -> Result<u8, SnapshotError> {
        self.array().map(|[byte]| byte)
    }

    /// Reads a number of 16 bits.
    ///
    /// # Errors
    /// As [`Reader::bytes`].
    #[inline(never)]
    pub fn u16(&mut self) -> Result<u16, SnapshotError> {
        self.array().map(u16::from_le_bytes)
    }

    /// Reads a number of 32 bits.
    ///
    /// # Errors
    /// As [`Reader::bytes`].
    #[inline(never)]
    pub fn u32(&mut self) -> Result<u32, SnapshotError> {
        self.array().map(u32::from_le_bytes)
    }

    /// Reads a number of 64 bits.
    ///
    /// # Errors
    /// As [`Reader::bytes`].
    pub fn u64(&mut self) -> Result<u64, SnapshotError> {
        self.array().map(u64::from_le_bytes)
    }

    /// Reads the bits of a float, which may be infinite or NaN.
    ///
    /// # Errors
    /// As [`Reader::bytes`].
    pub fn f32(&mut self) -> Result<f32, SnapshotError> {
        self.u32().map(f32::from_bits)
    }

    /// Checks that everything was read.
    ///
    /// # Errors
    /// [`SnapshotError::Contents`] if bytes are left.
    pub fn finish(&self) -> Result<(), SnapshotError> {
        if self.bytes.is_empty() { Ok(()) } else { Err(SnapshotError::Contents) }
    }
}
