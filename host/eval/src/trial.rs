//! One path and its ground truth, the same for every filter.

use super::{
    environment::Environment,
    equivalence::SmallestEquivalent,
    graph::Graph,
    hints::Hint,
    prior::PriorSource,
    settings::{Filter, Settings},
    walk::{Walk, draw_walk, observe, path_rng, quantise},
};
use rand::{Rng, seq::SliceRandom};
use toposlam::{Fingerprint, Observation, Ways};

/// A visited place and the robot's observation of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visit {
    /// The index of the place.
    pub place: usize,
    /// The input of the filter.
    pub observation: Observation,
}

/// One path. Its walk, readings and hints depend only on the seed and the number of the path, not on the filter or the
/// prior.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial<'a> {
    /// The environment of the path.
    pub environment: &'a Environment,
    /// Whether the path traverses every edge.
    pub exhaustive: bool,
    /// The path.
    pub visits: Vec<Visit>,
    /// The n-grams that a filter maps before the path, in random order, each an independent sequence.
    pub ngrams: Vec<Vec<Visit>>,
    /// The seed of the filter.
    pub filter_seed: u64,
    knows: Knowledge,
}

/// The part of its environment that a filter has observed and is judged by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Knowledge {
    /// The part that the path has traversed so far.
    SoFar,
    /// The part that the whole path traverses.
    WholePath,
    /// All of it.
    Everything,
}

/// The ground truth of a map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Truth {
    /// The smallest equivalent of the observed part of the environment.
    pub graph: Graph,
    /// The true vertex at every place of the mapped n-grams and of the path.
    pub classes: Vec<usize>,
}

impl<'a> Trial<'a> {
    /// Draws path number `number`. `explored` are the walks of the n-grams of an exploration; other priors need none.
    pub fn draw(environment: &'a Environment, explored: &[Vec<usize>], settings: &Settings, number: u64) -> Self {
        let mut rng = path_rng(settings.seed, number);
        // Hints have their own stream, so that the readings are the same with and without them.
        let mut hint_rng = rng.clone();
        hint_rng.jump();
        let Walk { places: walk, exhaustive } = draw_walk(environment, settings.longest(), &mut rng);
        let mut read = |walk: &[usize], rng: &mut _| -> Vec<Visit> {
            let fingerprints: Vec<_> = walk.iter().map(|&place| observe(&environment.places()[place], rng)).collect();
            let hints = settings.hints.draw(environment, walk, &mut hint_rng);
            let visit = |((&place, fingerprint), hint): ((&usize, Fingerprint), Hint)| {
                let fingerprint = quantise(fingerprint, settings.fingerprint_bits);
                let Hint { turn, degree } = hint;
                let ways = degree.and_then(|degree| Ways::from_count(degree).ok());
                Visit { place, observation: Observation { exit: turn, ways, ..Observation::new(fingerprint) } }
            };
            begin(walk.iter().zip(fingerprints).zip(hints).map(visit).collect())
        };
        let visits = read(&walk, &mut rng);
        let filter_seed = rng.next_u64();
        let mut ngrams: Vec<Vec<Visit>> = match settings.prior {
            PriorSource::None => Vec::new(),
            PriorSource::Path => {
                visits.windows(settings.ngram_length.get().into()).map(|window| begin(window.to_vec())).collect()
            }
            PriorSource::Exploration => explored.iter().map(|walk| read(walk, &mut rng)).collect(),
        };
        ngrams.shuffle(&mut rng);
        let knows = match (settings.filter, settings.prior) {
            // The map of the paper's filter grows only with the path.
            (Filter::Paper(_), _) | (Filter::Robust(_), PriorSource::None) => Knowledge::SoFar,
            (Filter::Robust(_), PriorSource::Path) => Knowledge::WholePath,
            (Filter::Robust(_), PriorSource::Exploration) => Knowledge::Everything,
        };
        Self { environment, exhaustive, visits, ngrams, filter_seed, knows }
    }

    /// The n-grams that the filter maps before the path.
    pub fn mapped_before(&self) -> &[Vec<Visit>] {
        if self.knows == Knowledge::SoFar { &[] } else { &self.ngrams }
    }

    /// Number of places in [`Trial::mapped_before`].
    pub fn places_before(&self) -> usize {
        self.mapped_before().iter().map(Vec::len).sum()
    }

    /// The truth after the first `steps` places of the path.
    pub fn truth(&self, steps: usize) -> Truth {
        let walk: Vec<usize> = self.visits.iter().map(|visit| visit.place).collect();
        let SmallestEquivalent { graph, class_of_place } = match self.knows {
            Knowledge::SoFar => SmallestEquivalent::of_traversed(self.environment, &walk[..steps]),
            Knowledge::WholePath => SmallestEquivalent::of_traversed(self.environment, &walk),
            Knowledge::Everything => SmallestEquivalent::of_environment(self.environment),
        };
        let before = self.mapped_before().iter().flatten().map(|visit| visit.place);
        let visited = before.chain(walk[..steps].iter().copied());
        // The observed part contains every visited place.
        let classes = visited.filter_map(|place| class_of_place[place]).collect();
        Truth { graph, classes }
    }
}

/// Visits as an independent sequence: the first place has no predecessor, and turns start at the third place.
fn begin(mut visits: Vec<Visit>) -> Vec<Visit> {
    visits.iter_mut().take(2).for_each(|visit| visit.observation.exit = None);
    visits.iter_mut().take(1).for_each(|visit| visit.observation.starts_sequence = true);
    visits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::walk::all_walks;
    use std::path::Path;
    use toposlam::{NgramLength, PaperConfig, RobustConfig};

    fn environment() -> Environment {
        Environment::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("environments/wean-surrogate-sd.toml")).unwrap()
    }

    fn settings(prior: PriorSource) -> Settings {
        Settings {
            paths: 1,
            lengths: vec![12, 40],
            seed: 5,
            filter: Filter::Robust(RobustConfig::DEFAULT),
            prior,
            refinement_steps: 0,
            prior_refinement_steps: 0,
            search_from_truth: 0,
            hints: "both".parse().unwrap(),
            fingerprint_bits: 12,
            ngram_length: NgramLength::new(5).unwrap(),
            threads: 1,
        }
    }

    #[test]
    fn a_path_does_not_depend_on_filter_prior_or_hints() {
        let environment = environment();
        let walks = all_walks(&environment, 5, 1000).unwrap();
        let fingerprints = |settings: &Settings| {
            let trial = Trial::draw(&environment, &walks, settings, 3);
            let read =
                trial.visits.iter().map(|visit| (visit.place, visit.observation.fingerprint)).collect::<Vec<_>>();
            (read, trial.filter_seed)
        };
        let first = fingerprints(&settings(PriorSource::None));
        assert_eq!(first.0.len(), 40);
        for prior in [PriorSource::Path, PriorSource::Exploration] {
            assert_eq!(fingerprints(&settings(prior)), first);
            let paper = Settings {
                filter: Filter::Paper(PaperConfig::DEFAULT),
                hints: "none".parse().unwrap(),
                ..settings(prior)
            };
            assert_eq!(fingerprints(&paper), first);
        }
    }

    #[test]
    fn n_grams_are_independent_sequences_in_a_different_order_on_each_path() {
        let environment = environment();
        let walks = all_walks(&environment, 5, 1000).unwrap();
        for (prior, count) in [(PriorSource::None, 0), (PriorSource::Path, 36), (PriorSource::Exploration, 287)] {
            let trial = Trial::draw(&environment, &walks, &settings(prior), 3);
            assert_eq!((trial.mapped_before().len(), trial.places_before()), (count, 5 * count));
            for sequence in trial.ngrams.iter().chain([&trial.visits]) {
                let starts = sequence.iter().map(|visit| visit.observation.starts_sequence);
                assert!(starts.eq((0..sequence.len()).map(|step| step == 0)));
                let turns = sequence.iter().map(|visit| visit.observation.exit.is_some());
                assert!(turns.eq((0..sequence.len()).map(|step| step >= 2)));
            }
            let places = |trial: &Trial| -> Vec<Vec<usize>> {
                let walk = |ngram: &Vec<Visit>| ngram.iter().map(|visit| visit.place).collect();
                trial.ngrams.iter().map(walk).collect()
            };
            let mut sorted = places(&trial);
            sorted.sort();
            if prior == PriorSource::Exploration {
                assert_eq!(sorted, walks);
                assert_ne!(places(&trial), places(&Trial::draw(&environment, &walks, &settings(prior), 4)));
            }
        }
    }

    #[test]
    fn the_truth_is_the_part_that_the_filter_observed() {
        let environment = environment();
        let walks = all_walks(&environment, 5, 1000).unwrap();
        let truth = |settings: &Settings| Trial::draw(&environment, &walks, settings, 3).truth(12);
        let explored = truth(&settings(PriorSource::Exploration));
        assert_eq!(&explored.graph, environment.graph());
        assert_eq!(explored.classes.len(), 5 * 287 + 12);
        let so_far = truth(&settings(PriorSource::None));
        assert!(so_far.graph.edges().len() < environment.graph().edges().len());
        assert_eq!(so_far.classes.len(), 12);
        let paper = Settings { filter: Filter::Paper(PaperConfig::DEFAULT), ..settings(PriorSource::Exploration) };
        assert_eq!(truth(&paper), so_far);
        let whole_path = truth(&settings(PriorSource::Path));
        assert!(whole_path.graph.edges().len() > so_far.graph.edges().len());
    }
}
