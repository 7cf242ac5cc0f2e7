//! The ordered filter: distinct hypotheses over the darts of an edge-ordered map.
//!
//! A hypothesis is a map and the way by which the robot came to the newest place. While the way by which it leaves is known, the
//! next place follows; at a frontier it is a new vertex, or any vertex with a frontier that fits. Repair builds the best maps
//! again from the newest observations with one closure undone, or with two vertices folded onto each other.

mod beam;
mod config;
mod fold;
mod hypothesis;
mod model;
mod noise;
mod observation;
mod record;
mod repair;
mod replay;
#[cfg(test)]
mod tests;

pub use config::OrderedConfig;
pub use observation::{OrderedObservation, WaysSeen};

use crate::config_error::ConfigError;
use crate::map::darts::DartMap;
use crate::place::Fingerprint;
use beam::Beam;
use fold::Union;
use hypothesis::Hypothesis;
use model::Model;
use record::{Entry, Record};
use repair::Repair;
use replay::Translation;

/// The noise is estimated at every fifth place from here on.
const NOISE_FROM: u32 = 10;

/// The ordered filter with at most `N` hypotheses, maps of at most `V` vertices and `D` darts, and the newest `T` places as
/// evidence that can still be explained in another way.
///
/// Memory: about `(N + 3) · (20 · V + 8 · D + T)` bytes and 12 bytes a place of the record.
#[derive(Clone, Debug)]
pub struct OrderedFilter<const N: usize, const V: usize, const D: usize, const T: usize> {
    seed: u64,
    observed: u32,
    refined: u32,
    /// Places at which a vertex found no room.
    full: u32,
    model: Model,
    record: Record<T>,
    beam: Beam<N, V, D, T>,
    draft: Hypothesis<V, D, T>,
    source: Hypothesis<V, D, T>,
    translation: Translation<V, D>,
    union: Union<D>,
    repair: Repair,
    /// The best hypothesis before the record begins.
    base: Hypothesis<V, D, T>,
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// A filter that waits for [`OrderedFilter::start`].
    pub const fn new() -> Self {
        Self {
            seed: 0,
            observed: 0,
            refined: 0,
            full: 0,
            model: Model::new(),
            record: Record::new(),
            beam: Beam::new(),
            draft: Hypothesis::NONE,
            source: Hypothesis::NONE,
            translation: Translation::new(),
            union: Union::new(),
            repair: Repair::NONE,
            base: Hypothesis::NONE,
        }
    }

    /// Resets the filter, with a configuration and the seed of its random draws.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range; the filter does not change then.
    pub fn start(&mut self, config: OrderedConfig, seed: u64) -> Result<(), ConfigError> {
        config.check()?;
        self.seed = seed;
        self.observed = 0;
        self.refined = 0;
        self.full = 0;
        self.model.configure(&config);
        self.record.clear();
        self.beam.clear();
        self.base.clear();
        self.repair = Repair::NONE;
        Ok(())
    }

    /// Takes the next place.
    pub fn observe(&mut self, observation: &OrderedObservation) {
        if self.record.is_full() {
            self.drop_oldest();
        }
        let index = self.record.len();
        self.record.push(Entry::new(observation));
        if self.beam.grow(&self.model, &self.record, index) {
            self.full += 1;
        }
        self.refined = 0;
        self.observed += 1;
        if self.observed >= NOISE_FROM && self.observed.is_multiple_of(5) {
            self.estimate_noise();
        }
    }

    /// Drops the oldest quarter of the record. The best hypothesis decides what it meant; its counts stay, as the base of all
    /// hypotheses from now on. Cost: as a refinement of all places.
    fn drop_oldest(&mut self) {
        self.repair = Repair::NONE;
        let (len, dropped) = (self.record.len(), (self.record.len() / 4).max(1));
        if let Some(best) = self.beam.get(0) {
            self.source.clone_from(best);
        }
        let forgotten = self.base.rest;
        let before = self.rebuild(0, dropped);
        self.draft.fade(&self.model);
        self.base.clone_from(&self.draft);
        self.base.rest = 0.0;
        if before.is_none() || self.rebuild(dropped, len).is_none() {
            // A map that contradicts its own path: it stays as it is, and nothing of it can be explained in another way.
            self.base.clone_from(&self.source);
            self.base.rest = 0.0;
            self.draft.clone_from(&self.base);
            self.record.clear();
            self.beam.begin_with(&self.draft);
            return;
        }
        self.draft.rest -= forgotten;
        self.draft.forget_oldest(dropped);
        self.record.drop_oldest(dropped);
        self.beam.begin_with(&self.draft);
    }

    fn estimate_noise(&mut self) {
        let Some(best) = self.beam.get(0) else { return };
        let (mut scatter, mut freedom) = (0.0, 0.0);
        for label in best.labels.iter().take(best.map.vertices().into()).filter(|label| label.visits >= 2) {
            scatter += label.scatter;
            freedom += f32::from(label.visits - 1);
        }
        if freedom < 3.0 {
            return;
        }
        let limit = noise::returning_deviation(&self.record).map_or(150.0, |deviation| 1.5 * deviation);
        self.model.set_noise(libm::sqrtf(scatter / freedom).min(limit).clamp(2.0, 150.0));
        let model = &self.model;
        self.beam.each(|hypothesis| hypothesis.weigh_labels(model));
        self.beam.sort();
    }

    /// The best map.
    pub fn map(&self) -> &DartMap<V, D> {
        &self.beam.get(0).unwrap_or(&self.draft).map
    }

    /// The way by which the robot came to each place of the record by the best hypothesis, the oldest first; 255 where that is
    /// open.
    pub fn path(&self) -> &[u8] {
        self.beam.get(0).and_then(|best| best.path.get(..self.record.len())).unwrap_or(&[])
    }

    /// The score of the best hypothesis.
    pub fn score(&self) -> f32 {
        self.beam.get(0).map_or(0.0, Hypothesis::score)
    }

    /// The noise in force in millimetres.
    pub fn noise_mm(&self) -> f32 {
        self.model.labels.noise_steps() * f32::from(Fingerprint::STEP_MM)
    }

    /// How often a vertex found no room.
    pub fn full(&self) -> u32 {
        self.full
    }

    /// Replaces all hypotheses by one that takes the places for given vertices and ways of a map; for evaluations.
    pub fn assume(&mut self, map: &DartMap<V, D>, path: &[u8]) -> Option<f32> {
        self.source.clear();
        self.source.map = map.clone();
        for (slot, &dart) in self.source.path.iter_mut().zip(path) {
            *slot = dart;
        }
        self.rebuild(0, path.len())?;
        self.repair = Repair::NONE;
        self.beam.begin_with(&self.draft);
        Some(self.draft.score())
    }
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> Default for OrderedFilter<N, V, D, T> {
    fn default() -> Self {
        Self::new()
    }
}
