//! The robust filter: distinct hypotheses, ranked by their evidence and refined by proposals. `docs/inference.md` describes it.
//!
//! A hypothesis is the vertex of each observation; map and statistics follow from it. Its evidence integrates out the mean and
//! the variance of each label, and takes each transition as a uniform choice among the exits of its vertex, so that a new edge
//! rescales the likelihood of all past transitions. A share of the bound of the map's other paths counts too. Each observation
//! extends all hypotheses, and the best distinct ones stay. Between observations, proposals merge, split and decode them, and folds
//! build maps from the history: nothing else revises an earlier decision.
//!
//! | File | |
//! |---|---|
//! | `history`, `statistics`, `hypothesis`, `marginalisation` | the state |
//! | `model`, `special_functions`, `noise` | the generative model |
//! | `step`, `growth`, `beam` | one more observation |
//! | `proposals`, `merge_proposals`, `split_proposals`, `merge` | refinement: changes of a hypothesis |
//! | `fold` | refinement: a map from the tree of the history |
//! | `lattice`, `hmm`, `viterbi`, `forward` | paths: the best one, and all |
//! | `confidence`, `publish` | what is published |

pub(crate) mod beam;
mod column;
pub(crate) mod confidence;
mod config;
mod fold;
mod forward;
mod growth;
pub(crate) mod history;
mod hmm;
pub(crate) mod hypothesis;
mod lattice;
mod marginalisation;
mod merge;
mod merge_proposals;
pub(crate) mod model;
mod noise;
mod proposals;
mod publish;
pub(crate) mod special_functions;
mod split_proposals;
pub(crate) mod statistics;
mod step;
#[cfg(feature = "_test")]
mod testing;
mod viterbi;

pub use config::RobustConfig;

use super::vertex_ids::VertexIds;
use super::{Filter, FilterCapacities, Update, WorstNgram, draws, worst_ngram};
use crate::config_error::ConfigError;
use crate::fault::FaultCounters;
use crate::filter::Observation;
use crate::filter::beam::Ranked as _;
use crate::map::PerVertex;
use crate::map::{Map, VertexId};
use crate::place::Fingerprint;
use beam::Beam;
use confidence::Trials;
use fold::{Fold, Progress};
use forward::Forward;
use history::ObservationHistory;
use hmm::Hmm;
use hypothesis::Hypothesis;
use lattice::Lattice;
use model::Model;
use proposals::Proposals;
use viterbi::Viterbi;

/// One of this many refinement steps belongs to a fold, on average.
const FOLD_EVERY: usize = 3;

/// The robust filter with at most `N` hypotheses, maps of at most `V` vertices (2 to 32), and a history of the newest `HISTORY`
/// places. Proposals can revise what the history contains; what is older is marginalised.
///
/// The filter is const-constructed to zero, so that a `static` of it is in `.bss`, and initialised in place by
/// [`Filter::start`]. Memory: about `(N + 1) · (HISTORY + 48 · V + 32) + 21 · HISTORY + 60 · V + 6000` bytes.
/// The same observations, seed and calls of [`Filter::refine`] give the same result on every target.
///
/// ```
/// use toposlam::{Filter, Fingerprint, RobustConfig, RobustFilter};
///
/// let mut filter = RobustFilter::<10, 16, 400>::new();
/// filter.start(RobustConfig::default(), 1)?;
/// for radius_mm in [1200, 2200, 1204, 2196, 1200] {
///     let update = filter.observe(Fingerprint::from_radius_mm(radius_mm)?);
///     filter.refine();
///     assert_eq!(update.place_index + 1, filter.observed());
/// }
/// assert_eq!(filter.map().vertices().len(), 2);
/// assert!(filter.path().map(u8::from).eq([0, 1, 0, 1, 0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct RobustFilter<const N: usize, const V: usize, const HISTORY: usize> {
    pub(crate) config: RobustConfig,
    pub(crate) seed: u64,
    pub(crate) observed: u32,
    /// How many proposals were made since the newest place.
    pub(crate) refinements: u32,
    pub(crate) localise_only: bool,
    pub(crate) model: Model,
    pub(crate) history: ObservationHistory<HISTORY>,
    pub(crate) beam: Beam<N, V, HISTORY>,
    pub(crate) draft: Hypothesis<V, HISTORY>,
    hmm: Hmm<V>,
    lattice: Lattice,
    viterbi: Viterbi<HISTORY>,
    forward: Forward<V>,
    pub(crate) fold: Fold<HISTORY>,
    pub(crate) trials: Trials,
    pub(crate) vertex_ids: VertexIds<V>,
    /// The published vertex of each observation of the history.
    pub(crate) published_path: [VertexId; HISTORY],
    pub(crate) map: Map<V>,
    pub(crate) worst: WorstNgram,
    pub(crate) belief_q16: PerVertex<u32, V>,
    pub(crate) map_probability_q16: u32,
    pub(crate) faults: FaultCounters,
}

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// A filter that ignores observations until [`Filter::start`].
    pub const fn new() -> Self {
        const {
            assert!(N >= 1 && N <= 255, "a filter has 1 to 255 hypotheses");
            assert!(V >= 2 && V <= 32, "a map has 2 to 32 vertices");
            assert!(HISTORY >= 8 && HISTORY <= 16384, "a history has 8 to 16384 places");
        }
        Self {
            config: RobustConfig::UNSET,
            seed: 0,
            observed: 0,
            refinements: 0,
            localise_only: false,
            model: Model::new(),
            history: ObservationHistory::new(),
            beam: Beam::new(),
            draft: Hypothesis::UNUSED,
            hmm: Hmm::new(),
            lattice: Lattice::new(),
            viterbi: Viterbi::new(),
            forward: Forward::new(),
            fold: Fold::new(),
            trials: Trials::NONE,
            vertex_ids: VertexIds::new(),
            published_path: [VertexId::FIRST; HISTORY],
            map: Map::new(),
            worst: WorstNgram::NONE,
            belief_q16: PerVertex::filled(0),
            map_probability_q16: 0,
            faults: FaultCounters::new(),
        }
    }

    /// As [`Filter::start`], with a known map. Its labels count with their visits, 512 at most, and with the configured noise. The
    /// robot may be at any vertex.
    ///
    /// # Errors
    /// As [`Filter::start`].
    pub fn start_with_map(&mut self, config: RobustConfig, seed: u64, map: &Map<V>) -> Result<(), ConfigError> {
        self.start(config, seed)?;
        self.draft.start_with(map, f32::from(config.noise_mm) / f32::from(Fingerprint::STEP_MM));
        self.draft.recount(&self.model, &self.history);
        self.beam.start_with(&self.draft);
        self.trials = Trials::OF_KNOWN_MAP;
        self.vertex_ids.start_with(map.vertices().len());
        self.map = *map;
        Ok(())
    }

    /// Publishes the best map without another place: the result of [`Filter::refine`] so far.
    pub fn refresh(&mut self) -> Update {
        self.update_bound();
        self.publish()
    }

    /// Adopts the noise that follows from the draft if with it the draft is better than the best hypothesis with that of the model; else
    /// computes the evidence of the draft with the latter.
    fn compare_with_own_noise(&mut self) {
        let mut own = self.model.clone();
        if let Some(noise) = noise::deviation_steps(&self.history, &self.draft, self.config.resolution_steps()) {
            own.set_noise(noise);
        }
        self.draft.evidence = self.draft.total(&own);
        if self.beam.best().is_some_and(|best| self.draft.score() > best.score()) {
            self.set_noise(own.noise_steps());
        } else {
            self.draft.evidence = self.draft.total(&self.model);
        }
    }

    /// Sets the standard deviation of a label, in steps, and computes the evidence of all hypotheses with it.
    fn set_noise(&mut self, deviation_steps: f32) {
        self.model.set_noise(deviation_steps);
        let model = &self.model;
        self.beam.for_each(|hypothesis| hypothesis.evidence = hypothesis.total(model));
        self.beam.sort();
    }

    /// Inserts the draft into the beam, and notes if its map is the best one now.
    fn insert_draft(&mut self) {
        let best_key = |beam: &Beam<N, V, HISTORY>| beam.best().map(|best| best.map_alone_key());
        let key = best_key(&self.beam);
        self.beam.insert(&self.draft, self.config.hypotheses.into());
        if best_key(&self.beam) != key {
            self.trials = Trials::NONE;
        }
    }

    /// How many places were observed.
    pub fn observed(&self) -> u32 {
        self.observed
    }
}

/// Vertices keep their ids from update to update as long as most of their visits stay together.
impl<const N: usize, const V: usize, const HISTORY: usize> Filter<V> for RobustFilter<N, V, HISTORY> {
    type Config = RobustConfig;

    const UNSTARTED: Self = Self::new();

    fn capacities(config: &RobustConfig) -> FilterCapacities {
        FilterCapacities {
            hypotheses: config.hypotheses.into(),
            history: HISTORY as u16,
            ngram_length: worst_ngram::LENGTH as u8,
        }
    }

    fn start(&mut self, config: RobustConfig, seed: u64) -> Result<(), ConfigError> {
        config.check(N)?;
        self.config = config;
        self.seed = seed;
        self.observed = 0;
        self.refinements = 0;
        self.localise_only = false;
        self.model.configure(&config);
        self.history.clear();
        self.beam.clear();
        self.vertex_ids.clear();
        self.map.clear();
        self.worst = WorstNgram::NONE;
        self.belief_q16.fill(0);
        self.map_probability_q16 = 0;
        self.faults = FaultCounters::new();
        self.fold.cancel();
        self.trials = Trials::NONE;
        Ok(())
    }

    fn config(&self) -> &RobustConfig {
        &self.config
    }

    /// Computes the evidence of all hypotheses again. The estimate of the noise starts again from the configured value.
    fn set_config(&mut self, config: RobustConfig) -> Result<(), ConfigError> {
        config.check(N)?;
        self.config = config;
        self.model.configure(&config);
        let (model, history) = (&self.model, &self.history);
        self.beam.for_each(|hypothesis| hypothesis.recount(model, history));
        self.beam.sort();
        Ok(())
    }

    /// Makes [`RobustConfig::moves`] proposals as well.
    ///
    /// Cost: N · (V + 1) predictions, and for each proposal and once more some passes over the history, each
    /// O(HISTORY · V).
    fn observe(&mut self, observation: impl Into<Observation>) -> Update {
        self.step(observation.into())
    }

    /// Makes one proposal, or a step of a fold. Cost: at most two decodings and a forward pass over the history, or 1500 merges of two nodes.
    fn refine(&mut self) {
        if self.localise_only || self.history.len() < 3 {
            return;
        }
        let mut random = draws(self.seed, u64::from(self.observed) << 16 | u64::from(self.refinements & 0xFFFF));
        let wanted = usize::from(self.config.hypotheses);
        let mut proposals = Proposals {
            model: &self.model,
            history: &self.history,
            hmm: &mut self.hmm,
            lattice: &mut self.lattice,
            viterbi: &mut self.viterbi,
            forward: &mut self.forward,
            random: &mut random,
            threshold: self.beam.threshold(wanted),
            decodings: 0,
        };
        // The best hypothesis every other time, else one of the better ones.
        let rank = if self.refinements.is_multiple_of(2) {
            0
        } else {
            proposals.below(self.beam.len()).min(proposals.below(self.beam.len()))
        };
        self.refinements = self.refinements.wrapping_add(1);
        let Some(hypothesis) = self.beam.get(rank) else { return };
        if proposals.below(FOLD_EVERY) == 0 && !hypothesis.has_marginalised() {
            if !self.fold.is_running() {
                self.fold.start(&self.model, &self.history, hypothesis, proposals.random);
            }
            if self.fold.step(&self.history, V, proposals.random) != Progress::Done {
                return;
            }
            self.draft.clone_from(hypothesis);
            self.fold.write(&self.history, &mut self.draft);
            if let Some(own) = self.fold.own_model() {
                Proposals { model: own, threshold: f32::NEG_INFINITY, ..proposals }.finish(&mut self.draft);
                self.compare_with_own_noise();
            } else if proposals.finish(&mut self.draft) {
                let key = self.draft.map_alone_key();
                self.trials.add_fold(self.beam.best().is_some_and(|best| best.map_alone_key() == key));
            } else {
                return;
            }
            self.insert_draft();
            return;
        }
        self.draft.clone_from(hypothesis);
        if proposals.step(&mut self.draft) {
            self.insert_draft();
        }
    }

    fn map(&self) -> &Map<V> {
        &self.map
    }

    fn faults(&self) -> &FaultCounters {
        &self.faults
    }

    fn recent(&self, ago: usize) -> Option<VertexId> {
        let index = self.history.len().checked_sub(ago)?.checked_sub(1)?;
        self.published_path.get(index).copied()
    }

    fn vertex_probability_q16(&self, vertex: VertexId) -> u32 {
        self.belief_q16.get(vertex).copied().unwrap_or(0)
    }

    fn map_probability_q16(&self) -> u32 {
        self.map_probability_q16
    }

    fn remapped(&self, before: VertexId) -> Option<VertexId> {
        self.vertex_ids.remapped(before)
    }

    fn worst(&self) -> WorstNgram {
        self.worst
    }

    fn is_in_doubt(&self) -> bool {
        self.has_unexplained_ngram()
    }

    /// The filter then finds the vertex of the robot alone, also after it was kidnapped, and there are no proposals. The places
    /// observed meanwhile count as evidence when mapping continues. Without a vertex on the map they are lost.
    fn set_localise_only(&mut self, localise_only: bool) {
        if localise_only == self.localise_only {
            return;
        }
        if localise_only && self.observed > 0 {
            // The map that stays is the one that is published.
            self.refresh();
        }
        self.localise_only = localise_only;
        self.fold.cancel();
        self.beam.keep_best();
        if !localise_only && let Some(best) = self.beam.best_mut() {
            best.recount(&self.model, &self.history);
        }
    }

    fn is_localise_only(&self) -> bool {
        self.localise_only
    }
}

impl<const N: usize, const V: usize, const HISTORY: usize> Default for RobustFilter<N, V, HISTORY> {
    fn default() -> Self {
        Self::new()
    }
}
