//! The robust filter in a snapshot: the state that cannot be recomputed from the places and the paths.
//!
//! A snapshot holds the path and the marginalised statistics of each hypothesis; map, statistics and evidence are
//! recomputed. Saving recomputes them in the running filter too and ends a fold under way, so that it equals a restored one bit for
//! bit.

mod hypothesis;
mod parts;

use crate::fault::FaultCounters;
use crate::filter::beam::Ranked as _;
use crate::filter::{RobustConfig, RobustFilter};
use crate::persist::Persist;
use crate::persist::snapshot::{FILTER_SECTION, FRAME_BYTES, ROBUST, Reader, SnapshotError, Writer};
use parts::{STATISTICS_BYTES, path_bytes, row_bytes};

/// Bounds of the noise scale 2 σ², in steps².
const SCALES: core::ops::RangeInclusive<f32> = 0.1..=1e6;

/// The fixed fields of the section, without history, map and hypotheses.
#[derive(Clone, Copy)]
struct Head {
    config: RobustConfig,
    seed: u64,
    observed: u32,
    refinements: u32,
    localise_only: bool,
    scale: f32,
}

const HEAD_BYTES: usize = 4 + 10 + 8 + 4 + 4 + 1 + 4;

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// The largest snapshot of this filter alone in bytes: `N` hypotheses of `V` vertices and a full history.
    pub const SNAPSHOT_BYTES: usize = {
        let counted = V * (STATISTICS_BYTES + row_bytes(V));
        let published = 1 + V * (11 + row_bytes(V)) + 4 + 4 + 1 + V + path_bytes(V, HISTORY);
        let hypothesis = hypothesis::FIXED_BYTES + path_bytes(V, HISTORY) + counted;
        FRAME_BYTES + HEAD_BYTES + 2 + 3 * HISTORY + published + 1 + hypothesis::KEPT_BYTES + counted + N * hypothesis
    };
}

impl<const N: usize, const V: usize, const HISTORY: usize> Persist for RobustFilter<N, V, HISTORY> {
    const SECTION: u8 = FILTER_SECTION;

    /// Writes settings, places, the published map, and as many hypotheses as fit, the best first.
    ///
    /// A buffer of [`RobustFilter::SNAPSHOT_BYTES`] has room for all of them; the restored filter then equals this one, bit for
    /// bit. Cost: one pass over the history for each hypothesis.
    ///
    /// # Errors
    /// [`SnapshotError::Full`] if there is no room for the best hypothesis.
    #[inline(never)]
    fn save(&mut self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        self.make_canonical();
        self.head().save::<V, HISTORY>(writer)?;
        self.history.save(writer)?;
        self.save_told(writer)?;
        let count_at = writer.mark();
        writer.u8(0)?;
        let len = self.history.len();
        if self.localise_only
            && let Some(best) = self.beam.best()
        {
            best.save_kept(writer)?;
        }
        writer.as_many_as_fit(count_at, self.beam.iter(), |writer, hypothesis| {
            hypothesis.save(writer, len, self.localise_only)
        })
    }

    /// Replaces the state by that of a section, settings and seed included; fault counts restart from 0.
    ///
    /// Everything is read and checked before anything changes. Cost: two passes over the bytes, and one over the history for
    /// each hypothesis.
    ///
    /// # Errors
    /// [`SnapshotError::Capacities`] for another kind of filter or other capacities, [`SnapshotError::TooShort`], or
    /// [`SnapshotError::Contents`]; the filter does not change then.
    fn restore(&mut self, section: Reader<'_>) -> Result<(), SnapshotError> {
        self.check(section)?;
        self.read(section, true)
    }

    /// Cost: one pass over the bytes.
    fn check(&mut self, section: Reader<'_>) -> Result<(), SnapshotError> {
        self.read(section, false)
    }
}

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// Reads a section. `kept` replaces the state; otherwise only the draft changes.
    #[inline(never)]
    fn read(&mut self, mut from: Reader<'_>, kept: bool) -> Result<(), SnapshotError> {
        let head = Head::read::<N, V, HISTORY>(&mut from)?;
        let len = usize::from(from.u16()?);
        if len > HISTORY || (head.observed as usize) < len {
            return Err(SnapshotError::Contents);
        }
        if kept {
            self.take_head(&head);
        }
        self.history.read(&mut from, len, kept)?;
        let told_vertices = self.read_told(&mut from, len, kept)?;
        let count = from.u8()?;
        if count == 0 || count > head.config.hypotheses {
            return Err(SnapshotError::Contents);
        }
        self.draft.clear();
        if head.localise_only {
            self.draft.read_kept(&mut from)?;
            if self.draft.vertices != told_vertices {
                return Err(SnapshotError::Contents);
            }
        }
        for _ in 0..count {
            self.draft.read(&mut from, len, head.localise_only)?;
            if kept {
                if !head.localise_only {
                    self.draft.recount(&self.model, &self.history);
                }
                self.beam.append(&self.draft);
            }
        }
        if kept {
            self.worst = self.find_worst_ngram();
        }
        from.finish()
    }

    /// Brings the filter into the state that its own snapshot restores.
    fn make_canonical(&mut self) {
        self.fold.cancel();
        if self.localise_only {
            // The map is fixed, so every hypothesis has the map of the best one.
            if let Some(best) = self.beam.best() {
                self.draft.clone_from(best);
                let kept = &self.draft;
                self.beam.for_each(|hypothesis| hypothesis.keep_map_of(kept));
            }
        } else {
            let (model, history) = (&self.model, &self.history);
            self.beam.for_each(|hypothesis| hypothesis.recount(model, history));
            self.beam.sort();
        }
    }

    fn head(&self) -> Head {
        Head {
            config: self.config,
            seed: self.seed,
            observed: self.observed,
            refinements: self.refinements,
            localise_only: self.localise_only,
            scale: self.model.scale,
        }
    }

    fn take_head(&mut self, head: &Head) {
        self.config = head.config;
        self.seed = head.seed;
        self.observed = head.observed;
        self.refinements = head.refinements;
        self.localise_only = head.localise_only;
        self.model.configure(&head.config);
        self.model.set_scale(head.scale);
        self.beam.start_empty();
        self.fold.cancel();
        self.faults = FaultCounters::new();
    }
}

impl Head {
    fn save<const V: usize, const HISTORY: usize>(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.u8(ROBUST)?;
        writer.u8(V as u8)?;
        writer.u16(HISTORY as u16)?;
        writer.u8(self.config.hypotheses)?;
        writer.u16(self.config.noise_mm)?;
        writer.u16(self.config.resolution_mm)?;
        writer.u8(self.config.moves)?;
        writer.u16(self.config.wrong_turn_permille)?;
        writer.u16(self.config.wrong_degree_permille)?;
        writer.u64(self.seed)?;
        writer.u32(self.observed)?;
        writer.u32(self.refinements)?;
        writer.u8(self.localise_only.into())?;
        writer.f32(self.scale)
    }

    fn read<const N: usize, const V: usize, const HISTORY: usize>(
        from: &mut Reader<'_>,
    ) -> Result<Self, SnapshotError> {
        let capacities = (from.u8()?, usize::from(from.u8()?), usize::from(from.u16()?));
        if capacities != (ROBUST, V, HISTORY) {
            return Err(SnapshotError::Capacities);
        }
        let config = RobustConfig {
            hypotheses: from.u8()?,
            noise_mm: from.u16()?,
            resolution_mm: from.u16()?,
            moves: from.u8()?,
            wrong_turn_permille: from.u16()?,
            wrong_degree_permille: from.u16()?,
        };
        if usize::from(config.hypotheses) > N {
            return Err(SnapshotError::Capacities);
        }
        config.check(N).map_err(|_| SnapshotError::Contents)?;
        let (seed, observed, refinements) = (from.u64()?, from.u32()?, from.u32()?);
        let localise_only = match from.u8()? {
            0 => false,
            1 => true,
            _ => return Err(SnapshotError::Contents),
        };
        let scale = from.f32()?;
        if !SCALES.contains(&scale) {
            return Err(SnapshotError::Contents);
        }
        Ok(Self { config, seed, observed, refinements, localise_only, scale })
    }
}
