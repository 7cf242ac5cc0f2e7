//! What an evaluation is told: how many paths of which length, which filter, and what that knows.

use super::{hints::Hints, prior::PriorSource};
use std::fmt;
use toposlam::{ConfigError, NgramLength, PaperConfig, RobustConfig};

/// What to evaluate.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How many paths, 1 or more.
    pub paths: usize,
    /// After how many places of a path its map is judged: check points in ascending order, 1 or more. A path visits as
    /// many places as the last one says.
    pub lengths: Vec<usize>,
    /// The seed of walks, noise, hints and filter.
    pub seed: u64,
    /// The filter and its parameters.
    pub filter: Filter,
    /// What the filter knows before it starts.
    pub prior: PriorSource,
    /// Refinement steps of the filter after each place.
    pub refinement_steps: u32,
    /// Refinement steps of the filter after each place of the prior n-grams.
    pub prior_refinement_steps: u32,
    /// Refinement steps of a search from the true path at each check point; 0 for no search.
    pub search_from_truth: u32,
    /// What the filter is told besides fingerprints.
    pub hints: Hints,
    /// How many bits a fingerprint has, 1 to 12, which is what the filter holds.
    pub fingerprint_bits: u32,
    /// `n`: how many labels an n-gram of the prior and of the judged distance has.
    pub ngram_length: NgramLength,
    /// How many threads; 0 for as many as there are processors.
    pub threads: usize,
}

impl Settings {
    /// How many places a path visits.
    pub fn longest(&self) -> usize {
        self.lengths.last().copied().unwrap_or(0)
    }
}

/// The filter to evaluate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// The particle filter of the paper, Eq. 2 to 9.
    Paper(PaperConfig),
    /// Distinct hypotheses with repair moves.
    Robust(RobustConfig),
}

impl Filter {
    /// The name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper(_) => "paper",
            Self::Robust(_) => "robust",
        }
    }
}

/// Why an evaluation did not start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EvaluationError {
    /// A parameter of the filter is out of its range.
    Config(ConfigError),
    /// There are no paths, no environments, or no check points in ascending order.
    Nothing,
    /// A path visits more places, those of n-grams that are mapped before it included, than the largest history holds.
    PathTooLong {
        /// How many places it holds.
        most: usize,
    },
    /// The path or the exploration may have more n-grams than the largest table holds.
    TooManyNgrams {
        /// How many n-grams it holds.
        most: usize,
    },
    /// The threads did not start.
    Threads,
}

impl fmt::Display for EvaluationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Config(error) => error.fmt(f),
            Self::Nothing => {
                write!(f, "there must be an environment, a path, and lengths from 1 up in ascending order")
            }
            Self::PathTooLong { most } => {
                write!(f, "a path, with the n-grams before it, may visit at most {most} places")
            }
            Self::TooManyNgrams { most } => write!(f, "the prior may need more than {most} n-grams"),
            Self::Threads => write!(f, "the threads for the paths did not start"),
        }
    }
}

impl std::error::Error for EvaluationError {}
