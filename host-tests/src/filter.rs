//! The paper's particle filter (Section III), with weights as natural logarithms.
//!
//! One step is [`predict`], which weighs every prediction, then [`resample`]. Where the paper leaves a choice open, it is
//! a field of [`Parameters`] or stated at the function.

use crate::consistency::{Hausdorff, hausdorff};
use crate::graph::Graph;
use crate::ngram::{NgramSet, grams_of_graph, grams_of_history};
use std::collections::{BTreeSet, HashMap};

/// Which half of Eq. 2 the consistency likelihood uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Both, as Eq. 2 is printed.
    TwoSided,
    /// From the n-grams of the map to those of the history.
    MapToHistory,
    /// From the n-grams of the history to those of the map.
    HistoryToMap,
}

/// The parameters of the filter and the choices that the paper leaves open.
#[derive(Clone, Debug)]
pub struct Parameters {
    /// n, the length of the n-grams.
    pub n: usize,
    /// N, the number of particles.
    pub particles: usize,
    /// φ of Eq. 9.
    pub phi: f64,
    /// σ_l of Eq. 7 and 9, in millimetres.
    pub sigma_label_mm: f64,
    /// σ_c of Eq. 8, in millimetres.
    pub sigma_consistency_mm: f64,
    /// Which half of Eq. 2 counts.
    pub direction: Direction,
    /// The label of a vertex is the mean of its observations, rounded to a multiple of this (halves up); `None`: not
    /// rounded. A filter with quantised labels can be compared exactly only when the reference rounds as it does.
    pub label_grid_mm: Option<f64>,
    /// n-grams are taken from labels rounded *down* to a multiple of this; `None`: not rounded. Long n-grams are packed
    /// with fewer bits for each label.
    pub ngram_grid_mm: Option<f64>,
    /// Distances of Eq. 2 are cut off here, so that an empty set of n-grams is very far away and not infinitely far.
    pub farthest_mm: f64,
    /// The largest number of vertices of a map; at this number no new vertex is predicted.
    pub most_vertices: usize,
}

impl Parameters {
    /// `Grams_H` of a history as the filter sees it.
    pub fn grams_of_history(&self, history_mm: &[f64]) -> NgramSet {
        let coarse: Vec<f64> = history_mm.iter().map(|&label| self.label_in_ngram(label)).collect();
        grams_of_history(&coarse, self.n)
    }

    /// `Grams_G` of a map as the filter sees it.
    pub fn grams_of_graph(&self, graph: &Graph) -> NgramSet {
        grams_of_graph(&graph.map_labels(|label| self.label_in_ngram(label)), self.n)
    }

    fn label_in_ngram(&self, label_mm: f64) -> f64 {
        self.ngram_grid_mm.map_or(label_mm, |grid| (label_mm / grid).floor() * grid)
    }

    fn mean_label(&self, sum_mm: f64, visits: usize) -> f64 {
        match self.label_grid_mm {
            None => sum_mm / visits as f64,
            Some(grid) => (sum_mm / (visits as f64 * grid) + 0.5).floor() * grid,
        }
    }
}

/// A map: the labelled graph, and what its labels are the means of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// The labelled graph `G_map`.
    pub graph: Graph,
    sums_mm: Vec<f64>,
    visits: Vec<usize>,
}

impl Map {
    /// How many observations the label of a vertex is the mean of.
    pub fn visits(&self, vertex: usize) -> usize {
        self.visits[vertex]
    }

    fn add_vertex(&mut self, observation_mm: f64) -> usize {
        self.sums_mm.push(observation_mm);
        self.visits.push(1);
        self.graph.add_vertex(observation_mm)
    }

    fn observe(&mut self, vertex: usize, observation_mm: f64, parameters: &Parameters) {
        self.sums_mm[vertex] += observation_mm;
        self.visits[vertex] += 1;
        self.graph.set_label(vertex, parameters.mean_label(self.sums_mm[vertex], self.visits[vertex]));
    }
}

/// A particle `s = {G_map, p}`. Equal draws of the same prediction are one particle with a multiplicity.
#[derive(Clone, Debug, PartialEq)]
pub struct Particle {
    /// The map.
    pub map: Map,
    /// **III.B**: the robot is at the vertex that the last observation updated or introduced. `None` before the first.
    pub place: Option<usize>,
    /// How many of the N samples are this particle.
    pub multiplicity: usize,
    /// Which particle of the previous step this one was predicted from.
    pub parent: usize,
}

/// The N particles before the first observation: empty maps.
pub fn first_particles(parameters: &Parameters) -> Vec<Particle> {
    vec![Particle { map: Map::default(), place: None, multiplicity: parameters.particles, parent: 0 }]
}

/// A predicted state `s̃` with the three factors of its weight.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The predicted map.
    pub map: Map,
    /// The vertex the observation is predicted to belong to.
    pub vertex: usize,
    /// Whether the observation introduced that vertex.
    pub is_new: bool,
    /// The particle it was predicted from.
    pub parent: usize,
    /// The multiplicity of that particle: as many of the predictions of all N particles are this one.
    pub multiplicity: usize,
    /// Eq. 2 of the predicted map and the history, in millimetres, not cut off.
    pub distance: Hausdorff,
    /// ln of Eq. 7.
    pub ln_observation: f64,
    /// ln of Eq. 8.
    pub ln_consistency: f64,
    /// ln of Eq. 9.
    pub ln_penalty: f64,
}

impl Candidate {
    /// **Eq. 6**: the logarithm of the weight, the sum of those of its three factors.
    pub fn ln_weight(&self) -> f64 {
        self.ln_observation + self.ln_consistency + self.ln_penalty
    }
}

/// **III.A, prediction phase**: for each particle K+1 predictions, one for each vertex of its map (the one the robot is at
/// too: a corridor may lead back to it) and one for a new vertex.
///
/// An edge from the vertex the robot is at is added when missing, and the observation is taken into the label. Eq. 7 sees
/// the label without the observation, Eq. 8 and 9 the predicted map. The order is that of the particles and, in each,
/// of the vertices, the new one last.
pub fn predict(
    particles: &[Particle],
    observation_mm: f64,
    history: &NgramSet,
    parameters: &Parameters,
) -> Vec<Candidate> {
    let mut pool = Vec::new();
    for (parent, particle) in particles.iter().enumerate() {
        let vertices = particle.map.graph.vertices();
        for vertex in 0..=vertices {
            let is_new = vertex == vertices;
            if is_new && vertices >= parameters.most_vertices {
                continue;
            }
            let mut map = particle.map.clone();
            let ln_observation = if is_new {
                map.add_vertex(observation_mm);
                0.0
            } else {
                let label_mm = map.graph.label(vertex);
                map.observe(vertex, observation_mm, parameters);
                ln_observation_likelihood(observation_mm, label_mm, parameters)
            };
            if let Some(place) = particle.place {
                map.graph.add_edge(place, vertex);
            }
            let distance = hausdorff(&parameters.grams_of_graph(&map.graph), history);
            pool.push(Candidate {
                vertex,
                is_new,
                parent,
                multiplicity: particle.multiplicity,
                distance,
                ln_observation,
                ln_consistency: ln_consistency_likelihood(distance, parameters),
                ln_penalty: ln_penalty(map.graph.labels(), parameters),
                map,
            });
        }
    }
    pool
}

/// ln of **Eq. 7**: how well an observation fits the label of a vertex. For a new vertex, which has no label yet, the
/// factor is 1.
pub fn ln_observation_likelihood(observation_mm: f64, label_mm: f64, parameters: &Parameters) -> f64 {
    -((observation_mm - label_mm) / parameters.sigma_label_mm).powi(2)
}

/// ln of **Eq. 8**: how consistent a map is with the history.
pub fn ln_consistency_likelihood(distance: Hausdorff, parameters: &Parameters) -> f64 {
    let distance_mm = match parameters.direction {
        Direction::TwoSided => distance.two_sided(),
        Direction::MapToHistory => distance.map_to_history,
        Direction::HistoryToMap => distance.history_to_map,
    };
    -(distance_mm.min(parameters.farthest_mm) / parameters.sigma_consistency_mm).powi(2)
}

/// ln of **Eq. 9**: the penalty for vertices with similar labels.
///
/// The product is taken as printed, over all ordered pairs with a = b among them: each vertex pays (1 - φ), and two
/// vertices pay for their likeness twice.
pub fn ln_penalty(labels_mm: &[f64], parameters: &Parameters) -> f64 {
    let mut sum = 0.0;
    for l_a in labels_mm {
        for l_b in labels_mm {
            sum += (1.0 - parameters.phi * (-((l_a - l_b) / parameters.sigma_label_mm).powi(2)).exp()).ln();
        }
    }
    sum
}

/// **Eq. 4**: the weights of the pool, multiplicities included, normalised to a sum of 1.
pub fn normalised_weights(pool: &[Candidate]) -> Vec<f64> {
    let best = pool.iter().map(Candidate::ln_weight).fold(f64::NEG_INFINITY, f64::max);
    let weight = |candidate: &Candidate| candidate.multiplicity as f64 * (candidate.ln_weight() - best).exp();
    let total: f64 = pool.iter().map(weight).sum();
    pool.iter().map(|candidate| weight(candidate) / total).collect()
}

/// How often each candidate is proposed, relative to the one that is proposed most: Eq. 7 · Eq. 9, multiplicities included.
/// Less than `least` is never proposed.
pub fn proposals(pool: &[Candidate], least: f64) -> Vec<f64> {
    let ln = |candidate: &Candidate| candidate.ln_observation + candidate.ln_penalty;
    let best = pool.iter().map(ln).fold(f64::NEG_INFINITY, f64::max);
    let relative = |candidate: &Candidate| (ln(candidate) - best).exp();
    let weight = |candidate: &Candidate| candidate.multiplicity as f64 * relative(candidate);
    pool.iter().map(|candidate| if relative(candidate) < least { 0.0 } else { weight(candidate) }).collect()
}

/// How often a proposed candidate is accepted: Eq. 8, relative to the best one that is proposed at all.
pub fn acceptances(pool: &[Candidate], proposals: &[f64]) -> Vec<f64> {
    let proposed = pool.iter().zip(proposals).filter(|&(_, &weight)| weight > 0.0);
    let best = proposed.map(|(candidate, _)| candidate.ln_consistency).fold(f64::NEG_INFINITY, f64::max);
    pool.iter().map(|candidate| (candidate.ln_consistency - best).min(0.0).exp()).collect()
}

/// One proposal: the two random numbers in [0, 1) and what came of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposal {
    /// The number that chose a candidate: the first whose share of the proposals, summed up in order, exceeds it.
    pub proposing: f64,
    /// The candidate.
    pub candidate: usize,
    /// The number that accepted the candidate, or did not.
    pub accepting: f64,
    /// Whether it was accepted: the number is below its acceptance.
    pub accepted: bool,
}

/// **III.A, end**: N draws in proportion to the weights of Eq. 6, by rejection: a candidate is proposed in proportion to
/// Eq. 7 · Eq. 9 and accepted in proportion to Eq. 8, until N are accepted. After `most` proposals the rest is drawn from
/// the weights themselves, with one number each and nothing to accept.
pub fn draw(
    proposals: &[f64],
    acceptances: &[f64],
    particles: usize,
    most: usize,
    mut random: impl FnMut() -> f64,
) -> Vec<Proposal> {
    let share = |(proposal, acceptance): (&f64, &f64)| proposal * acceptance;
    let weights: Vec<f64> = proposals.iter().zip(acceptances).map(share).collect();
    let mut made: Vec<Proposal> = Vec::new();
    while made.iter().filter(|proposal| proposal.accepted).count() < particles {
        let is_sure = made.len() >= most;
        let proposing = random();
        let candidate = chosen_by(proposing, if is_sure { &weights } else { proposals });
        let accepting = if is_sure { 0.0 } else { random() };
        let accepted = is_sure || accepting < acceptances[candidate];
        made.push(Proposal { proposing, candidate, accepting, accepted });
    }
    made
}

/// The first candidate whose share of the weights, summed up in order, exceeds a number in [0, 1).
fn chosen_by(number: f64, weights: &[f64]) -> usize {
    let total: f64 = weights.iter().sum();
    let mut share = 0.0;
    let exceeding = weights.iter().position(|weight| {
        share += weight / total;
        share > number
    });
    exceeding.unwrap_or(weights.len() - 1)
}

/// The posterior: N samples of the pool as particles, in the order of the pool.
pub fn resample(pool: &[Candidate], drawn: &[usize]) -> Vec<Particle> {
    let mut counts = HashMap::new();
    for &chosen in drawn {
        *counts.entry(chosen).or_insert(0) += 1;
    }
    let in_order: BTreeSet<usize> = drawn.iter().copied().collect();
    let particle = |chosen: usize| Particle {
        map: pool[chosen].map.clone(),
        place: Some(pool[chosen].vertex),
        multiplicity: counts[&chosen],
        parent: pool[chosen].parent,
    };
    in_order.into_iter().map(particle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMETERS: Parameters = Parameters {
        n: 3,
        particles: 4,
        phi: 0.5,
        sigma_label_mm: 100.0,
        sigma_consistency_mm: 50.0,
        direction: Direction::TwoSided,
        label_grid_mm: None,
        ngram_grid_mm: None,
        farthest_mm: f64::INFINITY,
        most_vertices: usize::MAX,
    };

    #[test]
    fn likelihoods_fall_to_one_over_e_at_one_sigma() {
        assert_eq!(ln_observation_likelihood(1100.0, 1000.0, &PARAMETERS), -1.0);
        let distance = Hausdorff { map_to_history: 50.0, history_to_map: 100.0, comparisons: 0 };
        assert_eq!(ln_consistency_likelihood(distance, &PARAMETERS), -4.0);
        let directed = Parameters { direction: Direction::MapToHistory, ..PARAMETERS };
        assert_eq!(ln_consistency_likelihood(distance, &directed), -1.0);
    }

    #[test]
    fn the_penalty_counts_every_vertex_once_and_every_pair_twice() {
        let expected = 2.0 * 0.5_f64.ln() + 2.0 * (1.0 - 0.5 * (-1_f64).exp()).ln();
        assert!((ln_penalty(&[1000.0, 1100.0], &PARAMETERS) - expected).abs() < 1e-12);
    }

    #[test]
    fn two_places_in_turn_become_two_vertices_joined_by_an_edge() {
        let mut particles = first_particles(&PARAMETERS);
        let history_mm = [1000.0, 2000.0, 1010.0];
        for (newest, observation_mm) in history_mm.into_iter().enumerate() {
            let evidence = PARAMETERS.grams_of_history(&history_mm[..=newest]);
            let pool = predict(&particles, observation_mm, &evidence, &PARAMETERS);
            let weights = normalised_weights(&pool);
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let proposals = proposals(&pool, 0.0);
            let acceptances = acceptances(&pool, &proposals);
            let made = draw(&proposals, &acceptances, 4, usize::MAX, || 0.5);
            let chosen = made.iter().filter(|proposal| proposal.accepted).map(|proposal| proposal.candidate);
            particles = resample(&pool, &chosen.collect::<Vec<_>>());
        }
        let [particle] = &particles[..] else { panic!("all draws are the same") };
        assert_eq!((particle.place, particle.multiplicity), (Some(0), 4));
        assert_eq!(particle.map.graph, Graph::with(&[1005.0, 2000.0], &[(0, 1)]));
    }

    #[test]
    fn drawing_by_rejection_follows_the_weights() {
        let (proposals, acceptances) = ([4.0, 1.0, 0.0, 3.0], [0.25, 1.0, 1.0, 0.5]);
        let mut state = 1_u64;
        let random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / 2_f64.powi(53)
        };
        let made = draw(&proposals, &acceptances, 70_000, usize::MAX, random);
        for (candidate, weight) in [1.0 / 3.5, 1.0 / 3.5, 0.0, 1.5 / 3.5].into_iter().enumerate() {
            let drawn = made.iter().filter(|proposal| proposal.accepted && proposal.candidate == candidate).count();
            assert!((drawn as f64 / 70_000.0 - weight).abs() < 0.01, "{candidate}: {drawn}");
        }
    }

    #[test]
    fn a_label_on_a_grid_is_rounded_half_up() {
        let on_grid = Parameters { label_grid_mm: Some(2.0), ..PARAMETERS };
        assert_eq!(on_grid.mean_label(1000.0 + 1002.0, 2), 1002.0);
        assert_eq!(on_grid.mean_label(1000.0 + 1000.0 + 1002.0, 3), 1000.0);
    }
}
