//! Evaluates a filter on many paths through the environments of one case, in parallel.

use super::{
    candidate::{MAX_NGRAMS, choose},
    case::Case,
    environment::Environment,
    judge::judge,
    parallel,
    prior::PriorSource,
    report::{Row, rows},
    settings::{EvaluationError, Settings},
    trial::Trial,
    walk::all_walks,
};

/// The environments of a case, each with the walks that give the n-grams of an exploration.
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
                .ok_or(EvaluationError::TooManyNgrams { most: MAX_NGRAMS }),
            PriorSource::Path | PriorSource::None => Ok(Vec::new()),
        };
        Ok(Self { case, settings, explored: case.environments.iter().map(walks).collect::<Result<_, _>>()? })
    }

    /// Draws a path.
    ///
    /// # Errors
    /// [`EvaluationError::Corridors`] when the hints are ways that a robot cannot perceive.
    pub fn trial(&self, path: u64) -> Result<Trial<'a>, EvaluationError> {
        let environment = path as usize % self.explored.len();
        Trial::draw(self.case.environment(path), &self.explored[environment], self.settings, path)
    }
}

/// Evaluates a filter on all paths of a case and returns a row for each check point.
///
/// `path_done` is called after each path, from any thread. All results but the times depend only on case and settings,
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
    let one = |path| {
        let result = course.trial(path as u64).map(|trial| judge(&trial, settings, start));
        path_done();
        result
    };
    let results = parallel::map(settings.paths, settings.threads, one).map_err(|_| EvaluationError::Threads)?;
    Ok(rows(case, settings, &results.into_iter().collect::<Result<Vec<_>, _>>()?))
}
