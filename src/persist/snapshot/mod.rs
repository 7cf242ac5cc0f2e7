//! Snapshots: the state of a robot as one byte string. `docs/snapshot.md` is the specification.
//!
//! ```text
//! magic "TSLM" | version u16 | length u32 | sections … | CRC-32
//!                                           tag u8 | length u32 | contents
//! ```
//!
//! All numbers are little endian, floats are their bits, and the length is that of the whole snapshot. A reader skips unknown
//! sections. Each [stage](super::Persist) has one section. The filter's uses all the remaining room, so it is the last one.
//!
//! ```
//! use toposlam::persist::snapshot::{Snapshot, Writer};
//!
//! const ODOMETER: u8 = 200;
//! let mut buffer = [0; 64];
//! let mut writer = Writer::new(&mut buffer)?;
//! writer.section(ODOMETER, |section| section.u32(1234))?;
//! let length = writer.finish()?;
//!
//! let snapshot = Snapshot::open(&buffer[..length])?;
//! let mut section = snapshot.section(ODOMETER).unwrap();
//! assert_eq!(section.u32()?, 1234);
//! section.finish()?;
//! # Ok::<(), toposlam::persist::snapshot::SnapshotError>(())
//! ```

use crate::setters::setters;
mod reader;
mod writer;

pub use reader::{Reader, Snapshot};
pub use writer::Writer;

use crate::checksum::CRC;
use core::fmt;

/// The version of the layout. A snapshot of another version is refused.
pub const SNAPSHOT_VERSION: u16 = 3;

/// The tag of the filter's section.
pub const FILTER_SECTION: u8 = 1;

/// The tag of the section with the names of vertices.
pub const NAMES_SECTION: u8 = 2;

/// The first byte of the filter's section: the kind of filter.
pub(crate) const ROBUST: u8 = 1;
/// As [`ROBUST`], of the paper's filter.
pub(crate) const PAPER: u8 = 2;
/// As [`ROBUST`], of the ordered filter.
pub(crate) const ORDERED: u8 = 3;

/// The first bytes of every snapshot.
const MAGIC: [u8; 4] = *b"TSLM";

/// Magic, version and length.
const HEADER_BYTES: usize = 10;
/// Tag and length of a section.
const SECTION_HEADER_BYTES: usize = 5;
const CRC_BYTES: usize = 4;

/// The length of a snapshot with one section, without the contents of the section.
pub(crate) const FRAME_BYTES: usize = HEADER_BYTES + SECTION_HEADER_BYTES + CRC_BYTES;

/// Why a snapshot could not be written or read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SnapshotError {
    /// The buffer has no room for it.
    Full,
    /// The snapshot is cut short.
    TooShort,
    /// The bytes are not a snapshot, or the CRC is wrong.
    Corrupt,
    /// The snapshot has another version of the layout.
    Version {
        /// The version of the snapshot.
        found: u16,
    },
    /// The snapshot was written by another kind of filter, or one with other capacities.
    Capacities,
    /// The contents are invalid.
    Contents,
}

impl fmt::Display for SnapshotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Full => f.write_str("the buffer has no room for a snapshot"),
            Self::TooShort => f.write_str("the snapshot is cut short"),
            Self::Corrupt => f.write_str("the bytes are not a snapshot, or the CRC is wrong"),
            Self::Version { found } => write!(f, "the snapshot has version {found}, not {SNAPSHOT_VERSION}"),
            Self::Capacities => f.write_str("the snapshot is of a filter with other capacities"),
            Self::Contents => f.write_str("the contents of the snapshot are invalid"),
        }
    }
}

impl core::error::Error for SnapshotError {}

/// Where the robot is when a snapshot is restored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resume {
    /// Where it was when the snapshot was taken: the next place is a neighbour of the last one.
    InPlace,
    /// At an unknown vertex: it may have been moved since. The next place starts a sequence.
    AtUnknownVertex,
}

/// When snapshots are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct SnapshotPolicy {
    /// A snapshot is stored every this many places; 0 for never. Default 25.
    pub every_places: u16,
}

impl SnapshotPolicy {
    setters! {
        with_every_places, every_places: u16;
    }

    /// The defaults.
    pub const DEFAULT: Self = Self { every_places: 25 };

    /// Whether a snapshot is due after the place of this number, counted from 0.
    pub const fn is_due(&self, place_index: u32) -> bool {
        match place_index.wrapping_add(1).checked_rem(self.every_places as u32) {
            Some(rest) => rest == 0,
            None => false,
        }
    }
}

impl Default for SnapshotPolicy {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_sections(buffer: &mut [u8]) -> Result<usize, SnapshotError> {
        let mut writer = Writer::new(buffer)?;
        writer.section(7, |section| section.u16(0x0102))?;
        writer.section(9, |section| {
            section.u8(1)?;
            section.u64(2)?;
            section.f32(-0.5)
        })?;
        writer.finish()
    }

    #[test]
    fn sections_are_found_by_tag_and_unknown_tags_are_none() {
        let mut buffer = [0xAA; 100];
        let length = two_sections(&mut buffer).unwrap();
        assert_eq!(length, HEADER_BYTES + 2 * SECTION_HEADER_BYTES + 2 + 13 + CRC_BYTES);
        // Bytes after the snapshot are ignored.
        for bytes in [&buffer[..length], &buffer[..]] {
            let snapshot = Snapshot::open(bytes).unwrap();
            let mut nine = snapshot.section(9).unwrap();
            assert_eq!((nine.u8(), nine.u64(), nine.f32()), (Ok(1), Ok(2), Ok(-0.5)));
            assert_eq!(nine.finish(), Ok(()));
            let mut seven = snapshot.section(7).unwrap();
            assert_eq!(seven.finish(), Err(SnapshotError::Contents), "unread bytes are an error");
            assert_eq!((seven.u16(), seven.u8()), (Ok(0x0102), Err(SnapshotError::TooShort)));
            assert!(snapshot.section(8).is_none());
        }
    }

    #[test]
    fn a_snapshot_needs_exactly_its_length() {
        let mut buffer = [0; 100];
        let length = two_sections(&mut buffer).unwrap();
        for room in 0..length {
            assert_eq!(two_sections(&mut buffer[..room]), Err(SnapshotError::Full), "{room}");
        }
        assert_eq!(two_sections(&mut buffer[..length]), Ok(length));
    }

    #[test]
    fn a_section_without_room_is_omitted() {
        let mut buffer = [0; HEADER_BYTES + SECTION_HEADER_BYTES + 1 + CRC_BYTES];
        let mut writer = Writer::new(&mut buffer).unwrap();
        writer.section(1, |section| section.u8(5)).unwrap();
        assert_eq!(writer.section(2, |_| Ok(())), Err(SnapshotError::Full));
        let length = writer.finish().unwrap();
        assert_eq!(Snapshot::open(&buffer[..length]).unwrap().section(1).unwrap().u8(), Ok(5));
    }

    #[test]
    fn every_flipped_bit_and_every_missing_byte_is_detected() {
        let mut buffer = [0; 100];
        let length = two_sections(&mut buffer).unwrap();
        for bit in 0..8 * length {
            let mut damaged = buffer;
            damaged[bit / 8] ^= 1 << (bit % 8);
            let opened = Snapshot::open(&damaged[..length]);
            assert!(matches!(opened, Err(SnapshotError::Corrupt | SnapshotError::TooShort)), "{bit}");
        }
        for kept in 0..length {
            assert_eq!(Snapshot::open(&buffer[..kept]).err(), Some(SnapshotError::TooShort), "{kept}");
        }
    }

    #[test]
    fn another_version_is_refused() {
        let mut buffer = [0; 100];
        let length = two_sections(&mut buffer).unwrap();
        buffer[4] = 1;
        let crc = CRC.checksum(&buffer[..length - CRC_BYTES]);
        buffer[length - CRC_BYTES..length].copy_from_slice(&crc.to_le_bytes());
        assert_eq!(Snapshot::open(&buffer[..length]).err(), Some(SnapshotError::Version { found: 1 }));
    }

    #[test]
    fn a_snapshot_is_due_at_the_configured_interval() {
        let policy = SnapshotPolicy { every_places: 3 };
        assert!((0..7).map(|place| policy.is_due(place)).eq([false, false, true, false, false, true, false]));
        assert!(!(0..7).any(|place| SnapshotPolicy { every_places: 0 }.is_due(place)));
    }
}
