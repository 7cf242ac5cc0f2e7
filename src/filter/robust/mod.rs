//! The robust filter: distinct hypotheses with a collapsed evidence, repaired by moves.

mod config;

pub use config::RobustConfig;

use super::{ConfigError, Update, WeightFactors};
use crate::{FaultCounters, Map, Observation};

/// STUB: being written; only the interface counts.
#[derive(Clone, Debug)]
pub struct RobustFilter<const N: usize, const V: usize, const HISTORY: usize> {
    map: Map<V>,
    path: [u8; HISTORY],
    observed: u32,
    faults: FaultCounters,
}

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// A filter that is yet to be started.
    pub const fn new() -> Self {
        Self { map: Map::new(), path: [0; HISTORY], observed: 0, faults: FaultCounters::new() }
    }

    /// Forgets everything and starts anew with a configuration and a seed.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range.
    pub fn start(&mut self, config: RobustConfig, _seed: u64) -> Result<(), ConfigError> {
        config.check(N)?;
        self.map.clear();
        self.observed = 0;
        Ok(())
    }

    /// Takes the next place.
    pub fn observe(&mut self, observation: impl Into<Observation>) -> Update {
        let observation: Observation = observation.into();
        if self.map.vertices() == 0 {
            let _ = self.map.add_vertex(observation.fingerprint);
        } else {
            self.map.observe(0, observation.fingerprint);
        }
        self.observed += 1;
        Update {
            place_index: self.observed - 1,
            vertex: 0,
            is_new: self.observed == 1,
            consistency_mm: 0,
            factors: WeightFactors::ONE,
            lead_q16: 0,
            distinct: 1,
        }
    }

    /// The best map.
    pub fn map(&self) -> &Map<V> {
        &self.map
    }

    /// The vertex of the best map that each of the newest `HISTORY` places was taken for, the oldest first: the path of
    /// the best hypothesis as it sees the past now.
    pub fn path(&self) -> impl Iterator<Item = u8> + '_ {
        self.path.iter().copied().take(self.observed as usize)
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
}

impl<const N: usize, const V: usize, const HISTORY: usize> Default for RobustFilter<N, V, HISTORY> {
    fn default() -> Self {
        Self::new()
    }
}
