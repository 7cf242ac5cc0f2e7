//! The automaton of a fold: nodes with at most one neighbour of each category, and merges that keep it so.
//!
//! Merged nodes are a union-find structure. All statistics are sums of integers, and nothing of a node is lost when it is merged
//! into another. So a merge is undone exactly, without copies.

use super::categories::{CATEGORIES, Category};
use crate::filter::robust::model::{LN_EDGE, LN_VERTEX, Model};
use core::ops::{Index, IndexMut};

/// The number of a node.
pub(super) type Node = u8;

/// No node.
pub(super) const NONE: Node = 127;

/// How many nodes there are at most.
pub(super) const NODES: usize = NONE as usize;

/// Deviations of a label from the mean of its category count up to this, in steps, so that no sum overflows.
const DEVIATION_MAX: i32 = 500;

/// A value for each node. Every index is in its range.
#[derive(Clone, Debug)]
pub(super) struct PerNode<T>([T; NODES + 1]);

impl<T: Copy> PerNode<T> {
    pub(super) const fn filled(value: T) -> Self {
        Self([value; NODES + 1])
    }
}

impl<T> Index<Node> for PerNode<T> {
    type Output = T;

    fn index(&self, node: Node) -> &T {
        &self.0[usize::from(node & NONE)]
    }
}

impl<T> IndexMut<Node> for PerNode<T> {
    fn index_mut(&mut self, node: Node) -> &mut T {
        &mut self.0[usize::from(node & NONE)]
    }
}

/// The neighbour of each category.
#[derive(Clone, Copy, Debug)]
struct Neighbours([Node; CATEGORIES]);

impl Neighbours {
    const NONE: Self = Self([NONE; CATEGORIES]);

    fn get(&self, category: Category) -> Node {
        self.0[category.index()]
    }

    fn set(&mut self, category: Category, node: Node) {
        self.0[category.index()] = node;
    }

    fn degree(&self) -> u32 {
        self.0.iter().map(|&node| u32::from(node != NONE)).sum()
    }
}

/// The labels of a node, as deviations from the mean of its category in steps.
#[derive(Clone, Copy, Debug)]
struct Labels {
    visits: u16,
    sum: i32,
    squares: u32,
}

impl Labels {
    const NONE: Self = Self { visits: 0, sum: 0, squares: 0 };

    fn include(&mut self, deviation: i32) {
        let deviation = deviation.clamp(-DEVIATION_MAX, DEVIATION_MAX);
        self.visits = self.visits.wrapping_add(1);
        self.sum = self.sum.wrapping_add(deviation);
        self.squares = self.squares.wrapping_add(deviation.unsigned_abs().pow(2));
    }

    fn add(&mut self, other: Self) {
        self.visits = self.visits.wrapping_add(other.visits);
        self.sum = self.sum.wrapping_add(other.sum);
        self.squares = self.squares.wrapping_add(other.squares);
    }

    fn subtract(&mut self, other: Self) {
        self.visits = self.visits.wrapping_sub(other.visits);
        self.sum = self.sum.wrapping_sub(other.sum);
        self.squares = self.squares.wrapping_sub(other.squares);
    }

    /// Q: the sum of squared distances from their mean, in steps².
    fn scatter(&self) -> f32 {
        let sum = self.sum as f32;
        (self.squares as f32 - sum * sum / f32::from(self.visits.max(1))).max(0.0)
    }
}

/// One step of a merge: a node that was merged into another, and the edges that its class got from it.
#[derive(Clone, Copy, Debug)]
struct Join {
    removed: Node,
    /// The representative that got the edges.
    owner: Node,
    /// One bit for each category of which the representative got a neighbour.
    edges: u16,
}

/// Nodes, their edges, and which of them are merged.
#[derive(Clone, Debug)]
pub(super) struct Automaton {
    len: Node,
    classes: u8,
    neighbours: PerNode<Neighbours>,
    category: PerNode<Category>,
    parent: PerNode<Node>,
    labels: PerNode<Labels>,
    /// The score of each class that is not part of a merge under way.
    scores: PerNode<f32>,
    joins: PerNode<Join>,
    joined: u8,
}

impl Automaton {
    /// All zero, so that a static of it is in `.bss`.
    pub(super) const fn new() -> Self {
        Self {
            len: 0,
            classes: 0,
            neighbours: PerNode::filled(Neighbours([0; CATEGORIES])),
            category: PerNode::filled(Category::FIRST),
            parent: PerNode::filled(0),
            labels: PerNode::filled(Labels::NONE),
            scores: PerNode::filled(0.0),
            joins: PerNode::filled(Join { removed: 0, owner: 0, edges: 0 }),
            joined: 0,
        }
    }

    pub(super) fn clear(&mut self) {
        self.len = 0;
        self.classes = 0;
        self.joined = 0;
    }

    /// Whether there is no room for a node.
    pub(super) fn is_full(&self) -> bool {
        self.len >= NONE
    }

    /// Makes one node of each class, numbered as their representatives are. `renamed` gets the new number of each node. No merge may
    /// be under way.
    pub(super) fn compact(&mut self, renamed: &mut PerNode<Node>) {
        let mut count = 0;
        for node in (0..self.len).filter(|&node| self.parent[node] == node) {
            renamed[node] = count;
            count += 1;
        }
        for node in (0..self.len).rev().filter(|&node| self.parent[node] != node) {
            renamed[node] = renamed[self.find(node)];
        }
        for node in 0..self.len {
            if self.parent[node] == node {
                let new = renamed[node];
                let mut neighbours = self.neighbours[node];
                neighbours.0.iter_mut().filter(|held| **held != NONE).for_each(|held| *held = renamed[*held]);
                self.neighbours[new] = neighbours;
                self.category[new] = self.category[node];
                self.labels[new] = self.labels[node];
                self.scores[new] = self.scores[node];
            }
        }
        (0..count).for_each(|node| self.parent[node] = node);
        self.len = count;
    }

    /// How many nodes there are.
    pub(super) fn len(&self) -> Node {
        self.len
    }

    /// How many classes of merged nodes there are.
    pub(super) fn classes(&self) -> u8 {
        self.classes
    }

    /// Adds a node; `None` when there is no room.
    pub(super) fn add(&mut self, category: Category) -> Option<Node> {
        let node = self.len;
        if self.is_full() {
            return None;
        }
        self.neighbours[node] = Neighbours::NONE;
        self.category[node] = category;
        self.parent[node] = node;
        self.labels[node] = Labels::NONE;
        self.len += 1;
        self.classes += 1;
        Some(node)
    }

    /// Joins two nodes by an edge.
    pub(super) fn connect(&mut self, a: Node, b: Node) {
        let (of_a, of_b) = (self.category[a], self.category[b]);
        self.neighbours[a].set(of_b, b);
        self.neighbours[b].set(of_a, a);
    }

    /// The neighbour of some category, if there is one.
    pub(super) fn neighbour(&self, node: Node, category: Category) -> Option<Node> {
        Some(self.neighbours[node].get(category)).filter(|&neighbour| neighbour != NONE)
    }

    /// Adds a label to a node, as deviation from the mean of its category.
    pub(super) fn include(&mut self, node: Node, deviation: i32) {
        self.labels[node].include(deviation);
    }

    /// Computes the scores of all nodes, which the first merge needs.
    pub(super) fn score_all(&mut self, model: &Model) {
        for node in 0..self.len {
            self.scores[node] = self.score(model, node);
        }
    }

    /// The node that represents the class of a node.
    pub(super) fn find(&self, mut node: Node) -> Node {
        while self.parent[node] != node {
            node = self.parent[node];
        }
        node
    }

    /// Whether a node represents its class.
    pub(super) fn is_representative(&self, node: Node) -> bool {
        self.parent[node] == node
    }

    pub(super) fn category(&self, node: Node) -> Category {
        self.category[node]
    }

    /// The score of a class: the evidence of its labels and of its transitions, and the prior of the vertex and of its half of
    /// each edge. The last place has no exit; here it counts with one.
    fn score(&self, model: &Model, node: Node) -> f32 {
        let labels = &self.labels[node];
        let degree = self.neighbours[node].degree();
        let transitions = f32::from(labels.visits) * libm::logf(degree.max(1) as f32);
        model.evidence_of_labels(labels.visits, labels.scatter()) - transitions
            + LN_VERTEX
            + 0.5 * LN_EDGE * degree as f32
    }

    /// Merges two classes of one category and, as long as a class has two neighbours of a category, those. Returns the gain in
    /// score and how many nodes were merged. The merge can be [undone](Automaton::undo) until [`Automaton::commit`]. `None`, and
    /// nothing changes, if two classes would be merged that are neighbours.
    pub(super) fn merge(&mut self, model: &Model, a: Node, b: Node) -> (Option<f32>, u32) {
        let is_consistent = self.join(a, b) && self.fold();
        let work = u32::from(self.joined) + 1;
        if !is_consistent {
            self.undo();
            return (None, work);
        }
        (Some(self.gain(model)), work)
    }

    /// Merges neighbours of the same category, until there are none.
    fn fold(&mut self) -> bool {
        let mut next = 0;
        while next < self.joined {
            let removed = self.joins[next].removed;
            let owner = self.find(removed);
            self.joins[next].owner = owner;
            for category in Category::all() {
                let there = self.neighbours[removed].get(category);
                if there == NONE {
                    continue;
                }
                let there = self.find(there);
                let here = self.neighbours[owner].get(category);
                if there == owner {
                    return false;
                }
                if here == NONE {
                    self.neighbours[owner].set(category, there);
                    self.joins[next].edges |= category.bit();
                    continue;
                }
                let here = self.find(here);
                if here == owner || here != there && !self.join(here, there) {
                    return false;
                }
            }
            next += 1;
        }
        true
    }

    /// Merges two classes, without their neighbours; `false` if they are neighbours.
    fn join(&mut self, a: Node, b: Node) -> bool {
        let category = self.category[a];
        let are_neighbours = [(a, b), (b, a)].into_iter().any(|(one, other)| {
            let neighbour = self.neighbours[one].get(category);
            neighbour != NONE && self.find(neighbour) == other
        });
        if are_neighbours || self.joined >= NONE {
            return false;
        }
        // The class with more visits represents both, so that the way to the representative stays short.
        let is_first = (self.labels[a].visits, b) >= (self.labels[b].visits, a);
        let (kept, removed) = if is_first { (a, b) } else { (b, a) };
        self.parent[removed] = kept;
        let labels = self.labels[removed];
        self.labels[kept].add(labels);
        self.joins[self.joined] = Join { removed, owner: NONE, edges: 0 };
        self.joined += 1;
        true
    }

    /// The gain in score by the merge under way.
    fn gain(&self, model: &Model) -> f32 {
        let mut counted = [0_u32; 4];
        let mut gain = 0.0;
        for join in (0..self.joined).map(|number| self.joins[number]) {
            gain -= self.scores[join.removed];
            let kept = self.find(join.removed);
            let word = &mut counted[usize::from(kept >> 5 & 3)];
            if *word >> (kept & 31) & 1 == 0 {
                *word |= 1 << (kept & 31);
                gain += self.score(model, kept) - self.scores[kept];
            }
        }
        gain
    }

    /// Undoes the merge under way.
    pub(super) fn undo(&mut self) {
        while let Some(last) = self.joined.checked_sub(1) {
            let Join { removed, owner, edges } = self.joins[last];
            for category in Category::all().filter(|category| edges & category.bit() != 0) {
                self.neighbours[owner].set(category, NONE);
            }
            let kept = self.parent[removed];
            let labels = self.labels[removed];
            self.labels[kept].subtract(labels);
            self.parent[removed] = removed;
            self.joined = last;
        }
    }

    /// Keeps the merge under way.
    pub(super) fn commit(&mut self, model: &Model) {
        for number in 0..self.joined {
            let kept = self.find(self.joins[number].removed);
            self.scores[kept] = self.score(model, kept);
        }
        self.classes = self.classes.saturating_sub(self.joined);
        self.joined = 0;
    }
}
