//! What the stages around a filter ask of it.

use super::{ConfigError, PaperFilter, RobustConfig, RobustFilter, Update, WorstNgram};
use crate::{Config, FaultCounters, Map, Observation};

/// What a filter with some settings has room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilterCapacities {
    /// The most hypotheses.
    pub hypotheses: u16,
    /// The most observations that are remembered.
    pub history: u16,
    /// The length of the n-grams.
    pub ngram_length: u8,
}

/// A filter: it takes one observation after the other, and its best map has at most `V` vertices.
///
/// Probabilities are in units of 2⁻¹⁶.
pub trait Filter<const V: usize>: Sized {
    /// The settings.
    type Config: Copy;

    /// A filter that waits for [`Filter::start`].
    const UNSTARTED: Self;

    /// What the filter has room for with some settings.
    fn capacities(config: &Self::Config) -> FilterCapacities;

    /// Forgets everything and starts anew with some settings and a seed.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is out of its range.
    fn start(&mut self, config: Self::Config, seed: u64) -> Result<(), ConfigError>;

    /// Takes the next place.
    fn observe(&mut self, observation: Observation) -> Update;

    /// The best map.
    fn map(&self) -> &Map<V>;

    /// What went wrong since the start: full tables.
    fn faults(&self) -> &FaultCounters;

    /// The probability that the robot is at a vertex of the best map.
    fn place_probability_q16(&self, vertex: u8) -> u32;

    /// The probability that the best map is right, relative to its rivals.
    fn map_probability_q16(&self) -> u32;

    /// For each vertex before the last update its number now; `None` when it is gone. A vertex that was merged into
    /// another has the number of the other.
    fn renamed(&self, before: u8) -> Option<u8>;

    /// The n-gram of the history that the best map explains worst.
    fn worst(&self) -> WorstNgram;
}

/// How many labels the n-gram has that the robust filter tells of.
const ROBUST_NGRAM_LENGTH: u8 = 5;

impl<const N: usize, const V: usize, const HISTORY: usize> Filter<V> for RobustFilter<N, V, HISTORY> {
    type Config = RobustConfig;

    const UNSTARTED: Self = Self::new();

    fn capacities(config: &RobustConfig) -> FilterCapacities {
        FilterCapacities {
            hypotheses: config.hypotheses.into(),
            history: HISTORY as u16,
            ngram_length: ROBUST_NGRAM_LENGTH,
        }
    }

    fn start(&mut self, config: RobustConfig, seed: u64) -> Result<(), ConfigError> {
        self.start(config, seed)
    }

    fn observe(&mut self, observation: Observation) -> Update {
        self.observe(observation)
    }

    fn map(&self) -> &Map<V> {
        self.map()
    }

    fn faults(&self) -> &FaultCounters {
        self.faults()
    }

    fn place_probability_q16(&self, vertex: u8) -> u32 {
        self.place_probability_q16(vertex)
    }

    fn map_probability_q16(&self) -> u32 {
        self.map_probability_q16()
    }

    fn renamed(&self, before: u8) -> Option<u8> {
        self.renamed(before)
    }

    fn worst(&self) -> WorstNgram {
        self.worst()
    }
}

/// The paper's filter reads the fingerprint alone. Its best particle is certain of its place, and the share of the draws
/// that chose it stands for the probability of its map. Vertices keep their numbers within a particle and mean nothing in
/// another one, so no vertex is told to be another. It knows how far its map is from the history, not which n-gram is.
impl<const N: usize, const V: usize, const WORDS: usize> Filter<V> for PaperFilter<N, V, WORDS> {
    type Config = Config;

    const UNSTARTED: Self = Self::new();

    fn capacities(config: &Config) -> FilterCapacities {
        FilterCapacities {
            hypotheses: config.particles.into(),
            history: (32 * WORDS) as u16,
            ngram_length: config.ngram_length,
        }
    }

    fn start(&mut self, config: Config, seed: u64) -> Result<(), ConfigError> {
        self.start(config, seed)
    }

    fn observe(&mut self, observation: Observation) -> Update {
        self.observe(observation.fingerprint)
    }

    fn map(&self) -> &Map<V> {
        self.map()
    }

    fn faults(&self) -> &FaultCounters {
        self.faults()
    }

    fn place_probability_q16(&self, vertex: u8) -> u32 {
        if self.observed() > 0 && vertex == self.best().place { 1 << 16 } else { 0 }
    }

    fn map_probability_q16(&self) -> u32 {
        let draws: u32 = self.particles().iter().map(|particle| u32::from(particle.multiplicity)).sum();
        // All draws are those of one particle or more, so the share is 1 at most.
        ((u32::from(self.best().multiplicity) << 16) / draws.max(1)).min(1 << 16)
    }

    fn renamed(&self, before: u8) -> Option<u8> {
        (before < self.map().vertices()).then_some(before)
    }

    fn worst(&self) -> WorstNgram {
        WorstNgram { distance_mm: self.best().consistency_mm, ..WorstNgram::NONE }
    }
}
