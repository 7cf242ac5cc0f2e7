//! Folding: a map from the history alone, without the map that the search is stuck in.
//!
//! A stuck map is a quotient of the right one: connected parts of the building lie on top of each other, and no single split undoes
//! that. So a fold starts from the tree of the history, which has a node for each way to a place. Two nodes are merged, and with
//! them their neighbours that look alike, as in the state merging of automata (Lang, Pearlmutter and Price, "Results of the
//! Abbadingo One DFA Learning Competition", ICGI 1998). The next merge is always that with the largest gain in evidence.

mod automaton;
mod categories;
#[cfg(test)]
mod tests;

use super::history::ObservationHistory;
use super::hypothesis::Hypothesis;
use super::model::Model;
use super::special_functions::gumbel;
use crate::map::VertexId;
use automaton::{Automaton, NODES, NONE, Node, PerNode};
use categories::{Categories, Category};
use rand_core::Rng;
use rand_xoshiro::Xoshiro128PlusPlus;

/// The gain of a label that leads to an existing node, in nats.
const KNOWN_WAY: f32 = 4.0;

/// The work of a step in units of the test of one pair, and that of a merge of two nodes.
const STEP_WORK: u32 = 60_000;
const MERGE_WORK: u32 = 40;

/// The tree grows again when merges have left at most this many nodes.
const NODES_LEFT: u8 = 96;

/// Folds differ, so that not all fail in the same way. Labels within this many standard deviations of the noise are of one
/// category.
const REACHES: [f32; 3] = [1.5, 2.0, 2.5];
/// The gain of a label whose category is that of the map of the hypothesis, in nats.
const INCUMBENTS: [f32; 3] = [4.0, 8.0, 1000.0];
/// The noise of a fold that starts from the labels alone, as a share of that of the model. Where the search is stuck in a map that folds
/// places with other labels onto each other, the noise that follows from this map is too large.
const NOISES: [f32; 3] = [1.0, 0.4, 0.16];
/// One of this many folds starts from the labels alone.
const FRESH_EVERY: u32 = 4;
/// The least noise of a fold, in steps.
const NOISE_MIN: f32 = 2.0;
/// The temperature of the draw among merges by their gain.
const TEMPERATURES: [f32; 3] = [0.0, 1.0, 2.0];

/// The state of a fold.
#[derive(Clone, Debug)]
pub(crate) struct Fold<const T: usize> {
    is_running: bool,
    /// Whether the fold has ended; the next step reports it.
    has_ended: bool,
    /// Whether it started from the labels alone, with a noise of its own.
    is_fresh: bool,
    temperature: f32,
    model: Model,
    categories: Categories,
    automaton: Automaton,
    /// The node of each of the first `placed` places of the history, then the category of each place up to `known`.
    nodes: [u8; T],
    placed: usize,
    known: usize,
    /// The gain of a label whose category is that of the map of the hypothesis, in nats.
    incumbent: f32,
    /// The pair that is tried next.
    pair: (Node, Node),
    /// The best pair, and its gain after noise.
    best: Option<(f32, Node, Node)>,
}

/// The result of a step of a fold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    Running,
    Done,
    Failed,
}

impl<const T: usize> Fold<T> {
    pub(super) const fn new() -> Self {
        Self {
            is_running: false,
            has_ended: false,
            is_fresh: false,
            temperature: 0.0,
            model: Model::new(),
            categories: Categories::new(),
            automaton: Automaton::new(),
            nodes: [0; T],
            placed: 0,
            known: 0,
            incumbent: 0.0,
            pair: (0, 0),
            best: None,
        }
    }

    pub(super) fn is_running(&self) -> bool {
        self.is_running
    }

    /// Ends a fold under way.
    pub(crate) fn cancel(&mut self) {
        self.is_running = false;
    }

    /// The model of a fold with a noise of its own.
    pub(super) fn own_model(&self) -> Option<&Model> {
        Some(&self.model).filter(|_| self.is_fresh)
    }

    /// Starts a fold of the history, with the categories of a hypothesis or from the labels alone. Cost: O(V³ + T · categories).
    pub(super) fn start<const V: usize>(
        &mut self,
        model: &Model,
        history: &ObservationHistory<T>,
        hypothesis: &Hypothesis<V, T>,
        random: &mut Xoshiro128PlusPlus,
    ) {
        let mut one_of = |values: [f32; 3]| values[(random.next_u32() % 3) as usize];
        let reach = one_of(REACHES);
        self.incumbent = one_of(INCUMBENTS);
        self.temperature = one_of(TEMPERATURES);
        let share = one_of(NOISES);
        self.model.clone_from(model);
        self.is_fresh = random.next_u32().is_multiple_of(FRESH_EVERY);
        if self.is_fresh {
            self.model.set_noise((share * model.noise_steps()).max(NOISE_MIN));
            self.incumbent = 0.0;
            self.categories.find_in(&self.model, history, reach);
        } else {
            let categories = self.categories.find(model, hypothesis, reach);
            for (slot, &vertex) in self.nodes.iter_mut().zip(&hypothesis.path) {
                *slot = categories[vertex].index() as u8;
            }
        }
        self.known = history.len();
        self.placed = 0;
        self.automaton.clear();
        self.grow(history);
        self.is_running = true;
        self.has_ended = false;
    }

    /// Adds places to the tree while there is room for nodes. Cost: O(T · categories).
    fn grow(&mut self, history: &ObservationHistory<T>) {
        let mut at = self.placed.checked_sub(1).and_then(|last| self.nodes.get(last)).copied();
        let places = history.iter().zip(&mut self.nodes).take(self.known).skip(self.placed);
        for (observation, slot) in places {
            let from = if observation.starts_sequence() { None } else { at };
            let mut best = (f32::NEG_INFINITY, Category::FIRST);
            for (category, mut score) in self.categories.ln_densities(observation.steps) {
                if from.is_some_and(|from| self.automaton.neighbour(from, category).is_some()) {
                    score += KNOWN_WAY;
                }
                if category.index() == usize::from(*slot) {
                    score += self.incumbent;
                }
                if score > best.0 {
                    best = (score, category);
                }
            }
            let category = best.1;
            let known = from.and_then(|from| self.automaton.neighbour(from, category));
            let Some(node) = known.or_else(|| self.automaton.add(category)) else { break };
            if let (None, Some(from)) = (known, from) {
                self.automaton.connect(from, node);
            }
            self.automaton.include(node, i32::from(observation.steps) - self.categories.mean(category) as i32);
            *slot = node;
            at = Some(node);
            self.placed += 1;
        }
        self.automaton.score_all(&self.model);
        self.pair = (0, 1);
        self.best = None;
    }

    /// Makes one node of each class and adds more places.
    fn grow_again(&mut self, history: &ObservationHistory<T>) {
        let mut renamed = PerNode::filled(NONE);
        self.automaton.compact(&mut renamed);
        self.nodes.iter_mut().take(self.placed).for_each(|node| *node = renamed[*node]);
        self.grow(history);
    }

    /// Tries some merges. A sweep tries all pairs of a category and makes the best merge.
    pub(super) fn step(
        &mut self,
        history: &ObservationHistory<T>,
        vertices: usize,
        random: &mut Xoshiro128PlusPlus,
    ) -> Progress {
        if self.has_ended {
            // What follows from the path is computed in a step of its own.
            self.is_running = false;
            let fits = usize::from(self.automaton.classes()) <= vertices;
            return if fits { Progress::Done } else { Progress::Failed };
        }
        let mut work = 0;
        while work < STEP_WORK {
            let (first, second) = self.pair;
            work += 1;
            if first >= self.automaton.len() {
                // The sweep is over.
                self.pair = (0, 1);
                let best = self.best.take();
                if let Some((_, a, b)) = best {
                    work += MERGE_WORK * self.automaton.merge(&self.model, a, b).1;
                    self.automaton.commit(&self.model);
                }
                let has_room = self.automaton.classes() <= if best.is_some() { NODES_LEFT } else { NODES as u8 - 1 };
                if self.placed < self.known && has_room {
                    self.grow_again(history);
                } else if best.is_none() {
                    self.has_ended = true;
                    return Progress::Running;
                }
                continue;
            }
            if second >= self.automaton.len() || !self.automaton.is_representative(first) {
                self.pair = (first + 1, first.saturating_add(2));
                continue;
            }
            self.pair = (first, second + 1);
            if !self.automaton.is_representative(second)
                || self.automaton.category(first) != self.automaton.category(second)
            {
                continue;
            }
            let (gain, merged) = self.automaton.merge(&self.model, first, second);
            self.automaton.undo();
            work += MERGE_WORK * merged;
            let has_to_merge = self.placed == self.known && usize::from(self.automaton.classes()) > vertices;
            if let Some(gain) = gain.filter(|&gain| gain > 0.0 || has_to_merge) {
                let drawn =
                    if self.temperature > 0.0 { gain / self.temperature + gumbel(random.next_u32()) } else { gain };
                if self.best.is_none_or(|best| drawn > best.0) {
                    self.best = Some((drawn, first, second));
                }
            }
        }
        Progress::Running
    }

    /// Writes the path of the folded map into a hypothesis. Newer places go to the vertex that explains their label best, of the
    /// neighbours if there is a choice.
    pub(super) fn write<const V: usize>(&self, history: &ObservationHistory<T>, hypothesis: &mut Hypothesis<V, T>) {
        let mut numbers = PerNode::filled(None);
        let mut count = 0;
        let mut at = None;
        for (index, (observation, &node)) in history.iter().zip(&self.nodes).enumerate() {
            let class =
                if index < self.placed { self.automaton.find(node) } else { self.closest(at, observation.steps) };
            let number = &mut numbers[class];
            if number.is_none() {
                *number = VertexId::new(count);
                count += 1;
            }
            hypothesis.set_vertex_of(index, number.unwrap_or(VertexId::FIRST));
            at = Some(class);
        }
        hypothesis.vertices = count;
    }

    /// The class that explains a label best of the next place after one at some class.
    fn closest(&self, from: Option<Node>, steps: u16) -> Node {
        let mut best = (f32::NEG_INFINITY, 0);
        let classes = (0..self.automaton.len()).filter(|&node| self.automaton.is_representative(node));
        for class in classes.filter(|&class| Some(class) != from) {
            let category = self.automaton.category(class);
            let known = from.and_then(|from| self.automaton.neighbour(from, category));
            let is_known = known.is_some_and(|known| self.automaton.find(known) == class);
            let score = self.categories.ln_density(category, steps) + if is_known { KNOWN_WAY } else { 0.0 };
            if score > best.0 {
                best = (score, class);
            }
        }
        best.1
    }
}
