//! Choosing among all predictions of all particles (Section III.A): prediction phase, weights, and the draw.

use super::particle::{Particle, predict};
use super::resample::{DISTANCE_REACH, PROPOSAL_REACH, PROPOSALS, accepts, draw_weight, target};
use crate::filter::NgramLength;
use crate::filter::PaperFactors;
use crate::filter::paper::consistency::{Consistency, Direction, Evidence};
use crate::filter::paper::likelihood::Likelihood;
use crate::map::PerVertex;
use crate::map::{Map, VertexId};
use crate::place::Fingerprint;

/// A prediction: the robot of a particle goes to a vertex, which may be a new one after the last. Ordered like the pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Choice {
    pub(super) parent: u8,
    pub(super) vertex: VertexId,
}

impl Choice {
    pub(super) const FIRST: Self = Self { parent: 0, vertex: VertexId::FIRST };
}

/// A prediction in the pool.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// ln of Eq. 7 · Eq. 9, how often it is proposed.
    ln_proposal: i32,
    distance: Distance,
}

/// The distance of Eq. 2 of a prediction, as far as it was computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Distance {
    /// Not computed: at least that of the nearest prediction.
    Unknown,
    /// The distance in millimetres; `u16::MAX` when it is infinite.
    Known(u16),
    /// So large that the prediction is not accepted.
    TooLarge,
}

impl Candidate {
    pub(super) const UNSET: Self = Self { ln_proposal: 0, distance: Distance::Unknown };
}

/// The particles of one place, the pool of their predictions, and the evidence.
pub(super) struct Selection<'a, E, const N: usize, const V: usize, const WORDS: usize, const INDICES: usize> {
    pub(super) parents: &'a [Particle<V>],
    pub(super) pool: &'a mut [PerVertex<Candidate, V>; N],
    pub(super) predicted: &'a mut Map<V>,
    pub(super) likelihood: &'a Likelihood,
    pub(super) observation: Fingerprint,
    pub(super) length: NgramLength,
    pub(super) direction: Direction,
    pub(super) evidence: &'a E,
    pub(super) consistency: &'a mut Consistency<V, WORDS, INDICES>,
    /// How often each prediction is proposed.
    pub(super) weights: [PerVertex<u32, V>; N],
    /// The smallest distance of Eq. 2 in the pool, in millimetres.
    pub(super) nearest_mm: u16,
}

impl<E: Evidence<WORDS>, const N: usize, const V: usize, const WORDS: usize, const INDICES: usize>
    Selection<'_, E, N, V, WORDS, INDICES>
{
    /// The prediction phase: K + 1 candidates for each particle, with Eq. 7 and 9.
    pub(super) fn predict(&mut self) {
        let mut ln_best = i32::MIN;
        for (parent, candidates) in self.parents.iter().zip(self.pool.iter_mut()) {
            for vertex in successors(&parent.map) {
                let ln_label = ln_label(self.likelihood, parent, vertex, self.observation);
                let ln_proposal = ln_size(self.likelihood, parent, vertex, self.observation).saturating_add(ln_label);
                candidates[vertex] = Candidate { ln_proposal, distance: Distance::Unknown };
                ln_best = ln_best.max(ln_proposal);
            }
        }
        for ((parent, candidates), weights) in self.parents.iter().zip(self.pool.iter()).zip(&mut self.weights) {
            for vertex in successors(&parent.map) {
                weights[vertex] = draw_weight(candidates[vertex].ln_proposal, ln_best) * u32::from(parent.multiplicity);
            }
        }
    }

    /// Finds the distance of the prediction that is nearest to the evidence, among those that can be proposed. For most of the
    /// others it only shows that they are not nearer, which costs much less than their distance.
    pub(super) fn find_nearest(&mut self) {
        let weights = self.weights().map(|(choice, weight)| (weight, choice));
        let Some((_, first)) = weights.max_by_key(|&(weight, choice)| (weight, core::cmp::Reverse(choice))) else {
            return;
        };
        // One place changes a map little, so the distance is mostly near that of the parent.
        let parent = self.parents.get(usize::from(first.parent));
        let guess = parent.map_or(0, |parent| parent.consistency_mm) / self.length.label_step_mm();
        let guess = guess.min(self.farthest_steps());
        let nearest = self.nearest_of(first, guess).or_else(|| self.search(first, (guess + 1, self.farthest_steps())));
        self.know(first, self.distance_of(nearest));
        let mut nearest_steps = nearest.unwrap_or(self.farthest_steps() + 1);
        for choice in choices(self.parents) {
            if choice == first || self.weight(choice) == 0 {
                continue;
            }
            let Some(nearer) = nearest_steps.checked_sub(1) else { break };
            if let Some(steps) = self.nearest_of(choice, nearer) {
                nearest_steps = steps;
                self.know(choice, self.distance_of(Some(steps)));
            }
        }
        let found = (nearest_steps <= self.farthest_steps()).then_some(nearest_steps);
        self.nearest_mm = match self.distance_of(found) {
            Distance::Known(distance_mm) => distance_mm,
            Distance::Unknown | Distance::TooLarge => u16::MAX,
        };
    }

    /// The distance of a prediction if it is not above a limit. For most predictions it is.
    fn nearest_of(&mut self, choice: Choice, limit: u16) -> Option<u16> {
        let mut nearest = self.search(choice, (limit, limit))?;
        let mut stride = 1;
        while let Some(nearer) = nearest.checked_sub(1) {
            let from = nearest.saturating_sub(stride);
            let steps = self.search(choice, (from, nearer));
            match steps {
                None => break,
                Some(steps) if steps > from => return Some(steps),
                Some(steps) => nearest = steps,
            }
            stride *= 2;
        }
        Some(nearest)
    }

    /// N independent draws, each prediction in proportion to its weight (Eq. 6, normalised by Eq. 4).
    pub(super) fn draw(&mut self, chosen: &mut [Choice], mut random: impl FnMut() -> u32) {
        let mut total = self.total();
        let mut proposals = 0;
        for slot in chosen {
            loop {
                if proposals == PROPOSALS {
                    self.weigh_all();
                    total = self.total();
                }
                proposals = proposals.saturating_add(1);
                let Some(choice) = self.propose(target(random(), total)) else { break };
                if proposals > PROPOSALS || accepts(random(), self.ln_behind(choice)) {
                    *slot = choice;
                    break;
                }
            }
        }
    }

    /// Weighs every prediction by Eq. 6 as a whole: the following proposals are draws without rejection.
    fn weigh_all(&mut self) {
        let mut ln_best = i32::MIN;
        for choice in choices(self.parents) {
            if self.candidate(choice).is_some_and(|candidate| matches!(candidate.distance, Distance::Known(_))) {
                ln_best = ln_best.max(self.ln_weight(choice));
            }
        }
        for choice in choices(self.parents) {
            if self.weight(choice) > 0 {
                // Farther away than this, its weight rounds to 0.
                let reach = self.ln_proposal(choice).saturating_sub(ln_best).saturating_add(PROPOSAL_REACH);
                self.distance(choice, reach.min(DISTANCE_REACH));
                ln_best = ln_best.max(self.ln_weight(choice));
            }
        }
        for choice in choices(self.parents) {
            if self.weight(choice) > 0 {
                let multiplicity = self.parents.get(usize::from(choice.parent)).map_or(0, |parent| parent.multiplicity);
                let weight = draw_weight(self.ln_weight(choice), ln_best) * u32::from(multiplicity);
                if let Some(weights) = self.weights.get_mut(usize::from(choice.parent)) {
                    weights[choice.vertex] = weight;
                }
            }
        }
    }

    fn total(&self) -> u64 {
        self.weights().map(|(_, weight)| weight).sum()
    }

    /// The consistency of a prediction that was chosen, in millimetres, and the factors of its weight.
    pub(super) fn judge(&mut self, parent: &Particle<V>, choice: Choice) -> (u16, PaperFactors) {
        let consistency_mm = match self.distance(choice, DISTANCE_REACH) {
            Distance::Known(distance_mm) => distance_mm,
            Distance::Unknown | Distance::TooLarge => u16::MAX,
        };
        let factors = PaperFactors {
            ln_label_q16: ln_label(self.likelihood, parent, choice.vertex, self.observation),
            ln_consistency_q16: self.likelihood.ln_consistency(consistency_mm),
            ln_size_q16: ln_size(self.likelihood, parent, choice.vertex, self.observation),
        };
        (consistency_mm, factors)
    }

    /// ln of a bound on the weight of every prediction but one.
    pub(super) fn ln_rival(&self, winner: Choice) -> i32 {
        let mut ln_rival = i32::MIN;
        for (choice, _) in self.weights().filter(|&(choice, _)| choice != winner) {
            let distance_mm = match self.candidate(choice).map(|candidate| candidate.distance) {
                Some(Distance::Unknown) => self.nearest_mm,
                Some(Distance::Known(distance_mm)) => distance_mm,
                Some(Distance::TooLarge) | None => continue,
            };
            let ln_weight = self.ln_proposal(choice).saturating_add(self.likelihood.ln_consistency(distance_mm));
            ln_rival = ln_rival.max(ln_weight);
        }
        ln_rival
    }

    /// The prediction at a position in the sum of all weights.
    fn propose(&self, target: u64) -> Option<Choice> {
        let mut sum = 0;
        let mut weights = self.weights();
        weights
            .find(|&(_, weight)| {
                sum += weight;
                target < sum
            })
            .map(|(choice, _)| choice)
    }

    /// Every prediction and how often it is proposed, in the order of the pool.
    fn weights(&self) -> impl Iterator<Item = (Choice, u64)> + '_ {
        choices(self.parents).map(|choice| (choice, u64::from(self.weight(choice))))
    }

    fn weight(&self, choice: Choice) -> u32 {
        self.weights.get(usize::from(choice.parent)).map_or(0, |weights| weights[choice.vertex])
    }

    fn candidate(&self, choice: Choice) -> Option<&Candidate> {
        self.pool.get(usize::from(choice.parent)).map(|candidates| &candidates[choice.vertex])
    }

    /// ln of Eq. 6, relative to the largest Eq. 8.
    fn ln_weight(&mut self, choice: Choice) -> i32 {
        self.ln_proposal(choice).saturating_sub(self.ln_behind(choice))
    }

    fn ln_proposal(&self, choice: Choice) -> i32 {
        self.candidate(choice).map_or(i32::MIN, |candidate| candidate.ln_proposal)
    }

    /// The difference between ln of Eq. 8 of the nearest prediction and of this one.
    fn ln_behind(&mut self, choice: Choice) -> i32 {
        let ln_nearest = self.likelihood.ln_consistency(self.nearest_mm);
        match self.distance(choice, DISTANCE_REACH) {
            Distance::Known(distance_mm) => ln_nearest.saturating_sub(self.likelihood.ln_consistency(distance_mm)),
            Distance::Unknown | Distance::TooLarge => i32::MAX,
        }
    }

    /// The distance of a prediction, computed if it is not known yet. It matters while ln of Eq. 8 is at most
    /// `reach` below that of the nearest prediction.
    fn distance(&mut self, choice: Choice, reach: i32) -> Distance {
        let known = self.candidate(choice).map_or(Distance::TooLarge, |candidate| candidate.distance);
        if known != Distance::Unknown {
            return known;
        }
        let step_mm = self.length.label_step_mm();
        let loss = reach.saturating_sub(self.likelihood.ln_consistency(self.nearest_mm));
        let limit = (self.likelihood.consistency_reach_mm(loss) / step_mm).min(self.farthest_steps());
        let distance = match self.search(choice, (self.nearest_mm / step_mm, limit)) {
            None if limit < self.farthest_steps() => Distance::TooLarge,
            steps => self.distance_of(steps),
        };
        self.know(choice, distance);
        distance
    }

    fn search(&mut self, choice: Choice, known_and_limit: (u16, u16)) -> Option<u16> {
        let parent = self.parents.get(usize::from(choice.parent))?;
        predict(self.predicted, parent, choice.vertex, self.observation);
        self.consistency.search(self.predicted, self.evidence, self.length, self.direction, known_and_limit)
    }

    fn know(&mut self, choice: Choice, distance: Distance) {
        if let Some(candidates) = self.pool.get_mut(usize::from(choice.parent)) {
            candidates[choice.vertex].distance = distance;
        }
    }

    /// The largest finite distance, in the steps of the n-grams.
    fn farthest_steps(&self) -> u16 {
        Fingerprint::MAX.steps() >> self.length.coarsening()
    }

    fn distance_of(&self, steps: Option<u16>) -> Distance {
        Distance::Known(steps.map_or(u16::MAX, |steps| steps * self.length.label_step_mm()))
    }
}

/// Every prediction, in the order of the pool.
fn choices<const V: usize>(parents: &[Particle<V>]) -> impl Iterator<Item = Choice> + '_ {
    (0_u8..)
        .zip(parents)
        .flat_map(|(index, parent)| successors(&parent.map).map(move |vertex| Choice { parent: index, vertex }))
}

/// The vertices that the robot can go to: those of a map, and a new one while there is room.
fn successors<const V: usize>(map: &Map<V>) -> impl Iterator<Item = VertexId> + use<V> {
    VertexId::first((map.vertices().len() + 1).min(V))
}

/// ln of Eq. 7 for a prediction. The observation is compared with what the label was before; a new vertex fits.
fn ln_label<const V: usize>(
    likelihood: &Likelihood,
    parent: &Particle<V>,
    vertex: VertexId,
    observation: Fingerprint,
) -> i32 {
    parent.map.label(vertex).map_or(0, |label| likelihood.ln_label(observation, label))
}

/// ln of Eq. 9 for a prediction, from that of its parent.
fn ln_size<const V: usize>(
    likelihood: &Likelihood,
    parent: &Particle<V>,
    vertex: VertexId,
    observation: Fingerprint,
) -> i32 {
    let (before, after) = (parent.map.label(vertex), parent.map.label_with(vertex, observation));
    if before == Some(after) {
        return parent.factors.ln_size_q16;
    }
    let others = parent.map.labels().iter().enumerate().filter(|&(other, _)| other != vertex.index());
    let change = likelihood.ln_size_change(others.map(|(_, &label)| label), before, after);
    parent.factors.ln_size_q16.saturating_add(change)
}
