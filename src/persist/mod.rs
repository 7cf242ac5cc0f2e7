//! State that survives a restart: snapshots of the map, and the flash that stores them.
//!
//! This module depends on the stages whose state it saves; no stage depends on this module.

mod mapper;
#[cfg(feature = "wire")]
mod names;
mod ordered_filter;
mod paper_filter;
mod robust_filter;
pub mod snapshot;
#[cfg(feature = "store")]
pub mod store;

use snapshot::{Reader, SnapshotError, Writer};

/// A stage whose state is one section of a snapshot.
///
/// ```
/// use toposlam::persist::snapshot::{Reader, Snapshot, SnapshotError, Writer};
/// use toposlam::persist::Persist;
///
/// /// A stage of an application.
/// #[derive(Debug, Default, PartialEq)]
/// struct Odometer {
///     distance_mm: u32,
/// }
///
/// impl Persist for Odometer {
///     const SECTION: u8 = 200;
///
///     fn save(&mut self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
///         writer.u32(self.distance_mm)
///     }
///
///     fn check(&mut self, mut section: Reader<'_>) -> Result<(), SnapshotError> {
///         section.u32()?;
///         section.finish()
///     }
///
///     fn restore(&mut self, mut section: Reader<'_>) -> Result<(), SnapshotError> {
///         self.check(section)?;
///         self.distance_mm = section.u32()?;
///         Ok(())
///     }
/// }
///
/// let mut buffer = [0; 64];
/// let mut writer = Writer::new(&mut buffer)?;
/// writer.stage(&mut Odometer { distance_mm: 1234 })?;
/// let length = writer.finish()?;
///
/// let mut restored = Odometer::default();
/// Snapshot::open(&buffer[..length])?.restore(&mut restored)?;
/// assert_eq!(restored, Odometer { distance_mm: 1234 });
/// # Ok::<(), SnapshotError>(())
/// ```
///
/// Every filter implements it.
pub trait Persist {
    /// The tag of the section. The library uses tags below 128.
    const SECTION: u8;

    /// Writes the contents of the section, and brings the stage into the state that [`Persist::restore`] gives.
    ///
    /// # Errors
    /// [`SnapshotError::Full`] if there is no room.
    fn save(&mut self, writer: &mut Writer<'_>) -> Result<(), SnapshotError>;

    /// Checks that [`Persist::restore`] accepts a section. The state of the stage does not change.
    ///
    /// # Errors
    /// [`SnapshotError`] if the section is invalid.
    fn check(&mut self, section: Reader<'_>) -> Result<(), SnapshotError>;

    /// Replaces the state of the stage by that of a section.
    ///
    /// # Errors
    /// As [`Persist::check`]; the state does not change then.
    fn restore(&mut self, section: Reader<'_>) -> Result<(), SnapshotError>;
}
