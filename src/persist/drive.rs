//! The drive in a snapshot: the way by which the robot left each place of the history, one byte per place.

use super::Persist;
use super::snapshot::{DRIVE_SECTION, Reader, SnapshotError, Writer};
use crate::drive::{Drive, is_departure};

impl<const V: usize, const HISTORY: usize> Persist for Drive<V, HISTORY> {
    const SECTION: u8 = DRIVE_SECTION;

    fn save(&mut self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        let departures = self.departures();
        writer.u16(departures.len() as u16)?;
        for departure in departures {
            writer.u8(departure)?;
        }
        Ok(())
    }

    fn check(&mut self, mut section: Reader<'_>) -> Result<(), SnapshotError> {
        let places = section.u16()?;
        if usize::from(places) > HISTORY {
            return Err(SnapshotError::Capacities);
        }
        for _ in 0..places {
            if !is_departure(section.u8()?) {
                return Err(SnapshotError::Contents);
            }
        }
        section.finish()
    }

    /// After a restore, the drive explores and searches for the Voronoi graph.
    fn restore(&mut self, mut section: Reader<'_>) -> Result<(), SnapshotError> {
        self.check(section)?;
        let places = section.u16()?;
        let departures = section.bytes(places.into())?;
        self.resume(departures.iter().copied());
        Ok(())
    }
}
