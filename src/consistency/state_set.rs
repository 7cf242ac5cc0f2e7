//! A set of states of the evidence: one bit for each place where reading a sequence of labels may have got to.

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
        let mut moved = *self;
        let mut carry = self.0.last().map_or(0, |word| word >> 31);
        for word in &mut moved.0 {
            let next = *word >> 31;
            *word = *word << 1 | carry;
            carry = next;
        }
        moved
    }

    /// Every state moved to the number before; the first one becomes the last.
    pub(super) fn rotated_down(&self) -> Self {
        let mut moved = *self;
        let mut carry = self.0.first().map_or(0, |word| word << 31);
        for word in moved.0.iter_mut().rev() {
            let next = *word << 31;
            *word = *word >> 1 | carry;
            carry = next;
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
        assert_eq!(set(&[0, 32, 63]).rotated_down(), set(&[63, 31, 62]));
        assert_eq!(set(&[1, 33]).halves_swapped(), set(&[33, 1]));
    }
}
