//! A set of states of the evidence: one bit for each state that the reading of a sequence of labels can reach.

/// A set of up to `32 · WORDS` states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateSet<const WORDS: usize>([u32; WORDS]);

impl<const WORDS: usize> StateSet<WORDS> {
    pub(super) const EMPTY: Self = Self([0; WORDS]);

    /// The set whose words come from an iterator; missing ones are empty.
    pub(super) fn from_words(words: impl Iterator<Item = u32>) -> Self {
        let mut set = Self::EMPTY;
        for (word, value) in set.0.iter_mut().zip(words) {
            *word = value;
        }
        set
    }

    pub(super) fn assign(&mut self, state: usize, member: bool) {
        if let Some(word) = self.0.get_mut(state / 32) {
            let bit = 1 << (state % 32);
            *word = if member { *word | bit } else { *word & !bit };
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.iter().all(|&word| word == 0)
    }

    /// The first state that another set has and this one lacks.
    pub(super) fn first_missing(&self, wanted: &Self) -> Option<usize> {
        let mut missing = self.0.iter().zip(wanted.0).map(|(word, wanted)| wanted & !word).enumerate();
        missing.find(|&(_, word)| word != 0).map(|(index, word)| 32 * index + word.trailing_zeros() as usize)
    }

    pub(super) fn contains(&self, state: usize) -> bool {
        self.0.get(state / 32).is_some_and(|word| word >> (state % 32) & 1 == 1)
    }

    pub(super) fn insert_all(&mut self, other: &Self) {
        for (word, more) in self.0.iter_mut().zip(other.0) {
            *word |= more;
        }
    }

    pub(super) fn intersection(mut self, other: &Self) -> Self {
        for (word, mask) in self.0.iter_mut().zip(other.0) {
            *word &= mask;
        }
        self
    }

    pub(super) fn intersects(&self, other: &Self) -> bool {
        self.0.iter().zip(other.0).any(|(word, mask)| word & mask != 0)
    }

    pub(super) fn contains_all(&self, other: &Self) -> bool {
        self.0.iter().zip(other.0).all(|(word, wanted)| wanted & !word == 0)
    }

    /// Every state moved to the next number; the last one becomes the first.
    pub(super) fn rotated_up(&self) -> Self {
        let mut moved = Self::EMPTY;
        let mut before = self.0.last().copied().unwrap_or(0);
        for (word, &own) in moved.0.iter_mut().zip(&self.0) {
            *word = own << 1 | before >> 31;
            before = own;
        }
        moved
    }

    /// Every state moved to the next number and to the one before; the first and the last are next to each other.
    pub(super) fn rotated_both_ways(&self) -> Self {
        let mut moved = Self::EMPTY;
        let mut before = self.0.last().copied().unwrap_or(0);
        let behind = self.0.iter().skip(1).chain(self.0.first());
        for ((word, &own), &next) in moved.0.iter_mut().zip(&self.0).zip(behind) {
            *word = own << 1 | before >> 31 | own >> 1 | next << 31;
            before = own;
        }
        moved
    }

    /// The lower half of the states exchanged with the upper half.
    pub(super) fn halves_swapped(&self) -> Self {
        let (lower, upper) = self.0.split_at(WORDS / 2);
        Self::from_words(upper.iter().chain(lower).copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(states: &[usize]) -> StateSet<2> {
        let mut set = StateSet::EMPTY;
        for &state in states {
            set.assign(state, true);
        }
        set
    }

    #[test]
    fn states_move_around_the_ring_either_way() {
        assert_eq!(set(&[0, 31, 63]).rotated_up(), set(&[1, 32, 0]));
        assert_eq!(set(&[0, 32]).rotated_both_ways(), set(&[63, 1, 31, 33]));
        assert_eq!(set(&[63]).rotated_both_ways(), set(&[62, 0]));
        assert_eq!(set(&[1, 33]).halves_swapped(), set(&[33, 1]));
    }
}
