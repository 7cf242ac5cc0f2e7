//! The ordered filter: distinct hypotheses over the darts of an edge-ordered map.
//!
//! A hypothesis is a map and the way by which the robot came to the newest place. While the way by which it leaves is known, the
//! next place follows; at a frontier it is a new vertex, or any vertex with a frontier that fits. Repair builds the best maps
//! again from the newest observations with one closure undone, with two vertices folded onto each other, or with a part of the map
//! removed.

mod beam;
mod choice;
mod config;
mod decode;
mod fold;
mod history;
mod hypothesis;
mod label;
mod localise;
mod logarithm;
mod model;
mod noise;
mod outliers;
mod proposals;
mod publish;
mod record;
mod removal;
mod repair;
mod replay;
#[cfg(test)]
mod tests;
mod translation;
mod ways_evidence;

pub use config::OrderedConfig;

#[cfg(feature = "snapshot")]
pub(crate) use {
    choice::OFF_MAP, hypothesis::Hypothesis as OrderedHypothesis, label::Label as OrderedLabel,
    record::Entry as OrderedEntry,
};

use super::vertex_ids::VertexIds;
use super::{Exit, Filter, FilterCapacities, Observation, Update, WorstNgram, worst_ngram};
use crate::config_error::ConfigError;
use crate::fault::{FaultCounters, FaultKind};
use crate::filter::beam::Ranked as _;
use crate::map::{DartId, DartMap, Darts, Map, NONE, PerVertex, VertexId};
use beam::Beam;
use decode::Decoder;
use fold::Union;
use hypothesis::{DARTS_MAX, Hypothesis};
use model::{Model, SAME_WAY};
use record::{Entry, Record};
use repair::Repair;
use translation::Translation;

/// The noise is estimated at every fifth place from here on.
const NOISE_FROM: u32 = 10;

/// The ordered filter with at most `N` hypotheses, maps of at most `V` vertices (1 to 64) and `D` darts (2 to 253), and a history of
/// the newest `T` places. Repairs can revise what the history contains.
///
/// The filter is const-constructed, to zero, so that a `static` of it is in `.bss`, and initialised in place by [`Filter::start`]. Memory:
/// about `(N + 4) · (20 · V + 8 · D + T)` bytes and 12 bytes a place of the history. The same observations, seed and calls of
/// [`Filter::refine`] give the same result on every target.
///
/// ```
/// use toposlam::{Exit, Filter, Fingerprint, Observation, OrderedConfig, OrderedFilter, Ways};
///
/// let mut filter = OrderedFilter::<6, 12, 60, 64>::new();
/// filter.start(OrderedConfig::DEFAULT, 1)?;
/// // A corridor between two dead ends.
/// for radius_mm in [1200, 2200, 1204, 2196, 1200] {
///     let fingerprint = Fingerprint::from_radius_mm(radius_mm)?;
///     let ways = Some(Ways::from_bearings_mrad(&[])?);
///     filter.observe(Observation { ways, exit: Some(Exit::Back), ..Observation::new(fingerprint) });
///     filter.refine();
/// }
/// assert_eq!(filter.map().vertices().len(), 2);
/// let darts = filter.darts().unwrap();
/// assert_eq!((darts.edges().count(), darts.frontiers().count()), (1, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct OrderedFilter<const N: usize, const V: usize, const D: usize, const T: usize> {
    pub(crate) config: OrderedConfig,
    pub(crate) seed: u64,
    pub(crate) observed: u32,
    pub(crate) refined: u32,
    pub(crate) model: Model,
    /// The first place of the record since the filter only localises; `None` while it maps.
    pub(crate) localised_from: Option<usize>,
    pub(crate) record: Record<T>,
    pub(crate) beam: Beam<N, V, D, T>,
    pub(crate) draft: Hypothesis<V, D, T>,
    source: Hypothesis<V, D, T>,
    translation: Translation<V, D>,
    union: Union<D>,
    decoder: Decoder,
    pub(crate) repair: Repair,
    /// The best hypothesis before the record begins.
    pub(crate) base: Hypothesis<V, D, T>,
    pub(crate) vertex_ids: VertexIds<V>,
    /// The published map as a graph, and with its ways.
    pub(crate) map: Map<V>,
    pub(crate) darts: DartMap<V, D>,
    /// The published way by which the robot came to each place of the record; [`NONE`] where that is unknown.
    pub(crate) path: [u8; T],
    /// The published way by which it came to the newest place.
    pub(crate) at: u8,
    pub(crate) worst: WorstNgram,
    pub(crate) belief_q16: PerVertex<u32, V>,
    pub(crate) map_probability_q16: u32,
    pub(crate) faults: FaultCounters,
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// A filter that ignores observations until [`Filter::start`].
    pub const fn new() -> Self {
        const {
            assert!(N >= 1 && N <= 255, "a filter has 1 to 255 hypotheses");
            assert!(D <= DARTS_MAX, "a map has 2 to 253 darts");
            assert!(T >= 8 && T <= 16384, "a history has 8 to 16384 places");
        }
        Self {
            config: OrderedConfig::UNSET,
            seed: 0,
            observed: 0,
            refined: 0,
            model: Model::new(),
            localised_from: None,
            record: Record::new(),
            beam: Beam::new(),
            draft: Hypothesis::UNUSED,
            source: Hypothesis::UNUSED,
            translation: Translation::new(),
            union: Union::new(),
            decoder: Decoder::new(),
            repair: Repair::NONE,
            base: Hypothesis::UNUSED,
            vertex_ids: VertexIds::new(),
            map: Map::new(),
            darts: DartMap::EMPTY,
            path: [0; T],
            at: 0,
            worst: WorstNgram::NONE,
            belief_q16: PerVertex::filled(0),
            map_probability_q16: 0,
            faults: FaultCounters::new(),
        }
    }

    /// How many places were observed.
    pub const fn observed(&self) -> u32 {
        self.observed
    }

    /// Publishes the best map without another place: the result of [`Filter::refine`] so far.
    pub fn refresh(&mut self) -> Update {
        self.publish()
    }

    /// Takes hints that contradict the place before out of an observation, and records the faults.
    fn checked(&mut self, mut observation: Observation) -> Observation {
        if observation.travel_frames == Some(0) {
            self.faults.record(FaultKind::InvalidHint);
            observation.travel_frames = None;
        }
        observation.starts_sequence |= self.observed == 0;
        if observation.starts_sequence {
            (observation.exit, observation.travel_frames) = (None, None);
        }
        let before = self.record.get(self.record.len().wrapping_sub(1));
        if let Some(Exit::Bearing(bearing)) = observation.exit
            && before.count() > 0
        {
            let bearing = u16::from(bearing) << 8;
            let off = |way: u16| (way.wrapping_sub(bearing) as i16).unsigned_abs();
            if !core::iter::once(0).chain(before.others()).any(|way| off(way) <= SAME_WAY) {
                self.faults.record(FaultKind::InvalidHint);
                observation.exit = None;
            }
        }
        observation
    }

    fn estimate_noise(&mut self) {
        let Some(best) = self.beam.best() else { return };
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
        self.weigh_labels();
    }

    /// Computes the evidence of all labels again, for another scale of the noise.
    fn weigh_labels(&mut self) {
        let model = &self.model;
        self.beam.for_each(|hypothesis| hypothesis.weigh_labels(model));
        self.beam.sort();
    }

    /// Replaces all hypotheses by one that takes the places for given vertices and ways of a map; for evaluations.
    #[doc(hidden)]
    #[cfg(feature = "_test")]
    pub fn assume(&mut self, map: &DartMap<V, D>, path: &[u8]) -> Option<f32> {
        self.source.clear();
        self.source.map = map.clone();
        for (slot, &dart) in self.source.path.iter_mut().zip(path) {
            *slot = dart;
        }
        self.rebuild(0, path.len())?;
        self.repair_nothing();
        self.beam.start_with(&self.draft);
        self.publish();
        Some(self.draft.score())
    }
}

/// Vertices keep their ids from update to update as long as most of their visits stay together.
impl<const N: usize, const V: usize, const D: usize, const T: usize> Filter<V> for OrderedFilter<N, V, D, T> {
    type Config = OrderedConfig;

    const UNSTARTED: Self = Self::new();

    fn capacities(_: &OrderedConfig) -> FilterCapacities {
        FilterCapacities { hypotheses: N as u16, history: T as u16, ngram_length: worst_ngram::LENGTH as u8 }
    }

    fn start(&mut self, config: OrderedConfig, seed: u64) -> Result<(), ConfigError> {
        config.check()?;
        self.config = config;
        self.seed = seed;
        self.observed = 0;
        self.refined = 0;
        self.model.configure(&config);
        self.localised_from = None;
        self.record.clear();
        self.beam.clear();
        self.base.clear();
        self.repair_nothing();
        self.vertex_ids.clear();
        self.map.clear();
        self.darts.clear();
        self.at = NONE;
        self.worst = WorstNgram::NONE;
        self.belief_q16.fill(0);
        self.map_probability_q16 = 0;
        self.faults = FaultCounters::new();
        Ok(())
    }

    fn config(&self) -> &OrderedConfig {
        &self.config
    }

    /// Computes the evidence of all labels again. The other evidence of the places so far stays as it is, and the estimate of the
    /// noise starts again from the configured value.
    fn set_config(&mut self, config: OrderedConfig) -> Result<(), ConfigError> {
        config.check()?;
        self.config = config;
        self.model.configure(&config);
        self.weigh_labels();
        Ok(())
    }

    /// Cost: for each of N hypotheses the explanations of one place, O(D) each; when the history is full, a pass over it as well.
    fn observe(&mut self, observation: impl Into<Observation>) -> Update {
        if self.beam.is_empty() {
            return Update::NONE;
        }
        if self.is_localise_only() && self.map.vertices().len() == 0 {
            // No hypothesis has a vertex for it.
            let place_index = self.observed;
            self.observed = self.observed.wrapping_add(1);
            return Update { place_index, ..Update::NONE };
        }
        let observation = self.checked(observation.into());
        if self.record.is_full() {
            self.faults.record(FaultKind::HistoryFull);
            if self.is_localise_only() {
                self.drop_oldest_localised();
            } else {
                self.drop_oldest();
            }
        }
        let index = self.record.len();
        self.record.push(Entry::new(&observation));
        self.extend_repair(index);
        self.refined = 0;
        self.observed = self.observed.wrapping_add(1);
        if self.is_localise_only() {
            self.localise(index);
            return self.publish();
        }
        if self.beam.grow(&self.model, &self.record, index) {
            self.faults.record(FaultKind::VerticesFull);
        }
        if self.observed >= NOISE_FROM && self.observed.is_multiple_of(5) {
            self.estimate_noise();
        }
        self.publish()
    }

    /// Runs a part of a repair, or all of it if it is short. Cost: at most 300 places that are followed, or 25 decisions.
    fn refine(&mut self) {
        if !self.is_localise_only() {
            self.repair();
        }
    }

    fn map(&self) -> &Map<V> {
        &self.map
    }

    fn darts(&self) -> Option<Darts<'_>> {
        Some(self.darts.view())
    }

    fn arrival(&self) -> Option<DartId> {
        if self.beam.is_empty() { None } else { DartId::new(self.at) }
    }

    fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    fn recent(&self, ago: usize) -> Option<VertexId> {
        VertexId::new(self.darts.vertex(self.recent_arrival(ago)?.into()))
    }

    fn recent_arrival(&self, ago: usize) -> Option<DartId> {
        let index = self.record.len().checked_sub(ago)?.checked_sub(1)?;
        DartId::new(*self.path.get(index)?)
    }

    fn vertex_probability_q16(&self, vertex: VertexId) -> u32 {
        self.belief_q16.get(vertex).copied().unwrap_or(0)
    }

    fn map_probability_q16(&self) -> u32 {
        self.map_probability_q16
    }

    fn remapped(&self, before: VertexId) -> Option<VertexId> {
        self.vertex_ids.remapped(before)
    }

    fn worst(&self) -> WorstNgram {
        self.worst
    }

    fn is_in_doubt(&self) -> bool {
        self.has_unexplained_ngram()
    }

    fn set_localise_only(&mut self, localise_only: bool) {
        Self::set_localise_only(self, localise_only);
    }

    fn is_localise_only(&self) -> bool {
        Self::is_localise_only(self)
    }
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> Default for OrderedFilter<N, V, D, T> {
    fn default() -> Self {
        Self::new()
    }
}
