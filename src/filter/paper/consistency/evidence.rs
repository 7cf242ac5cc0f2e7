//! Sets of n-grams (Γ of the paper) that are read label by label: the history on line, or a table.
//!
//! Reading a sequence of labels ends in a set of *states*. For a history a state is a position: the next label is read at the
//! position before or after, because the robot may turn back anywhere. For a table a state is an n-gram in one of its two
//! directions; the second half of the states is the first half reversed.

use super::state_set::StateSet;
use crate::filter::{History, NgramLength, NgramTable};

/// A set of n-grams to compare a map with: a [`History`] or an [`NgramTable`].
pub trait Evidence<const WORDS: usize>: Readable<WORDS> {}

impl<const WORDS: usize> Evidence<WORDS> for History<WORDS> {}
impl<const WORDS: usize> Evidence<WORDS> for NgramTable<WORDS> {}

/// The operations of the consistency measure on a set of n-grams.
pub trait Readable<const WORDS: usize> {
    /// The number of labels of a straight reading, which goes in one direction: `n`, or less for a shorter history; 0 for an empty
    /// set.
    fn straight_labels(&self, length: NgramLength) -> u8;

    /// The states whose label number `index` lies within the range of steps, both ends included.
    fn reading(&self, length: NgramLength, index: u8, range_steps: (u16, u16)) -> StateSet<WORDS>;

    /// The states that a reading can reach with one more label, in either direction.
    fn around(&self, states: &StateSet<WORDS>) -> StateSet<WORDS>;

    /// The states that a straight reading reaches with one more label.
    fn onward(&self, states: &StateSet<WORDS>) -> StateSet<WORDS>;

    /// The states at which the straight readings of the whole set end.
    fn ends(&self, straight_labels: u8) -> StateSet<WORDS>;

    /// Label number `index` of the straight reading that ends at a state, in the n-gram's steps; `None` when no straight
    /// reading ends there.
    fn straight_label(&self, length: NgramLength, end: usize, index: u8) -> Option<u16>;

    /// Whether two readings from either end make one n-gram: they share their last label when `n` is odd, and are one
    /// step apart when it is even.
    fn meets(&self, length: NgramLength, first: &StateSet<WORDS>, second: &StateSet<WORDS>) -> bool;
}

fn within(steps: u16, (low, high): (u16, u16)) -> bool {
    steps.wrapping_sub(low) <= high.wrapping_sub(low)
}

impl<const WORDS: usize> Readable<WORDS> for History<WORDS> {
    fn straight_labels(&self, length: NgramLength) -> u8 {
        // Every walk to and fro stays inside n successive positions, so the straight ones are matched last.
        if self.len() < 2 { 0 } else { length.get().min(u8::try_from(self.len()).unwrap_or(u8::MAX)) }
    }

    fn reading(&self, _: NgramLength, _: u8, range_steps: (u16, u16)) -> StateSet<WORDS> {
        let mut left = self.len();
        StateSet::from_words(self.slots().iter().map(|slots| {
            let word =
                slots.iter().rev().fold(0, |word, label| word << 1 | u32::from(within(label.steps(), range_steps)));
            let valid = if left >= 32 { u32::MAX } else { (1 << left) - 1 };
            left = left.saturating_sub(32);
            word & valid
        }))
    }

    fn around(&self, states: &StateSet<WORDS>) -> StateSet<WORDS> {
        let mut around = states.rotated_both_ways();
        // The newest and the oldest position are no neighbours.
        let (newest, oldest) = (self.newest_slot(), self.slot_behind_newest());
        around.assign(newest, states.contains((newest + Self::CAPACITY - 1) % Self::CAPACITY));
        around.assign(oldest, states.contains((oldest + 1) % Self::CAPACITY));
        around
    }

    fn onward(&self, states: &StateSet<WORDS>) -> StateSet<WORDS> {
        let mut forth = states.rotated_up();
        forth.assign(self.slot_behind_newest(), false);
        forth
    }

    fn ends(&self, straight_labels: u8) -> StateSet<WORDS> {
        let mut ends = StateSet::from_words((0..WORDS).map(|_| u32::MAX));
        let oldest = (self.newest_slot() + 1 + Self::CAPACITY - self.len()) % Self::CAPACITY;
        for age in 1..usize::from(straight_labels) {
            ends.assign((oldest + age - 1) % Self::CAPACITY, false);
        }
        for unused in self.len()..Self::CAPACITY {
            ends.assign(unused, false);
        }
        ends
    }

    fn straight_label(&self, length: NgramLength, end: usize, index: u8) -> Option<u16> {
        let labels = usize::from(self.straight_labels(length));
        let end_age = (self.newest_slot() + Self::CAPACITY).checked_sub(end)? % Self::CAPACITY;
        let start_age = end_age + labels.checked_sub(1)?;
        let label = self.newest(start_age).and(self.newest(start_age.checked_sub(usize::from(index))?))?;
        Some(label.steps() >> length.coarsening())
    }

    fn meets(&self, length: NgramLength, first: &StateSet<WORDS>, second: &StateSet<WORDS>) -> bool {
        if length.get() % 2 == 1 { first.intersects(second) } else { self.around(first).intersects(second) }
    }
}

impl<const WORDS: usize> Readable<WORDS> for NgramTable<WORDS> {
    fn straight_labels(&self, length: NgramLength) -> u8 {
        if self.is_empty() { 0 } else { length.get() }
    }

    fn reading(&self, length: NgramLength, index: u8, range_steps: (u16, u16)) -> StateSet<WORDS> {
        let coarse = (range_steps.0 >> length.coarsening(), range_steps.1 >> length.coarsening());
        let direction = |index: u8| {
            let mut words = self.ngrams().chunks(32).map(move |ngrams| {
                let label = |word, ngram: &crate::filter::Ngram| {
                    word << 1 | u32::from(within(ngram.label(length, index), coarse))
                };
                ngrams.iter().rev().fold(0, label)
            });
            (0..WORDS / 2).map(move |_| words.next().unwrap_or(0))
        };
        let mirrored = length.get().wrapping_sub(1).wrapping_sub(index);
        StateSet::from_words(direction(index).chain(direction(mirrored)))
    }

    fn around(&self, states: &StateSet<WORDS>) -> StateSet<WORDS> {
        *states
    }

    fn onward(&self, states: &StateSet<WORDS>) -> StateSet<WORDS> {
        *states
    }

    fn ends(&self, _: u8) -> StateSet<WORDS> {
        let mut left = self.len();
        StateSet::from_words((0..WORDS / 2).map(|_| {
            let word = if left >= 32 { u32::MAX } else { (1 << left) - 1 };
            left = left.saturating_sub(32);
            word
        }))
    }

    fn straight_label(&self, length: NgramLength, end: usize, index: u8) -> Option<u16> {
        self.ngrams().get(end).map(|ngram| ngram.label(length, index))
    }

    fn meets(&self, _: NgramLength, first: &StateSet<WORDS>, second: &StateSet<WORDS>) -> bool {
        first.intersects(&second.halves_swapped())
    }
}
