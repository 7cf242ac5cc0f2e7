//! The paper's particle filter: topological SLAM from a sequence of fingerprints (Section III).

mod config;
mod consistency;
mod history;
mod likelihood;
mod ngram;
mod particle;
mod particles;
mod prior;
mod resample;
mod selection;
#[cfg(feature = "_test")]
mod testing;

pub use config::PaperConfig;
pub use consistency::{Consistency, Direction, Evidence};
pub use history::History;
pub use ngram::{Ngram, NgramError, NgramLength, NgramTable, NgramsFull};
pub use particle::Particle;
pub use prior::Prior;

use super::{Filter, FilterCapacities, Update, WeightFactors, WorstNgram, draws};
use crate::config_error::ConfigError;
use crate::fault::{FaultCounters, FaultKind};
use crate::filter::Observation;
use crate::map::{Map, VertexId};
use crate::place::Fingerprint;
use particles::{Particles, Step};
use rand_core::Rng;

/// The particle filter of the paper with at most `N` particles, maps of at most `V` vertices, and the newest
/// `32 · WORDS` observations as evidence.
///
/// The filter is const-constructed, so that a `static` of it is in `.bss`, and initialised in place by
/// [`Filter::start`]. Equal draws of one candidate are held once, with a multiplicity. Memory: about
/// `2 · N · (18 · V + 32) + 8 · N · V + 44 · V · (WORDS + 1) + 120 · WORDS + 1500` bytes.
///
/// ```
/// use toposlam::{Filter, Fingerprint, PaperConfig, PaperFilter};
///
/// let mut filter = PaperFilter::<10, 16, 8>::new();
/// filter.start(PaperConfig::default(), 1)?;
/// for radius_mm in [1200, 2200, 1200, 2200, 1200] {
///     filter.observe(Fingerprint::from_radius_mm(radius_mm)?);
/// }
/// let best = filter.best();
/// assert_eq!((best.map.vertices().len(), best.at.index()), (2, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct PaperFilter<const N: usize, const V: usize, const WORDS: usize> {
    pub(crate) config: PaperConfig,
    pub(crate) seed: u64,
    pub(crate) observed: u32,
    pub(crate) particles: Particles<N, V>,
    pub(crate) history: History<WORDS>,
    pub(crate) consistency: Consistency<V, WORDS, 1>,
    pub(crate) faults: FaultCounters,
}

impl<const N: usize, const V: usize, const WORDS: usize> PaperFilter<N, V, WORDS> {
    /// A filter that ignores observations until [`Filter::start`].
    pub const fn new() -> Self {
        const { assert!(N >= 1 && N <= 255, "a filter has 1 to 255 particles") };
        Self {
            config: PaperConfig::UNSET,
            seed: 0,
            observed: 0,
            particles: Particles::new(),
            history: History::new(),
            consistency: Consistency::new(),
            faults: FaultCounters::new(),
        }
    }

    /// As [`Filter::observe`], with Γ_env from an earlier exploration, as the paper assumes. The length of its n-grams is that of
    /// the prior.
    pub fn observe_with_prior<const PRIOR_WORDS: usize>(
        &mut self,
        fingerprint: Fingerprint,
        prior: &mut Prior<V, PRIOR_WORDS>,
    ) -> Update {
        let random = self.random();
        self.step_with_prior(fingerprint, prior, random)
    }

    /// Takes the next place: Γ_env is what the history contains, this observation included. `random` gives the random draws:
    /// for each particle in turn, one that proposes a prediction and one that accepts or rejects it, until one is accepted.
    /// After 128 proposals all predictions are weighed in full, and one draw chooses each particle that is still missing.
    fn step(&mut self, fingerprint: Fingerprint, random: impl FnMut() -> u32) -> Update {
        self.remember(fingerprint);
        let evidence = (&self.history, &mut self.consistency);
        let length = NgramLength::new(self.config.ngram_length).unwrap_or(NgramLength::MIN);
        let step = self.particles.step(length, self.config.direction, fingerprint, random, evidence);
        self.finish(step)
    }

    /// As [`PaperFilter::step`], with Γ_env from an earlier exploration.
    fn step_with_prior<const PRIOR_WORDS: usize>(
        &mut self,
        fingerprint: Fingerprint,
        prior: &mut Prior<V, PRIOR_WORDS>,
        random: impl FnMut() -> u32,
    ) -> Update {
        self.remember(fingerprint);
        let length = prior.ngrams().length();
        let step = self.particles.step(length, self.config.direction, fingerprint, random, prior.split());
        self.finish(step)
    }

    /// The random draws of the next place.
    fn random(&self) -> impl FnMut() -> u32 + use<N, V, WORDS> {
        let mut random = draws(self.seed, self.observed.into());
        move || random.next_u32()
    }

    fn length(&self) -> NgramLength {
        NgramLength::new(self.config.ngram_length).unwrap_or(NgramLength::MIN)
    }

    fn remember(&mut self, fingerprint: Fingerprint) {
        if self.history.push(fingerprint).is_some() {
            self.faults.record(FaultKind::HistoryFull);
        }
        let length = self.length();
        self.consistency.include_newest(&self.history, length);
    }

    fn finish(&mut self, step: Step) -> Update {
        if step.vertices_full {
            self.faults.record(FaultKind::VerticesFull);
        }
        let best = self.best();
        let update = Update {
            place_index: self.observed,
            vertex: best.at,
            is_new: best.map.visits(best.at) == 1,
            consistency_mm: best.consistency_mm,
            factors: WeightFactors::Paper(best.factors),
            lead_q16: step.lead_q16,
            distinct: self.particles.distinct(),
        };
        self.observed = self.observed.wrapping_add(1);
        update
    }

    /// The particle with the largest weight among those that the last resampling kept.
    pub fn best(&self) -> &Particle<V> {
        self.particles.best()
    }

    /// The distinct particles, in the order of the pool they were drawn from.
    pub fn particles(&self) -> &[Particle<V>] {
        self.particles.all()
    }

    /// The newest observations.
    pub fn history(&self) -> &History<WORDS> {
        &self.history
    }

    /// How many places were observed.
    pub fn observed(&self) -> u32 {
        self.observed
    }
}

/// The paper's filter reads the fingerprint of an observation alone, and it does not refine. The best particle has one vertex, so
/// its probability is 1. The probability of the map is the share of the draws that chose the best particle. The filter knows the
/// newest vertex but no path. Vertices keep their ids within a particle; ids of different particles are unrelated, so no id is
/// remapped. Of the worst n-gram it knows the distance alone.
impl<const N: usize, const V: usize, const WORDS: usize> Filter<V> for PaperFilter<N, V, WORDS> {
    type Config = PaperConfig;

    const UNSTARTED: Self = Self::new();

    fn capacities(config: &PaperConfig) -> FilterCapacities {
        FilterCapacities {
            hypotheses: config.particles.into(),
            history: (32 * WORDS) as u16,
            ngram_length: config.ngram_length,
        }
    }

    fn start(&mut self, config: PaperConfig, seed: u64) -> Result<(), ConfigError> {
        config.check(N)?;
        self.config = config;
        self.seed = seed;
        self.observed = 0;
        self.particles.start(&config);
        self.history.clear();
        self.consistency.forget();
        self.faults = FaultCounters::new();
        Ok(())
    }

    fn config(&self) -> &PaperConfig {
        &self.config
    }

    fn set_config(&mut self, config: PaperConfig) -> Result<(), ConfigError> {
        config.check(N)?;
        self.config = config;
        Ok(())
    }

    /// Cost: (particles) · (V + 1) predictions, of which some particles' worth need the distance of Eq. 2; at most all.
    fn observe(&mut self, observation: impl Into<Observation>) -> Update {
        let observation = observation.into();
        let random = self.random();
        self.step(observation.fingerprint, random)
    }

    fn map(&self) -> &Map<V> {
        &self.best().map
    }

    fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    fn recent(&self, ago: usize) -> Option<VertexId> {
        (self.observed > 0 && ago == 0).then(|| self.best().at)
    }

    fn vertex_probability_q16(&self, vertex: VertexId) -> u32 {
        if self.observed > 0 && vertex == self.best().at { 1 << 16 } else { 0 }
    }

    fn map_probability_q16(&self) -> u32 {
        let draws: u32 = self.particles().iter().map(|particle| u32::from(particle.multiplicity)).sum();
        // All draws are those of one particle or more, so the share is 1 at most.
        ((u32::from(self.best().multiplicity) << 16) / draws.max(1)).min(1 << 16)
    }

    fn remapped(&self, before: VertexId) -> Option<VertexId> {
        self.map().contains(before).then_some(before)
    }

    fn worst(&self) -> WorstNgram {
        WorstNgram { distance_mm: self.best().consistency_mm, ..WorstNgram::NONE }
    }
}

impl<const N: usize, const V: usize, const WORDS: usize> Default for PaperFilter<N, V, WORDS> {
    fn default() -> Self {
        Self::new()
    }
}
