//! The filters that can be evaluated, behind one interface, with few sets of capacities, because each takes seconds to
//! compile.

mod ordered;
mod paper;
mod robust;

pub(super) use paper::prior as prior_table;

use super::{
    prior::{PriorSource, path_ngrams},
    rotation::RotationSystem,
    settings::{EvaluationError, Filter, Settings},
    trial::{Trial, Truth},
};
use toposlam::{ConfigError, Map, NgramLength, Observation};

/// Largest number of vertices of a map: the width of a row of the adjacency matrix. Fault counters count full maps.
pub const VERTICES: usize = 64;
/// Largest number of hypotheses or particles of a filter.
pub const MAX_HYPOTHESES: usize = 100;
/// Largest number of n-grams of a prior.
pub const MAX_NGRAMS: usize = 8192;

/// A filter that maps one path.
pub trait Candidate {
    /// Processes the next place.
    fn observe(&mut self, observation: Observation);
    /// Runs `steps` refinement steps.
    fn refine(&mut self, steps: u32);
    /// The filter after a search of `steps` refinement steps from the true path. `None` for a filter without a search.
    fn search_from(&self, _trial: &Trial, _truth: &Truth, _steps: u32) -> Option<Box<dyn Candidate>> {
        None
    }
    /// The best map.
    fn map(&self) -> Map<VERTICES>;
    /// The edges of the best map in the order of its ways; `None` for a filter that knows no ways.
    fn ways(&self) -> Option<RotationSystem> {
        None
    }
    /// The vertex of each of the newest `places` places in the best map, the oldest first; `None` where it is not known.
    fn path(&self, places: usize) -> Vec<Option<usize>>;
    /// The probability of the best map, as the filter states it.
    fn map_probability(&self) -> f64;
    /// Number of times that the filter needed a new vertex and its map was full.
    fn vertices_full(&self) -> u32;
}

/// A probability in units of 2⁻¹⁶.
fn probability(q16: u32) -> f64 {
    f64::from(q16) / 65536.0
}

/// A map with room for more vertices.
fn widened<const V: usize>(map: &Map<V>) -> Map<VERTICES> {
    let mut wide = Map::new();
    for &label in map.labels() {
        // The larger map has room for it.
        let _ = wide.add_vertex(label);
    }
    map.edges().for_each(|(a, b)| wide.add_edge(a, b));
    wide
}

/// Starts a filter for one path.
pub type Start = fn(&Settings, &Trial) -> Box<dyn Candidate>;

/// Chooses the filter of the settings. `explored` is the number of n-grams of an exploration.
///
/// # Errors
/// [`EvaluationError`] when a parameter is out of its range, or the largest capacities are too small.
pub fn choose(settings: &Settings, explored: usize) -> Result<Start, EvaluationError> {
    let length = settings.ngram_length;
    let ngrams = match settings.prior {
        PriorSource::None => 0,
        PriorSource::Path => path_ngrams(length, settings.longest()),
        PriorSource::Exploration => explored,
    };
    if ngrams > MAX_NGRAMS {
        return Err(EvaluationError::TooManyNgrams { most: MAX_NGRAMS });
    }
    match settings.filter {
        Filter::Paper(config) => {
            config.check(MAX_HYPOTHESES).map_err(EvaluationError::Config)?;
            // The judged distance and the filter use n-grams of one length.
            if NgramLength::new(config.ngram_length) != Ok(length) {
                let (value, wanted) = (config.ngram_length.into(), length.get() as i32);
                let error = ConfigError::OutOfRange { field: "ngram_length", value, min: wanted, max: wanted };
                return Err(EvaluationError::Config(error));
            }
            paper::choose(settings, ngrams)
        }
        Filter::Robust(config) => {
            config.check(MAX_HYPOTHESES).map_err(EvaluationError::Config)?;
            let labels = usize::from(length.get());
            let before = match settings.prior {
                PriorSource::None => 0,
                PriorSource::Path => (settings.longest() + 1).saturating_sub(labels),
                PriorSource::Exploration => explored,
            };
            robust::choose(config.hypotheses.into(), before * labels + settings.longest())
        }
        Filter::Ordered(config) => {
            config.check().map_err(EvaluationError::Config)?;
            Ok(ordered::start)
        }
    }
}
