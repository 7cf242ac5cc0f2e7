//! From the map to the evidence: is every walk of the map near some n-gram of the evidence?
//!
//! A walk of `n` vertices is two *arms* of `⌈n/2⌉` vertices that meet: at one vertex when `n` is odd, over an edge when it
//! is even. It is confirmed when the sets of states that the readings of both arms reach meet as well. Of the arms that end at
//! a vertex only those with minimal sets of states matter: a set that meets another one meets all supersets of it.

use super::{Consistency, evidence::Evidence, readings::Readings, state_set::StateSet, witness::Walk};
use crate::filter::NgramLength;
use crate::map::PerVertex;
use crate::map::{Map, VertexId, VertexSet};

/// How many arms are compared at once; more are compared in blocks.
const BLOCK: usize = 14;

/// How many minimal tails of a vertex are kept; the tails of a vertex with more are read again each time.
const TAILS: usize = 6;

/// A reading along some vertices, and the states that it reaches.
#[derive(Clone, Copy, Debug)]
struct Arm<const WORDS: usize> {
    states: StateSet<WORDS>,
    /// The vertices, the one of the last label first.
    path: [VertexId; LONGEST_ARM],
}

/// Fills up the path of a shorter arm.
const NONE: VertexId = VertexId::FIRST;

/// The vertices of the longest arm.
const LONGEST_ARM: usize = NgramLength::MAX.get().div_ceil(2) as usize;

impl<const WORDS: usize> Arm<WORDS> {
    const NONE: Self = Self { states: StateSet::EMPTY, path: [NONE; LONGEST_ARM] };

    /// Adds this arm to a list of arms with minimal sets of states, unless the set of one of them is a subset of its own; removes
    /// those whose sets are supersets. Returns the number of arms in the list, or `None` if there is no room; the list is then
    /// as minimal as before.
    fn insert_minimal(&self, arms: &mut [Self], held: usize) -> Option<usize> {
        if arms.iter().take(held).any(|arm| self.states.contains_all(&arm.states)) {
            return Some(held);
        }
        let mut kept = 0;
        for index in 0..held {
            if !arms.get(index)?.states.contains_all(&self.states) {
                if kept < index {
                    *arms.get_mut(kept)? = *arms.get(index)?;
                }
                kept += 1;
            }
        }
        *arms.get_mut(kept)? = *self;
        Some(kept + 1)
    }
}

/// The memory for one threshold.
#[derive(Clone, Debug)]
pub(super) struct Arms<const V: usize, const WORDS: usize> {
    block: [Arm<WORDS>; BLOCK],
    /// For each vertex, the minimal sets of states that can follow a tail that ends there.
    tails: PerVertex<[Arm<WORDS>; TAILS], V>,
    /// For each vertex, its tails: one bit for each that is kept, [`UNREAD`], or [`TOO_MANY`].
    kept: PerVertex<u8, V>,
    /// For each vertex, the states that can follow its label alone.
    ahead: PerVertex<StateSet<WORDS>, V>,
    /// The vertices whose `ahead` is valid.
    is_ahead: VertexSet,
}

/// The tails of a vertex are not read yet.
const UNREAD: u8 = 0;
/// A vertex has more minimal tails than are kept.
const TOO_MANY: u8 = 1 << TAILS;

impl<const V: usize, const WORDS: usize> Arms<V, WORDS> {
    pub(super) const fn new() -> Self {
        Self {
            block: [Arm::NONE; BLOCK],
            tails: PerVertex::filled([Arm::NONE; TAILS]),
            kept: PerVertex::filled(UNREAD),
            ahead: PerVertex::filled(StateSet::EMPTY),
            is_ahead: VertexSet::EMPTY,
        }
    }
}

impl<const V: usize, const WORDS: usize, const INDICES: usize> Consistency<V, WORDS, INDICES> {
    /// Whether max over the map's walks of min over the evidence of Eq. 3 is at most `distance`.
    ///
    /// Cost: O(V · A² · WORDS) with A minimal arms a vertex, A ≤ Δ^(⌈n/2⌉−1) for a largest degree of Δ; memory: a block
    /// of 14 arms and 6 tails a vertex, independent of A.
    pub(super) fn confirms(
        &mut self,
        map: &Map<V>,
        evidence: &impl Evidence<WORDS>,
        length: NgramLength,
        distance: u16,
    ) -> bool {
        let Self { readings, arms: Arms { block, tails, kept, ahead, is_ahead }, witnesses, .. } = self;
        if witnesses.refute_walks(map, evidence, length, distance, readings) {
            return false;
        }
        *kept = PerVertex::filled(UNREAD);
        *is_ahead = VertexSet::EMPTY;
        let mut question = Question { map, evidence, length, distance, readings, tails, kept, ahead, is_ahead };
        for vertex in map.vertices() {
            if let Err(walk) = question.confirm_at(vertex, block) {
                witnesses.remember_walk(walk);
                return false;
            }
        }
        true
    }
}

/// A map and a threshold, to be confirmed by the evidence.
struct Question<'a, E, const V: usize, const WORDS: usize, const INDICES: usize> {
    map: &'a Map<V>,
    evidence: &'a E,
    length: NgramLength,
    distance: u16,
    readings: &'a mut Readings<V, WORDS, INDICES>,
    tails: &'a mut PerVertex<[Arm<WORDS>; TAILS], V>,
    kept: &'a mut PerVertex<u8, V>,
    ahead: &'a mut PerVertex<StateSet<WORDS>, V>,
    is_ahead: &'a mut VertexSet,
}

impl<E: Evidence<WORDS>, const V: usize, const WORDS: usize, const INDICES: usize> Question<'_, E, V, WORDS, INDICES> {
    /// Whether all walks whose middle is a vertex, or an edge from it to a vertex of no smaller number, are confirmed; if
    /// not, one that is not.
    fn confirm_at(&mut self, vertex: VertexId, block: &mut [Arm<WORDS>; BLOCK]) -> Result<(), Walk> {
        let mut onward = (self.map.neighbours(vertex) - VertexSet::first(vertex.index())).iter();
        if self.length == NgramLength::MIN {
            let arm = |states, vertex| Arm { states, path: [vertex, NONE, NONE, NONE] };
            let first = arm(*self.reading(vertex, 0), vertex);
            return onward.try_for_each(|neighbour| {
                let second = arm(*self.reading(neighbour, 0), neighbour);
                self.meet(&first, &second)
            });
        }
        let odd = self.length.get() % 2 == 1;
        let mut ways = self.ways(vertex);
        let mut arm = self.next_arm(&mut ways);
        while arm.is_some() {
            let mut held = 0;
            while let Some(next) = &arm {
                let Some(now_held) = next.insert_minimal(block, held) else { break };
                held = now_held;
                arm = self.next_arm(&mut ways);
            }
            let block = block.get(..held).unwrap_or(&[]);
            if odd {
                for (first, end) in block.iter().zip(1..) {
                    block.iter().take(end).try_for_each(|other| self.meet(first, other))?;
                }
                if let Some(arm) = &arm {
                    block.iter().try_for_each(|other| self.meet(arm, other))?;
                }
                self.all_meet(block, ways.clone())?;
            } else {
                onward.clone().try_for_each(|neighbour| self.all_meet(block, self.ways(neighbour)))?;
            }
        }
        Ok(())
    }

    /// Whether two arms make walks that are confirmed; if not, the walk.
    fn meet(&self, first: &Arm<WORDS>, second: &Arm<WORDS>) -> Result<(), Walk> {
        if self.evidence.meets(self.length, &first.states, &second.states) {
            return Ok(());
        }
        let arm_vertices = usize::from(self.length.get().div_ceil(2));
        let shared = usize::from(self.length.get() % 2);
        let there = first.path.iter().take(arm_vertices).rev();
        let mut walk = [NONE; 7];
        for (slot, &vertex) in walk.iter_mut().zip(there.chain(second.path.iter().take(arm_vertices).skip(shared))) {
            *slot = vertex;
        }
        Err(walk)
    }

    /// Whether all arms along the remaining ways meet each arm of a block.
    fn all_meet(&mut self, block: &[Arm<WORDS>], mut ways: Ways) -> Result<(), Walk> {
        while let Some(arm) = self.next_arm(&mut ways) {
            block.iter().try_for_each(|other| self.meet(other, &arm))?;
        }
        Ok(())
    }

    /// The ways from the middle of a walk to where the tails of its arms begin.
    fn ways(&self, middle: VertexId) -> Ways {
        let vertices = if self.length.get() > 6 { 3 } else { 2 };
        Ways {
            path: [middle, NONE, NONE],
            waiting: [VertexSet::EMPTY, self.map.neighbours(middle), VertexSet::EMPTY],
            vertices,
            tails: VertexSet::EMPTY,
        }
    }

    /// The next arm, read from its far end to the middle of the walk.
    fn next_arm(&mut self, ways: &mut Ways) -> Option<Arm<WORDS>> {
        let number = loop {
            if let Some(number) = ways.tails.pop_first() {
                break number;
            }
            let end = ways.next(self.map)?;
            ways.tails = self.tails_at(end);
        };
        let [middle, between, far] = ways.path;
        if ways.vertices == 2 {
            let Arm { states, path: [end, begin, ..] } = self.tail(between, number);
            let states = states.intersection(self.reading(middle, self.tail_labels()));
            return Some(Arm { states, path: [middle, end, begin, NONE] });
        }
        let Arm { states, path: [end, begin, ..] } = self.tail(far, number);
        let states = states.intersection(self.reading(between, self.tail_labels()));
        let states = self.evidence.around(&states).intersection(self.reading(middle, self.tail_labels() + 1));
        Some(Arm { states, path: [middle, between, end, begin] })
    }

    /// How many labels a tail has: two, but only the last one where an arm has no more than two.
    fn tail_labels(&self) -> u8 {
        if self.length.get() > 4 { 2 } else { 1 }
    }

    /// The tails of a vertex, as a set of numbers for [`Question::tail`].
    fn tails_at(&mut self, vertex: VertexId) -> VertexSet {
        let all = if self.tail_labels() == 1 { VertexSet::first(1) } else { self.map.neighbours(vertex) };
        if self.kept[vertex] == UNREAD {
            let mut held = Some(0);
            for number in all.iter() {
                let tail = self.read_tail(vertex, number);
                held = match held {
                    Some(held) => tail.insert_minimal(&mut self.tails[vertex], held),
                    None => break,
                };
            }
            self.kept[vertex] = held.map_or(TOO_MANY, |held| (1 << held) - 1);
        }
        match self.kept[vertex] {
            TOO_MANY => all,
            kept => VertexSet::from_bits(kept.into()),
        }
    }

    fn tail(&mut self, vertex: VertexId, number: VertexId) -> Arm<WORDS> {
        if self.kept[vertex] == TOO_MANY {
            return self.read_tail(vertex, number);
        }
        self.tails[vertex].get(number.index()).copied().unwrap_or(Arm::NONE)
    }

    /// The states that can follow a tail. A tail of two labels starts at the neighbour with this number.
    fn read_tail(&mut self, vertex: VertexId, number: VertexId) -> Arm<WORDS> {
        let path = [vertex, number, NONE, NONE];
        if self.tail_labels() == 1 {
            return Arm { states: self.ahead(vertex), path };
        }
        let states = self.ahead(number).intersection(self.reading(vertex, 1));
        Arm { states: self.evidence.around(&states), path }
    }

    /// The states that can follow the label of one vertex.
    fn ahead(&mut self, vertex: VertexId) -> StateSet<WORDS> {
        if !self.is_ahead.contains(vertex) {
            self.is_ahead.insert(vertex);
            let states = *self.reading(vertex, 0);
            self.ahead[vertex] = self.evidence.around(&states);
        }
        self.ahead[vertex]
    }

    fn reading(&mut self, vertex: VertexId, index: u8) -> &StateSet<WORDS> {
        let label = (vertex, self.map.label_of(vertex));
        self.readings.at(self.evidence, self.length, label, index, self.distance)
    }
}

/// All walks of two or three vertices from a vertex, in a fixed order, and the tails at the end of the current one.
#[derive(Clone)]
struct Ways {
    path: [VertexId; 3],
    /// For every vertex of the path but the first, the alternatives that remain.
    waiting: [VertexSet; 3],
    vertices: u8,
    /// The tails at the end of the current walk that remain.
    tails: VertexSet,
}

impl Ways {
    /// Goes to the next walk; returns its last vertex.
    fn next<const V: usize>(&mut self, map: &Map<V>) -> Option<VertexId> {
        loop {
            let [_, first, second] = &mut self.waiting;
            if self.vertices == 3
                && let Some(third) = second.pop_first()
            {
                self.path[2] = third;
                return Some(third);
            }
            self.path[1] = first.pop_first()?;
            if self.vertices == 2 {
                return Some(self.path[1]);
            }
            *second = map.neighbours(self.path[1]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arm(states: &[usize]) -> Arm<2> {
        let mut arm = Arm::NONE;
        for &state in states {
            arm.states.assign(state, true);
        }
        arm
    }

    #[test]
    fn only_arms_with_minimal_states_are_held() {
        let mut arms = [Arm::NONE; 2];
        let mut held = arm(&[1, 2, 3]).insert_minimal(&mut arms, 0).unwrap();
        held = arm(&[4, 5]).insert_minimal(&mut arms, held).unwrap();
        assert_eq!(arm(&[1, 2]).insert_minimal(&mut arms, held), Some(2), "replaces the first");
        assert_eq!(arm(&[4, 5, 6]).insert_minimal(&mut arms, held), Some(2), "holds the second");
        assert!([[1, 2], [4, 5]].iter().all(|states| arms.iter().any(|held| held.states == arm(states).states)));
        assert_eq!(arm(&[7]).insert_minimal(&mut arms, held), None, "no room");
        assert_eq!(arm(&[]).insert_minimal(&mut arms, held), Some(1), "the empty set lies within all");
    }
}
