//! A robust filter whose results are compared with their definitions after every place.

use toposlam::{
    Consistency, Direction, Exit, Filter, Fingerprint, History, NgramLength, Observation, RobustConfig, RobustFilter,
    Update,
};
use toposlam_host_tests::consistency::hausdorff;
use toposlam_host_tests::graph::Graph;
use toposlam_host_tests::ngram::{Ngram, NgramSet, grams_of_graph};
use toposlam_host_tests::robust::{self, Hypothesis, Noise, OTHER_PATHS_SHARE, mean};

/// Tolerance of the core's evidence, in nats and relative to its magnitude: sums of f32 over some dozen places.
pub const EVIDENCE_TOLERANCE: (f64, f64) = (5e-3, 2e-5);
/// Tolerance of the bound of the other paths, in nats.
pub const BOUND_TOLERANCE: f64 = 5e-3;
/// Tolerance of a probability, and of a sum of several.
pub const PROBABILITY_TOLERANCE: f64 = 1e-3;
/// The core considers all vertices of a place whose log likelihood is less than this below the best one.
pub const REACH: f64 = 15.0;
/// Sequences with more walks through the map than this are not enumerated.
const MOST_WALKS: usize = 2_000;
/// Tolerance of the probability of a vertex.
const BELIEF_TOLERANCE: f64 = 5e-3;
/// The number 1 in the unit of probabilities.
const ONE: f64 = 65536.0;

/// A filter and its observations.
pub struct Watched<const N: usize, const V: usize, const HISTORY: usize> {
    /// The filter.
    pub filter: Box<RobustFilter<N, V, HISTORY>>,
    config: RobustConfig,
    /// The history, the oldest observation first.
    observations: Vec<Observation>,
    /// The path after the newest place.
    path: Vec<usize>,
    vertices: usize,
    /// Whether an observation was marginalised: statistics and evidence then include more than the history.
    pub has_dropped: bool,
    /// The counts.
    pub counts: Counts,
}

/// How often each comparison was made, and how often it failed in a way that may be rare.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Bound and belief were compared.
    pub compared: u32,
    /// The paths that the core leaves out make a difference.
    pub pruned: u32,
    /// Bound or belief were not those of the best hypothesis.
    pub stale: u32,
    /// The worst n-gram was searched.
    pub searched: u32,
    /// The core found an n-gram that is not the worst: it evaluates a limited number.
    pub overlooked: u32,
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, more: Self) {
        self.compared += more.compared;
        self.pruned += more.pruned;
        self.stale += more.stale;
        self.searched += more.searched;
        self.overlooked += more.overlooked;
    }
}

impl<const N: usize, const V: usize, const HISTORY: usize> Watched<N, V, HISTORY> {
    /// Starts a filter.
    pub fn new(config: RobustConfig, seed: u64) -> Self {
        let mut filter = Box::new(RobustFilter::new());
        filter.start(config, seed).expect("the configurations of tests are in range");
        let observations = Vec::new();
        Self {
            filter,
            config,
            observations,
            path: Vec::new(),
            vertices: 0,
            has_dropped: false,
            counts: Counts::default(),
        }
    }

    /// Observes the next place and makes all comparisons.
    pub fn observe(&mut self, observation: Observation) -> Update {
        self.observations.push(observation);
        let first = self.observations.len().saturating_sub(HISTORY);
        self.has_dropped |= first > 0;
        self.observations.drain(..first);
        self.path.drain(..first.min(self.path.len()));
        let update = self.filter.observe(observation);
        self.check(&update);
        update
    }

    fn check(&mut self, update: &Update) {
        let path: Vec<usize> = self.filter.path().map(usize::from).collect();
        assert_eq!(path.len(), self.observations.len());
        assert_eq!(path.last(), Some(&usize::from(update.vertex)), "the robot is where the path ends");
        assert!(update.distinct >= 1 && update.distinct <= self.config.hypotheses, "{update:?}");
        self.check_probabilities();
        self.check_ids(&path);
        self.check_worst(update);
        let evidence = f64::from(self.filter.evidence().0);
        let factors = f64::from(update.factors.ln_weight_q16()) / ONE;
        assert!(near(evidence, factors), "the evidence is the product of its factors: {evidence} {factors}");
        if !self.has_dropped {
            self.check_map(&path, update);
            self.check_evidence(&path);
        }
        self.path = path;
        self.vertices = self.filter.map().vertices().len();
    }

    /// The observations as the reference reads them, of which the first starts a sequence.
    fn seen(&self) -> Vec<robust::Observation> {
        let seen = |(at, observation): (usize, &Observation)| robust::Observation {
            label: f64::from(observation.fingerprint.steps()),
            turned_back: observation.exit.map(Exit::is_back),
            degree: observation.ways.map(|ways| usize::from(ways.count())),
            starts_sequence: at == 0 || observation.starts_sequence,
        };
        self.observations.iter().enumerate().map(seen).collect()
    }

    fn noise(&self) -> Noise {
        Noise {
            deviation: f64::from(self.filter.noise_mm()) / f64::from(Fingerprint::STEP_MM),
            wrong_turn: f64::from(self.config.wrong_turn_permille) / 1000.0,
            wrong_degree: f64::from(self.config.wrong_degree_permille) / 1000.0,
        }
    }

    fn check_probabilities(&mut self) {
        let of_vertex = |vertex| f64::from(self.filter.vertex_probability_q16(vertex)) / ONE;
        let sum: f64 = self.filter.map().vertices().map(of_vertex).sum();
        self.counts.stale += u32::from((sum - 1.0).abs() >= PROBABILITY_TOLERANCE);
        assert!(self.filter.map_probability_q16() <= ONE as u32);
        assert!(self.filter.map_probability_q16() > 0);
    }

    /// Asserts that the map follows from the path.
    fn check_map(&self, path: &[usize], update: &Update) {
        let observations = self.seen();
        let hypothesis = Hypothesis { observations: &observations, path, noise: self.noise() };
        let map = self.filter.map();
        assert_eq!(map.vertices().len(), hypothesis.vertices());
        let edges: Vec<_> = map.edges().map(|(a, b)| (usize::from(a), usize::from(b))).collect();
        assert!(hypothesis.edges().into_iter().eq(edges), "the edges are those that were driven");
        for (vertex, labels) in map.vertices().zip(hypothesis.labels()) {
            let label = map.label(vertex).map_or(f64::NAN, |label| f64::from(label.steps()));
            assert!((label - mean(&labels)).abs() < 0.501, "a label is the rounded mean: {label} {labels:?}");
            assert_eq!(map.visits(vertex) as usize, labels.len());
        }
        assert_eq!(update.is_new, map.visits(update.vertex) == 1);
    }

    fn check_evidence(&mut self, path: &[usize]) {
        let observations = self.seen();
        let hypothesis = Hypothesis { observations: &observations, path, noise: self.noise() };
        let (evidence, bound) = self.filter.evidence();
        let expected = hypothesis.evidence();
        assert!(near(f64::from(evidence), expected), "evidence {evidence} {expected} {path:?}");
        let of = |reach: f64| hypothesis.all_paths(reach, MOST_WALKS);
        let (Some(least), Some(most)) = (of(REACH), of(f64::INFINITY)) else { return };
        let bound = f64::from(bound);
        let [low, high] = [least.bound, most.bound].map(|bound| bound * OTHER_PATHS_SHARE);
        self.counts.compared += 1;
        if bound <= low - BOUND_TOLERANCE || bound >= high + BOUND_TOLERANCE {
            self.counts.stale += 1;
            return;
        }
        if high - low > BOUND_TOLERANCE {
            self.counts.pruned += 1;
            return;
        }
        let of_vertex = |vertex: usize| f64::from(self.filter.vertex_probability_q16(super::vertex(vertex))) / ONE;
        let is_right = |(vertex, place): (usize, &f64)| (of_vertex(vertex) - place).abs() < BELIEF_TOLERANCE;
        self.counts.stale += u32::from(!most.belief.iter().enumerate().all(is_right));
    }

    /// Asserts that a vertex keeps its id as long as its visits stay together.
    fn check_ids(&self, path: &[usize]) {
        let vertices = self.filter.map().vertices().len();
        let shared = || self.path.iter().copied().zip(path.iter().copied());
        for before in 0..V {
            let remapped = self.filter.remapped(super::vertex(before)).map(usize::from);
            assert!(remapped.is_none_or(|now| now < vertices), "{before} is now {remapped:?} of {vertices}");
            assert!(remapped.is_none() || before < self.vertices, "{before} was not there: {remapped:?}");
            let mut now: Vec<usize> = shared().filter(|&(was, _)| was == before).map(|(_, now)| now).collect();
            now.dedup();
            let &[now] = now.as_slice() else { continue };
            assert_eq!(remapped, Some(now), "all visits of {before} went there");
            let kept_together = shared().all(|(was, is)| is != now || was == before);
            if kept_together && before < vertices {
                assert_eq!(now, before, "its visits stayed together: {:?} {path:?}", self.path);
            }
        }
    }

    /// The worst n-gram has the directed distance of Eq. 2, by the reference over the sequences and, where there is one
    /// sequence, by the core's own measure of histories. It is compared at every place at first, and from the fiftieth on.
    fn check_worst(&mut self, update: &Update) {
        const N_GRAM: usize = 5;
        let map = self.filter.map();
        let worst = self.filter.worst();
        assert_eq!(update.consistency_mm, worst.distance_mm);
        if self.observations.len() > 20 && self.observations.len() < 50 {
            return;
        }
        let step_mm = f64::from(Fingerprint::STEP_MM);
        let labels: Vec<f64> = self.observations.iter().map(|seen| f64::from(seen.fingerprint.radius_mm())).collect();
        let is_whole = |&end: &usize| {
            end + 1 >= N_GRAM && self.observations[end + 2 - N_GRAM..=end].iter().all(|seen| !seen.starts_sequence)
        };
        let ngram = |end: usize| Ngram::new(&labels[end + 1 - N_GRAM..=end]);
        let ends: Vec<usize> = (0..labels.len()).filter(is_whole).collect();
        let history: NgramSet = ends.iter().map(|&end| ngram(end)).collect();
        let mean_mm: Vec<f64> = map.labels().iter().map(|label| f64::from(label.radius_mm())).collect();
        let edges: Vec<_> = map.edges().map(|(a, b)| (usize::from(a), usize::from(b))).collect();
        let graph = Graph::with(&mean_mm, &edges);
        let distance_mm = hausdorff(&grams_of_graph(&graph, N_GRAM), &history).history_to_map;
        let found_mm = f64::from(worst.distance_mm);
        assert!(found_mm <= distance_mm.min(f64::from(u16::MAX)), "Eq. 2: {found_mm} {distance_mm}");
        self.counts.searched += 1;
        self.counts.overlooked += u32::from(found_mm < distance_mm);
        if ends.is_empty() {
            assert_eq!(worst.length, 0);
            return;
        }
        assert_eq!(usize::from(worst.length), N_GRAM);
        let walk = worst.walk();
        let end = labels.len() - 1 - usize::from(worst.newest_age);
        assert!(ends.contains(&end), "it is an n-gram of one sequence");
        let apart =
            walk.iter().zip(&labels[end + 1 - N_GRAM..]).map(|(&at, seen)| (mean_mm[usize::from(at)] - seen).abs());
        assert_eq!(apart.fold(0.0, f64::max), found_mm, "the walk is so far from the n-gram");
        assert!(walk.windows(2).all(|pair| map.neighbours(pair[0]).contains(pair[1])), "{walk:?} is a walk");
        if ends.len() + N_GRAM == labels.len() + 1 {
            let mut history = History::<16>::new();
            self.observations.iter().for_each(|seen| _ = history.push(seen.fingerprint));
            let length = NgramLength::new(N_GRAM as u8).expect("5 is a length");
            let mut consistency = Box::new(Consistency::<V, 16, 1>::new());
            let steps = consistency.distance_steps(map, &history, length, Direction::HistoryToMap);
            assert_eq!(steps.map(|steps| f64::from(steps) * step_mm), Some(distance_mm), "with U-turns");
        }
    }
}

fn near(of_core: f64, expected: f64) -> bool {
    (of_core - expected).abs() <= EVIDENCE_TOLERANCE.0 + EVIDENCE_TOLERANCE.1 * expected.abs()
}
