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

pub use config::Config;
pub use consistency::{Consistency, Direction, Evidence};
pub use history::History;
pub use ngram::{Ngram, NgramError, NgramLength, NgramTable, NgramsFull};
pub use particle::Particle;
pub use prior::Prior;

use super::{Update, WeightFactors, draws};
use crate::{ConfigError, FaultCounters, FaultKind, Fingerprint, Map};
use particles::{Particles, Step};
use rand_core::Rng;

/// The particle filter of the paper with at most `N` particles, maps of at most `V` vertices, and the newest
/// `32 · WORDS` observations as evidence.
///
/// The filter is const-constructed, so that a `static` of it lies in `.bss`, and set up in place by
/// [`PaperFilter::start`]. Equal draws of one candidate are held once, with a multiplicity. Memory: about
/// `2 · N · (18 · V + 32) + 8 · N · V + 44 · V · (WORDS + 1) + 120 · WORDS + 1500` bytes.
///
/// ```
/// use toposlam::{Config, Fingerprint, PaperFilter};
///
/// let mut filter = PaperFilter::<10, 16, 8>::new();
/// filter.start(Config::default(), 1)?;
/// for radius_mm in [1200, 2200, 1200, 2200, 1200] {
///     filter.observe(Fingerprint::from_radius_mm(radius_mm)?);
/// }
/// let best = filter.best();
/// assert_eq!((best.map.vertices().len(), best.at.index()), (2, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct PaperFilter<const N: usize, const V: usize, const WORDS: usize> {
    config: Config,
    seed: u64,
    observed: u32,
    particles: Particles<N, V>,
    history: History<WORDS>,
    consistency: Consistency<V, WORDS, 1>,
    faults: FaultCounters,
}

impl<const N: usize, const V: usize, const WORDS: usize> PaperFilter<N, V, WORDS> {
    /// A filter that is yet to be set up by [`PaperFilter::start`]; before that, observations are lost.
    pub const fn new() -> Self {
        const { assert!(N >= 1 && N <= 255, "a filter has 1 to 255 particles") };
        Self {
            config: Config::UNSET,
            seed: 0,
            observed: 0,
            particles: Particles::new(),
            history: History::new(),
            consistency: Consistency::new(),
            faults: FaultCounters::new(),
        }
    }

    /// Forgets everything and starts anew with a configuration and a seed.
    ///
    /// # Errors
    /// [`ConfigError`] names the first field that is out of its range; the filter goes on as it was.
    pub fn start(&mut self, config: Config, seed: u64) -> Result<(), ConfigError> {
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

    /// Goes on with other settings.
    ///
    /// # Errors
    /// As [`PaperFilter::start`].
    pub fn set_config(&mut self, config: Config) -> Result<(), ConfigError> {
        config.check(N)?;
        self.config = config;
        Ok(())
    }

    /// Takes the next place on line: Γ_env is what the filter's own history holds, this observation included.
    ///
    /// Cost: (particles) · (V + 1) predictions, of which some particles' worth need the distance of Eq. 2; at most all.
    pub fn observe(&mut self, fingerprint: Fingerprint) -> Update {
        let random = self.random();
        self.observe_with_draws(fingerprint, random)
    }

    /// Takes the next place with Γ_env from an earlier exploration, as the paper assumes. The length of its n-grams is
    /// that of the prior.
    pub fn observe_with_prior<const PRIOR_WORDS: usize>(
        &mut self,
        fingerprint: Fingerprint,
        prior: &mut Prior<V, PRIOR_WORDS>,
    ) -> Update {
        let random = self.random();
        self.observe_with_prior_and_draws(fingerprint, prior, random)
    }

    /// As [`PaperFilter::observe`], with the random draws given: for each particle in turn, one that proposes a
    /// prediction and one that accepts or rejects it, until one is accepted. After 128 proposals all predictions are
    /// weighed in full, and one draw chooses each particle that is still missing.
    pub fn observe_with_draws(&mut self, fingerprint: Fingerprint, random: impl FnMut() -> u32) -> Update {
        self.remember(fingerprint);
        let evidence = (&self.history, &mut self.consistency);
        let length = NgramLength::new(self.config.ngram_length).unwrap_or(NgramLength::MIN);
        let step = self.particles.step(length, self.config.direction, fingerprint, random, evidence);
        self.finish(step)
    }

    /// As [`PaperFilter::observe_with_prior`], with the random draws given as in [`PaperFilter::observe_with_draws`].
    pub fn observe_with_prior_and_draws<const PRIOR_WORDS: usize>(
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

    /// The random draws for the next place.
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

    /// The particle with the largest weight among those that survived the last resampling.
    pub fn best(&self) -> &Particle<V> {
        self.particles.best()
    }

    /// The different particles, in the order of the pool they were drawn from.
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

    /// What went wrong since the start: full tables.
    pub fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    /// The configuration in force.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The best map.
    pub fn map(&self) -> &Map<V> {
        &self.best().map
    }
}

impl<const N: usize, const V: usize, const WORDS: usize> Default for PaperFilter<N, V, WORDS> {
    fn default() -> Self {
        Self::new()
    }
}
