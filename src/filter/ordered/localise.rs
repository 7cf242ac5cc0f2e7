//! Localisation on a map that does not change, and the start with a known map.

use super::choice::{Choice, Gain, OFF_MAP, Target};
use super::hypothesis::{Hypothesis, LN_OFF_MAP};
use super::label::Label;
use super::model::Model;
use super::record::Record;
use super::{OrderedConfig, OrderedFilter};
use crate::config_error::ConfigError;
use crate::filter::Filter;
use crate::map::{DartMap, Map, NONE};
use crate::place::Fingerprint;

/// The log prior of a kidnapping that was not reported, in nats.
const LN_KIDNAPPED: f32 = -8.0;

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// As [`Filter::start`], with a known map: labels with their visits, and the ways of the same vertices. Labels count with 512
    /// visits at most and with the configured noise; ways without sightings count as seen at every visit. The robot may have come
    /// to any vertex by any way.
    ///
    /// # Errors
    /// As [`Filter::start`], and [`ConfigError`] for `vertices` when `map` and `darts` have different numbers of vertices.
    pub fn start_with_map(
        &mut self,
        config: OrderedConfig,
        seed: u64,
        map: &Map<V>,
        darts: &DartMap<V, D>,
    ) -> Result<(), ConfigError> {
        let vertices = i32::from(darts.vertices());
        ConfigError::check("vertices", map.vertices().len() as i32, vertices, vertices)?;
        self.start(config, seed)?;
        let noise_steps = f32::from(config.noise_mm) / f32::from(Fingerprint::STEP_MM);
        self.base.map.clone_from(darts);
        for vertex in map.vertices() {
            let label = Label::known(map.label_of(vertex), map.visits(vertex), noise_steps);
            if let Some(slot) = self.base.labels.get_mut(vertex.index()) {
                *slot = label;
            }
            self.base.map.assume_seen(vertex.into(), label.looks);
        }
        self.base.rekey();
        self.base.weigh_labels(&self.model);
        self.beam.start_with(&self.base);
        self.vertex_ids.start_with(map.vertices().len());
        self.map = *map;
        self.darts.clone_from(&self.base.map);
        Ok(())
    }

    /// Whether the filter only localises.
    pub const fn is_localise_only(&self) -> bool {
        self.localised_from.is_some()
    }

    /// Switches between mapping and localisation alone.
    ///
    /// While the filter only localises, the map does not change and there are no repairs; the filter finds the vertex of the robot,
    /// also after it was kidnapped. The places observed meanwhile, the newest `T` of them, count as evidence when mapping continues.
    /// Without a vertex on the map they are lost. Cost when mapping continues: O(T · D).
    pub fn set_localise_only(&mut self, localise_only: bool) {
        if localise_only == self.is_localise_only() || self.beam.is_empty() {
            return;
        }
        self.repair_nothing();
        if localise_only {
            if self.observed > 0 {
                // The map that stays is the one that is published.
                self.publish();
            }
            self.localised_from = Some(self.record.len());
            self.beam.keep_best();
            return;
        }
        let localised_from = self.localised_from.take().unwrap_or(0);
        if let Some(best) = self.beam.best() {
            self.source.clone_from(best);
        }
        // Places that were not on the map may be new ones.
        let localised = self.source.path.iter_mut().take(self.record.len()).skip(localised_from);
        localised.filter(|came_by| **came_by == OFF_MAP).for_each(|came_by| *came_by = NONE);
        if !self.rebuild_with_decisions() {
            self.forget_record();
        }
        self.beam.start_with(&self.draft);
    }

    /// Takes the next place on the map as it is.
    pub(super) fn localise(&mut self, index: usize) {
        self.beam.localise(&self.model, &self.record, index);
        let Some(best) = self.beam.best() else { return };
        for index in self.localised_from.unwrap_or(0).max(1)..self.record.len() {
            let (from, at) = (best.came_by(index - 1), best.came_by(index));
            let left = best.map.partner(at).map(|partner| best.map.vertex(partner));
            self.record.set_kidnapped(index, left != Some(best.map.vertex(from)));
        }
    }

    /// Drops the oldest quarter of the record while the filter only localises: places that were mapped become part of the base,
    /// the others are lost.
    pub(super) fn drop_oldest_localised(&mut self) {
        let mapped = self.localised_from.unwrap_or(0).min(self.record.len());
        let mut dropped = (self.record.len() / 4).max(1);
        if mapped > 0 {
            if let Some(best) = self.beam.best() {
                self.source.clone_from(best);
            }
            if self.rebuild(0, dropped.min(mapped)).is_some() {
                self.base.clone_from(&self.draft);
            } else {
                // A map that contradicts its own path stays as it is.
                self.base.clone_from(&self.source);
                dropped = dropped.max(mapped);
            }
            self.base.rest = 0.0;
        }
        self.beam.for_each(|hypothesis| hypothesis.forget_oldest(dropped));
        self.record.drop_oldest(dropped);
        self.path.copy_within(dropped.min(T).., 0);
        self.localised_from = Some(mapped.saturating_sub(dropped));
        if dropped > mapped {
            self.record.set_kidnapped(0, true);
        }
    }
}

impl<const V: usize, const D: usize, const T: usize> Hypothesis<V, D, T> {
    /// Proposes the ways by which the robot may have come to observation `index` on a map that does not change. `is_best` proposes
    /// kidnappings too.
    pub(super) fn localisations(
        &self,
        model: &Model,
        record: &Record<T>,
        index: usize,
        is_best: bool,
        mut proposed: impl FnMut(u8, Gain),
    ) {
        let entry = record.get(index);
        let follows = self.is_on_map() && !entry.starts();
        if follows {
            let reported = self.reported_exit(record, index, self.at);
            for &exit in self.map.ways(self.map.vertex(self.at)) {
                if let Some(partner) = self.map.partner(exit) {
                    let gain = self.gain(model, &entry, reported, Choice { exit, target: Target::Known });
                    proposed(partner, gain);
                }
            }
        }
        if is_best || !follows {
            let cost = model.ln_of(self.map.darts().into()) - if follows { LN_KIDNAPPED } else { 0.0 };
            let near = |&dart: &u8| !self.is_far(model, entry.steps, self.map.vertex(dart));
            for dart in (0..self.map.darts()).filter(near) {
                let mut gain = self.arrival(model, &entry, dart);
                gain.rest -= cost;
                proposed(dart, gain);
            }
            proposed(OFF_MAP, Gain { labels: 0.0, rest: LN_OFF_MAP });
        }
    }
}
