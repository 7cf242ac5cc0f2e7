//! A filter without a map that records its observations.

use toposlam::persist::Persist;
use toposlam::persist::snapshot::{Reader, SnapshotError, Writer};
use toposlam::reference::VERTICES;
use toposlam::{
    ConfigError, FaultCounters, Filter, FilterCapacities, Map, Observation, RobustFactors, Update, VertexId,
    WeightFactors, WorstNgram,
};

/// The observations that a mapper passed to its filter. The configuration is the capacity of its history, which a snapshot contains; 0 is out of range.
pub struct Notes {
    pub observations: Vec<Observation>,
    pub history: u16,
    map: Map<VERTICES>,
    faults: FaultCounters,
}

impl Filter<VERTICES> for Notes {
    type Config = u16;

    const UNSTARTED: Self =
        Self { observations: Vec::new(), history: 0, map: Map::new(), faults: FaultCounters::new() };

    fn capacities(&history: &u16) -> FilterCapacities {
        FilterCapacities { hypotheses: 7, history, ngram_length: 3 }
    }

    fn start(&mut self, history: u16, _: u64) -> Result<(), ConfigError> {
        self.history = history;
        if history > 0 {
            return Ok(());
        }
        Err(ConfigError::OutOfRange { field: "history", value: 0, min: 1, max: u16::MAX.into() })
    }

    fn config(&self) -> &u16 {
        &self.history
    }

    fn set_config(&mut self, _: u16) -> Result<(), ConfigError> {
        Ok(())
    }

    fn observe(&mut self, observation: impl Into<Observation>) -> Update {
        self.observations.push(observation.into());
        Update {
            place_index: self.observations.len() as u32 - 1,
            vertex: VertexId::FIRST,
            is_new: false,
            consistency_mm: 0,
            factors: WeightFactors::Robust(RobustFactors { ln_labels_q16: 0, ln_moves_q16: 0, ln_size_q16: 0 }),
            lead_q16: 0,
            distinct: 1,
        }
    }

    fn map(&self) -> &Map<VERTICES> {
        &self.map
    }

    fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    fn recent(&self, _: usize) -> Option<VertexId> {
        None
    }

    fn vertex_probability_q16(&self, _: VertexId) -> u32 {
        0
    }

    fn map_probability_q16(&self) -> u32 {
        0
    }

    fn remapped(&self, before: VertexId) -> Option<VertexId> {
        Some(before)
    }

    fn worst(&self) -> WorstNgram {
        WorstNgram::NONE
    }
}

impl Persist for Notes {
    const SECTION: u8 = 1;

    fn save(&mut self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.u16(self.history)
    }

    fn check(&mut self, mut section: Reader<'_>) -> Result<(), SnapshotError> {
        section.u16()?;
        section.finish()
    }

    fn restore(&mut self, mut section: Reader<'_>) -> Result<(), SnapshotError> {
        self.check(section)?;
        self.history = section.u16()?;
        Ok(())
    }
}
