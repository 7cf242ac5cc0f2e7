//! The core's paper filter and the reference filter on the same observations and the same random draws.

pub use super::split_mix::Random;
use super::{fingerprint, length};
use toposlam::{
    Direction, FaultKind, Filter, Fingerprint, PaperConfig, PaperFilter, Particle as CoreParticle, Prior, Update,
    WeightFactors,
};
use toposlam_host_tests::filter::{self, Candidate, Map, Parameters, Particle};
use toposlam_host_tests::graph::Graph;
use toposlam_host_tests::ngram::NgramSet;

/// Particles of the core in these tests.
pub const PARTICLES: usize = 10;
/// Capacity of its maps.
pub const VERTICES: usize = 8;
/// Words of its history: 32 places, fewer than a long drive has.
pub const WORDS: usize = 1;
/// Words of a prior: 512 n-grams.
pub const PRIOR_WORDS: usize = 32;

/// Tolerance of a logarithm of Eq. 7 or 8, in nats, and relative to its magnitude.
pub const LN_TOLERANCE: (f64, f64) = (2e-5, 1e-6);
/// Tolerance of each of the A² factors of Eq. 9, in nats: rounding, the cancellation in 1 − φ in f32, and, where σ_l is
/// too large for the core's table to hold every label difference, linear interpolation between points h = 0.035 σ_l
/// apart, which errs by up to h²/8 times the curvature 2φ / (1 − φ).
pub fn penalty_tolerance(parameters: &Parameters) -> f64 {
    let phi = parameters.phi;
    let interpolation = if parameters.sigma_label_mm > 113.0 { 3.1e-4 * phi / (1.0 - phi) } else { 0.0 };
    1e-5 + 1e-7 / (1.0 - phi) + interpolation
}

/// Tolerance of a weight relative to the best one: weights are rounded to this.
pub const WEIGHT_STEP: f64 = 1.0 / (1 << 20) as f64;
/// A candidate with a smaller weight, relative to the best one, is never proposed: it rounds to 0.
pub const LEAST_PROPOSAL: f64 = WEIGHT_STEP / 2.0;
/// Tolerance of an acceptance besides its logarithm: it is a single-precision number.
pub const ACCEPTANCE_STEP: f64 = 1.0 / (1 << 22) as f64;
/// After this number of proposals for one place the core computes all weights.
pub const MOST_PROPOSALS: usize = 128;
/// Lower bound of Eq. 7 and 8 in the core: e to the minus this.
pub const LARGEST_LOSS: f64 = 4096.0;

impl Random {
    /// A connected building of this many places, some with equal labels, all labels on the grid.
    pub fn building(&mut self, places: usize) -> Graph {
        let spacing_mm = [60.0, 200.0, 400.0][self.below(3)];
        let labels: Vec<f64> = (0..places).map(|_| 1000.0 + spacing_mm * self.below(4) as f64).collect();
        let mut building = Graph::with(&labels, &[]);
        for place in 1..places {
            building.add_edge(place, self.below(place));
        }
        for _ in 0..places / 2 {
            building.add_edge(self.below(places), self.below(places));
        }
        building
    }

    /// The measurements of a robot on a random walk through a building, with a noise of up to this many steps.
    pub fn walk(&mut self, building: &Graph, observations: usize, noise_steps: usize) -> Vec<f64> {
        let mut place = self.below(building.vertices());
        let mut observe = |_| {
            let ways: Vec<usize> = building.neighbours(place).iter().copied().collect();
            place = ways[self.below(ways.len())];
            let noise = self.below(2 * noise_steps + 1) as f64 - noise_steps as f64;
            building.label(place) + 2.0 * noise
        };
        (0..observations).map(&mut observe).collect()
    }
}

/// The evidence for the consistency of the maps.
pub enum Evidence {
    /// The filter's own history.
    OnLine,
    /// The n-grams of an earlier exploration.
    Prior(Vec<f64>),
}

/// How many draws of a drive were near a tie.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// All random draws.
    pub draws: usize,
    /// Draws so near the boundary of two candidates that the tolerance allows both.
    pub ties: usize,
    /// Draws with different candidates; each is near a tie.
    pub differing: usize,
}

/// Both filters.
pub struct Drive {
    config: PaperConfig,
    parameters: Parameters,
    core: Box<PaperFilter<PARTICLES, VERTICES, WORDS>>,
    prior: Option<(Box<Prior<VERTICES, PRIOR_WORDS>>, NgramSet)>,
    particles: Vec<Particle>,
    history_mm: Vec<f64>,
    /// The draws so far.
    pub tally: Tally,
}

impl Drive {
    /// Starts both filters with one configuration.
    pub fn new(config: PaperConfig, evidence: &Evidence) -> Self {
        let n = usize::from(config.ngram_length);
        let parameters = Parameters {
            n,
            particles: usize::from(config.particles),
            phi: f64::from(config.penalty_permille) / 1000.0,
            sigma_label_mm: f64::from(config.sigma_label_mm),
            sigma_consistency_mm: f64::from(config.sigma_consistency_mm),
            direction: match config.direction {
                Direction::TwoSided => filter::Direction::TwoSided,
                Direction::MapToHistory => filter::Direction::MapToHistory,
                Direction::HistoryToMap => filter::Direction::HistoryToMap,
            },
            label_grid_mm: Some(f64::from(Fingerprint::STEP_MM)),
            ngram_grid_mm: Some(f64::from(length(n).label_step_mm())),
            farthest_mm: LARGEST_LOSS.sqrt() * f64::from(config.sigma_consistency_mm),
            most_vertices: VERTICES,
        };
        let mut core = Box::new(PaperFilter::new());
        core.start(config, 0).expect("tests use valid configurations");
        let prior = match evidence {
            Evidence::OnLine => None,
            Evidence::Prior(exploration_mm) => {
                let mut prior = Box::new(Prior::new(length(n)));
                let mut exploration = toposlam::History::<8>::new();
                for &label_mm in exploration_mm {
                    exploration.push(fingerprint(label_mm));
                    prior.extend(&exploration).expect("tests keep to the capacity");
                }
                Some((prior, parameters.grams_of_history(exploration_mm)))
            }
        };
        let particles = filter::first_particles(&parameters);
        Self { config, parameters, core, prior, particles, history_mm: Vec::new(), tally: Tally::default() }
    }

    /// Observes a place with both filters; panics if they differ.
    pub fn observe(&mut self, observation_mm: f64, random: &mut Random) {
        let mut of_reference = Random(random.0);
        let draws = || (random.bits() >> 32) as u32;
        self.history_mm.push(observation_mm);
        let observation = fingerprint(observation_mm);
        let (update, evidence) = match &mut self.prior {
            Some((prior, grams)) => (self.core.observe_with_prior_and_draws(observation, prior, draws), grams.clone()),
            None => {
                let kept = &self.history_mm[self.history_mm.len().saturating_sub(32 * WORDS)..];
                (self.core.observe_with_draws(observation, draws), self.parameters.grams_of_history(kept))
            }
        };
        let pool = filter::predict(&self.particles, observation_mm, &evidence, &self.parameters);
        let chosen = self.chosen_by_the_core(&pool);
        self.check_choice(&pool, &chosen, || unit((of_reference.bits() >> 32) as u32));
        self.check_update(&pool, &chosen, update);
        self.particles = filter::resample(&pool, &chosen);
        self.check_particles(&pool);
    }

    /// The core's count of a kind of fault.
    pub fn faults(&self, kind: FaultKind) -> u32 {
        self.core.faults().count(kind)
    }

    /// The numbers of vertices of the core's maps.
    pub fn sizes(&self) -> Vec<usize> {
        self.core.particles().iter().map(|particle| particle.map.vertices().len()).collect()
    }

    /// The candidates drawn by the core, in the order of the pool.
    fn chosen_by_the_core(&self, pool: &[Candidate]) -> Vec<usize> {
        let candidate_of = |particle: &CoreParticle<VERTICES>| {
            let is_it = |candidate: &Candidate| {
                (candidate.parent, candidate.vertex) == (usize::from(particle.parent), usize::from(particle.at))
            };
            pool.iter().position(is_it).expect("the core draws from the same pool")
        };
        let repeated = |particle| std::iter::repeat_n(candidate_of(particle), usize::from(particle.multiplicity));
        self.core.particles().iter().flat_map(repeated).collect()
    }

    /// Asserts that the reference draws the same candidates with the same random numbers, except for draws within the tolerance
    /// of a boundary.
    fn check_choice(&mut self, pool: &[Candidate], chosen: &[usize], random: impl FnMut() -> f64) {
        let proposals = filter::proposals(pool, LEAST_PROPOSAL);
        let acceptances = filter::acceptances(pool, &proposals);
        let weights: Vec<f64> = proposals.iter().zip(&acceptances).map(|(a, b)| a * b).collect();
        let made = filter::draw(&proposals, &acceptances, self.parameters.particles, MOST_PROPOSALS, random);
        let mut expected: Vec<usize> =
            made.iter().filter(|proposal| proposal.accepted).map(|proposal| proposal.candidate).collect();
        expected.sort_unstable();
        assert_eq!(chosen.len(), expected.len(), "all draws have a candidate");
        let (proposing, sure) = (self.boundaries(pool, &proposals), self.boundaries(pool, &weights));
        let is_tie = self.floor_is_close(pool)
            || made.iter().enumerate().any(|(number, proposal)| {
                let boundaries = if number < MOST_PROPOSALS { &proposing } else { &sure };
                let near = |&(boundary, tolerance): &(f64, f64)| (proposal.proposing - boundary).abs() <= tolerance;
                let acceptance = acceptances[proposal.candidate];
                let tolerance = acceptance * self.tolerance_of_weight(&pool[proposal.candidate]) + ACCEPTANCE_STEP;
                boundaries.iter().any(near)
                    || (number < MOST_PROPOSALS
                        && acceptance < 1.0
                        && (proposal.accepting - acceptance).abs() <= tolerance)
            });
        self.tally.draws += made.len();
        self.tally.ties += usize::from(is_tie);
        self.tally.differing += usize::from(chosen != expected);
        assert!(
            is_tie || chosen == expected,
            "{chosen:?}, not {expected:?}, of {proposals:?} accepted with {acceptances:?} after {made:?} with {:?}",
            self.config
        );
    }

    /// Whether a candidate is within the tolerance of the smallest weight that is proposed.
    fn floor_is_close(&self, pool: &[Candidate]) -> bool {
        let sure = filter::proposals(pool, LEAST_PROPOSAL * 1.001);
        let possible = filter::proposals(pool, LEAST_PROPOSAL * 0.999);
        sure.iter().zip(&possible).any(|(sure, possible)| sure != possible)
    }

    /// The boundary between one candidate's share of the proposals and the next one's, and its tolerance.
    ///
    /// If all logarithms have an error of at most ε, a share c of the sum has an error of at most 2 ε c (1 − c), plus the
    /// rounding of the weights.
    fn boundaries(&self, pool: &[Candidate], proposals: &[f64]) -> Vec<(f64, f64)> {
        let proposed = pool.iter().zip(proposals).filter(|&(_, &weight)| weight > 0.0);
        let epsilon = proposed.map(|(candidate, _)| self.tolerance_of_weight(candidate)).fold(0.0, f64::max);
        let total: f64 = proposals.iter().sum();
        let multiplicities: usize = pool.iter().map(|candidate| candidate.multiplicity).sum();
        let rounding = WEIGHT_STEP / 2.0 * multiplicities as f64 / total.max(1.0);
        let mut share = 0.0;
        let mut boundaries = vec![(0.0, rounding)];
        for weight in proposals {
            share += weight / total;
            boundaries.push((share, 2.0 * epsilon * share * (1.0 - share).max(0.0) + rounding));
        }
        boundaries
    }

    /// Tolerance of the logarithm of Eq. 6.
    fn tolerance_of_weight(&self, candidate: &Candidate) -> f64 {
        let of_penalty = penalty_tolerance(&self.parameters) * candidate.map.graph.vertices().pow(2) as f64;
        let gaussian = candidate.ln_observation + candidate.ln_consistency;
        2.0 * LN_TOLERANCE.0 + of_penalty - LN_TOLERANCE.1 * gaussian
    }

    fn check_update(&self, pool: &[Candidate], chosen: &[usize], update: Update) {
        assert_eq!(update.place_index as usize + 1, self.history_mm.len());
        assert_eq!(usize::from(update.distinct), self.core.particles().len());
        let ascending = |candidates: &mut dyn Iterator<Item = usize>| {
            let mut candidates: Vec<&Candidate> = candidates.map(|candidate| &pool[candidate]).collect();
            candidates.sort_by(|a, b| a.ln_weight().total_cmp(&b.ln_weight()));
            candidates
        };
        let best = self.core.best();
        let of_chosen = ascending(&mut chosen.iter().copied());
        let heaviest = of_chosen[of_chosen.len() - 1];
        let difference = nats(best.factors.ln_weight_q16()) - heaviest.ln_weight();
        assert!(difference.abs() <= self.tolerance_of_weight(heaviest), "{update:?} {difference}");
        assert_eq!((update.vertex, update.factors), (best.at, WeightFactors::Paper(best.factors)));
        // The reported lead is a bound of the true one: it assumes the best consistency for the rivals.
        let proposals = filter::proposals(pool, LEAST_PROPOSAL * 1.1);
        let rivals = || {
            let is_rival =
                |candidate: &Candidate| (candidate.parent, candidate.vertex) != (heaviest.parent, heaviest.vertex);
            pool.iter()
                .zip(&proposals)
                .filter(move |&(rival, &weight)| weight > 0.0 && is_rival(rival))
                .map(|(rival, _)| rival)
        };
        let tolerance = pool.iter().map(|candidate| 2.0 * self.tolerance_of_weight(candidate)).fold(0.0, f64::max);
        let heaviest_rival = rivals().map(Candidate::ln_weight).fold(f64::NEG_INFINITY, f64::max);
        let lead = (heaviest.ln_weight() - heaviest_rival).min(15.0);
        assert!(nats(update.lead_q16) <= lead + tolerance, "{update:?} {lead} {:?}", self.config);
        assert_eq!(update.is_new, best.map.visits(best.at) == 1);
    }

    fn check_particles(&self, pool: &[Candidate]) {
        assert_eq!(self.core.particles().len(), self.particles.len());
        for (core, particle) in self.core.particles().iter().zip(&self.particles) {
            assert_eq!(usize::from(core.multiplicity), particle.multiplicity);
            assert_eq!(Some(usize::from(core.at)), particle.place);
            assert_eq!(map_of(core), map_parts(&particle.map));
            let is_it = |candidate: &&Candidate| {
                (candidate.parent, candidate.vertex) == (particle.parent, usize::from(core.at))
            };
            self.check_factors(core, pool.iter().find(is_it).expect("it was drawn from the pool"));
        }
    }

    fn check_factors(&self, core: &CoreParticle<VERTICES>, candidate: &Candidate) {
        let distance_mm = match self.parameters.direction {
            filter::Direction::TwoSided => candidate.distance.two_sided(),
            filter::Direction::MapToHistory => candidate.distance.map_to_history,
            filter::Direction::HistoryToMap => candidate.distance.history_to_map,
        };
        assert_eq!(f64::from(core.consistency_mm), distance_mm.min(f64::from(u16::MAX)), "Eq. 2");
        let near = |of_core: i32, ln: f64, tolerance: f64, equation: &str| {
            assert!((nats(of_core) - ln).abs() <= tolerance, "{equation}: {} {ln} {:?}", nats(of_core), self.config);
        };
        let gaussian = |ln: f64| LN_TOLERANCE.0 - ln * LN_TOLERANCE.1;
        let ln_observation = candidate.ln_observation.max(-LARGEST_LOSS);
        near(core.factors.ln_label_q16, ln_observation, gaussian(ln_observation), "Eq. 7");
        near(core.factors.ln_consistency_q16, candidate.ln_consistency, gaussian(candidate.ln_consistency), "Eq. 8");
        let factors = candidate.map.graph.vertices().pow(2) as f64;
        near(core.factors.ln_size_q16, candidate.ln_penalty, penalty_tolerance(&self.parameters) * factors, "Eq. 9");
    }
}

fn nats(log_q16: i32) -> f64 {
    f64::from(log_q16) / 65536.0
}

fn unit(draw: u32) -> f64 {
    f64::from(draw) / 2_f64.powi(32)
}

type MapParts = (Vec<f64>, Vec<usize>, Vec<(usize, usize)>);

fn map_of(particle: &CoreParticle<VERTICES>) -> MapParts {
    let map = &particle.map;
    let labels = map.labels().iter().map(|label| f64::from(label.radius_mm())).collect();
    let visits = map.vertices().map(|vertex| map.visits(vertex) as usize).collect();
    let edges = map.edges().map(|(a, b)| (usize::from(a), usize::from(b))).collect();
    (labels, visits, edges)
}

fn map_parts(map: &Map) -> MapParts {
    let visits = (0..map.graph.vertices()).map(|vertex| map.visits(vertex)).collect();
    (map.graph.labels().to_vec(), visits, map.graph.edges())
}
