//! The particles, from one generation to the next (Section III.A).

use super::particle::{Particle, predict};
use super::resample::PROPOSAL_REACH;
use super::selection::{Candidate, Choice, Selection};
use crate::filter::paper::consistency::{Consistency, Direction, Evidence};
use crate::filter::paper::likelihood::Likelihood;
use crate::filter::{NgramLength, PaperConfig};
use crate::map::Map;
use crate::map::PerVertex;
use crate::place::Fingerprint;
use crate::top_k::insertion_sort;

/// The result of a step besides the particles.
pub(super) struct Step {
    pub(super) lead_q16: i32,
    /// The map of a particle had no room for another vertex.
    pub(super) vertices_full: bool,
}

/// The particles of two successive places, used in turn, and the pool they are drawn from.
#[derive(Clone, Debug)]
pub(crate) struct Particles<const N: usize, const V: usize> {
    generations: [[Particle<V>; N]; 2],
    current: bool,
    distinct: u8,
    best: u8,
    wanted: u8,
    /// For every particle, one candidate per vertex, and the new vertex after the last one while there is room.
    pool: [PerVertex<Candidate, V>; N],
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
            pool: [PerVertex::filled(Candidate::UNSET); N],
            predicted: Map::new(),
            likelihood: Likelihood::new(),
        }
    }

    /// One particle with an empty map stands for the state before the first place.
    pub(super) fn start(&mut self, config: &PaperConfig) {
        self.likelihood.configure(config);
        self.wanted = config.particles;
        self.distinct = 0;
        self.best = 0;
    }

    /// The number of the best particle.
    #[cfg(feature = "snapshot")]
    pub(crate) fn best_index(&self) -> u8 {
        self.best
    }

    /// Starts with `distinct` particles, which [`Particles::put`] gives.
    #[cfg(feature = "snapshot")]
    pub(crate) fn resume(&mut self, config: &PaperConfig, distinct: u8, best: u8) {
        self.start(config);
        (self.distinct, self.best) = (distinct, best);
    }

    /// Replaces one particle.
    #[cfg(feature = "snapshot")]
    pub(crate) fn put(&mut self, index: usize, particle: &Particle<V>) {
        if let Some(slot) = self.generations[usize::from(self.current)].get_mut(index) {
            *slot = *particle;
        }
    }

    pub(crate) fn distinct(&self) -> u8 {
        self.distinct
    }

    pub(crate) fn all(&self) -> &[Particle<V>] {
        self.generations[usize::from(self.current)].get(..usize::from(self.distinct)).unwrap_or(&[])
    }

    pub(super) fn best(&self) -> &Particle<V> {
        self.all().get(usize::from(self.best)).unwrap_or(const { &Particle::NONE })
    }

    /// Takes one observation: predicts and draws. `random` gives the random draws.
    pub(super) fn step<const WORDS: usize, const INDICES: usize>(
        &mut self,
        length: NgramLength,
        direction: Direction,
        observation: Fingerprint,
        random: impl FnMut() -> u32,
        (evidence, consistency): (&impl Evidence<WORDS>, &mut Consistency<V, WORDS, INDICES>),
    ) -> Step {
        let [even, odd] = &mut self.generations;
        let (parents, children) = if self.current { (odd, even) } else { (even, odd) };
        if self.distinct == 0 {
            if let Some(first) = parents.first_mut() {
                *first = Particle { multiplicity: self.wanted, ..Particle::NONE };
                first.map.clear();
            }
            self.distinct = 1;
        }
        let parents = parents.get(..usize::from(self.distinct)).unwrap_or(&[]);
        let mut selection = Selection {
            parents,
            pool: &mut self.pool,
            predicted: &mut self.predicted,
            likelihood: &self.likelihood,
            observation,
            length,
            direction,
            evidence,
            consistency,
            weights: [PerVertex::filled(0); N],
            nearest_mm: 0,
        };
        selection.predict();
        selection.find_nearest();
        let mut chosen = [Choice::FIRST; N];
        let chosen = chosen.get_mut(..usize::from(self.wanted)).unwrap_or(&mut []);
        selection.draw(chosen, random);

        let mut children = children.iter_mut();
        let mut heaviest: Option<(i32, Choice)> = None;
        let mut drawn = 0;
        // The children stand in the order of the pool: equal draws follow each other once they are sorted.
        insertion_sort(chosen, |one, other| one <= other);
        let mut rest: &[Choice] = chosen;
        while let Some((&choice, _)) = rest.split_first() {
            let multiplicity = rest.iter().take_while(|&&other| other == choice).count();
            rest = rest.get(multiplicity..).unwrap_or(&[]);
            let (Some(child), Some(parent)) = (children.next(), parents.get(usize::from(choice.parent))) else { break };
            predict(&mut child.map, parent, choice.vertex, observation);
            child.at = choice.vertex;
            child.multiplicity = multiplicity as u8;
            child.parent = choice.parent;
            (child.consistency_mm, child.factors) = selection.judge(parent, choice);
            let ln_weight = child.factors.ln_weight_q16();
            if heaviest.is_none_or(|(ln_heaviest, _)| ln_weight > ln_heaviest) {
                heaviest = Some((ln_weight, choice));
                self.best = drawn;
            }
            drawn += 1;
        }
        let lead_q16 = heaviest.map_or(0, |(ln_weight, choice)| ln_weight.saturating_sub(selection.ln_rival(choice)));
        self.distinct = drawn;
        self.current = !self.current;
        let vertices_full = parents.iter().any(|parent| parent.map.vertices().len() == V);
        Step { lead_q16: lead_q16.min(PROPOSAL_REACH), vertices_full }
    }
}
