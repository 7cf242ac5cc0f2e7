//! What a robot does with the snapshots in its store when it starts.

use embedded_storage::nor_flash::NorFlash;

use super::{Store, StoreError, Stored};
use crate::persist::snapshot::{Resume, SnapshotError};

/// What a robot does with the newest snapshot when it starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BootPolicy {
    /// It starts afresh; the snapshots stay until later ones take their room.
    Fresh,
    /// It goes on with the map, wherever it stands: it may have been carried while it was off. The default.
    #[default]
    ContinueElsewhere,
    /// It goes on where it was when the snapshot was made: for a robot that nobody moves, and that makes a snapshot whenever
    /// it stops.
    ContinueInPlace,
}

/// Where the robot's map comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BootOutcome {
    /// It has none, as it should.
    Fresh,
    /// It has none, for want of a snapshot that could be taken.
    Nothing,
    /// It has that of a snapshot.
    Continued(Stored),
}

/// What a start found in the store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BootReport {
    /// Where the map comes from.
    pub outcome: BootOutcome,
    /// How many snapshots were passed over.
    pub rejected: u8,
    /// Why the last of them was.
    pub why: Option<SnapshotError>,
    /// What was wrong with the store, if anything.
    pub store: Option<StoreError>,
}

/// Goes on, as the policy says, with the newest snapshot that `restore` takes: one that is damaged, of another version or other
/// capacities gives way to the one before. What is restored must have been started afresh, and stays so where nothing can be taken.
pub fn resume<FLASH: NorFlash>(
    store: &mut Store<FLASH>,
    buffer: &mut [u8],
    policy: BootPolicy,
    mut restore: impl FnMut(&[u8], Resume) -> Result<(), SnapshotError>,
) -> BootReport {
    let mut report = BootReport { outcome: BootOutcome::Fresh, rejected: 0, why: None, store: None };
    let place = match policy {
        BootPolicy::Fresh => return report,
        BootPolicy::ContinueElsewhere => Resume::AtUnknownVertex,
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
