//! Many paths through the environments of one case, in parallel, each mapped by its own filter and scored.

use super::{
    candidate::{MAX_NGRAMS, choose},
    case::Case,
    environment::Environment,
    hints::Hints,
    judge::judge,
    prior::PriorSource,
    report::{Row, rows},
    trial::Trial,
    walk::all_walks,
};
use rayon::prelude::*;
use std::fmt;
use toposlam::{Config, ConfigError, NgramLength, RobustConfig};

/// Filters and priors are made on the stack, in builds without optimisation more than once.
const STACK_BYTES: usize = 64 << 20;

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
    /// How many slices of the time between two places the filter uses.
    pub polish: u32,
    /// How many slices the filter uses after each place of the n-grams of a prior.
    pub polish_prior: u32,
    /// How many slices a search from the truth takes at each check point; 0 for no search.
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
    Paper(Config),
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
    TooManyNgrams,
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
            Self::TooManyNgrams => write!(f, "the prior may need more than {MAX_NGRAMS} n-grams"),
            Self::Threads => write!(f, "the threads for the paths did not start"),
        }
    }
}

impl std::error::Error for EvaluationError {}

/// The environments of a case, each with the walks whose n-grams an exploration brings.
pub struct Course<'a> {
    case: &'a Case,
    settings: &'a Settings,
    explored: Vec<Vec<Vec<usize>>>,
}

impl<'a> Course<'a> {
    /// Prepares to draw paths.
    ///
    /// # Errors
    /// [`EvaluationError`] when there is nothing to draw, or too many n-grams.
    pub fn new(case: &'a Case, settings: &'a Settings) -> Result<Self, EvaluationError> {
        let ascending = settings.lengths.is_sorted_by(|shorter, longer| shorter < longer);
        let first = settings.lengths.first().copied().unwrap_or(0);
        if settings.paths == 0 || case.environments.is_empty() || first == 0 || !ascending {
            return Err(EvaluationError::Nothing);
        }
        let walks = |environment: &Environment| match settings.prior {
            PriorSource::Exploration => all_walks(environment, settings.ngram_length.get().into(), MAX_NGRAMS)
                .ok_or(EvaluationError::TooManyNgrams),
            PriorSource::Path | PriorSource::None => Ok(Vec::new()),
        };
        Ok(Self { case, settings, explored: case.environments.iter().map(walks).collect::<Result<_, _>>()? })
    }

    /// Draws a path.
    pub fn trial(&self, path: u64) -> Trial<'a> {
        let environment = path as usize % self.explored.len();
        Trial::draw(self.case.environment(path), &self.explored[environment], self.settings, path)
    }
}

/// Evaluates a filter on all paths of a case, and gives a row for each check point.
///
/// `path_done` is called after each path, from any thread. Everything but the times depends on case and settings alone,
/// not on the number of threads.
///
/// # Errors
/// [`EvaluationError`] when the settings are out of range or ask for more than the largest capacities.
pub fn evaluate(
    case: &Case,
    settings: &Settings,
    path_done: impl Fn() + Sync + Send,
) -> Result<Vec<Row>, EvaluationError> {
    let course = Course::new(case, settings)?;
    let most_explored = course.explored.iter().map(Vec::len).max().unwrap_or(0);
    let start = choose(settings, most_explored)?;
    let threads = rayon::ThreadPoolBuilder::new().num_threads(settings.threads).stack_size(STACK_BYTES).build();
    let threads = threads.map_err(|_| EvaluationError::Threads)?;
    let results: Vec<_> = threads.install(|| {
        let paths = (0..settings.paths as u64).into_par_iter();
        paths.map(|path| judge(&course.trial(path), settings, start)).inspect(|_| path_done()).collect()
    });
    Ok(rows(case, settings, &results))
}
