//! Regrowth: a second beam explains the record again from a place on.
//!
//! After a wrong closure the correct map is soon no longer among the hypotheses, and no single repair gains: what was built on the
//! closure contradicts the correct map. A regrowth follows the path of a hypothesis up to a place, forbids what the hypothesis did there,
//! and grows a beam of its own from there to the newest place. Nothing of the map after that place is kept.

use super::OrderedFilter;
use super::choice::{Choice, Target};
#[cfg(test)]
use super::hypothesis::Hypothesis;
use super::hypothesis::mix;
use super::logarithm::{gumbel, uniform};
use super::repair::below;
use super::replay::Builder;
use crate::filter::beam::Ranked as _;
use rand_core::Rng;
use rand_xoshiro::Xoshiro128PlusPlus;

/// A step stops after the place at which it has computed this many explanations.
const EXPLANATIONS: usize = 180;

/// Of 16 regrowths, how many explain the whole record again.
const WHOLE: usize = 4;

/// Of four regrowths, how many start from the best hypothesis in any case.
const BEST: usize = 3;

/// The noise of the ranking is drawn up to this, in nats.
const TEMPERATURE: f32 = 1.0;

/// How far a regrowth has got, and what it does differently from the hypothesis it started from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Regrowth {
    /// The next observation; `None` when no regrowth is under way.
    next: Option<usize>,
    /// The first observation that is explained again.
    from: usize,
    /// Whether `forbidden` applies. `None` of an `Option<Choice>` is not all zero, so a `static` filter would not be in `.bss`.
    forbids: bool,
    /// How it must not be explained.
    forbidden: Choice,
    /// Noise of the ranking.
    temperature: f32,
    seed: u32,
}

impl Regrowth {
    /// No regrowth.
    pub(crate) const NONE: Self =
        Self { next: None, from: 0, forbids: false, forbidden: Choice::ZERO, temperature: 0.0, seed: 0 };

    /// What forbids the decision of a hypothesis at an observation.
    #[cfg(test)]
    pub(super) fn forbidding<const N: usize, const V: usize, const D: usize, const T: usize>(
        filter: &mut OrderedFilter<N, V, D, T>,
        hypothesis: &Hypothesis<V, D, T>,
        from: usize,
    ) -> Self {
        filter.source.clone_from(hypothesis);
        assert!(filter.rebuild(0, from).is_some());
        let mut builder =
            Builder { model: &filter.model, record: &filter.record, translation: &mut filter.translation };
        let step = builder.step(&filter.source, &mut filter.draft, from);
        let forbidden = step.map_or(Choice::ZERO, |step| step.choice);
        Self { from, forbids: step.is_some(), forbidden, ..Self::NONE }
    }

    pub(super) fn is_under_way(&self) -> bool {
        self.next.is_some()
    }

    /// Whether observation `index` must not be explained like this.
    pub(super) fn forbids(&self, index: usize, choice: Choice) -> bool {
        self.forbids && self.forbidden == choice && index == self.from
    }

    /// What is added to the score of a map to rank it; the same as long as the map has the same edges.
    pub(super) fn noise(&self, map_key: u32) -> f32 {
        if self.temperature > 0.0 { self.temperature * gumbel(mix(map_key ^ self.seed)) } else { 0.0 }
    }
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// Chooses a hypothesis and a place, and starts the second beam there. Cost: as following the record once.
    pub(super) fn start_regrowth(&mut self, random: &mut Xoshiro128PlusPlus) {
        self.regrowth = Regrowth::NONE;
        let rank = if below(random, 4) < BEST { 0 } else { below(random, self.beam.len()) };
        let Some(source) = self.beam.get(rank) else { return };
        self.source.clone_from(source);
        let from = if below(random, 16) < WHOLE { 0 } else { self.some_first_passage(random) };
        if self.rebuild(0, from).is_none() {
            return;
        }
        self.regrown.start_with(&self.draft);
        let mut builder = Builder { model: &self.model, record: &self.record, translation: &mut self.translation };
        let step = builder.step(&self.source, &mut self.draft, from);
        let forbidden = step.map(|step| step.choice).filter(|choice| from > 0 && choice.target != Target::Known);
        let temperature = TEMPERATURE * uniform(random.next_u32());
        self.regrowth = Regrowth {
            next: Some(from),
            from,
            forbids: forbidden.is_some(),
            forbidden: forbidden.unwrap_or(Choice::ZERO),
            temperature,
            seed: random.next_u32(),
        };
    }

    /// The place after the first passage of a corridor that is drawn from those of the source; the first place if it has none.
    fn some_first_passage(&self, random: &mut Xoshiro128PlusPlus) -> usize {
        let map = &self.source.map;
        let corridor = map.edges().nth(below(random, map.edges().count()));
        let path = self.source.path.iter().take(self.record.len());
        let first = |(a, b)| path.clone().position(|&came_by| came_by == a || came_by == b);
        corridor.and_then(first).unwrap_or(0)
    }

    /// Grows the second beam by some places. At the newest place its hypotheses enter the beam if they are better than the worst one.
    pub(super) fn continue_regrowth(&mut self) {
        let Some(mut index) = self.regrowth.next else { return };
        let mut explanations = 0;
        while index < self.record.len() && explanations < EXPLANATIONS {
            explanations += self.regrown.grow(&self.model, &self.record, index, &self.regrowth).explanations;
            index += 1;
        }
        self.regrowth.next = Some(index);
        if index < self.record.len() {
            return;
        }
        self.regrowth = Regrowth::NONE;
        self.regrown.sort();
        for hypothesis in self.regrown.iter() {
            if hypothesis.score() > self.beam.threshold(N) {
                self.beam.insert(hypothesis, N);
            }
        }
    }
}
