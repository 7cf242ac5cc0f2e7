//! Restores the newest valid snapshot of the store at the start.

use embedded_storage::nor_flash::NorFlash;

use super::{Store, StoreError, Stored};
use crate::persist::snapshot::{Resume, SnapshotError};

/// Whether the robot restores the newest snapshot at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BootPolicy {
    /// Start with an empty map. The stored snapshots remain until later ones overwrite them.
    Fresh,
    /// Restore the map at an unknown vertex, because the robot may have been moved while it was off. The default.
    #[default]
    ContinueAtUnknownVertex,
    /// Restore the map and the vertex of the snapshot. For a robot that is never moved while it is off and takes a
    /// snapshot whenever it stops.
    ContinueInPlace,
}

/// The origin of the robot's map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BootOutcome {
    /// The map is empty, as the policy demands.
    Fresh,
    /// The map is empty, because no snapshot could be restored.
    Nothing,
    /// The map was restored from a snapshot.
    Continued(Stored),
}

/// The result of [`resume`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BootReport {
    /// The origin of the map.
    pub outcome: BootOutcome,
    /// The number of snapshots that were rejected.
    pub rejected: u8,
    /// The reason of the last rejection.
    pub why: Option<SnapshotError>,
    /// The error of the store, if it failed.
    pub store: Option<StoreError>,
}

/// Restores the newest snapshot that `restore` accepts, if the policy allows it.
///
/// After a damaged snapshot, or one of another version or other capacities, the previous one is tried. The stages must have
/// been started before; they do not change if no snapshot is accepted.
pub fn resume<FLASH: NorFlash>(
    store: &mut Store<FLASH>,
    buffer: &mut [u8],
    policy: BootPolicy,
    mut restore: impl FnMut(&[u8], Resume) -> Result<(), SnapshotError>,
) -> BootReport {
    let mut report = BootReport { outcome: BootOutcome::Fresh, rejected: 0, why: None, store: None };
    let place = match policy {
        BootPolicy::Fresh => return report,
        BootPolicy::ContinueAtUnknownVertex => Resume::AtUnknownVertex,
        BootPolicy::ContinueInPlace => Resume::InPlace,
    };
    report.outcome = BootOutcome::Nothing;
    let mut next = store.newest(buffer);
    loop {
        let stored = match next {
            Ok(Some(stored)) => stored,
            Ok(None) => return report,
            Err(error) => {
                report.store = Some(error);
                return report;
            }
        };
        match restore(buffer.get(..stored.length).unwrap_or(&[]), place) {
            Ok(()) => {
                report.outcome = BootOutcome::Continued(stored);
                return report;
            }
            Err(error) => {
                report.rejected = report.rejected.saturating_add(1);
                report.why = Some(error);
            }
        }
        next = store.before(stored, buffer);
    }
}
