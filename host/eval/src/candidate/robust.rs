//! The robust filter as a candidate.

use super::{Candidate, MAX_HYPOTHESES, Start, VERTICES, probability, widened};
use crate::{
    settings::{EvaluationError, Filter, Settings},
    trial::{Trial, Truth},
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

    fn search_from(&self, _: &Trial, truth: &Truth, steps: u32) -> Option<Box<dyn Candidate>> {
        // The filter numbers vertices by first visit.
        let mut seen = Vec::new();
        let number = |class: &usize| {
            let number = seen.iter().position(|known| known == class).unwrap_or_else(|| {
                seen.push(*class);
                seen.len() - 1
            });
            VertexId::new(u8::try_from(number).ok()?)
        };
        let path: Vec<VertexId> = truth.classes.iter().map(number).collect::<Option<_>>()?;
        let mut search = Self(self.0.clone());
        search.0.assume_path(&path)?;
        search.refine(steps);
        search.0.refresh();
        Some(Box::new(search))
    }

    fn map(&self) -> Map<VERTICES> {
        widened(self.0.map())
    }

    fn path(&self, places: usize) -> Vec<Option<usize>> {
        let path: Vec<Option<usize>> = self.0.path().map(|vertex| Some(vertex.index())).collect();
        path[path.len().saturating_sub(places)..].to_vec()
    }

    fn map_probability(&self) -> f64 {
        probability(self.0.map_probability_q16())
    }

    fn vertices_full(&self) -> u32 {
        self.0.faults().count(FaultKind::VerticesFull)
    }
}
