//! The robust filter as a candidate.

use super::{Candidate, MAX_HYPOTHESES, Start, VERTICES};
use crate::{
    settings::{EvaluationError, Filter, Settings},
    trial::Trial,
};
use toposlam::Filter as _;
use toposlam::{FaultKind, Fingerprint, Map, Observation, RobustConfig, RobustFilter, VertexId};

/// Largest number of vertices of a map of the robust filter.
const ROBUST_VERTICES: usize = 32;
/// Largest number of places of the prior's n-grams and the path together.
const MAX_HISTORY: usize = 16384;

/// `places` is the number of places of the n-grams and the path together. Each filter takes seconds to compile, so
/// there is one for the usual case and one for the largest.
pub(super) fn choose(hypotheses: usize, places: usize) -> Result<Start, EvaluationError> {
    match (hypotheses, places) {
        (0..=10, 0..=512) => Ok(Robust::<10, 512>::start),
        (_, 0..=MAX_HISTORY) => Ok(Robust::<MAX_HYPOTHESES, MAX_HISTORY>::start),
        _ => Err(EvaluationError::PathTooLong { most: MAX_HISTORY }),
    }
}

struct Robust<const N: usize, const HISTORY: usize>(Box<RobustFilter<N, ROBUST_VERTICES, HISTORY>>);

impl<const N: usize, const HISTORY: usize> Robust<N, HISTORY> {
    fn start(settings: &Settings, trial: &Trial) -> Box<dyn Candidate> {
        let mut filter = Box::new(RobustFilter::new());
        let config = if let Filter::Robust(config) = settings.filter { config } else { RobustConfig::DEFAULT };
        // Coarser fingerprints have wider steps.
        let resolution_mm = Fingerprint::STEP_MM << Fingerprint::BITS.saturating_sub(settings.fingerprint_bits);
        let config = config.with_resolution_mm(resolution_mm.min(1000));
        let started = filter.start(config, trial.filter_seed);
        assert!(started.is_ok(), "the configuration was checked");
        Box::new(Self(filter))
    }
}

impl<const N: usize, const HISTORY: usize> Candidate for Robust<N, HISTORY> {
    fn observe(&mut self, observation: Observation) {
        self.0.observe(observation);
    }

    fn refine(&mut self, steps: u32) {
        (0..steps).for_each(|_| self.0.refine());
    }

    fn search_from(&self, path: &[VertexId], steps: u32) -> Option<(Map<VERTICES>, Vec<usize>)> {
        let mut search = Self(self.0.clone());
        search.0.assume_path(path)?;
        search.refine(steps);
        search.0.refresh();
        Some((search.map(), search.path(path.len())))
    }

    fn map(&self) -> Map<VERTICES> {
        let best = self.0.map();
        let mut map = Map::new();
        for &label in best.labels() {
            // The larger map has room for it.
            let _ = map.add_vertex(label);
        }
        best.edges().for_each(|(a, b)| map.add_edge(a, b));
        map
    }

    fn path(&self, places: usize) -> Vec<usize> {
        let path: Vec<usize> = self.0.path().map(usize::from).collect();
        path[path.len().saturating_sub(places)..].to_vec()
    }

    fn vertices_full(&self) -> u32 {
        self.0.faults().count(FaultKind::VerticesFull)
    }
}
