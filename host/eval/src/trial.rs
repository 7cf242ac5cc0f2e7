//! One path and its ground truth, the same for every filter.

use super::{
    corridors::{Bearings, Corridors},
    environment::Environment,
    equivalence::SmallestEquivalent,
    graph::Graph,
    hints::Hint,
    prior::PriorSource,
    rotation::RotationSystem,
    settings::{EvaluationError, Filter, Settings},
    walk::{PathRng, Walk, draw_walk, observe, path_rng, quantise},
};
use rand::{Rng, seq::SliceRandom};
use std::collections::BTreeSet;
use toposlam::{Fingerprint, Observation};

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
    /// Its corridors as the robot perceives them, if the hints are ways.
    pub corridors: Option<Corridors>,
    /// The path.
    pub walk: Walk,
    /// The places of the path.
    pub visits: Vec<Visit>,
    /// The n-grams that a filter maps before the path, in random order, each an independent sequence.
    pub ngrams: Vec<Vec<Visit>>,
    /// The seed of the filter.
    pub filter_seed: u64,
    knows: Knowledge,
    judges_ways: bool,
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
    /// The observed part of the environment: of a map that is judged by its ways the part itself, otherwise its smallest
    /// equivalent.
    pub graph: Graph,
    /// The ways of this part, if maps are judged by their ways.
    pub rotation: Option<RotationSystem>,
    /// The true vertex at every place of the mapped n-grams and of the path.
    pub classes: Vec<usize>,
}

impl<'a> Trial<'a> {
    /// Draws path number `number`. `explored` are the walks of the n-grams of an exploration; other priors need none.
    ///
    /// # Errors
    /// [`EvaluationError::Corridors`] when the hints are ways that a robot cannot perceive.
    pub fn draw(
        environment: &'a Environment,
        explored: &[Vec<usize>],
        settings: &Settings,
        number: u64,
    ) -> Result<Self, EvaluationError> {
        let mut rng = path_rng(settings.seed, number);
        // Hints and corridors have their own streams, so that the readings are the same with and without them.
        let mut hint_rng = rng.clone();
        hint_rng.jump();
        let corridors =
            settings.hints.ways.then(|| draw_corridors(environment, settings.bearings, &hint_rng)).transpose()?;
        let walk = draw_walk(environment, settings.longest(), settings.walk, &mut rng);
        // Whether the robot turned back needs two places before; which way it took needs one.
        let first_exit = if settings.hints.ways { 1 } else { 2 };
        let mut read = |walk: &Walk, rng: &mut _| -> Vec<Visit> {
            let reading =
                |&place: &usize| quantise(observe(&environment.places()[place], rng), settings.fingerprint_bits);
            let fingerprints: Vec<Fingerprint> = walk.places.iter().map(reading).collect();
            let hints = settings.hints.draw(environment, corridors.as_ref(), walk, &mut hint_rng);
            let visit = |((&place, fingerprint), Hint { exit, ways, travel_frames })| {
                let observation = Observation { ways, exit, travel_frames, ..Observation::new(fingerprint) };
                Visit { place, observation }
            };
            begin(walk.places.iter().zip(fingerprints).zip(hints).map(visit).collect(), first_exit)
        };
        let visits = read(&walk, &mut rng);
        let filter_seed = rng.next_u64();
        let mut ngrams: Vec<Vec<Visit>> = match settings.prior {
            PriorSource::None => Vec::new(),
            PriorSource::Path => visits
                .windows(settings.ngram_length.get().into())
                .map(|window| begin(window.to_vec(), first_exit))
                .collect(),
            PriorSource::Exploration => explored
                .iter()
                .map(|places| {
                    let walk = Walk::along(environment, places, &mut rng);
                    read(&walk, &mut rng)
                })
                .collect(),
        };
        ngrams.shuffle(&mut rng);
        let knows = match (settings.filter, settings.prior) {
            // The map of the paper's filter grows only with the path.
            (Filter::Paper(_), _) | (_, PriorSource::None) => Knowledge::SoFar,
            (_, PriorSource::Path) => Knowledge::WholePath,
            (_, PriorSource::Exploration) => Knowledge::Everything,
        };
        let judges_ways = settings.judges_ways();
        Ok(Self { environment, corridors, walk, visits, ngrams, filter_seed, knows, judges_ways })
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
        let all = self.visits.len();
        let (graph, rotation, class_of_place) = match (self.judges_ways, self.knows) {
            (true, Knowledge::SoFar) => self.ways(self.walk.traversed(steps), &self.walk.places[..steps]),
            (true, Knowledge::WholePath) => self.ways(self.walk.traversed(all), &self.walk.places),
            (true, Knowledge::Everything) => {
                let places: Vec<usize> = (0..self.environment.places().len()).collect();
                self.ways((0..self.environment.corridors().len()).collect(), &places)
            }
            (false, Knowledge::SoFar) => self.labels(Some(steps)),
            (false, Knowledge::WholePath) => self.labels(Some(all)),
            (false, Knowledge::Everything) => self.labels(None),
        };
        let before = self.mapped_before().iter().flatten().map(|visit| visit.place);
        let visited = before.chain(self.walk.places[..steps].iter().copied());
        // The observed part contains every visited place.
        let classes = visited.filter_map(|place| class_of_place[place]).collect();
        Truth { graph, rotation, classes }
    }

    /// The smallest equivalent of the part that the first `steps` places traverse, or of all.
    fn labels(&self, steps: Option<usize>) -> (Graph, Option<RotationSystem>, Vec<Option<usize>>) {
        let smallest = match steps {
            Some(steps) => SmallestEquivalent::of_traversed(self.environment, &self.walk.places[..steps]),
            None => SmallestEquivalent::of_environment(self.environment),
        };
        (smallest.graph, None, smallest.class_of_place)
    }

    /// The part with some corridors and places. The vertices are numbered like the places.
    fn ways(
        &self,
        corridors: BTreeSet<usize>,
        places: &[usize],
    ) -> (Graph, Option<RotationSystem>, Vec<Option<usize>>) {
        let mut vertices = places.to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let number = |place| vertices.binary_search(&place).ok();
        let ends = corridors.iter().map(|&corridor| self.environment.corridors()[corridor]);
        let edges = ends.filter_map(|(a, b)| Some((number(a)?, number(b)?)));
        let graph = Graph::from_edges(vertices.len(), edges);
        let rotation = self.corridors.as_ref().map(Corridors::rotation);
        let rotation = rotation.map(|rotation| rotation.part(&vertices, |corridor| corridors.contains(&corridor)));
        (graph, rotation, (0..self.environment.places().len()).map(number).collect())
    }
}

/// The corridors of a path. Their stream follows that of the hints.
fn draw_corridors(
    environment: &Environment,
    bearings: Bearings,
    hint_rng: &PathRng,
) -> Result<Corridors, EvaluationError> {
    let mut rng = hint_rng.clone();
    rng.jump();
    Corridors::draw(environment, bearings, &mut rng).map_err(EvaluationError::Corridors)
}

/// Visits as an independent sequence: the first place has no predecessor, and exits start at place number `first_exit`, counted
/// from 0.
fn begin(mut visits: Vec<Visit>, first_exit: usize) -> Vec<Visit> {
    visits.iter_mut().take(first_exit).for_each(|visit| visit.observation.exit = None);
    if let Some(first) = visits.first_mut() {
        (first.observation.travel_frames, first.observation.starts_sequence) = (None, true);
    }
    visits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        family::Family,
        walk::{WalkKind, all_walks},
    };
    use std::path::Path;
    use toposlam::{NgramLength, OrderedConfig, PaperConfig, RobustConfig};

    fn environment() -> Environment {
        Environment::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("environments/wean-surrogate-sd.toml")).unwrap()
    }

    fn settings(prior: PriorSource) -> Settings {
        Settings {
            paths: 1,
            lengths: vec![12, 40],
            walk: WalkKind::Uniform,
            seed: 5,
            filter: Filter::Robust(RobustConfig::DEFAULT),
            capacities: Default::default(),
            prior,
            refinement_steps: 0,
            prior_refinement_steps: 0,
            search_from_truth: 0,
            hints: "both".parse().unwrap(),
            bearings: Bearings::Spread,
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
            let trial = Trial::draw(&environment, &walks, settings, 3).unwrap();
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
            let trial = Trial::draw(&environment, &walks, &settings(prior), 3).unwrap();
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
                assert_ne!(places(&trial), places(&Trial::draw(&environment, &walks, &settings(prior), 4).unwrap()));
            }
        }
    }

    #[test]
    fn with_ways_the_truth_of_the_ordered_filter_is_what_was_driven() {
        let multigraph = "1,1,10,10,2.6,4,0.03,multigraph".parse::<Family>().unwrap().environment(0).unwrap();
        let ordered = Settings {
            filter: Filter::Ordered(OrderedConfig::DEFAULT),
            hints: "ways".parse().unwrap(),
            lengths: vec![12, 200],
            ..settings(PriorSource::None)
        };
        let trial = Trial::draw(&multigraph, &[], &ordered, 3).unwrap();
        let so_far = trial.truth(12).rotation.unwrap();
        let driven: BTreeSet<usize> = trial.walk.exits[..11].iter().map(|exit| exit / 2).collect();
        assert_eq!(so_far.dart_count(), 2 * driven.len());
        assert_eq!(so_far.genus(), 0);
        let Truth { graph, rotation, classes } = trial.truth(200);
        assert_eq!(rotation.as_ref(), multigraph.rotation());
        assert_eq!((&graph, classes), (multigraph.graph(), trial.walk.places.clone()));
        // Robust maps are judged by what labels distinguish, on the same path.
        let robust = Settings { filter: Filter::Robust(RobustConfig::DEFAULT), ..ordered };
        let same = Trial::draw(&multigraph, &[], &robust, 3).unwrap();
        assert_eq!((&same.visits, same.truth(200).rotation), (&trial.visits, None));
    }

    #[test]
    fn sequences_start_without_exit_and_time() {
        let environment = environment();
        let hints = "ways,travel".parse().unwrap();
        let trial = Trial::draw(&environment, &[], &Settings { hints, ..settings(PriorSource::Path) }, 3).unwrap();
        for sequence in trial.ngrams.iter().chain([&trial.visits]) {
            for (step, visit) in sequence.iter().enumerate() {
                let Observation { ways, exit, travel_frames, starts_sequence, .. } = visit.observation;
                assert_eq!((exit.is_some(), travel_frames.is_some()), (step > 0, step > 0));
                assert!(ways.is_some() && starts_sequence == (step == 0));
            }
        }
    }

    #[test]
    fn the_truth_is_the_part_that_the_filter_observed() {
        let environment = environment();
        let walks = all_walks(&environment, 5, 1000).unwrap();
        let truth = |settings: &Settings| Trial::draw(&environment, &walks, settings, 3).unwrap().truth(12);
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
