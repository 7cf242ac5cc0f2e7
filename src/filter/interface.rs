//! What the stages around a filter ask of it.

use super::robust::NGRAM_LENGTH;
use super::{PaperFilter, RobustConfig, RobustFilter, Update, WorstNgram};
use crate::{Config, ConfigError, FaultCounters, Map, Observation, VertexId};

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

    /// Goes on with other settings; what was observed stays.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is out of its range; the filter goes on as it was.
    fn set_config(&mut self, config: Self::Config) -> Result<(), ConfigError>;

    /// Takes the next place.
    fn observe(&mut self, observation: Observation) -> Update;

    /// Goes on thinking for one slice of the time between two places; a filter with nothing to think about does nothing.
    /// The next [`Filter::observe`] tells what came out.
    fn polish(&mut self) {}

    /// The best map.
    fn map(&self) -> &Map<V>;

    /// What went wrong since the start: full tables.
    fn faults(&self) -> &FaultCounters;

    /// The vertex of a place by the best path, so many places ago, 0 for the newest; `None` when the filter does not
    /// remember that.
    fn recent(&self, ago: usize) -> Option<VertexId>;

    /// The probability that the robot is at a vertex of the best map.
    fn place_probability_q16(&self, vertex: VertexId) -> u32;

    /// The probability that the best map is right, relative to its rivals.
    fn map_probability_q16(&self) -> u32;

    /// For each vertex before the last update its number now; `None` when it is gone. A vertex that was merged into
    /// another has the number of the other.
    fn renamed(&self, before: VertexId) -> Option<VertexId>;

    /// The n-gram of the history that the best map explains worst.
    fn worst(&self) -> WorstNgram;

    /// Whether the best map does not explain what was observed, so that more polishing is worth its while.
    fn is_in_doubt(&self) -> bool {
        false
    }
}

impl<const N: usize, const V: usize, const HISTORY: usize> Filter<V> for RobustFilter<N, V, HISTORY> {
    type Config = RobustConfig;

    const UNSTARTED: Self = Self::new();

    fn capacities(config: &RobustConfig) -> FilterCapacities {
        FilterCapacities {
            hypotheses: config.hypotheses.into(),
            history: HISTORY as u16,
            ngram_length: NGRAM_LENGTH as u8,
        }
    }

    fn start(&mut self, config: RobustConfig, seed: u64) -> Result<(), ConfigError> {
        self.start(config, seed)
    }

    fn set_config(&mut self, config: RobustConfig) -> Result<(), ConfigError> {
        self.set_config(config)
    }

    fn observe(&mut self, observation: Observation) -> Update {
        self.observe(observation)
    }

    fn polish(&mut self) {
        self.polish();
    }

    fn map(&self) -> &Map<V> {
        self.map()
    }

    fn faults(&self) -> &FaultCounters {
        self.faults()
    }

    fn recent(&self, ago: usize) -> Option<VertexId> {
        self.recent(ago)
    }

    fn place_probability_q16(&self, vertex: VertexId) -> u32 {
        self.place_probability_q16(vertex)
    }

    fn map_probability_q16(&self) -> u32 {
        self.map_probability_q16()
    }

    fn renamed(&self, before: VertexId) -> Option<VertexId> {
        self.renamed(before)
    }

    fn worst(&self) -> WorstNgram {
        self.worst()
    }

    fn is_in_doubt(&self) -> bool {
        self.is_in_doubt()
    }
}

/// The paper's filter reads the fingerprint alone. Its best particle is certain of its place, and the share of the draws
/// that chose it stands for the probability of its map. It remembers no path, only where it is. Vertices keep their numbers
/// within a particle and mean nothing in another one, so no vertex is told to be another. It knows how far its map is from the
/// history, not which n-gram is.
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

    fn set_config(&mut self, config: Config) -> Result<(), ConfigError> {
        self.set_config(config)
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

    fn recent(&self, ago: usize) -> Option<VertexId> {
        (self.observed() > 0 && ago == 0).then(|| self.best().at)
    }

    fn place_probability_q16(&self, vertex: VertexId) -> u32 {
        if self.observed() > 0 && vertex == self.best().at { 1 << 16 } else { 0 }
    }

    fn map_probability_q16(&self) -> u32 {
        let draws: u32 = self.particles().iter().map(|particle| u32::from(particle.multiplicity)).sum();
        // All draws are those of one particle or more, so the share is 1 at most.
        ((u32::from(self.best().multiplicity) << 16) / draws.max(1)).min(1 << 16)
    }

    fn renamed(&self, before: VertexId) -> Option<VertexId> {
        self.map().contains(before).then_some(before)
    }

    fn worst(&self) -> WorstNgram {
        WorstNgram { distance_mm: self.best().consistency_mm, ..WorstNgram::NONE }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Fingerprint;

    /// After radii in millimetres, places of 1.2 m and 2.2 m being far apart.
    fn after<F: Filter<4>>(config: F::Config, radii_mm: &[u16]) -> F {
        let mut filter = F::UNSTARTED;
        filter.start(config, 1).unwrap();
        for &radius_mm in radii_mm {
            filter.observe(Observation::new(Fingerprint::from_radius_mm(radius_mm).unwrap()));
        }
        filter
    }

    type Paper = PaperFilter<10, 4, 1>;

    #[test]
    fn the_paper_s_filter_is_certain_of_its_place_and_trusts_its_map_by_its_draws() {
        let filter: Paper = after(Config::DEFAULT, &[]);
        assert_eq!((filter.place_probability_q16(VertexId::FIRST), Filter::map_probability_q16(&filter)), (0, 0));
        let filter: Paper = after(Config::DEFAULT, &[1200, 2200, 1200, 2200]);
        let at = filter.best().at;
        for vertex in VertexId::first(4) {
            assert_eq!(filter.place_probability_q16(vertex), if vertex == at { 1 << 16 } else { 0 });
            let has_it = filter.best().map.contains(vertex);
            assert_eq!(Filter::renamed(&filter, vertex), has_it.then_some(vertex));
        }
        let share = (u32::from(filter.best().multiplicity) << 16) / 10;
        assert_eq!(filter.map_probability_q16(), share);
        assert_eq!(filter.worst(), WorstNgram { distance_mm: filter.best().consistency_mm, ..WorstNgram::NONE });
    }

    #[test]
    fn capacities_follow_the_settings() {
        let config = Config { particles: 3, ngram_length: 4, ..Config::DEFAULT };
        let expected = FilterCapacities { hypotheses: 3, history: 32, ngram_length: 4 };
        assert_eq!(Paper::capacities(&config), expected);
        let config = RobustConfig { hypotheses: 6, ..RobustConfig::DEFAULT };
        let capacities = RobustFilter::<10, 4, 50>::capacities(&config);
        assert_eq!((capacities.hypotheses, capacities.history), (6, 50));
    }
}
