//! Many paths through one environment, in parallel, each mapped by its own filter and scored.

use super::{
    ancestry::Ancestry,
    environment::Environment,
    equivalence::SmallestEquivalent,
    graph::Graph,
    prior::{PriorSource, exploration_prior, path_ngrams, path_prior},
    report::{Distribution, EnvironmentReport},
    score::{MapScore, is_localised, score_map},
    walk::{EXHAUSTIVE_FROM_LENGTH, PathRng, all_walks, draw_walk, observe, path_rng},
};
use rand::Rng;
use rayon::prelude::*;
use std::{
    collections::BTreeMap,
    fmt, ptr,
    time::{Duration, Instant},
};
use toposlam::{
    Config, ConfigError, Consistency, Direction, Evidence, FaultKind, Fingerprint, Map, NgramLength, PaperFilter,
    Update,
};

/// How many vertices a map can have: what a row of the adjacency matrix holds. Faults count the maps that were full.
pub const VERTICES: usize = 64;
/// How many particles a filter can have.
pub const MAX_PARTICLES: usize = 128;
/// Room for this many particles is enough for most, and quicker.
const FEW_PARTICLES: usize = 16;
/// The sizes of history and of n-gram table that are built, smallest first, in words.
const HISTORY_WORDS: [usize; 2] = [8, 64];
const PRIOR_WORDS: [usize; 3] = [32, 64, 512];
/// How many places a path can visit without a prior, 2048, and how many n-grams a prior can hold, 8192.
const MAX_PLACES: usize = 32 * HISTORY_WORDS[1];
const MAX_NGRAMS: usize = 16 * PRIOR_WORDS[2];
/// Filters and priors are made on the stack, in builds without optimisation more than once.
const STACK_BYTES: usize = 64 << 20;

/// What to evaluate.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// How many paths, 1 or more.
    pub paths: usize,
    /// How many places a path visits, 1 or more; the largest is 2048 without a prior, and about 800 with the n-grams of
    /// the path at n = 5.
    pub length: usize,
    /// The seed of walks, noise and filter.
    pub seed: u64,
    /// What the filter knows before it starts.
    pub prior: PriorSource,
    /// The parameters of the filter; up to 128 particles.
    pub config: Config,
}

/// What came out, and what a reader of it should know.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The results.
    pub report: EnvironmentReport,
    /// How many paths do not traverse every edge although their length asks for it.
    pub paths_not_exhaustive: usize,
    /// How often a filter wanted a vertex that its map had no room for.
    pub vertices_full: u64,
}

/// Why an evaluation did not start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EvaluationError {
    /// A parameter of the filter is out of its range.
    Config(ConfigError),
    /// There are no paths, or they visit no places.
    Nothing,
    /// A path visits more places than the largest history holds.
    PathTooLong,
    /// The path or the exploration may have more n-grams than the largest table holds.
    TooManyNgrams,
    /// The threads did not start.
    Threads,
}

impl fmt::Display for EvaluationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Config(error) => error.fmt(f),
            Self::Nothing => write!(f, "there must be a path of at least one place"),
            Self::PathTooLong => write!(f, "without a prior, a path may visit at most {MAX_PLACES} places"),
            Self::TooManyNgrams => write!(f, "the prior may need more than {MAX_NGRAMS} n-grams"),
            Self::Threads => write!(f, "the threads for the paths did not start"),
        }
    }
}

impl std::error::Error for EvaluationError {}

/// Evaluates the paper's filter in one environment, on all threads of the current rayon pool.
///
/// `path_done` is called after each path, from any thread. Everything but the time depends on the arguments alone, not
/// on the number of threads.
///
/// # Errors
/// [`EvaluationError`] when the settings are out of range or ask for more than the largest capacities.
pub fn evaluate(
    environment: &Environment,
    settings: &Settings,
    path_done: impl Fn() + Sync + Send,
) -> Result<Outcome, EvaluationError> {
    let length = settings.config.check(MAX_PARTICLES).map_err(EvaluationError::Config)?;
    if settings.paths == 0 || settings.length == 0 {
        return Err(EvaluationError::Nothing);
    }
    let threads = rayon::ThreadPoolBuilder::new().stack_size(STACK_BYTES).build();
    let threads = threads.map_err(|_| EvaluationError::Threads)?;
    let case = Case { environment, settings, length };
    let results = if usize::from(settings.config.particles) <= FEW_PARTICLES {
        threads.install(|| case.run::<FEW_PARTICLES>(path_done))?
    } else {
        threads.install(|| case.run::<MAX_PARTICLES>(path_done))?
    };
    Ok(case.summarise(&results))
}

/// Checked settings.
struct Case<'a> {
    environment: &'a Environment,
    settings: &'a Settings,
    length: NgramLength,
}

/// What one path contributes.
struct PathResult {
    exhaustive: bool,
    score: MapScore,
    vertices: usize,
    localised_share: f64,
    consistency_mm: u16,
    vertices_full: u32,
    filter_time: Duration,
}

impl Case<'_> {
    /// All paths, with the smallest tables that hold what they bring.
    fn run<const N: usize>(&self, path_done: impl Fn() + Sync + Send) -> Result<Vec<PathResult>, EvaluationError> {
        let Settings { length: places, prior, .. } = *self.settings;
        if prior == PriorSource::None {
            return match places.div_ceil(32) {
                words if words <= HISTORY_WORDS[0] => {
                    Ok(self.all(path_done, |n| self.online::<N, { HISTORY_WORDS[0] }>(n)))
                }
                words if words <= HISTORY_WORDS[1] => {
                    Ok(self.all(path_done, |n| self.online::<N, { HISTORY_WORDS[1] }>(n)))
                }
                _ => Err(EvaluationError::PathTooLong),
            };
        }
        let walks = match prior {
            PriorSource::Exploration => all_walks(self.environment, usize::from(self.length.get()), MAX_NGRAMS)
                .ok_or(EvaluationError::TooManyNgrams)?,
            PriorSource::Path | PriorSource::None => Vec::new(),
        };
        let ngrams = if prior == PriorSource::Path { path_ngrams(self.length, places) } else { walks.len() };
        match ngrams.div_ceil(16) {
            words if words <= PRIOR_WORDS[0] => {
                Ok(self.all(path_done, |n| self.informed::<N, { PRIOR_WORDS[0] }>(n, &walks)))
            }
            words if words <= PRIOR_WORDS[1] => {
                Ok(self.all(path_done, |n| self.informed::<N, { PRIOR_WORDS[1] }>(n, &walks)))
            }
            words if words <= PRIOR_WORDS[2] => {
                Ok(self.all(path_done, |n| self.informed::<N, { PRIOR_WORDS[2] }>(n, &walks)))
            }
            _ => Err(EvaluationError::TooManyNgrams),
        }
    }

    fn all(
        &self,
        path_done: impl Fn() + Sync + Send,
        path: impl Fn(u64) -> PathResult + Sync + Send,
    ) -> Vec<PathResult> {
        let paths = (0..self.settings.paths as u64).into_par_iter();
        paths.map(path).inspect(|_| path_done()).collect()
    }

    /// One path without a prior.
    fn online<const N: usize, const WORDS: usize>(&self, number: u64) -> PathResult {
        let (trial, _) = self.draw(number);
        let mut drive = Drive::<N, WORDS>::start(&trial, self.settings.config);
        drive.all(&trial, |filter, observation| filter.observe(observation));
        let consistency_mm = self.consistency_mm::<WORDS, 1>(drive.filter.map(), drive.filter.history());
        drive.finish(&trial, consistency_mm)
    }

    /// One path with a prior: the n-grams of the walks, or of the path itself when there are none.
    fn informed<const N: usize, const WORDS: usize>(&self, number: u64, walks: &[Vec<usize>]) -> PathResult {
        let (trial, mut rng) = self.draw(number);
        let prior = match self.settings.prior {
            PriorSource::Exploration => exploration_prior(self.environment, walks, self.length, &mut rng),
            PriorSource::Path | PriorSource::None => path_prior(&trial.observations, self.length),
        };
        let mut prior = prior.unwrap_or_else(|_| unreachable!("the table was chosen to have room"));
        // With a prior the filter does not look at its own history, so the shortest will do.
        let mut drive = Drive::<N, 1>::start(&trial, self.settings.config);
        drive.all(&trial, |filter, observation| filter.observe_with_prior::<WORDS>(observation, &mut prior));
        let consistency_mm = self.consistency_mm::<WORDS, 7>(drive.filter.map(), prior.ngrams());
        drive.finish(&trial, consistency_mm)
    }

    /// What happens on a path, and the generator for its prior. The same seed brings the same walks, readings and
    /// draws of the filter whatever the prior is.
    fn draw(&self, number: u64) -> (Trial, PathRng) {
        let mut rng = path_rng(self.settings.seed, number);
        let walk = draw_walk(self.environment, self.settings.length, &mut rng);
        let places = self.environment.places();
        let observations = walk.places.iter().map(|&place| observe(&places[place], &mut rng)).collect();
        let truth = SmallestEquivalent::of_traversed(self.environment, &walk.places);
        let classes = walk.places.iter().filter_map(|&place| truth.class_of_place[place]).collect();
        let trial = Trial {
            exhaustive: walk.exhaustive,
            observations,
            truth: truth.graph,
            classes,
            filter_seed: rng.next_u64(),
        };
        (trial, rng)
    }

    /// The two-sided distance of a map from the evidence, whatever direction the filter took.
    fn consistency_mm<const WORDS: usize, const INDICES: usize>(
        &self,
        map: &Map<VERTICES>,
        evidence: &impl Evidence<WORDS>,
    ) -> u16 {
        let mut consistency = Box::new(Consistency::<VERTICES, WORDS, INDICES>::new());
        let steps = consistency.distance_steps(map, evidence, self.length, Direction::TwoSided);
        steps.map_or(u16::MAX, |steps| steps.saturating_mul(self.length.label_step_mm()))
    }

    fn summarise(&self, results: &[PathResult]) -> Outcome {
        let Settings { paths, length, seed, prior, config } = *self.settings;
        let mean = |value: fn(&PathResult) -> f64| results.iter().map(value).sum::<f64>() / results.len() as f64;
        let mut vertices = BTreeMap::new();
        for result in results {
            *vertices.entry(result.vertices).or_insert(0) += 1;
        }
        let filter_time: Duration = results.iter().map(|result| result.filter_time).sum();
        let missed = results.iter().filter(|result| !result.exhaustive).count();
        Outcome {
            report: EnvironmentReport {
                name: self.environment.name().into(),
                filter: "paper".into(),
                prior: prior.name().into(),
                paths,
                length,
                particles: config.particles,
                seed,
                exact: mean(|result| f64::from(u8::from(result.score.exact))),
                isomorphic: mean(|result| f64::from(u8::from(result.score.isomorphic))),
                vertices,
                edge_f1: mean(|result| result.score.edge_f1),
                location_online: mean(|result| result.localised_share),
                location_smoothed: mean(|result| result.score.location),
                consistency_mm: Distribution::of(results.iter().map(|result| result.consistency_mm).collect()),
                seconds_per_place: filter_time.as_secs_f64() / (paths * length) as f64,
            },
            paths_not_exhaustive: if length >= EXHAUSTIVE_FROM_LENGTH { missed } else { 0 },
            vertices_full: results.iter().map(|result| u64::from(result.vertices_full)).sum(),
        }
    }
}

/// What happens on one path, and what is true about it.
struct Trial {
    exhaustive: bool,
    observations: Vec<Fingerprint>,
    /// The smallest equivalent of what was traversed.
    truth: Graph,
    /// The vertex of the truth that the robot is at, for every step.
    classes: Vec<usize>,
    filter_seed: u64,
}

/// One filter on its way along one path.
struct Drive<const N: usize, const WORDS: usize> {
    filter: Box<PaperFilter<N, VERTICES, WORDS>>,
    ancestry: Ancestry,
    localised_steps: usize,
    filter_time: Duration,
}

impl<const N: usize, const WORDS: usize> Drive<N, WORDS> {
    fn start(trial: &Trial, config: Config) -> Self {
        let mut filter = Box::new(PaperFilter::new());
        let started = filter.start(config, trial.filter_seed);
        assert!(started.is_ok(), "the configuration was checked");
        Self { filter, ancestry: Ancestry::new(), localised_steps: 0, filter_time: Duration::ZERO }
    }

    fn all(
        &mut self,
        trial: &Trial,
        mut observe: impl FnMut(&mut PaperFilter<N, VERTICES, WORDS>, Fingerprint) -> Update,
    ) {
        for (step, &observation) in trial.observations.iter().enumerate() {
            let start = Instant::now();
            observe(&mut self.filter, observation);
            self.filter_time += start.elapsed();
            let particles = self.filter.particles().iter();
            self.ancestry
                .advance(particles.map(|particle| (usize::from(particle.parent), usize::from(particle.place))));
            self.localised_steps += usize::from(is_localised(self.path(), &trial.classes[..=step]));
        }
    }

    /// The vertices that the best particle visited.
    fn path(&self) -> &[usize] {
        let best = self.filter.best();
        let index = self.filter.particles().iter().position(|particle| ptr::eq(particle, best));
        self.ancestry.path(index.unwrap_or(0))
    }

    fn finish(&self, trial: &Trial, consistency_mm: u16) -> PathResult {
        let map = self.filter.map();
        let edges = map.edges().map(|(a, b)| (usize::from(a), usize::from(b)));
        let graph = Graph::from_edges(usize::from(map.vertices()), edges);
        PathResult {
            exhaustive: trial.exhaustive,
            score: score_map(&graph, self.path(), &trial.truth, &trial.classes),
            vertices: graph.vertex_count(),
            localised_share: self.localised_steps as f64 / trial.observations.len() as f64,
            consistency_mm,
            vertices_full: self.filter.faults().of(FaultKind::VerticesFull),
            filter_time: self.filter_time,
        }
    }
}
