//! The interface of a filter.

use super::{Update, WorstNgram};
use crate::config_error::ConfigError;
use crate::fault::FaultCounters;
use crate::filter::Observation;
use crate::map::{DartId, Darts, Map, VertexId};

/// A map of a lower probability is [uncertain](Filter::is_uncertain): it is more probably wrong than right.
pub const CERTAIN_Q16: u32 = 1 << 15;

/// The capacities of a filter with a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilterCapacities {
    /// The largest number of hypotheses.
    pub hypotheses: u16,
    /// The largest number of places in the history.
    pub history: u16,
    /// The length of the n-grams.
    pub ngram_length: u8,
}

/// A filter that maps and localises: it takes one observation after the other. Its best map has at most `V` vertices.
///
/// Probabilities are in units of 2⁻¹⁶.
pub trait Filter<const V: usize>: Sized {
    /// The parameters.
    type Config: Copy;

    /// A filter that waits for [`Filter::start`].
    const UNSTARTED: Self;

    /// The capacities with a configuration.
    fn capacities(config: &Self::Config) -> FilterCapacities;

    /// Resets the filter, with a configuration and the seed of its random draws.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range; the filter does not change then.
    fn start(&mut self, config: Self::Config, seed: u64) -> Result<(), ConfigError>;

    /// The configuration in use. A restored snapshot brings its own.
    fn config(&self) -> &Self::Config;

    /// Replaces the configuration. The filter keeps what it observed.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range; the filter does not change then.
    fn set_config(&mut self, config: Self::Config) -> Result<(), ConfigError>;

    /// Takes the next place and publishes the best map. Without [`Filter::refine`] between two places the map is rarely right.
    fn observe(&mut self, observation: impl Into<Observation>) -> Update;

    /// Runs one refinement step, in the time between two places. The next [`Filter::observe`] publishes the result. A filter
    /// without refinement does nothing.
    fn refine(&mut self) {}

    /// The best map.
    fn map(&self) -> &Map<V>;

    /// The ways of the best map: [`Filter::map`] with the order and the bearings of the ways. `None` for a filter that knows
    /// edges only.
    fn darts(&self) -> Option<Darts<'_>> {
        None
    }

    /// The way by which the robot came to the newest place, on the best map. `None` for a filter that knows edges only, and
    /// after a place that starts a sequence.
    fn arrival(&self) -> Option<DartId> {
        None
    }

    /// The way by which the robot came to the place before the last `ago` places, on the best map; `None` where it is not in the history.
    fn recent_arrival(&self, _ago: usize) -> Option<DartId> {
        None
    }

    /// Faults since the start: full tables, invalid hints.
    fn faults(&self) -> &FaultCounters;

    /// The vertex of the place `ago` places before the newest, on the best path; `None` when the filter does not know it.
    fn recent(&self, ago: usize) -> Option<VertexId>;

    /// The probability that the robot is at a vertex of the best map.
    fn vertex_probability_q16(&self, vertex: VertexId) -> u32;

    /// The probability that the best map is right: its share among the maps of all hypotheses, and with the robust filter among
    /// those that it may have missed.
    fn map_probability_q16(&self) -> u32;

    /// Whether the best map is more probably wrong than right: its probability is less than [`CERTAIN_Q16`].
    fn is_uncertain(&self) -> bool {
        self.map_probability_q16() < CERTAIN_Q16
    }

    /// The id after the last update of a vertex by its id before. A vertex that was merged into another has the id of the
    /// other; `None` for a vertex that was removed.
    fn remapped(&self, before: VertexId) -> Option<VertexId>;

    /// The n-gram of the history that the best map explains worst.
    fn worst(&self) -> WorstNgram;

    /// Whether the best map does not explain the history, so that more refinement is worth its time.
    fn is_in_doubt(&self) -> bool {
        false
    }

    /// Switches between mapping and localisation alone, in which the map does not change. A filter that always maps ignores it.
    fn set_localise_only(&mut self, localise_only: bool) {
        let _ = localise_only;
    }

    /// Whether the filter only localises.
    fn is_localise_only(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{PaperConfig, PaperFilter, RobustConfig, RobustFilter};
    use crate::place::Fingerprint;

    /// A filter after places of some radii. Places of 1.2 m and 2.2 m are far apart.
    fn after<F: Filter<4>>(config: F::Config, radii_mm: &[u16]) -> F {
        let mut filter = F::UNSTARTED;
        filter.start(config, 1).unwrap();
        for &radius_mm in radii_mm {
            filter.observe(Fingerprint::from_radius_mm(radius_mm).unwrap());
        }
        filter
    }

    type Paper = PaperFilter<10, 4, 1>;

    #[test]
    fn the_paper_s_filter_has_one_vertex_and_the_share_of_its_draws_as_map_probability() {
        let filter: Paper = after(PaperConfig::DEFAULT, &[]);
        assert_eq!((filter.vertex_probability_q16(VertexId::FIRST), filter.map_probability_q16()), (0, 0));
        let filter: Paper = after(PaperConfig::DEFAULT, &[1200, 2200, 1200, 2200]);
        let at = filter.best().at;
        for vertex in VertexId::first(4) {
            assert_eq!(filter.vertex_probability_q16(vertex), if vertex == at { 1 << 16 } else { 0 });
            let has_it = filter.best().map.contains(vertex);
            assert_eq!(filter.remapped(vertex), has_it.then_some(vertex));
        }
        let share = (u32::from(filter.best().multiplicity) << 16) / 10;
        assert_eq!(filter.map_probability_q16(), share);
        assert_eq!(filter.worst(), WorstNgram { distance_mm: filter.best().consistency_mm, ..WorstNgram::NONE });
    }

    #[test]
    fn capacities_follow_the_configuration() {
        let config = PaperConfig { particles: 3, ngram_length: 4, ..PaperConfig::DEFAULT };
        let expected = FilterCapacities { hypotheses: 3, history: 32, ngram_length: 4 };
        assert_eq!(Paper::capacities(&config), expected);
        let config = RobustConfig { hypotheses: 6, ..RobustConfig::DEFAULT };
        let capacities = RobustFilter::<10, 4, 50>::capacities(&config);
        assert_eq!((capacities.hypotheses, capacities.history), (6, 50));
    }
}
