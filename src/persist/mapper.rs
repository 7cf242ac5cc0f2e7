//! The mapper in a snapshot: the state of its filter. The place detector is reset by a restore.

use super::Persist;
use super::snapshot::{Resume, Snapshot, SnapshotError, Writer};
use crate::filter::Filter;
use crate::mapper::Mapper;

impl<const SONARS: usize, const V: usize, F: Filter<V> + Persist> Mapper<SONARS, V, F> {
    /// Writes a snapshot of the mapper alone and returns its length in bytes.
    ///
    /// It holds as many hypotheses as fit, the best first; the published map does not change. For a
    /// [`RobustFilter`](crate::RobustFilter), `RobustFilter::SNAPSHOT_BYTES` is room for all of them. Call it between two
    /// places.
    ///
    /// # Errors
    /// [`SnapshotError::Full`] if there is no room for the best hypothesis.
    pub fn snapshot(&mut self, buffer: &mut [u8]) -> Result<usize, SnapshotError> {
        let mut writer = Writer::new(buffer)?;
        self.save(&mut writer)?;
        writer.finish()
    }

    /// Writes the mapper's section of a snapshot. It uses all the remaining room, so the other stages come first.
    ///
    /// # Errors
    /// As [`Mapper::snapshot`].
    pub fn save(&mut self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.stage(&mut self.filter)
    }

    /// Replaces the state of the filter by that of a snapshot, its settings and seed included. The mapper must have been
    /// started.
    ///
    /// # Errors
    /// [`SnapshotError`] if the snapshot is invalid; the mapper does not change then.
    pub fn restore(&mut self, bytes: &[u8], resume: Resume) -> Result<(), SnapshotError> {
        Snapshot::open(bytes)?.restore(&mut self.filter)?;
        self.starts_sequence = resume == Resume::AtUnknownVertex;
        Ok(())
    }
}
