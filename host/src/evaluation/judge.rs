//! One filter along one path, and how right its map is at each check point.

use super::{
    candidate::{Start, VERTICES, prior_table},
    graph::Graph,
    prior::PriorSource,
    run::Settings,
    score::{MapScore, is_localised, score_map_from},
    trial::{Trial, Truth},
};
use std::time::{Duration, Instant};
use toposlam::{Consistency, Direction, Evidence, History, Map, NgramLength};

/// Whether a map is exact is looked at after every so many places, and at the check points.
pub const EXACT_EVERY: usize = 10;

/// What one path contributes.
#[derive(Clone, Debug, PartialEq)]
pub struct PathResult {
    /// Whether the path traverses every edge.
    pub exhaustive: bool,
    /// One for each check point.
    pub judgements: Vec<Judgement>,
    /// How often the filter wanted a vertex that its map had no room for.
    pub vertices_full: u32,
    /// How long the n-grams of the prior took to map.
    pub prior_time: Duration,
}

/// How right a map is after some places of the path.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// The score of the map.
    pub score: MapScore,
    /// How many vertices the map has.
    pub vertices: usize,
    /// The share of the places so far at which the best hypothesis of that moment knew where the robot was.
    pub localised_share: f64,
    /// The two-sided distance of Eq. 2, in millimetres; `u16::MAX` when it is infinite.
    pub consistency_mm: u16,
    /// The first place, counted from 1, from which on the map was exact up to now, as far as was looked at.
    pub exact_from: Option<usize>,
    /// How long the filter took for the places so far.
    pub filter_time: Duration,
}

/// Drives a filter along a path and judges it.
pub fn judge(trial: &Trial, settings: &Settings, start: Start) -> PathResult {
    let mut candidate = start(settings, trial);
    let started = Instant::now();
    for visit in trial.mapped_before().iter().flatten() {
        candidate.observe(visit.observation);
    }
    let prior_time = started.elapsed();

    let before = trial.places_before();
    let distance_mm = distance_mm(trial, settings);
    let truths: Vec<Truth> = settings.lengths.iter().map(|&length| trial.truth(length)).collect();
    let mut localised = vec![0; truths.len()];
    let mut exact_from = None;
    let mut filter_time = Duration::ZERO;
    let mut judgements = Vec::new();
    for (step, visit) in trial.visits.iter().enumerate() {
        let start = Instant::now();
        candidate.observe(visit.observation);
        filter_time += start.elapsed();

        let steps = step + 1;
        let path = candidate.path(before + steps);
        // The check points that are still ahead.
        for (truth, localised) in truths.iter().zip(&mut localised).skip(judgements.len()) {
            *localised += usize::from(is_localised(&path, &truth.classes[..before + steps]));
        }
        let check_point = (settings.lengths.get(judgements.len()) == Some(&steps)).then_some(judgements.len());
        if check_point.is_none() && !steps.is_multiple_of(EXACT_EVERY) {
            continue;
        }
        let map = candidate.map();
        let graph = graph_of(&map);
        let truth = trial.truth(steps);
        let score = score_map_from(&graph, &path, &truth.graph, &truth.classes, before);
        exact_from = score.exact.then(|| exact_from.unwrap_or(steps));
        if let Some(check_point) = check_point {
            judgements.push(Judgement {
                score,
                vertices: graph.vertex_count(),
                localised_share: localised[check_point] as f64 / steps as f64,
                consistency_mm: distance_mm(&map, steps),
                exact_from,
                filter_time,
            });
        }
    }
    let vertices_full = candidate.vertices_full();
    PathResult { exhaustive: trial.exhaustive, judgements, vertices_full, prior_time }
}

fn graph_of(map: &Map<VERTICES>) -> Graph {
    let edges = map.edges().map(|(a, b)| (usize::from(a), usize::from(b)));
    Graph::from_edges(usize::from(map.vertices()), edges)
}

/// The two-sided distance (Eq. 2) of a map from the n-grams of the prior, or, without one, from those of the first so
/// many places of the path; in millimetres, whatever direction the filter takes.
fn distance_mm<'a>(trial: &'a Trial, settings: &Settings) -> Box<dyn Fn(&Map<VERTICES>, usize) -> u16 + 'a> {
    let length = settings.ngram_length;
    let ngrams = match settings.prior {
        PriorSource::None if settings.longest() <= 256 => return from_history::<8>(trial, length),
        PriorSource::None => return from_history::<64>(trial, length),
        PriorSource::Path => super::prior::path_ngrams(length, settings.longest()),
        PriorSource::Exploration => trial.ngrams.len(),
    };
    match ngrams {
        ..=512 => from_prior::<32>(trial, settings),
        ..=1024 => from_prior::<64>(trial, settings),
        _ => from_prior::<512>(trial, settings),
    }
}

fn from_history<'a, const WORDS: usize>(
    trial: &'a Trial,
    length: NgramLength,
) -> Box<dyn Fn(&Map<VERTICES>, usize) -> u16 + 'a> {
    Box::new(move |map, steps| {
        let mut history = Box::new(History::<WORDS>::new());
        for visit in &trial.visits[..steps] {
            history.push(visit.observation.fingerprint);
        }
        two_sided_mm::<WORDS, 1>(map, &*history, length)
    })
}

fn from_prior<const WORDS: usize>(
    trial: &Trial,
    settings: &Settings,
) -> Box<dyn Fn(&Map<VERTICES>, usize) -> u16 + 'static> {
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
