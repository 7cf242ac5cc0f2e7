//! Refinement between two places: a repair builds a hypothesis again, in steps of bounded work.
//!
//! A repair starts from one of the hypotheses, its source, and builds a draft from the record. The draft follows the path of the
//! source until it has to leave it: at a decision that is forbidden, at a place from which on all is decided again, or where the
//! source contradicts itself because two of its vertices were folded onto each other. From there on decisions look ahead, until the
//! draft is where the source is. When a part of the source was removed, its path is decoded first. A draft that is better than the
//! worst hypothesis becomes one.

use super::OrderedFilter;
use super::choice::{ReportedExit, UNSEEN};
use super::fold::{fit, fold};
use super::hypothesis::Hypothesis;
use super::logarithm::gumbel;
use super::replay::Builder;
use crate::filter::beam::Ranked as _;
use crate::filter::{draws, uniform};
use crate::map::NONE;
use rand_core::Rng;
use rand_xoshiro::Xoshiro128PlusPlus;

/// Vertices are not considered for a fold when labels and ways speak against it by more than this, in nats.
const UNFIT: f32 = -14.0;

/// The number of folds that are compared before one is made.
const FOLDS: usize = 8;

/// The work of one step: one unit follows the source by a place.
const WORK: u32 = 300;

/// The work of one decision.
const DECISION: u32 = 12;

/// Of 16 repairs, how many start from the best hypothesis in any case, and how many remove a part of the map; of 16 others, how many
/// fold two vertices; of 16 others, how many decide everything again.
const BEST: usize = 4;
const REMOVED: usize = 10;
const FOLDED: usize = 6;
const RESTARTS: usize = 2;
/// And how many relocate the robot.
const RELOCATED: usize = 4;
/// Of 16 others, how many forbid an edge that contradicts a reported exit.
const DOUBTED: usize = 6;

/// Of 16 repairs that forbid a decision, how many decide everything after it again.
const FREE: usize = 6;

/// A repair starts from the draft of the one before if that is no more than this below the best hypothesis, in nats; and how often
/// that happens in sequence.
const CHAIN_LOSS: f32 = 25.0;
const CHAIN_LENGTH: u8 = 2;

/// The noise of decisions is drawn up to this, in nats.
const TEMPERATURE: f32 = 3.0;

/// The noise of the choice of a fold, in nats.
const FOLD_TEMPERATURE: f32 = 3.0;

/// Where a repair leaves the path of its source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Deviation {
    /// Only where the source contradicts itself.
    Never,
    /// At the decision with this number.
    AtDecision(usize),
    /// At this observation.
    At(usize),
    /// From an observation on, for good.
    From(usize),
}

/// How far a repair has got.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Repair {
    /// The next observation; `None` when no repair is under way.
    next: Option<usize>,
    deviation: Deviation,
    /// Whether the draft is where the source is.
    follows: bool,
    /// Noise of the decisions.
    temperature: f32,
    /// How many repairs in sequence started from a draft that is no hypothesis.
    chained: u8,
    /// Whether the path of the source is being decoded, before the draft is built.
    decodes: bool,
}

impl Repair {
    pub(crate) const NONE: Self =
        Self { next: None, deviation: Deviation::Never, follows: false, temperature: 0.0, chained: 0, decodes: false };

    /// The path of the source is to be decoded.
    pub(super) fn decode(&mut self) {
        *self = Self { next: Some(0), decodes: true, chained: self.chained, ..Self::NONE };
    }

    /// It is decoded up to a place.
    pub(super) fn decode_from(&mut self, next: usize) {
        self.next = Some(next);
    }

    /// It is decoded, and the draft is to be built along it.
    pub(super) fn build(&mut self) {
        *self = Self { next: Some(0), follows: true, chained: self.chained, ..Self::NONE };
    }
}

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// Runs one refinement step: a repair, or a part of one that is too long for a step. The next [`OrderedFilter::observe`]
    /// uses the result.
    ///
    /// Cost: at most `WORK` places or `WORK / DECISION` decisions, or the arrivals of a part of a decoding; the choice of a fold is
    /// O(V² + D²).
    pub(super) fn repair(&mut self) {
        if self.record.len() < 3 {
            return;
        }
        let piece = u64::from(self.observed) << 16 | u64::from(self.refined);
        self.refined += 1;
        let mut random = draws(self.seed, piece);
        if self.repair.next.is_none() && !self.start_repair(&mut random) {
            self.repair_nothing();
            return;
        }
        if self.continue_repair(&mut random) {
            self.repair.next = None;
            if self.draft.score() > self.beam.threshold(N) {
                self.beam.insert(&self.draft, N);
                self.repair.chained = 0;
            } else {
                // A change that loses little may be the first of two that gain.
                let best = self.beam.best().map_or(0.0, Hypothesis::score);
                let continues = self.draft.score() > best - CHAIN_LOSS && self.repair.chained < CHAIN_LENGTH;
                self.repair.chained = if continues { self.repair.chained + 1 } else { 0 };
            }
        }
    }

    /// Chooses a source and where to leave its path. Returns whether there is something to repair.
    fn start_repair(&mut self, random: &mut Xoshiro128PlusPlus) -> bool {
        let rank = match self.repair.chained {
            0 if below(random, 16) < BEST => Some(0),
            0 => Some(below(random, self.beam.len())),
            _ => None,
        };
        self.take_source(rank);
        if below(random, 16) < REMOVED {
            return self.remove_some(random);
        }
        let deviation = if below(random, 16) < FOLDED {
            if !self.fold_two(random, rank) {
                return false;
            }
            Deviation::Never
        } else if below(random, 16) < RELOCATED {
            let from = below(random, 2) * below(random, self.record.len());
            let builder = Builder { model: &self.model, record: &self.record, translation: &mut self.translation };
            if !builder.relocate(&mut self.source, from, || FOLD_TEMPERATURE * gumbel(random.next_u32())) {
                return false;
            }
            Deviation::Never
        } else if below(random, 16) < RESTARTS {
            Deviation::From(1)
        } else if below(random, 16) < DOUBTED
            && let Some(at) = self.doubted_edge(random)
        {
            Deviation::At(at)
        } else if below(random, 4) > 0 {
            // Some more than there are edges: exits that were doubted, and places that fit badly.
            Deviation::AtDecision(below(random, self.source.map.edges().count() + 3))
        } else {
            Deviation::From(1 + below(random, self.record.len() - 1))
        };
        let temperature = if deviation == Deviation::Never { 0.0 } else { TEMPERATURE * uniform(random.next_u32()) };
        self.repair.build();
        (self.repair.deviation, self.repair.temperature) = (deviation, temperature);
        self.start_draft();
        true
    }

    /// Takes the hypothesis of a rank for the source, or the draft.
    fn take_source(&mut self, rank: Option<usize>) {
        if let Some(source) = rank.map_or(Some(&self.draft), |rank| self.beam.get(rank)) {
            self.source.clone_from(source);
        }
    }

    /// Draws a passage at which the source contradicts the reported exit, and returns the first passage of the edge that was
    /// reported. `None` if there is no contradiction. Cost: O(T).
    fn doubted_edge(&self, random: &mut Xoshiro128PlusPlus) -> Option<usize> {
        let source = &self.source;
        let mut doubted = 0_usize;
        let mut chosen = None;
        for index in 1..self.record.len() {
            let before = source.came_by(index - 1);
            if before >= UNSEEN || self.record.get(index).starts() {
                continue;
            }
            if let ReportedExit::Way(exit) = source.reported_exit(&self.record, index, before)
                && let Some(partner) = source.map.partner(exit)
                && source.came_by(index) != partner
            {
                doubted += 1;
                if below(random, doubted) == 0 {
                    chosen = Some((exit, partner));
                }
            }
        }
        let (exit, partner) = chosen?;
        source.path.iter().take(self.record.len()).position(|&came_by| came_by == exit || came_by == partner)
    }

    /// Builds on the draft. Returns whether it explains the whole record.
    fn continue_repair(&mut self, random: &mut Xoshiro128PlusPlus) -> bool {
        let Some(mut index) = self.repair.next else { return false };
        if self.repair.decodes {
            if !self.continue_decoding(index) {
                return false;
            }
            index = 0;
        }
        let mut builder = Builder { model: &self.model, record: &self.record, translation: &mut self.translation };
        let mut work = 0;
        while index < self.record.len() && work < WORK {
            let mut forbidden = None;
            if let Deviation::From(from) = self.repair.deviation {
                self.repair.follows &= index < from;
            }
            if self.repair.follows
                && let Some(step) = builder.step(&self.source, &mut self.draft, index)
            {
                work += 1;
                match &mut self.repair.deviation {
                    Deviation::AtDecision(0) if step.is_decision => {
                        forbidden = Some(step.choice);
                        self.repair.deviation =
                            if below(random, 16) < FREE { Deviation::From(index) } else { Deviation::Never };
                    }
                    Deviation::AtDecision(left) if step.is_decision => *left -= 1,
                    Deviation::At(at) if *at == index => {
                        forbidden = Some(step.choice);
                        self.repair.deviation =
                            if below(random, 16) < FREE { Deviation::From(index) } else { Deviation::Never };
                    }
                    _ => {}
                }
                if forbidden.is_none() {
                    builder.take(&self.source, &mut self.draft, index, step);
                    index += 1;
                    continue;
                }
            }
            let temperature = self.repair.temperature;
            let noise = || temperature * gumbel(random.next_u32());
            let Some((target, followed)) = builder.decide(&mut self.draft, index, forbidden, noise) else {
                // Nothing else explains the place, or there is no room for what does.
                self.repair = Repair::NONE;
                return false;
            };
            work += if followed { 1 } else { DECISION };
            self.repair.follows = builder.is_back(&self.source, &mut self.draft, index, target);
            index += 1;
        }
        self.repair.next = Some(index);
        index == self.record.len()
    }

    /// Leaves observation `index` of the source open: the repair under way started before it.
    pub(super) fn extend_repair(&mut self, index: usize) {
        if self.repair.next.is_none() {
            self.repair_nothing();
        }
        if let Some(slot) = self.source.path.get_mut(index) {
            *slot = NONE;
        }
    }

    /// Gives up the repair that is under way.
    pub(crate) fn repair_nothing(&mut self) {
        self.repair = Repair::NONE;
    }

    /// Builds the draft along the path of the source, and decides where that contradicts itself. Returns whether the draft explains
    /// the whole record.
    pub(super) fn rebuild_with_decisions(&mut self) -> bool {
        self.repair = Repair { next: Some(0), follows: true, ..Repair::NONE };
        self.start_draft();
        let mut random = draws(self.seed, u64::from(self.observed) << 16);
        let mut is_whole = false;
        while self.repair.next.is_some() && !is_whole {
            is_whole = self.continue_repair(&mut random);
        }
        self.repair_nothing();
        is_whole
    }

    /// The draft as it was before the record begins.
    pub(super) fn start_draft(&mut self) {
        self.draft.clone_from(&self.base);
        self.translation.start(self.base.map.vertices(), self.base.map.darts());
    }

    /// Builds the draft strictly along the path of the source, from one observation, the first for a new draft, to before another;
    /// `None` when it contradicts itself.
    pub(super) fn rebuild(&mut self, from: usize, until: usize) -> Option<()> {
        if from == 0 {
            self.start_draft();
        }
        let mut builder = Builder { model: &self.model, record: &self.record, translation: &mut self.translation };
        (from..until).try_for_each(|index| builder.follow(&self.source, &mut self.draft, index))
    }

    /// Folds two vertices of the source, the hypothesis of a rank or the draft. Returns whether there were two that fit.
    ///
    /// Pairs are drawn by how well they fit, then one of them by what follows from it.
    fn fold_two(&mut self, random: &mut Xoshiro128PlusPlus, rank: Option<usize>) -> bool {
        let mut drawn = [(f32::NEG_INFINITY, NONE, NONE); FOLDS];
        let source = &self.source;
        for u in 1..source.map.vertices() {
            for v in 0..u {
                let (label, other) = (source.label(u), source.label(v));
                if source.is_label_far(&self.model, label.mean, v) {
                    continue;
                }
                let labels = label.with(&other).evidence(&self.model)
                    - label.evidence(&self.model)
                    - other.evidence(&self.model);
                for &a in source.map.ways(u) {
                    for &b in source.map.ways(v) {
                        let fit = labels + fit(&self.model, source, (a, b));
                        if fit > UNFIT {
                            rank_in(&mut drawn, (fit + FOLD_TEMPERATURE * gumbel(random.next_u32()), a, b));
                        }
                    }
                }
            }
        }
        let len = self.record.len();
        let mut chosen = (f32::NEG_INFINITY, NONE, NONE);
        for &(_, a, b) in drawn.iter().take_while(|(score, ..)| *score > f32::NEG_INFINITY) {
            if let Some(gain) = fold(&self.model, &mut self.source, &mut self.union, (a, b), len) {
                let score = gain + FOLD_TEMPERATURE * gumbel(random.next_u32());
                if score > chosen.0 {
                    chosen = (score, a, b);
                }
            }
            self.take_source(rank);
        }
        let (_, a, b) = chosen;
        a != NONE && fold(&self.model, &mut self.source, &mut self.union, (a, b), len).is_some()
    }
}

/// Puts a pair among the best ones.
fn rank_in<const K: usize>(ranked: &mut [(f32, u8, u8); K], mut pair: (f32, u8, u8)) {
    for slot in ranked {
        if pair.0 > slot.0 {
            core::mem::swap(slot, &mut pair);
        }
    }
}

/// A random number below a bound; 0 when the bound is 0.
pub(super) fn below(random: &mut Xoshiro128PlusPlus, bound: usize) -> usize {
    ((u64::from(random.next_u32()) * bound as u64) >> 32) as usize
}
