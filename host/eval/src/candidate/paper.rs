//! The paper's filter as a candidate, with the n-grams of its own history or of a prior.

use super::{Candidate, MAX_HYPOTHESES, Start, VERTICES, probability};
use crate::{
    ancestry::Ancestry,
    prior::{PriorSource, path_prior, table_prior},
    settings::{EvaluationError, Filter, Settings},
    trial::Trial,
};
use std::ptr;
use toposlam::Filter as _;
use toposlam::{FaultKind, Fingerprint, Map, Observation, PaperConfig, PaperFilter, Prior};

/// Largest number of places of a path without a prior.
pub(super) const MAX_PLACES: usize = 2048;

pub(super) fn choose(settings: &Settings, ngrams: usize) -> Result<Start, EvaluationError> {
    if settings.prior == PriorSource::None {
        // A word of history holds 32 places.
        return match settings.longest() {
            0..=256 => Ok(Online::<8>::start),
            257..=MAX_PLACES => Ok(Online::<64>::start),
            _ => Err(EvaluationError::PathTooLong { most: MAX_PLACES }),
        };
    }
    // A word of a table holds 16 n-grams.
    match ngrams {
        0..=1024 => Ok(Informed::<64>::start),
        _ => Ok(Informed::<512>::start),
    }
}

/// The filter and the paths of its particles.
struct Particles<const WORDS: usize> {
    filter: Box<PaperFilter<MAX_HYPOTHESES, VERTICES, WORDS>>,
    ancestry: Ancestry,
}

impl<const WORDS: usize> Particles<WORDS> {
    fn start(settings: &Settings, trial: &Trial) -> Self {
        let mut filter = Box::new(PaperFilter::new());
        let config = if let Filter::Paper(config) = settings.filter { config } else { PaperConfig::DEFAULT };
        let started = filter.start(config, trial.filter_seed);
        assert!(started.is_ok(), "the configuration was checked");
        Self { filter, ancestry: Ancestry::new() }
    }

    fn advance(&mut self) {
        let particles = self.filter.particles().iter();
        self.ancestry.advance(particles.map(|particle| (particle.parent.into(), particle.at.into())));
    }

    /// The newest vertices that the best particle visited.
    fn path(&self, places: usize) -> Vec<Option<usize>> {
        let best = self.filter.best();
        let index = self.filter.particles().iter().position(|particle| ptr::eq(particle, best));
        let path = self.ancestry.path(index.unwrap_or(0));
        path[path.len().saturating_sub(places)..].iter().copied().map(Some).collect()
    }
}

/// The filter without a prior: the n-grams are those of the path so far.
struct Online<const WORDS: usize>(Particles<WORDS>);

impl<const WORDS: usize> Online<WORDS> {
    fn start(settings: &Settings, trial: &Trial) -> Box<dyn Candidate> {
        Box::new(Self(Particles::start(settings, trial)))
    }
}

impl<const WORDS: usize> Candidate for Online<WORDS> {
    fn observe(&mut self, observation: Observation) {
        self.0.filter.observe(observation.fingerprint);
        self.0.advance();
    }

    fn refine(&mut self, _steps: u32) {}

    fn map(&self) -> Map<VERTICES> {
        *self.0.filter.map()
    }

    fn path(&self, places: usize) -> Vec<Option<usize>> {
        self.0.path(places)
    }

    fn map_probability(&self) -> f64 {
        probability(self.0.filter.map_probability_q16())
    }

    fn vertices_full(&self) -> u32 {
        self.0.filter.faults().count(FaultKind::VerticesFull)
    }
}

/// The filter with a prior. It does not use its own history, so the shortest one is enough.
struct Informed<const WORDS: usize> {
    particles: Particles<1>,
    prior: Box<Prior<VERTICES, WORDS>>,
}

impl<const WORDS: usize> Informed<WORDS> {
    fn start(settings: &Settings, trial: &Trial) -> Box<dyn Candidate> {
        Box::new(Self { particles: Particles::start(settings, trial), prior: prior(settings, trial) })
    }
}

impl<const WORDS: usize> Candidate for Informed<WORDS> {
    fn observe(&mut self, observation: Observation) {
        self.particles.filter.observe_with_prior(observation.fingerprint, &mut self.prior);
        self.particles.advance();
    }

    fn refine(&mut self, _steps: u32) {}

    fn map(&self) -> Map<VERTICES> {
        *self.particles.filter.map()
    }

    fn path(&self, places: usize) -> Vec<Option<usize>> {
        self.particles.path(places)
    }

    fn map_probability(&self) -> f64 {
        probability(self.particles.filter.map_probability_q16())
    }

    fn vertices_full(&self) -> u32 {
        self.particles.filter.faults().count(FaultKind::VerticesFull)
    }
}

/// The n-grams of a trial's prior, in a table that has room for them.
pub(crate) fn prior<const WORDS: usize>(settings: &Settings, trial: &Trial) -> Box<Prior<VERTICES, WORDS>> {
    let fingerprint = |visit: &crate::trial::Visit| visit.observation.fingerprint;
    let prior = if settings.prior == PriorSource::Path {
        path_prior(&trial.visits.iter().map(fingerprint).collect::<Vec<_>>(), settings.ngram_length)
    } else {
        let ngrams = trial.ngrams.iter().map(|ngram| ngram.iter().map(fingerprint).collect::<Vec<Fingerprint>>());
        table_prior(ngrams, settings.ngram_length)
    };
    prior.unwrap_or_else(|_| unreachable!("the table was chosen to have room"))
}
