//! From the map to the evidence: is every walk of the map near some n-gram of the evidence?

use super::{Consistency, evidence::Evidence, readings::Readings, state_set::StateSet};
use crate::{Map, NgramLength, map::bits};

/// How many arms are held at once.
pub(super) const BLOCK: usize = 16;

/// The longest arm: the half of the longest n-gram, its middle included.
const LONGEST_ARM: usize = 4;

impl<const V: usize, const WORDS: usize, const INDICES: usize> Consistency<V, WORDS, INDICES> {
    /// Whether max over the map's walks of min over the evidence of Eq. 3 is at most `distance`.
    ///
    /// A walk of `n` vertices is two arms of `⌈n/2⌉` vertices that meet: at one vertex when `n` is odd, over an edge
    /// when it is even. It is confirmed when the states that either arm may have been read to meet as well. Arms are
    /// few where walks are many. Cost: O(V · A² · WORDS) with A arms a vertex, A ≤ Δ^(⌈n/2⌉−1) for a largest degree of Δ;
    /// memory: a block of 16 arms, whatever A is.
    pub(super) fn confirms(
        &mut self,
        map: &Map<V>,
        evidence: &impl Evidence<WORDS>,
        length: NgramLength,
        distance: u16,
    ) -> bool {
        let suspect = if self.suspect < map.vertices() { self.suspect } else { 0 };
        for vertex in (suspect..map.vertices()).chain(0..suspect) {
            if !self.confirms_at(map, evidence, length, distance, vertex) {
                self.suspect = vertex;
                return false;
            }
        }
        true
    }

    /// Whether all walks whose middle is a vertex, or an edge from it to a vertex of no smaller number, are confirmed.
    fn confirms_at(
        &mut self,
        map: &Map<V>,
        evidence: &impl Evidence<WORDS>,
        length: NgramLength,
        distance: u16,
        vertex: u8,
    ) -> bool {
        let block = &mut self.arms;
        let mut question = Question { map, evidence, length, distance, readings: &mut self.readings };
        let odd = length.get() % 2 == 1;
        let mut arms = Arms::from(map, length, vertex);
        loop {
            let mut held = 0;
            for slot in block.iter_mut() {
                let Some(arm) = arms.next(map) else { break };
                *slot = question.states(&arm, arms.vertices);
                held += 1;
            }
            let block = block.get(..held).unwrap_or(&[]);
            if block.is_empty() {
                return true;
            }
            let confirmed = if odd {
                let pairs = block.iter().enumerate();
                pairs
                    .into_iter()
                    .all(|(index, arm)| block.iter().take(index + 1).all(|other| evidence.meets(length, arm, other)))
                    && question.all_meet(block, arms.clone())
            } else {
                bits(map.neighbours(vertex) >> vertex << vertex)
                    .all(|neighbour| question.all_meet(block, Arms::from(map, length, neighbour)))
            };
            if !confirmed {
                return false;
            }
        }
    }
}

/// What the arms are held against.
struct Question<'a, E, const V: usize, const WORDS: usize, const INDICES: usize> {
    map: &'a Map<V>,
    evidence: &'a E,
    length: NgramLength,
    distance: u16,
    readings: &'a mut Readings<V, WORDS, INDICES>,
}

impl<E: Evidence<WORDS>, const V: usize, const WORDS: usize, const INDICES: usize> Question<'_, E, V, WORDS, INDICES> {
    /// The states that the evidence may have been read to along an arm, from its far end to the middle of the walk.
    fn states(&mut self, arm: &[u8; LONGEST_ARM], vertices: u8) -> StateSet<WORDS> {
        let mut states = StateSet::EMPTY;
        for (index, &vertex) in (0..vertices).zip(arm.iter().take(usize::from(vertices)).rev()) {
            let label = (vertex, self.map.label_of(vertex));
            let reading = self.readings.at(self.evidence, self.length, label, index, self.distance);
            states = if index == 0 { *reading } else { self.evidence.around(&states).intersection(reading) };
        }
        states
    }

    /// Whether each of a block of arms meets all of some other arms.
    fn all_meet(&mut self, block: &[StateSet<WORDS>], mut others: Arms) -> bool {
        while let Some(arm) = others.next(self.map) {
            let states = self.states(&arm, others.vertices);
            if !block.iter().all(|held| self.evidence.meets(self.length, held, &states)) {
                return false;
            }
        }
        true
    }
}

/// All walks that start at a vertex and have half the length of an n-gram, in a fixed order.
#[derive(Clone)]
struct Arms {
    /// The vertices of the current arm, the middle of the walk first.
    path: [u8; LONGEST_ARM],
    /// For every vertex of the arm but the first, its brothers that are still to come.
    waiting: [u64; LONGEST_ARM],
    /// How many vertices an arm has: 1 to 4.
    vertices: u8,
    /// How many vertices of the path stand.
    depth: u8,
}

impl Arms {
    fn from<const V: usize>(map: &Map<V>, length: NgramLength, vertex: u8) -> Self {
        let vertices = length.get().div_ceil(2);
        let mut waiting = [0; LONGEST_ARM];
        waiting[1] = map.neighbours(vertex);
        Self { path: [vertex, 0, 0, 0], waiting, vertices, depth: 1 }
    }

    fn next<const V: usize>(&mut self, map: &Map<V>) -> Option<[u8; LONGEST_ARM]> {
        if self.vertices == 1 {
            // An arm of one vertex is the vertex itself, once, and only where a walk can go on from it.
            let alone = self.depth == 1 && self.waiting[1] != 0;
            self.depth = 0;
            return alone.then_some(self.path);
        }
        loop {
            let depth = usize::from(self.depth);
            let waiting = self.waiting.get_mut(depth)?;
            if *waiting == 0 {
                self.depth = self.depth.checked_sub(1).filter(|&depth| depth > 0)?;
                continue;
            }
            let vertex = waiting.trailing_zeros() as u8;
            *waiting &= *waiting - 1;
            *self.path.get_mut(depth)? = vertex;
            if self.depth + 1 == self.vertices {
                return Some(self.path);
            }
            self.depth += 1;
            *self.waiting.get_mut(depth + 1)? = map.neighbours(vertex);
        }
    }
}
