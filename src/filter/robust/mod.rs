//! The robust filter: distinct hypotheses with a collapsed evidence, repaired by moves.
//!
//! A hypothesis says of every observation which vertex it belongs to; map, labels and counts follow from that. Its evidence
//! integrates the mean and variance of every label out and takes each move as a uniform choice among the edges of its
//! vertex, so that an edge prices the past anew; vertices and edges have a price. To it comes what the other paths of the
//! same map add. A place extends every hypothesis in every way and keeps the best distinct ones; moves then merge, split,
//! unfold and decode them, because what one place decided wrongly no later place can take back otherwise.

pub(crate) mod beam;
mod config;
mod decode;
mod forward;
mod growth;
pub(crate) mod hypothesis;
mod lattice;
mod merges;
mod moves;
pub(crate) mod names;
mod noise;
pub(crate) mod prices;
pub(crate) mod record;
mod splits;
pub(crate) mod tally;
mod tell;
mod union;
pub(crate) mod worst;

pub use config::RobustConfig;
pub(super) use worst::LENGTH as NGRAM_LENGTH;

use super::{Update, WorstNgram, draws};
use crate::{ConfigError, FaultCounters, FaultKind, Fingerprint, Map, Observation, VertexId};
use beam::Beam;
use decode::Decoder;
use forward::Forward;
use hypothesis::Hypothesis;
use lattice::Model;
use moves::Workshop;
use names::Names;
use prices::Prices;
use record::Record;

/// The noise is estimated at every fifth place at first, later at every tenth.
const NOISE_FROM: u32 = 10;
const NOISE_OFTEN_UNTIL: u32 = 40;

/// How many hypotheses are brought up to date at a place at most, until the best one is.
const SOFTENED: u8 = 3;

/// The robust filter with at most `N` hypotheses, maps of at most `V` vertices (`V` ≤ 32), and the newest `HISTORY` places
/// as evidence that moves can still explain in another way; what is older counts as it was decided.
///
/// The filter is const-constructed to zero, so that a `static` of it lies in `.bss`, and set up in place by
/// [`RobustFilter::start`]. Memory: about `(N + 1) · (HISTORY + 48 · V + 32) + 20 · HISTORY + 60 · V + 1200` bytes.
/// The same observations, seed and calls of [`RobustFilter::polish`] give the same result on every target.
///
/// ```
/// use toposlam::{Fingerprint, RobustConfig, RobustFilter};
///
/// let mut filter = RobustFilter::<10, 16, 400>::new();
/// filter.start(RobustConfig::default(), 1)?;
/// for radius_mm in [1200, 2200, 1204, 2196, 1200] {
///     let update = filter.observe(Fingerprint::from_radius_mm(radius_mm)?);
///     filter.polish();
///     assert_eq!(update.place_index + 1, filter.observed());
/// }
/// assert_eq!(filter.map().vertices().len(), 2);
/// assert!(filter.path().map(u8::from).eq([0, 1, 0, 1, 0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct RobustFilter<const N: usize, const V: usize, const HISTORY: usize> {
    pub(crate) config: RobustConfig,
    pub(crate) seed: u64,
    pub(crate) observed: u32,
    /// How many moves were made since the newest place.
    pub(crate) polished: u32,
    pub(crate) localise_only: bool,
    pub(crate) prices: Prices,
    pub(crate) record: Record<HISTORY>,
    pub(crate) beam: Beam<N, V, HISTORY>,
    pub(crate) draft: Hypothesis<V, HISTORY>,
    model: Model<V>,
    decoder: Decoder<HISTORY>,
    forward: Forward<V>,
    pub(crate) names: Names<V, HISTORY>,
    pub(crate) map: Map<V>,
    pub(crate) worst: WorstNgram,
    pub(crate) belief_q16: [u32; V],
    pub(crate) map_probability_q16: u32,
    pub(crate) faults: FaultCounters,
}

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// A filter that is yet to be set up by [`RobustFilter::start`]; before that, observations are lost.
    pub const fn new() -> Self {
        const {
            assert!(N >= 1 && N <= 255, "a filter has 1 to 255 hypotheses");
            assert!(V >= 2 && V <= 32, "a map has 2 to 32 vertices: a row is one u32");
            assert!(HISTORY >= 8 && HISTORY <= 16384, "a history holds 8 to 16384 places");
        }
        Self {
            config: RobustConfig::UNSET,
            seed: 0,
            observed: 0,
            polished: 0,
            localise_only: false,
            prices: Prices::new(),
            record: Record::new(),
            beam: Beam::new(),
            draft: Hypothesis::NONE,
            model: Model::new(),
            decoder: Decoder::new(),
            forward: Forward::new(),
            names: Names::new(),
            map: Map::new(),
            worst: WorstNgram::NONE,
            belief_q16: [0; V],
            map_probability_q16: 0,
            faults: FaultCounters::new(),
        }
    }

    /// Forgets everything and starts anew with a configuration and a seed.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range; the filter goes on as it was.
    pub fn start(&mut self, config: RobustConfig, seed: u64) -> Result<(), ConfigError> {
        config.check(N)?;
        self.config = config;
        self.seed = seed;
        self.observed = 0;
        self.polished = 0;
        self.localise_only = false;
        self.prices.configure(&config);
        self.record.clear();
        self.beam.clear();
        self.names.clear();
        self.map.clear();
        self.worst = WorstNgram::NONE;
        self.belief_q16 = [0; V];
        self.map_probability_q16 = 0;
        self.faults = FaultCounters::new();
        Ok(())
    }

    /// As [`RobustFilter::start`], with a map that is known already: its labels count as many visits as it says, with the
    /// configured noise. The robot may be at any of its vertices.
    ///
    /// # Errors
    /// As [`RobustFilter::start`].
    pub fn start_with_map(&mut self, config: RobustConfig, seed: u64, map: &Map<V>) -> Result<(), ConfigError> {
        self.start(config, seed)?;
        self.draft.know(map, f32::from(config.noise_mm) / f32::from(Fingerprint::STEP_MM));
        self.draft.recount(&self.prices, &self.record);
        self.beam.begin_with(&self.draft);
        self.names.begin_with(map.vertices().len() as u8);
        self.map = *map;
        Ok(())
    }

    /// Goes on with other settings: all hypotheses are weighed anew, and the noise is estimated anew from its first guess.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range; the filter goes on as it was.
    pub fn set_config(&mut self, config: RobustConfig) -> Result<(), ConfigError> {
        config.check(N)?;
        self.config = config;
        self.prices.configure(&config);
        let (prices, record) = (&self.prices, &self.record);
        self.beam.each(|hypothesis| hypothesis.recount(prices, record));
        self.beam.sort();
        Ok(())
    }

    /// Whether the map is kept as it is.
    pub const fn is_localise_only(&self) -> bool {
        self.localise_only
    }

    /// Whether the map is kept as it is from now on: the filter then only tells where the robot is, notices by itself when
    /// it was carried elsewhere, and makes no moves. The places seen meanwhile count as evidence when mapping goes on. A map
    /// without vertices stays without, and the places are lost.
    pub fn set_localise_only(&mut self, localise_only: bool) {
        if localise_only == self.localise_only {
            return;
        }
        if localise_only && self.observed > 0 {
            // The map that is kept is the one that is told.
            self.refresh();
        }
        self.localise_only = localise_only;
        self.beam.keep_best();
        if !localise_only && let Some(best) = self.beam.get_mut(0) {
            best.recount(&self.prices, &self.record);
        }
    }

    /// Takes the next place, makes the configured number of moves, and publishes the best map.
    ///
    /// Cost: N · (V + 1) predictions, and for each move and once more some passes over the record, each O(HISTORY · V).
    pub fn observe(&mut self, observation: impl Into<Observation>) -> Update {
        let mut observation: Observation = observation.into();
        if self.localise_only && self.beam.get(0).is_none_or(|best| best.vertices == 0) {
            // No hypothesis could say where it is, so none would live on.
            let place_index = self.observed;
            self.observed = self.observed.wrapping_add(1);
            return Update { place_index, ..Update::NONE };
        }
        observation.starts_sequence |= self.record.is_empty();
        if self.record.is_full() {
            self.faults.record(FaultKind::HistoryFull);
            let record = &self.record;
            let mut have_faded = false;
            self.beam.each(|hypothesis| have_faded |= hypothesis.settle_oldest(record));
            self.names.drop_oldest();
            self.record.drop_oldest();
            // A map that is kept has the counts it was kept with.
            if have_faded && !self.localise_only {
                self.rebase();
            }
        }
        let index = self.record.len();
        self.record.push(&observation);
        let wanted = usize::from(self.config.hypotheses);
        if let Some(entry) = self.record.get(index)
            && self.beam.grow(&self.prices, &self.record, (index, entry), wanted, self.localise_only)
        {
            self.faults.record(FaultKind::VerticesFull);
        }
        self.polished = 0;
        if self.localise_only {
            self.notice_carriage();
        } else {
            for _ in 0..self.config.moves {
                self.polish();
            }
        }
        self.observed = self.observed.wrapping_add(1);
        let often = if self.observed < NOISE_OFTEN_UNTIL { 5 } else { 10 };
        if !self.localise_only && self.observed >= NOISE_FROM && self.observed.is_multiple_of(often) {
            self.estimate_noise();
        }
        self.refresh()
    }

    /// Tells the best map as [`RobustFilter::observe`] does, without another place: what came out of polishing.
    pub fn refresh(&mut self) -> Update {
        self.soften_best();
        self.publish()
    }

    /// Makes one more move on the hypotheses: for the time between two places, in as many slices as there is time for. The
    /// next [`RobustFilter::observe`] or [`RobustFilter::refresh`] publishes what came out. Cost: at most seven passes over
    /// the record.
    pub fn polish(&mut self) {
        if self.localise_only || self.record.len() < 3 {
            return;
        }
        let mut random = draws(self.seed, u64::from(self.observed) << 16 | u64::from(self.polished & 0xFFFF));
        let wanted = usize::from(self.config.hypotheses);
        let mut workshop = Workshop {
            prices: &self.prices,
            record: &self.record,
            model: &mut self.model,
            decoder: &mut self.decoder,
            forward: &mut self.forward,
            random: &mut random,
            threshold: self.beam.threshold(wanted),
        };
        // The best hypothesis every other time, else one of the better ones.
        let rank = if self.polished.is_multiple_of(2) {
            0
        } else {
            workshop.below(self.beam.len()).min(workshop.below(self.beam.len()))
        };
        self.polished = self.polished.wrapping_add(1);
        let Some(hypothesis) = self.beam.get(rank) else { return };
        self.draft.clone_from(hypothesis);
        if workshop.change(&mut self.draft) {
            self.beam.insert(&self.draft, wanted);
        }
    }

    /// Goes on with counts that have faded.
    fn rebase(&mut self) {
        let (prices, record) = (&self.prices, &self.record);
        self.beam.each(|hypothesis| hypothesis.rebase(prices, record));
        let common = self.beam.get(0).map_or(0.0, Hypothesis::faded);
        self.beam.each(|hypothesis| hypothesis.forget(common));
    }

    /// Where no edge of the map leads from one place of the best path to the next, the robot was carried.
    fn notice_carriage(&mut self) {
        let Some(best) = self.beam.get(0) else { return };
        for index in 1..self.record.len() {
            self.record.set_carried(index, !best.is_edge(best.at(index - 1), best.at(index)));
        }
    }

    /// Computes anew how much the best map gains from its other paths, until the best one is up to date, and the distribution
    /// of its newest place.
    fn soften_best(&mut self) {
        for round in 1..=SOFTENED {
            let Some(best) = self.beam.get_mut(0) else { return };
            self.forward.soften(&self.prices, &self.record, &mut self.model, best);
            let key = best.key();
            // The last one is told even if another has become the better one by now: its belief is at hand.
            if self.localise_only || round == SOFTENED {
                return;
            }
            self.beam.sort();
            if self.beam.get(0).is_some_and(|now| now.key() == key) {
                return;
            }
        }
    }

    /// Takes the scale of the noise from what was observed, and weighs all hypotheses anew.
    fn estimate_noise(&mut self) {
        let resolution = f32::from(self.config.resolution_mm) / f32::from(Fingerprint::STEP_MM);
        let Some(deviation) = self.beam.get(0).and_then(|best| noise::deviation_steps(&self.record, best, resolution))
        else {
            return;
        };
        self.prices.set_noise(deviation);
        let prices = &self.prices;
        self.beam.each(|hypothesis| hypothesis.evidence = hypothesis.total(prices));
        self.beam.sort();
    }

    /// How many places were observed.
    pub fn observed(&self) -> u32 {
        self.observed
    }

    /// What went wrong since the start: full tables.
    pub fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    /// Replaces all hypotheses by one that takes the newest places for given vertices, numbered from 0 without gaps, the
    /// oldest first; tells its score. It is for tests and evaluations: to force a mistake, or to begin a search at the truth.
    /// Nothing happens when there are not as many vertices as places, or more vertices than a map holds.
    pub fn assume_path(&mut self, path: &[VertexId]) -> Option<f32> {
        let vertices = path.iter().max().map_or(0, |last| last.index() + 1);
        if path.len() != self.record.len() || vertices > V {
            return None;
        }
        self.draft.clear();
        self.draft.vertices = vertices as u8;
        for (slot, &vertex) in self.draft.path.iter_mut().zip(path) {
            *slot = vertex.into();
        }
        self.draft.rebuild(&self.prices, &self.record);
        self.beam.begin_with(&self.draft);
        self.refresh();
        self.beam.get(0).map(Hypothesis::score)
    }
}

impl<const N: usize, const V: usize, const HISTORY: usize> Default for RobustFilter<N, V, HISTORY> {
    fn default() -> Self {
        Self::new()
    }
}
