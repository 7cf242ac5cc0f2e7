//! What a robot does with its store when it starts.

use embedded_storage::nor_flash::NorFlash;

use super::{Kept, Store, StoreError};
use crate::snapshot::{Resume, SnapshotError};
use crate::{Filter, Mapper, MapperConfig, MapperError};

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
    Continued(Kept),
}

/// What a start found in the store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BootReport {
    /// The number of the start, which the robot introduces itself with.
    pub start: u32,
    /// Where the map comes from.
    pub outcome: BootOutcome,
    /// How many snapshots were passed over.
    pub rejected: u8,
    /// Why the last of them was.
    pub why: Option<SnapshotError>,
    /// What was wrong with the store, if anything.
    pub store: Option<StoreError>,
}

/// Starts a mapper and, as the policy says, goes on with the newest snapshot that can be taken: one that is damaged, of another
/// version or other capacities gives way to the one before. The start is counted, and its number takes the place of
/// `config.boot`. Where the store fails the mapper has started afresh.
///
/// # Errors
/// [`MapperError`], as [`Mapper::start`].
pub fn boot<const SONARS: usize, const V: usize, F: Filter<V>, FLASH: NorFlash>(
    mapper: &mut Mapper<SONARS, V, F>,
    config: &MapperConfig<SONARS, F::Config>,
    store: &mut Store<FLASH>,
    buffer: &mut [u8],
    policy: BootPolicy,
) -> Result<BootReport, MapperError> {
    let counted = store.count_start();
    let start = counted.unwrap_or(config.boot);
    mapper.start(&MapperConfig { boot: start, ..*config })?;
    let mut report = BootReport { start, outcome: BootOutcome::Fresh, rejected: 0, why: None, store: counted.err() };
    let resume = match policy {
        BootPolicy::Fresh => return Ok(report),
        BootPolicy::ContinueElsewhere => Resume::Elsewhere,
        BootPolicy::ContinueInPlace => Resume::InPlace,
    };
    report.outcome = BootOutcome::Nothing;
    let mut next = store.newest(buffer);
    loop {
        let kept = match next {
            Ok(Some(kept)) => kept,
            Ok(None) => return Ok(report),
            Err(error) => {
                report.store = Some(error);
                return Ok(report);
            }
        };
        match mapper.restore(buffer.get(..kept.length).unwrap_or(&[]), resume) {
            Ok(()) => {
                report.outcome = BootOutcome::Continued(kept);
                return Ok(report);
            }
            Err(error) => {
                report.rejected = report.rejected.saturating_add(1);
                report.why = Some(error);
            }
        }
        next = store.before(kept, buffer);
    }
}
