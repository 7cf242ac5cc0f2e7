//! The ordered filter in a snapshot: the places of the history, the published map, and the hypotheses.
//!
//! Every hypothesis is saved as it is, so that a restored filter continues bit for bit. A repair under way is not saved;
//! saving ends it in the running filter too.

mod hypothesis;
mod published;

use crate::fault::FaultCounters;
use crate::filter::ordered::OrderedEntry;
use crate::filter::{OrderedConfig, OrderedFilter};
use crate::persist::Persist;
use crate::persist::snapshot::{FILTER_SECTION, FRAME_BYTES, ORDERED, Reader, SnapshotError, Writer};
use crate::place::Fingerprint;

/// No way, no vertex.
const NOWHERE: u8 = u8::MAX;

/// The bounds of the standard deviation of a label in steps.
const NOISE_STEPS: core::ops::RangeInclusive<f32> = 0.1..=1000.0;

/// Kind, capacities, settings, seed, places, refinements, noise, the first place that was localised only.
const HEAD_BYTES: usize = 5 + 12 + 8 + 4 + 4 + 4 + 2;

/// While the filter maps.
const MAPS: u16 = u16::MAX;
const ENTRY_BYTES: usize = 12;

/// The fixed fields of the section.
struct Head {
    config: OrderedConfig,
    seed: u64,
    observed: u32,
    refined: u32,
    noise_steps: f32,
    localised_from: Option<u16>,
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// The largest snapshot of this filter alone in bytes: `N` hypotheses of `V` vertices and `D` ways, and a full history.
    pub const SNAPSHOT_BYTES: usize = FRAME_BYTES
        + HEAD_BYTES
        + 2
        + T * ENTRY_BYTES
        + published::bytes(V, D, T)
        + hypothesis::bytes(V, D, 0)
        + 1
        + N * hypothesis::bytes(V, D, T);
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> Persist for OrderedFilter<N, V, D, T> {
    const SECTION: u8 = FILTER_SECTION;

    /// Writes settings, places, the published map, and as many hypotheses as fit, the best first.
    ///
    /// A buffer of [`OrderedFilter::SNAPSHOT_BYTES`] has room for all of them; the restored filter then equals this one, bit for
    /// bit. Cost: linear in the number of bytes.
    ///
    /// # Errors
    /// [`SnapshotError::Full`] if there is no room for the best hypothesis.
    #[inline(never)]
    fn save(&mut self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        self.repair_nothing();
        self.head().save::<V, D, T>(writer)?;
        let len = self.record.len();
        writer.u16(len as u16)?;
        for index in 0..len {
            let entry = self.record.get(index);
            writer.u16(entry.steps)?;
            writer.u16(entry.ln_travel)?;
            writer.bytes(&entry.to_bytes())?;
        }
        self.save_published(writer)?;
        self.base.save(writer, 0)?;
        let count_at = writer.mark();
        writer.u8(0)?;
        writer.as_many_as_fit(count_at, self.beam.iter(), |writer, hypothesis| hypothesis.save(writer, len))
    }

    /// Replaces the state by that of a section, settings and seed included; fault counts restart from 0.
    ///
    /// # Errors
    /// [`SnapshotError::Capacities`] for another kind of filter or other capacities, [`SnapshotError::TooShort`], or
    /// [`SnapshotError::Contents`]; the filter does not change then, but a repair under way ends.
    fn restore(&mut self, section: Reader<'_>) -> Result<(), SnapshotError> {
        self.check(section)?;
        self.read(section, true)
    }

    /// A repair under way ends. Cost: one pass over the bytes.
    fn check(&mut self, section: Reader<'_>) -> Result<(), SnapshotError> {
        self.read(section, false)
    }
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// Reads a section. `kept` replaces the state; otherwise only the draft changes.
    #[inline(never)]
    fn read(&mut self, mut from: Reader<'_>, kept: bool) -> Result<(), SnapshotError> {
        self.repair_nothing();
        let head = Head::read::<V, D, T>(&mut from)?;
        let len = usize::from(from.u16()?);
        if len > T
            || (head.observed as usize) < len
            || head.localised_from.is_some_and(|first| usize::from(first) > len)
        {
            return Err(SnapshotError::Contents);
        }
        if kept {
            self.take_head(&head);
        }
        for _ in 0..len {
            let entry = read_entry(&mut from)?;
            if kept {
                self.record.push(entry);
            }
        }
        self.read_published(&mut from, len, kept)?;
        self.draft.read(&mut from, 0)?;
        if kept {
            self.base.clone_from(&self.draft);
        }
        let count = from.u8()?;
        if count == 0 || usize::from(count) > N {
            return Err(SnapshotError::Contents);
        }
        for _ in 0..count {
            self.draft.read(&mut from, len)?;
            if kept {
                self.beam.append(&self.draft);
            }
        }
        from.finish()
    }

    fn head(&self) -> Head {
        Head {
            config: self.config,
            seed: self.seed,
            observed: self.observed,
            refined: self.refined,
            noise_steps: self.model.labels.noise_steps(),
            localised_from: self.localised_from.map(|first| first as u16),
        }
    }

    fn take_head(&mut self, head: &Head) {
        self.config = head.config;
        self.seed = head.seed;
        self.observed = head.observed;
        self.refined = head.refined;
        self.localised_from = head.localised_from.map(usize::from);
        self.model.configure(&head.config);
        self.model.set_noise(head.noise_steps);
        self.record.clear();
        self.beam.start_empty();
        self.faults = FaultCounters::new();
    }
}

impl Head {
    fn save<const V: usize, const D: usize, const T: usize>(
        &self,
        writer: &mut Writer<'_>,
    ) -> Result<(), SnapshotError> {
        writer.u8(ORDERED)?;
        writer.u8(V as u8)?;
        writer.u8(D as u8)?;
        writer.u16(T as u16)?;
        let config = &self.config;
        for value in [
            config.noise_mm,
            config.wrong_exit_permille,
            config.missed_way_permille,
            config.false_way_permille,
            config.bearing_noise_mrad,
            config.travel_noise_permille,
        ] {
            writer.u16(value)?;
        }
        writer.u64(self.seed)?;
        writer.u32(self.observed)?;
        writer.u32(self.refined)?;
        writer.f32(self.noise_steps)?;
        writer.u16(self.localised_from.unwrap_or(MAPS))
    }

    fn read<const V: usize, const D: usize, const T: usize>(from: &mut Reader<'_>) -> Result<Self, SnapshotError> {
        let kind = from.u8()?;
        if kind != ORDERED || (usize::from(from.u8()?), usize::from(from.u8()?), usize::from(from.u16()?)) != (V, D, T)
        {
            return Err(SnapshotError::Capacities);
        }
        let config = OrderedConfig {
            noise_mm: from.u16()?,
            wrong_exit_permille: from.u16()?,
            missed_way_permille: from.u16()?,
            false_way_permille: from.u16()?,
            bearing_noise_mrad: from.u16()?,
            travel_noise_permille: from.u16()?,
        };
        config.check().map_err(|_| SnapshotError::Contents)?;
        let head = Self {
            config,
            seed: from.u64()?,
            observed: from.u32()?,
            refined: from.u32()?,
            noise_steps: from.f32()?,
            localised_from: Some(from.u16()?).filter(|&first| first != MAPS),
        };
        if NOISE_STEPS.contains(&head.noise_steps) { Ok(head) } else { Err(SnapshotError::Contents) }
    }
}

fn read_entry(from: &mut Reader<'_>) -> Result<OrderedEntry, SnapshotError> {
    let (steps, ln_travel) = (from.u16()?, from.u16()?);
    let bytes = from.bytes(ENTRY_BYTES - 4)?.first_chunk().ok_or(SnapshotError::TooShort)?;
    if Fingerprint::from_steps(steps).is_none() {
        return Err(SnapshotError::Contents);
    }
    Ok(OrderedEntry::from_bytes(steps, ln_travel, *bytes))
}
