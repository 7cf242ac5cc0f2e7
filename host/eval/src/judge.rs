//! Runs one filter on one path and judges its map at each check point.

use super::{
    candidate::{Candidate, Start, VERTICES, prior_table},
    graph::Graph,
    prior::PriorSource,
    score::{MapScore, has_the_same_edges, has_the_same_ways, is_localised, score_map_from},
    settings::Settings,
    trial::{Trial, Truth},
};
use crate::processor_time::processor_time;
use std::time::Duration;
use toposlam::{Consistency, Direction, Evidence, History, Map, NgramLength};

/// Interval between tests for an exact map, in places; check points are tested, too.
pub const EXACT_EVERY: usize = 10;

/// The results of one path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathResult {
    /// Whether the path traverses every edge.
    pub exhaustive: bool,
    /// One judgement for each check point.
    pub judgements: Vec<Judgement>,
    /// Number of times that the filter needed a new vertex and its map was full.
    pub vertices_full: u32,
    /// Processor time to map the n-grams of the prior.
    pub prior_time: Duration,
}

/// Quality of a map after some places of the path.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// The score of the map.
    pub score: MapScore,
    /// Whether the vertices and the edges are right, whatever the order of the ways; `None` for a map that is not judged by its
    /// ways.
    pub exact_edges: Option<bool>,
    /// The probability of the map, as the filter states it.
    pub map_probability: f64,
    /// How many vertices the map has.
    pub vertices: usize,
    /// The share of the places so far at which the best hypothesis of that moment was localised.
    pub localised_share: f64,
    /// The two-sided distance of Eq. 2, in millimetres; `u16::MAX` when it is infinite.
    pub consistency_mm: u16,
    /// The first place, counted from 1, from which on the map passed every test for an exact map.
    pub exact_from: Option<usize>,
    /// Whether a long search from the true path ends in another map, which then has the better score; `None` without a
    /// search.
    pub leaves_truth: Option<bool>,
    /// Processor time of the filter for the places so far, refinement included.
    pub filter_time: Duration,
}

/// Runs a filter on a path and judges its maps.
pub fn judge(trial: &Trial, settings: &Settings, start: Start) -> PathResult {
    let mut candidate = start(settings, trial);
    let started = processor_time();
    for visit in trial.mapped_before().iter().flatten() {
        candidate.observe(visit.observation);
        candidate.refine(settings.prior_refinement_steps);
    }
    let prior_time = processor_time().saturating_sub(started);

    let before = trial.places_before();
    let distance_mm = distance_mm(trial, settings);
    let truths: Vec<Truth> = settings.lengths.iter().map(|&length| trial.truth(length)).collect();
    let mut localised = vec![0; truths.len()];
    let mut exact_from = None;
    let mut filter_time = Duration::ZERO;
    let mut judgements = Vec::new();
    for (step, visit) in trial.visits.iter().enumerate() {
        let start = processor_time();
        if step > 0 {
            candidate.refine(settings.refinement_steps);
        }
        candidate.observe(visit.observation);
        filter_time += processor_time().saturating_sub(start);

        let steps = step + 1;
        let path = candidate.path(before + steps);
        // The remaining check points.
        for (truth, localised) in truths.iter().zip(&mut localised).skip(judgements.len()) {
            *localised += usize::from(is_known_and_localised(&path, &truth.classes[..before + steps]));
        }
        let check_point = (settings.lengths.get(judgements.len()) == Some(&steps)).then_some(judgements.len());
        if check_point.is_none() && !steps.is_multiple_of(EXACT_EVERY) {
            continue;
        }
        let truth = trial.truth(steps);
        let (score, exact_edges) = score(&*candidate, &truth, before);
        exact_from = score.exact.then(|| exact_from.unwrap_or(steps));
        if let Some(check_point) = check_point {
            let map = candidate.map();
            judgements.push(Judgement {
                score,
                exact_edges,
                map_probability: candidate.map_probability(),
                vertices: map.vertices().len(),
                localised_share: localised[check_point] as f64 / steps as f64,
                consistency_mm: distance_mm(&map, steps),
                exact_from,
                leaves_truth: leaves_truth(&*candidate, trial, &truth, settings.search_from_truth),
                filter_time,
            });
        }
    }
    let vertices_full = candidate.vertices_full();
    PathResult { exhaustive: trial.walk.exhaustive, judgements, vertices_full, prior_time }
}

/// Scores the map of a filter, and whether it has the right vertices and edges without regard to the order of the ways. Places that
/// the filter has forgotten do not count.
fn score(candidate: &dyn Candidate, truth: &Truth, before: usize) -> (MapScore, Option<bool>) {
    let path = candidate.path(truth.classes.len());
    let known = |(&vertex, &class): (&Option<usize>, &usize)| Some((vertex?, class));
    let first = path.iter().take(before).flatten().count();
    let (path, classes): (Vec<usize>, Vec<usize>) = path.iter().zip(&truth.classes).filter_map(known).unzip();
    let score = score_map_from(&graph_of(&candidate.map()), &path, &truth.graph, &classes, first);
    match (&truth.rotation, candidate.ways()) {
        (Some(truth), Some(ways)) => {
            let exact = has_the_same_ways(&ways, &path, truth, &classes);
            let exact_edges = has_the_same_edges(&ways, &path, truth, &classes);
            (MapScore { exact, ..score }, Some(exact_edges))
        }
        _ => (score, None),
    }
}

/// Whether the last vertex of a path is known and represents the class of the robot, judged only by the path so far.
fn is_known_and_localised(path: &[Option<usize>], classes: &[usize]) -> bool {
    let known = path.iter().zip(classes).filter_map(|(&vertex, &class)| Some((vertex?, class)));
    let (known, classes): (Vec<usize>, Vec<usize>) = known.unzip();
    path.last().is_some_and(Option::is_some) && is_localised(&known, &classes)
}

/// Whether a search of `steps` refinement steps from the true path ends in another map.
fn leaves_truth(candidate: &dyn Candidate, trial: &Trial, truth: &Truth, steps: u32) -> Option<bool> {
    if steps == 0 {
        return None;
    }
    let found = candidate.search_from(trial, truth, steps)?;
    Some(!score(&*found, truth, trial.places_before()).0.exact)
}

fn graph_of(map: &Map<VERTICES>) -> Graph {
    let edges = map.edges().map(|(a, b)| (usize::from(a), usize::from(b)));
    Graph::from_edges(map.vertices().len(), edges)
}

/// Distance of a map after this number of places of the path, in millimetres.
type Distance<'a> = Box<dyn Fn(&Map<VERTICES>, usize) -> u16 + 'a>;

/// The two-sided distance (Eq. 2) of a map from the n-grams of the prior or, without a prior, of the path so far; in
/// millimetres, whatever direction the filter takes.
fn distance_mm<'a>(trial: &'a Trial, settings: &Settings) -> Distance<'a> {
    let length = settings.ngram_length;
    let ngrams = match settings.prior {
        PriorSource::None if settings.longest() <= 256 => return from_history::<8>(trial, length),
        PriorSource::None => return from_history::<64>(trial, length),
        PriorSource::Path => super::prior::path_ngrams(length, settings.longest()),
        PriorSource::Exploration => trial.ngrams.len(),
    };
    match ngrams {
        0..=512 => from_prior::<32>(trial, settings),
        513..=1024 => from_prior::<64>(trial, settings),
        _ => from_prior::<512>(trial, settings),
    }
}

fn from_history<'a, const WORDS: usize>(trial: &'a Trial, length: NgramLength) -> Distance<'a> {
    Box::new(move |map, steps| {
        let mut history = Box::new(History::<WORDS>::new());
        for visit in &trial.visits[..steps] {
            history.push(visit.observation.fingerprint);
        }
        two_sided_mm::<WORDS, 1>(map, &*history, length)
    })
}

fn from_prior<const WORDS: usize>(trial: &Trial, settings: &Settings) -> Distance<'static> {
    let (prior, length) = (prior_table::<WORDS>(settings, trial), settings.ngram_length);
    Box::new(move |map, _| two_sided_mm::<WORDS, 7>(map, prior.ngrams(), length))
}

fn two_sided_mm<const WORDS: usize, const INDICES: usize>(
    map: &Map<VERTICES>,
    evidence: &impl Evidence<WORDS>,
    length: NgramLength,
) -> u16 {
    let mut consistency = Box::new(Consistency::<VERTICES, WORDS, INDICES>::new());
    let steps = consistency.distance_steps(map, evidence, length, Direction::TwoSided);
    steps.map_or(u16::MAX, |steps| steps.saturating_mul(length.label_step_mm()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        candidate::Candidate,
        environment::{Environment, Place},
        settings::Filter,
        walk::{WalkKind, all_walks},
    };
    use toposlam::{Fingerprint, Observation, RobustConfig};

    /// A candidate whose map is the whole environment from the start, and whose location is right except for the first
    /// `LOST_FOR` places.
    struct Oracle {
        map: Map<VERTICES>,
        places: Vec<usize>,
        seen: usize,
        lost_for: usize,
    }

    impl Candidate for Oracle {
        fn observe(&mut self, _: Observation) {
            self.seen += 1;
        }

        fn refine(&mut self, _steps: u32) {}

        fn map(&self) -> Map<VERTICES> {
            self.map
        }

        fn path(&self, places: usize) -> Vec<Option<usize>> {
            let vertex = |(step, &place)| Some(if step < self.lost_for { (place + 1) % 3 } else { place });
            let path: Vec<Option<usize>> = self.places[..self.seen].iter().enumerate().map(vertex).collect();
            path[self.seen - places..].to_vec()
        }

        fn map_probability(&self) -> f64 {
            0.75
        }

        fn vertices_full(&self) -> u32 {
            3
        }
    }

    fn oracle<const LOST_FOR: usize>(_: &Settings, trial: &Trial) -> Box<dyn Candidate> {
        let mut map = Map::new();
        let radii = trial.environment.places().iter().map(|place| Fingerprint::from_radius_mm(place.mean_mm as u16));
        let vertices: Vec<_> = radii.map(|radius| map.add_vertex(radius.unwrap()).unwrap()).collect();
        trial.environment.graph().edges().iter().for_each(|&(a, b)| map.add_edge(vertices[a], vertices[b]));
        let places = trial.mapped_before().iter().flatten().chain(&trial.visits).map(|visit| visit.place).collect();
        Box::new(Oracle { map, places, seen: 0, lost_for: LOST_FOR })
    }

    fn triangle() -> Environment {
        let places = [800.0, 1600.0, 2400.0].iter().zip(0..).map(|(&mean_mm, id)| Place { id, mean_mm, sd_mm: 0.0 });
        Environment::new("triangle".into(), places.collect(), &[[0, 1], [1, 2], [2, 0]]).unwrap()
    }

    fn judged(prior: PriorSource, lengths: &[usize], start: Start) -> PathResult {
        let environment = triangle();
        let settings = Settings {
            paths: 1,
            lengths: lengths.to_vec(),
            walk: WalkKind::Uniform,
            seed: 1,
            filter: Filter::Robust(RobustConfig::DEFAULT),
            capacities: Default::default(),
            prior,
            refinement_steps: 0,
            prior_refinement_steps: 0,
            search_from_truth: 0,
            hints: Default::default(),
            bearings: Default::default(),
            fingerprint_bits: 12,
            ngram_length: NgramLength::new(3).unwrap(),
            threads: 1,
        };
        let walks = all_walks(&environment, 3, 100).unwrap();
        judge(&Trial::draw(&environment, &walks, &settings, 0).unwrap(), &settings, start)
    }

    #[test]
    fn a_map_of_the_explored_environment_is_exact_at_once() {
        let result = judged(PriorSource::Exploration, &[1, 4, 30], oracle::<0>);
        assert_eq!(result.vertices_full, 3);
        for (judgement, exact_from) in result.judgements.iter().zip([1, 1, 1]) {
            let right = MapScore { exact: true, isomorphic: true, edge_f1: 1.0, location: 1.0 };
            assert_eq!(judgement.score, right);
            assert_eq!((judgement.vertices, judgement.localised_share), (3, 1.0));
            assert_eq!((judgement.exact_from, judgement.consistency_mm), (Some(exact_from), 0));
        }
    }

    #[test]
    fn without_a_prior_a_map_is_judged_by_the_traversed_part() {
        let result = judged(PriorSource::None, &[1, 30], oracle::<0>);
        let [first, last] = [&result.judgements[0], &result.judgements[1]];
        assert!(!first.score.exact && last.score.exact);
        assert_eq!((first.exact_from, last.exact_from), (None, Some(10)));
    }

    #[test]
    fn a_lost_robot_is_localised_online_once_most_visits_are_right() {
        let result = judged(PriorSource::None, &[12, 60], oracle::<4>);
        let [first, last] = [&result.judgements[0], &result.judgements[1]];
        assert_eq!(last.score.location, 56.0 / 60.0);
        assert!(first.localised_share < last.localised_share && last.localised_share < 1.0);
    }
}
