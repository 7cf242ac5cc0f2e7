//! The particles: predict every vertex the robot may be at, weigh the predictions, draw the next particles (Section III.A).

use super::Config;
use super::resample::{REACH, relative_weight, target};
use crate::consistency::{Consistency, Direction, Evidence};
use crate::likelihood::Likelihood;
use crate::{Fingerprint, Map, NgramLength};

/// The three factors of a weight (Eq. 6), as logarithms in units of 2⁻¹⁶ nats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WeightFactors {
    /// ln of Eq. 7: how well the observation fits the label its vertex had before.
    pub ln_label_q16: i32,
    /// ln of Eq. 8: how consistent the map is with the evidence.
    pub ln_consistency_q16: i32,
    /// ln of Eq. 9: what the size of the map costs.
    pub ln_size_q16: i32,
}

impl WeightFactors {
    const ONE: Self = Self { ln_label_q16: 0, ln_consistency_q16: 0, ln_size_q16: 0 };

    /// ln of the weight (Eq. 6), in units of 2⁻¹⁶ nats; saturates.
    pub const fn ln_weight_q16(&self) -> i32 {
        self.ln_size_q16.saturating_add(self.ln_label_q16).saturating_add(self.ln_consistency_q16)
    }
}

/// One hypothesis: a map and the place the robot is at.
#[derive(Clone, Copy, Debug)]
pub struct Particle<const V: usize> {
    /// The map.
    pub map: Map<V>,
    /// The vertex the robot is at.
    pub place: u8,
    /// How many of the N draws chose this particle.
    pub multiplicity: u8,
    /// The index, among the particles before the last observation, of the one this particle came from.
    pub parent: u8,
    /// The distance of Eq. 2 in millimetres; `u16::MAX` when it is infinite.
    pub consistency_mm: u16,
    /// The factors of its weight.
    pub factors: WeightFactors,
}

impl<const V: usize> Particle<V> {
    const NONE: Self =
        Self { map: Map::new(), place: 0, multiplicity: 0, parent: 0, consistency_mm: 0, factors: WeightFactors::ONE };
}

/// A prediction in the pool: its weight, and the distance of Eq. 2 in millimetres.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    ln_weight: i32,
    consistency_mm: u16,
}

impl Candidate {
    const NONE: Self = Self { ln_weight: 0, consistency_mm: 0 };
    const IMPOSSIBLE: Self = Self { ln_weight: i32::MIN, consistency_mm: u16::MAX };
}

/// What a step tells besides the particles.
pub(super) struct Step {
    pub(super) lead_q16: i32,
    /// A particle wanted one more vertex than a map can hold.
    pub(super) vertices_full: bool,
}

/// The particles of two successive places, used in turn, and the pool they are drawn from.
#[derive(Clone, Debug)]
pub(super) struct Particles<const N: usize, const V: usize> {
    generations: [[Particle<V>; N]; 2],
    current: bool,
    distinct: u8,
    best: u8,
    wanted: u8,
    /// For every particle, one candidate a vertex, and the new vertex behind the last one while there is room.
    pool: [[Candidate; V]; N],
    predicted: Map<V>,
    likelihood: Likelihood,
}

impl<const N: usize, const V: usize> Particles<N, V> {
    pub(super) const fn new() -> Self {
        Self {
            generations: [[Particle::NONE; N]; 2],
            current: false,
            distinct: 0,
            best: 0,
            wanted: 0,
            pool: [[Candidate::NONE; V]; N],
            predicted: Map::new(),
            likelihood: Likelihood::new(),
        }
    }

    /// One particle with an empty map stands for the state before the first place.
    pub(super) fn start(&mut self, config: &Config) {
        self.likelihood.configure(config);
        self.wanted = config.particles;
        self.distinct = 0;
        self.best = 0;
    }

    pub(super) fn distinct(&self) -> u8 {
        self.distinct
    }

    pub(super) fn all(&self) -> &[Particle<V>] {
        self.generations[usize::from(self.current)].get(..usize::from(self.distinct)).unwrap_or(&[])
    }

    pub(super) fn best(&self) -> &Particle<V> {
        self.all().get(usize::from(self.best)).unwrap_or(const { &Particle::NONE })
    }

    /// Takes one observation: predicts, weighs and draws.
    pub(super) fn step<const WORDS: usize, const INDICES: usize>(
        &mut self,
        length: NgramLength,
        direction: Direction,
        observation: Fingerprint,
        draws: &[u32; N],
        (evidence, consistency): (&impl Evidence<WORDS>, &mut Consistency<V, WORDS, INDICES>),
    ) -> Step {
        if self.distinct == 0 {
            let generation = &mut self.generations[usize::from(self.current)];
            if let Some(first) = generation.first_mut() {
                *first = Particle { multiplicity: self.wanted, ..Particle::NONE };
                first.map.clear();
            }
            self.distinct = 1;
        }
        let mut weigher = Weigher {
            length,
            direction,
            observation,
            evidence,
            consistency,
            likelihood: &self.likelihood,
            predicted: &mut self.predicted,
            ln_best: i32::MIN,
            ln_second: i32::MIN,
        };
        let generation = &self.generations[usize::from(self.current)];
        let particles = generation.get(..usize::from(self.distinct)).unwrap_or(&[]);
        // A good weight first spares most of the others their distance.
        let favourite = favourite(particles, &self.likelihood, observation);
        let mut first = Candidate::IMPOSSIBLE;
        if let Some((particle, vertex)) = favourite.and_then(|(index, vertex)| Some((particles.get(index)?, vertex))) {
            first = weigher.weigh(particle, vertex);
        }
        for (index, (particle, pool)) in particles.iter().zip(&mut self.pool).enumerate() {
            for (vertex, candidate) in (0..=particle.map.vertices()).zip(pool) {
                *candidate = if favourite == Some((index, vertex)) { first } else { weigher.weigh(particle, vertex) };
            }
        }
        let vertices_full = particles.iter().any(|particle| usize::from(particle.map.vertices()) == V);
        let (ln_best, ln_second) = (weigher.ln_best, weigher.ln_second);
        self.draw(observation, draws, ln_best);
        Step { lead_q16: ln_best.saturating_sub(ln_second).min(REACH), vertices_full }
    }

    /// Draws the next generation from the pool: N independent draws, each candidate as often as its weight says.
    fn draw(&mut self, observation: Fingerprint, draws: &[u32; N], ln_best: i32) {
        let Self { generations: [even, odd], current, distinct, best, wanted, pool, likelihood, .. } = self;
        let (parents, children) = if *current { (odd, even) } else { (even, odd) };
        let parents = parents.get(..usize::from(*distinct)).unwrap_or(&[]);
        let weighted = || {
            parents.iter().zip(pool.iter()).zip(0_u8..).flat_map(|((parent, pool), index)| {
                let candidates = (0..=parent.map.vertices()).zip(pool);
                candidates.filter_map(move |(vertex, candidate)| {
                    let weight = relative_weight(candidate.ln_weight, ln_best) * u32::from(parent.multiplicity);
                    (weight > 0).then_some((index, parent, vertex, candidate, u64::from(weight)))
                })
            })
        };
        let total: u64 = weighted().map(|(.., weight)| weight).sum();
        let mut children = children.iter_mut();
        let mut drawn = 0;
        let mut ln_largest = i32::MIN;
        let mut sum = 0;
        for (index, parent, vertex, candidate, weight) in weighted() {
            let interval = sum..sum + weight;
            sum += weight;
            let chosen =
                draws.iter().take(usize::from(*wanted)).filter(|&&draw| interval.contains(&target(draw, total)));
            let multiplicity = chosen.count() as u8;
            if multiplicity == 0 {
                continue;
            }
            let Some(child) = children.next() else { break };
            predict(&mut child.map, parent, vertex, observation);
            child.place = vertex;
            child.multiplicity = multiplicity;
            child.parent = index;
            child.consistency_mm = candidate.consistency_mm;
            child.factors = WeightFactors {
                ln_label_q16: ln_label(likelihood, parent, vertex, observation),
                ln_consistency_q16: likelihood.ln_consistency(candidate.consistency_mm),
                ln_size_q16: ln_size(likelihood, parent, &child.map, vertex),
            };
            if candidate.ln_weight > ln_largest {
                ln_largest = candidate.ln_weight;
                *best = drawn;
            }
            drawn += 1;
        }
        *distinct = drawn;
        *current = !*current;
    }
}

/// Weighs predictions, and spares those that cannot be drawn.
struct Weigher<'a, E, const V: usize, const WORDS: usize, const INDICES: usize> {
    length: NgramLength,
    direction: Direction,
    observation: Fingerprint,
    evidence: &'a E,
    consistency: &'a mut Consistency<V, WORDS, INDICES>,
    likelihood: &'a Likelihood,
    predicted: &'a mut Map<V>,
    ln_best: i32,
    ln_second: i32,
}

impl<E: Evidence<WORDS>, const V: usize, const WORDS: usize, const INDICES: usize> Weigher<'_, E, V, WORDS, INDICES> {
    /// The weight of a prediction (Eq. 6), exactly, unless it is so far behind the best one that it cannot be drawn.
    ///
    /// Eq. 8 is the dear factor and never above 1, so the other two bound the weight; and as the weight must reach the
    /// best one's less [`REACH`], only distances up to a limit need to be told apart.
    fn weigh(&mut self, parent: &Particle<V>, vertex: u8) -> Candidate {
        let ln_label = ln_label(self.likelihood, parent, vertex, self.observation);
        if ln_label < self.ln_best.saturating_sub(REACH) {
            return Candidate::IMPOSSIBLE;
        }
        predict(self.predicted, parent, vertex, self.observation);
        let bound = ln_size(self.likelihood, parent, self.predicted, vertex).saturating_add(ln_label);
        let loss = bound.saturating_sub(self.ln_best).saturating_add(REACH);
        if loss < 0 {
            return Candidate::IMPOSSIBLE;
        }
        let step_mm = self.length.label_step_mm();
        let largest = Fingerprint::MAX.steps() >> self.length.coarsening();
        let limit = (self.likelihood.consistency_reach_mm(loss) / step_mm).min(largest);
        let hint = parent.consistency_mm / step_mm;
        let distance = self.consistency.search(self.predicted, self.evidence, self.length, self.direction, hint, limit);
        let consistency_mm = match distance {
            Some(steps) => steps * step_mm,
            // No finite distance is larger.
            None if limit == largest => u16::MAX,
            None => return Candidate::IMPOSSIBLE,
        };
        let ln_weight = bound.saturating_add(self.likelihood.ln_consistency(consistency_mm));
        if ln_weight > self.ln_best {
            self.ln_second = self.ln_best;
            self.ln_best = ln_weight;
        } else {
            self.ln_second = self.ln_second.max(ln_weight);
        }
        Candidate { ln_weight, consistency_mm }
    }
}

/// Predicts that the robot went from the place of a particle to a vertex, a new one behind the last: the edge is added
/// when it is missing, and the observation goes into the label of the vertex.
fn predict<const V: usize>(predicted: &mut Map<V>, parent: &Particle<V>, vertex: u8, observation: Fingerprint) {
    *predicted = parent.map;
    if vertex == parent.map.vertices() {
        // The pool has no candidate for a vertex that a full map has no room for.
        let _ = predicted.add_vertex(observation);
    } else {
        predicted.observe(vertex, observation);
    }
    if parent.map.vertices() > 0 {
        predicted.add_edge(parent.place, vertex);
    }
}

/// ln of Eq. 7 for a prediction. The observation is compared with what the label was before; a new vertex fits.
fn ln_label<const V: usize>(
    likelihood: &Likelihood,
    parent: &Particle<V>,
    vertex: u8,
    observation: Fingerprint,
) -> i32 {
    parent.map.label(vertex).map_or(0, |label| likelihood.ln_label(observation, label))
}

/// ln of Eq. 9 for a prediction, from that of its parent.
fn ln_size<const V: usize>(likelihood: &Likelihood, parent: &Particle<V>, predicted: &Map<V>, vertex: u8) -> i32 {
    let (before, after) = (parent.map.label(vertex), predicted.label_of(vertex));
    if before == Some(after) {
        return parent.factors.ln_size_q16;
    }
    let others = parent.map.labels().iter().enumerate().filter(|&(other, _)| other != usize::from(vertex));
    let change = likelihood.ln_size_change(others.map(|(_, &label)| label), before, after);
    parent.factors.ln_size_q16.saturating_add(change)
}

/// The prediction that fits its label best, as the index of the particle and the vertex.
fn favourite<const V: usize>(
    particles: &[Particle<V>],
    likelihood: &Likelihood,
    observation: Fingerprint,
) -> Option<(usize, u8)> {
    let predictions = particles.iter().enumerate().flat_map(|(index, particle)| {
        (0_u8..).zip(particle.map.labels()).map(move |(vertex, &label)| {
            let ln = likelihood.ln_label(observation, label).saturating_add(particle.factors.ln_size_q16);
            (ln, index, vertex)
        })
    });
    predictions.max_by_key(|&(ln, ..)| ln).map(|(_, index, vertex)| (index, vertex))
}
