//! The filters that can be evaluated, behind one interface, with capacities of which each is a few seconds of compiling.

mod paper;
mod robust;

pub(super) use paper::prior as prior_table;

use super::{
    prior::{PriorSource, path_ngrams},
    settings::{EvaluationError, Filter, Settings},
    trial::Trial,
};
use toposlam::{ConfigError, Map, NgramLength, Observation, VertexId};

/// How many vertices a map can have: what a row of the adjacency matrix holds. Faults count the maps that were full.
pub const VERTICES: usize = 64;
/// How many hypotheses, or particles, a filter can have.
pub const MAX_HYPOTHESES: usize = 100;
/// How many n-grams a prior can hold.
pub const MAX_NGRAMS: usize = 8192;

/// A filter on its way along one path.
pub trait Candidate {
    /// Takes the next place.
    fn observe(&mut self, observation: Observation);
    /// Runs `steps` refinement steps.
    fn refine(&mut self, steps: u32);
    /// Map and path at the end of a search of `steps` refinement steps from a path, given as a vertex for each place so far.
    /// `None` for a filter that does not search.
    fn search_from(&self, path: &[VertexId], steps: u32) -> Option<(Map<VERTICES>, Vec<usize>)>;
    /// The best map.
    fn map(&self) -> Map<VERTICES>;
    /// The vertex of the best map that each of the newest `places` places is taken for, the oldest first.
    fn path(&self, places: usize) -> Vec<usize>;
    /// How often the filter wanted a vertex that its map had no room for.
    fn vertices_full(&self) -> u32;
}

/// Starts a filter for one path.
pub type Start = fn(&Settings, &Trial) -> Box<dyn Candidate>;

/// Chooses the filter that the settings ask for. `explored` is how many n-grams an exploration brings.
///
/// # Errors
/// [`EvaluationError`] when a parameter is out of its range, or the largest capacities do not do.
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
            // What is judged and what the filter uses are n-grams of one length.
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
    }
}
