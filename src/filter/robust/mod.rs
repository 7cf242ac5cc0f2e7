//! The robust filter: distinct hypotheses with a collapsed evidence, repaired by moves.

mod beam;
mod config;
mod decode;
mod forward;
mod hypothesis;
mod lattice;
mod moves;
mod prices;
mod record;
mod tally;

pub use config::RobustConfig;

use super::{ConfigError, Update, WeightFactors, WorstNgram};
use crate::{FaultCounters, FaultKind, Fingerprint, Map, Observation};
use beam::Beam;
use decode::Decoder;
use forward::Forward;
use hypothesis::Hypothesis;
use lattice::{Model, Weighing};
use moves::Workshop;
use prices::Prices;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro128PlusPlus;
use record::Record;

/// How many places lie between two estimates of the noise.
const NOISE_EVERY: u32 = 10;

/// The robust filter.
#[derive(Clone, Debug)]
pub struct RobustFilter<const N: usize, const V: usize, const HISTORY: usize> {
    config: RobustConfig,
    seed: u64,
    observed: u32,
    prices: Prices,
    record: Record<HISTORY>,
    beam: Beam<N, V, HISTORY>,
    draft: Hypothesis<V, HISTORY>,
    model: Model<V>,
    decoder: Decoder<HISTORY>,
    forward: Forward<V>,
    map: Map<V>,
    faults: FaultCounters,
}

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// A filter that is yet to be started.
    pub const fn new() -> Self {
        Self {
            config: RobustConfig::DEFAULT,
            seed: 0,
            observed: 0,
            prices: Prices::new(),
            record: Record::new(),
            beam: Beam::new(),
            draft: Hypothesis::NONE,
            model: Model::new(),
            decoder: Decoder::new(),
            forward: Forward::new(),
            map: Map::new(),
            faults: FaultCounters::new(),
        }
    }

    /// Forgets everything and starts anew with a configuration and a seed.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range.
    pub fn start(&mut self, config: RobustConfig, seed: u64) -> Result<(), ConfigError> {
        config.check(N)?;
        self.config = config;
        self.seed = seed;
        self.observed = 0;
        self.prices.configure(&config);
        self.record.clear();
        self.beam.clear();
        self.map.clear();
        self.faults = FaultCounters::new();
        Ok(())
    }

    /// Takes the next place.
    pub fn observe(&mut self, observation: impl Into<Observation>) -> Update {
        let mut observation: Observation = observation.into();
        observation.begins |= self.observed == 0;
        if self.record.is_full() {
            self.faults.count(FaultKind::HistoryFull);
            let record = &self.record;
            self.beam.each(|hypothesis| hypothesis.settle_oldest(record));
            self.record.drop_oldest();
        }
        let index = self.record.len();
        self.record.push(&observation);
        let wanted = usize::from(self.config.hypotheses);
        if let Some(entry) = self.record.get(index) {
            self.beam.grow(&self.prices, &self.record, index, entry, wanted);
        }
        let place_seed = self.seed.wrapping_add(u64::from(self.observed).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let mut random = Xoshiro128PlusPlus::seed_from_u64(place_seed);
        for k in 0..self.config.soft {
            self.soften(if k % 2 == 0 { 0 } else { self.observed as usize % self.beam.len().max(1) });
            self.beam.sort();
        }
        for number in 0..self.config.moves {
            self.repair(number, &mut random);
        }
        self.observed = self.observed.wrapping_add(1);
        if self.config.adapt > 0
            && self.observed >= 10
            && self.observed.is_multiple_of(if self.observed < 40 { 5 } else { NOISE_EVERY })
        {
            self.estimate_noise();
        }
        self.publish()
    }

    /// Tries one move on a hypothesis, the best one every other time.
    fn repair(&mut self, number: u8, random: &mut Xoshiro128PlusPlus) {
        let mut workshop = Workshop {
            prices: &self.prices,
            record: &self.record,
            model: &mut self.model,
            decoder: &mut self.decoder,
            forward: &mut self.forward,
            random,
        };
        let rank = if number.is_multiple_of(2) {
            0
        } else {
            workshop.below(self.beam.len()).min(workshop.below(self.beam.len()))
        };
        let Some(hypothesis) = self.beam.get(rank) else { return };
        self.draft.clone_from(hypothesis);
        if !workshop.change(&mut self.draft) {
            return;
        }
        self.beam.insert(&self.draft, usize::from(self.config.hypotheses));
    }

    /// Computes how much the map of a hypothesis gains from its other paths.
    fn soften(&mut self, rank: usize) {
        if self.config.soft == 0 {
            return;
        }
        let Some(hypothesis) = self.beam.get_mut(rank) else { return };
        self.model.read(&self.prices, &self.record, hypothesis, Weighing::Expected);
        hypothesis.surplus =
            self.prices.weight * self.forward.surplus(&self.prices, &self.record, &self.model, hypothesis);
    }

    /// Takes the scale of the noise from the best map and weighs all hypotheses anew.
    fn estimate_noise(&mut self) {
        let Some(best) = self.beam.get(0) else { return };
        let mut scatter = 0.0;
        let mut freedom = 0_u32;
        for tally in best.tallies.iter().take(usize::from(best.vertices)).filter(|tally| tally.visits >= 2) {
            scatter += tally.scatter();
            freedom += u32::from(tally.visits) - 1;
        }
        if freedom == 0 {
            return;
        }
        let mut deviation = libm::sqrtf(scatter / freedom as f32);
        if self.config.adapt > 1 {
            let mut histogram = [0_u16; 256];
            let mut pairs = 0_u16;
            for index in 2..self.record.len() {
                if let (Some(a), Some(b), Some(c)) =
                    (self.record.get(index - 2), self.record.get(index - 1), self.record.get(index))
                {
                    if b.begins() || c.begins() {
                        continue;
                    }
                    let d = usize::from(a.steps.abs_diff(c.steps));
                    histogram[d.min(255)] += 1;
                    pairs += 1;
                }
            }
            let mut below = 0;
            let wanted = f32::from(pairs) * 0.2;
            let q = histogram
                .iter()
                .position(|&n| {
                    below += n;
                    f32::from(below) >= wanted
                })
                .unwrap_or(255);
            let estimate = (q as f32 + 0.5) / 0.82;
            deviation = deviation.min(estimate * f32::from(self.config.adapt) / 10.0);
        }
        let deviation = deviation.clamp(2.0, 150.0);
        self.prices.set_noise(deviation);
        let prices = &self.prices;
        self.beam.each(|hypothesis| hypothesis.evidence = hypothesis.total(prices));
        self.beam.sort();
    }

    fn publish(&mut self) -> Update {
        self.map.clear();
        let mut vertex = 0;
        if let Some(best) = self.beam.get(0) {
            vertex = best.place;
            for tally in best.tallies.iter().take(usize::from(best.vertices)) {
                let _ = self.map.add_vertex(tally.mean_label());
            }
            for a in 0..best.vertices {
                for b in crate::map::bits(u64::from(best.row(a))) {
                    self.map.add_edge(a, b);
                }
            }
        }
        Update {
            place_index: self.observed - 1,
            vertex,
            is_new: false,
            consistency_mm: 0,
            factors: WeightFactors::ONE,
            lead_q16: 0,
            distinct: self.beam.len() as u8,
        }
    }

    /// The best map.
    pub fn map(&self) -> &Map<V> {
        &self.map
    }

    /// The vertex of the best map that each of the newest `HISTORY` places was taken for, the oldest first: the path of
    /// the best hypothesis as it sees the past now.
    pub fn path(&self) -> impl Iterator<Item = u8> + '_ {
        self.beam.get(0).into_iter().flat_map(|best| best.path.iter().copied()).take(self.record.len())
    }

    /// The probability that the robot is at a vertex, in units of 2⁻¹⁶.
    pub fn place_probability_q16(&self, vertex: u8) -> u32 {
        if vertex == 0 { 1 << 16 } else { 0 }
    }

    /// The probability that the best map is right, relative to its rivals, in units of 2⁻¹⁶.
    pub fn map_probability_q16(&self) -> u32 {
        1 << 16
    }

    /// For each vertex before the last update its number now; `None` when it is gone. A vertex that was merged into
    /// another has the number of the other.
    pub fn renamed(&self, before: u8) -> Option<u8> {
        Some(before)
    }

    /// The n-gram of the history that is farthest from every walk of the best map.
    pub fn worst(&self) -> WorstNgram {
        WorstNgram::NONE
    }

    /// Whether the map is kept as it is: the filter then only tells where the robot is.
    pub fn set_localise_only(&mut self, _localise_only: bool) {}

    /// How many places were observed.
    pub fn observed(&self) -> u32 {
        self.observed
    }

    /// What went wrong since the start: full tables.
    pub fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    /// Score of the best hypothesis (evidence, surplus).
    pub fn debug_score(&self) -> (f32, f32) {
        self.beam.get(0).map_or((0.0, 0.0), |best| (best.evidence, best.surplus))
    }

    /// Scores a given path on the current record, after a search of some moves.
    pub fn debug_limit(&mut self, path: &[u8], moves: u32) -> (f32, bool) {
        let Some(best) = self.beam.get(0) else { return (0.0, false) };
        self.draft.clone_from(best);
        self.draft.path[..path.len()].copy_from_slice(path);
        self.draft.vertices = path.iter().max().map_or(0, |last| last + 1);
        self.draft.rebuild(&self.prices, &self.record);
        self.model.read(&self.prices, &self.record, &self.draft, Weighing::Expected);
        self.draft.surplus =
            self.prices.weight * self.forward.surplus(&self.prices, &self.record, &self.model, &self.draft);
        if self.config.soft == 0 {
            self.draft.surplus = 0.0;
        }
        let truth = self.draft.score();
        let key = self.draft.key();
        self.beam.begin_with(&self.draft);
        let mut random = Xoshiro128PlusPlus::seed_from_u64(1);
        for number in 0..moves {
            self.repair(number as u8, &mut random);
        }
        self.publish();
        (truth, self.beam.get(0).is_some_and(|best| best.key() == key))
    }
}

impl<const N: usize, const V: usize, const HISTORY: usize> Default for RobustFilter<N, V, HISTORY> {
    fn default() -> Self {
        Self::new()
    }
}
