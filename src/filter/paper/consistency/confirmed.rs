//! From the map to the evidence: is every walk of the map near some n-gram of the evidence?
//!
//! A walk of `n` vertices is two *arms* of `⌈n/2⌉` vertices that meet: at one vertex when `n` is odd, over an edge when it
//! is even. It is confirmed when the states that either arm may have been read to meet as well. Of the arms that end at a
//! vertex only those with minimal sets of states matter: what meets a set meets all that it lies within.

use super::{Consistency, evidence::Evidence, readings::Readings, state_set::StateSet, witness::Walk};
use crate::{Map, NgramLength, map::bits};

/// How many arms are held at once; more are taken in blocks.
const BLOCK: usize = 14;

/// How many minimal tails of a vertex are kept; the tails of a vertex with more are read anew each time.
const TAILS: usize = 6;

/// A reading along some vertices, and the states it may have got to.
#[derive(Clone, Copy, Debug)]
struct Arm<const WORDS: usize> {
    states: StateSet<WORDS>,
    /// The vertices, that of the last label first.
    path: [u8; LONGEST_ARM],
}

/// The vertices of the longest arm.
const LONGEST_ARM: usize = NgramLength::MAX.get().div_ceil(2) as usize;

impl<const WORDS: usize> Arm<WORDS> {
    const NONE: Self = Self { states: StateSet::EMPTY, path: [0; LONGEST_ARM] };

    /// Adds this arm to a list of arms with minimal states, unless one of them has its states within those of this one;
    /// those that have these states within theirs leave. The number of arms in the list is returned, or `None` when
    /// there is no room; then nothing that mattered has left.
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

/// The scratch memory of one question.
#[derive(Clone, Debug)]
pub(super) struct Arms<const V: usize, const WORDS: usize> {
    block: [Arm<WORDS>; BLOCK],
    /// For each vertex, where the readings of a tail that ends there may go on to: the minimal ones.
    tails: [[Arm<WORDS>; TAILS]; V],
    /// For each vertex, the tails it has: bits of kept ones, [`UNREAD`], or [`TOO_MANY`].
    kept: [u8; V],
    /// For each vertex, where the reading of its label alone may go on to.
    ahead: [StateSet<WORDS>; V],
    /// The vertices whose `ahead` was read.
    is_ahead: u64,
}

/// The tails of a vertex were not asked for yet.
const UNREAD: u8 = 0;
/// A vertex has more minimal tails than are kept.
const TOO_MANY: u8 = 1 << TAILS;

impl<const V: usize, const WORDS: usize> Arms<V, WORDS> {
    pub(super) const fn new() -> Self {
        Self {
            block: [Arm::NONE; BLOCK],
            tails: [[Arm::NONE; TAILS]; V],
            kept: [UNREAD; V],
            ahead: [StateSet::EMPTY; V],
            is_ahead: 0,
        }
    }
}

impl<const V: usize, const WORDS: usize, const INDICES: usize> Consistency<V, WORDS, INDICES> {
    /// Whether max over the map's walks of min over the evidence of Eq. 3 is at most `distance`.
    ///
    /// Cost: O(V · A² · WORDS) with A minimal arms a vertex, A ≤ Δ^(⌈n/2⌉−1) for a largest degree of Δ; memory: a block
    /// of 14 arms and 6 tails a vertex, whatever A is.
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
        kept.fill(UNREAD);
        *is_ahead = 0;
        let mut question = Question { map, evidence, length, distance, readings, tails, kept, ahead, is_ahead };
        for vertex in 0..map.vertices() {
            if let Err(walk) = question.confirm_at(vertex, block) {
                witnesses.remember_walk(walk);
                return false;
            }
        }
        true
    }
}

/// A map and a distance held against evidence.
struct Question<'a, E, const V: usize, const WORDS: usize, const INDICES: usize> {
    map: &'a Map<V>,
    evidence: &'a E,
    length: NgramLength,
    distance: u16,
    readings: &'a mut Readings<V, WORDS, INDICES>,
    tails: &'a mut [[Arm<WORDS>; TAILS]; V],
    kept: &'a mut [u8; V],
    ahead: &'a mut [StateSet<WORDS>; V],
    is_ahead: &'a mut u64,
}

impl<E: Evidence<WORDS>, const V: usize, const WORDS: usize, const INDICES: usize> Question<'_, E, V, WORDS, INDICES> {
    /// Whether all walks whose middle is a vertex, or an edge from it to a vertex of no smaller number, are confirmed; if
    /// not, one that is not.
    fn confirm_at(&mut self, vertex: u8, block: &mut [Arm<WORDS>; BLOCK]) -> Result<(), Walk> {
        let mut onward = bits(self.map.neighbours(vertex) >> vertex << vertex);
        if self.length == NgramLength::MIN {
            let arm = |states, vertex| Arm { states, path: [vertex, 0, 0, 0] };
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
        let mut walk = [0; 7];
        for (slot, &vertex) in walk.iter_mut().zip(there.chain(second.path.iter().take(arm_vertices).skip(shared))) {
            *slot = vertex;
        }
        Err(walk)
    }

    /// Whether all arms along the ways that are still to come meet each of a block.
    fn all_meet(&mut self, block: &[Arm<WORDS>], mut ways: Ways) -> Result<(), Walk> {
        while let Some(arm) = self.next_arm(&mut ways) {
            block.iter().try_for_each(|other| self.meet(other, &arm))?;
        }
        Ok(())
    }

    /// The ways from the middle of a walk to where the tails of its arms begin.
    fn ways(&self, middle: u8) -> Ways {
        let vertices = if self.length.get() > 6 { 3 } else { 2 };
        Ways { path: [middle, 0, 0], waiting: [0, self.map.neighbours(middle), 0], vertices, tails: 0 }
    }

    /// The next arm, read from its far end to the middle of the walk.
    fn next_arm(&mut self, ways: &mut Ways) -> Option<Arm<WORDS>> {
        while ways.tails == 0 {
            let end = ways.next(self.map)?;
            ways.tails = self.tails_at(end);
        }
        let number = ways.tails.trailing_zeros() as u8;
        ways.tails &= ways.tails - 1;
        let [middle, between, far] = ways.path;
        if ways.vertices == 2 {
            let Arm { states, path: [end, begin, ..] } = self.tail(between, number);
            let states = states.intersection(self.reading(middle, self.tail_labels()));
            return Some(Arm { states, path: [middle, end, begin, 0] });
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

    /// The tails of a vertex, as a row of numbers for [`Question::tail`].
    fn tails_at(&mut self, vertex: u8) -> u64 {
        let slot = usize::from(vertex);
        let row = if self.tail_labels() == 1 { 1 } else { self.map.neighbours(vertex) };
        if self.kept.get(slot) == Some(&UNREAD) {
            let mut held = Some(0);
            for number in bits(row) {
                let tail = self.read_tail(vertex, number);
                held = match (held, self.tails.get_mut(slot)) {
                    (Some(held), Some(tails)) => tail.insert_minimal(tails, held),
                    _ => break,
                };
            }
            if let Some(kept) = self.kept.get_mut(slot) {
                *kept = held.map_or(TOO_MANY, |held| (1 << held) - 1);
            }
        }
        match self.kept.get(slot) {
            Some(&kept) if kept != TOO_MANY => u64::from(kept),
            _ => row,
        }
    }

    fn tail(&mut self, vertex: u8, number: u8) -> Arm<WORDS> {
        let slot = usize::from(vertex);
        if self.kept.get(slot) == Some(&TOO_MANY) {
            return self.read_tail(vertex, number);
        }
        self.tails.get(slot).and_then(|tails| tails.get(usize::from(number))).copied().unwrap_or(Arm::NONE)
    }

    /// Where the reading of a tail may go on to: a tail of two labels begins at the neighbour with a number.
    fn read_tail(&mut self, vertex: u8, number: u8) -> Arm<WORDS> {
        let path = [vertex, number, 0, 0];
        if self.tail_labels() == 1 {
            return Arm { states: self.ahead(vertex), path };
        }
        let states = self.ahead(number).intersection(self.reading(vertex, 1));
        Arm { states: self.evidence.around(&states), path }
    }

    /// Where the reading of the label of one vertex may go on to.
    fn ahead(&mut self, vertex: u8) -> StateSet<WORDS> {
        let bit = 1 << (vertex & 63);
        if *self.is_ahead & bit == 0 {
            *self.is_ahead |= bit;
            let states = *self.reading(vertex, 0);
            if let Some(ahead) = self.ahead.get_mut(usize::from(vertex)) {
                *ahead = self.evidence.around(&states);
            }
        }
        self.ahead.get(usize::from(vertex)).copied().unwrap_or(StateSet::EMPTY)
    }

    fn reading(&mut self, vertex: u8, index: u8) -> &StateSet<WORDS> {
        let label = (vertex, self.map.label_of(vertex));
        self.readings.at(self.evidence, self.length, label, index, self.distance)
    }
}

/// All walks of two or three vertices that start at a vertex, in a fixed order, and the tails at the end of the current.
#[derive(Clone)]
struct Ways {
    path: [u8; 3],
    /// For every vertex of the path but the first, its brothers that are still to come.
    waiting: [u64; 3],
    vertices: u8,
    /// The tails at the end of the current walk that are still to come.
    tails: u64,
}

impl Ways {
    /// Goes to the next walk; returns its last vertex.
    fn next<const V: usize>(&mut self, map: &Map<V>) -> Option<u8> {
        loop {
            let [_, first, second] = &mut self.waiting;
            if self.vertices == 3 && *second != 0 {
                self.path[2] = second.trailing_zeros() as u8;
                *second &= *second - 1;
                return Some(self.path[2]);
            }
            if *first == 0 {
                return None;
            }
            self.path[1] = first.trailing_zeros() as u8;
            *first &= *first - 1;
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
