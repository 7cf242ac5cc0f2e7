//! The settings of an evaluation: number and length of the paths, the filter, and its prior.

use super::{
    corridors::{Bearings, CorridorsError},
    hints::Hints,
    prior::PriorSource,
    walk::WalkKind,
};
use std::fmt;
use toposlam::{ConfigError, NgramLength, OrderedConfig, PaperConfig, RobustConfig};

/// Settings of an evaluation.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Number of paths, 1 or more.
    pub paths: usize,
    /// The check points: the numbers of places after which the map of a path is judged, in ascending order, 1 or more.
    /// The last one is the length of a path.
    pub lengths: Vec<usize>,
    /// How a path is drawn.
    pub walk: WalkKind,
    /// The seed of walks, noise, hints and filter.
    pub seed: u64,
    /// The filter and its parameters.
    pub filter: Filter,
    /// The capacities of the ordered filter.
    pub capacities: Capacities,
    /// The prior of the filter.
    pub prior: PriorSource,
    /// Refinement steps of the filter after each place.
    pub refinement_steps: u32,
    /// Refinement steps of the filter after each place of the prior n-grams.
    pub prior_refinement_steps: u32,
    /// Refinement steps of a search from the true path at each check point; 0 for no search.
    pub search_from_truth: u32,
    /// The hints besides fingerprints.
    pub hints: Hints,
    /// How the bearings of ways are drawn.
    pub bearings: Bearings,
    /// Resolution of a fingerprint in bits, 1 to 12; the filter stores 12.
    pub fingerprint_bits: u32,
    /// The length `n` of the n-grams of the prior and of the judged distance.
    pub ngram_length: NgramLength,
    /// Number of threads; 0 for as many as there are processors.
    pub threads: usize,
}

impl Settings {
    /// Number of places of a path.
    pub fn longest(&self) -> usize {
        self.lengths.last().copied().unwrap_or(0)
    }

    /// Whether maps are judged by their ways: the filter knows them, and the robot reports them. Otherwise they are judged by what
    /// labels can distinguish.
    pub fn judges_ways(&self) -> bool {
        self.hints.ways && matches!(self.filter, Filter::Ordered(_))
    }
}

/// The robot whose capacities the ordered filter has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Capacities {
    /// The reference robot.
    #[default]
    Reference,
    /// The small robot.
    Small,
}

/// The filter to evaluate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// The particle filter of the paper, Eq. 2 to 9.
    Paper(PaperConfig),
    /// Distinct hypotheses with repair moves.
    Robust(RobustConfig),
    /// Distinct hypotheses over the ways of a map.
    Ordered(OrderedConfig),
}

impl Filter {
    /// The name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper(_) => "paper",
            Self::Robust(_) => "robust",
            Self::Ordered(_) => "ordered",
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
    /// A path, with the n-grams that are mapped before it, visits more places than the largest history holds.
    PathTooLong {
        /// Capacity of the history in places.
        most: usize,
    },
    /// The path or the exploration may have more n-grams than the largest table holds.
    TooManyNgrams {
        /// Capacity of the table in n-grams.
        most: usize,
    },
    /// The hints are ways, but a robot cannot perceive those of an environment.
    Corridors(CorridorsError),
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
            Self::Corridors(error) => error.fmt(f),
            Self::Threads => write!(f, "the threads for the paths did not start"),
        }
    }
}

impl std::error::Error for EvaluationError {}
