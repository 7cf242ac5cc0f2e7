//! The history of the robot: the fingerprints of the places it visited, in order (H of the paper).

use crate::place::Fingerprint;

/// The newest `32 · WORDS` fingerprints, a ring in fixed memory: 64 bytes a word.
///
/// The unit of the capacity is a word because the consistency measure computes with sets of positions, one bit each, in 32-bit
/// words.
///
/// ```
/// use toposlam::{Fingerprint, History};
///
/// let mut history = History::<8>::new();
/// for radius_mm in [1200, 800, 1500] {
///     history.push(Fingerprint::from_radius_mm(radius_mm)?);
/// }
/// assert_eq!(history.newest(0).map(Fingerprint::radius_mm), Some(1500));
/// assert_eq!((history.len(), History::<8>::CAPACITY), (3, 256));
/// # Ok::<(), toposlam::FingerprintError>(())
/// ```
#[derive(Clone, Debug)]
pub struct History<const WORDS: usize> {
    slots: [[Fingerprint; 32]; WORDS],
    /// The number of observations in total; the newest is in slot `pushed − 1` modulo the capacity.
    pushed: u32,
}

impl<const WORDS: usize> History<WORDS> {
    /// How many observations the history holds.
    pub const CAPACITY: usize = 32 * WORDS;

    /// A history without observations.
    pub const fn new() -> Self {
        const { assert!(WORDS.is_power_of_two(), "the capacity is a power of two, so that the counter can wrap") };
        Self { slots: [[Fingerprint::ZERO; 32]; WORDS], pushed: 0 }
    }

    /// Appends an observation; returns the oldest one if it was dropped. Cost: O(1).
    pub fn push(&mut self, fingerprint: Fingerprint) -> Option<Fingerprint> {
        let full = self.len() == Self::CAPACITY;
        let next = self.pushed as usize % Self::CAPACITY;
        let slot = self.slots.as_flattened_mut().get_mut(next)?;
        let dropped = core::mem::replace(slot, fingerprint);
        // Stays congruent modulo the capacity, a power of two, and above it, when the counter would overflow.
        self.pushed = self.pushed.checked_add(1).unwrap_or(1 << 31);
        full.then_some(dropped)
    }

    /// How many observations the history contains, at most [`History::CAPACITY`].
    pub fn len(&self) -> usize {
        (self.pushed as usize).min(Self::CAPACITY)
    }

    /// Whether nothing was observed yet.
    pub fn is_empty(&self) -> bool {
        self.pushed == 0
    }

    /// The observation `age` places ago, 0 for the newest; `None` beyond the oldest.
    pub fn newest(&self, age: usize) -> Option<Fingerprint> {
        if age >= self.len() {
            return None;
        }
        let slot = (self.pushed as usize).wrapping_sub(age + 1) % Self::CAPACITY;
        self.slots.as_flattened().get(slot).copied()
    }

    /// All observations, the oldest first.
    pub fn iter(&self) -> impl Iterator<Item = Fingerprint> + '_ {
        (0..self.len()).rev().filter_map(|age| self.newest(age))
    }

    /// How many observations there were in total, congruent modulo the capacity.
    #[cfg(feature = "snapshot")]
    pub(crate) fn pushed(&self) -> u32 {
        self.pushed
    }

    /// Goes back to where the observations that a history of this total holds, pushed again, give the same slots.
    #[cfg(feature = "snapshot")]
    pub(crate) fn resume(&mut self, pushed: u32) {
        self.pushed = pushed - pushed.min(Self::CAPACITY as u32);
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.pushed = 0;
    }

    /// The slots of the ring, 32 to a word; those that hold nothing yet are zero.
    pub(crate) fn slots(&self) -> &[[Fingerprint; 32]; WORDS] {
        &self.slots
    }

    /// The slot of the newest observation; 0 when there is none.
    pub(crate) fn newest_slot(&self) -> usize {
        (self.pushed as usize).wrapping_sub(1) % Self::CAPACITY
    }

    /// The slot after the newest observation: that of the oldest one in a full ring, else a free one.
    pub(crate) fn slot_behind_newest(&self) -> usize {
        self.pushed as usize % Self::CAPACITY
    }
}

impl<const WORDS: usize> Default for History<WORDS> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fingerprint(steps: u16) -> Fingerprint {
        Fingerprint::from_steps(steps).unwrap()
    }

    #[test]
    fn a_full_history_drops_the_oldest_and_reports_it() {
        let mut history = History::<1>::new();
        for steps in 0..32 {
            assert_eq!(history.push(fingerprint(steps)), None);
        }
        assert_eq!(history.push(fingerprint(32)), Some(fingerprint(0)));
        assert_eq!(history.len(), 32);
        assert!(history.iter().eq((1..=32).map(fingerprint)));
        assert_eq!(history.newest(0), Some(fingerprint(32)));
        assert_eq!(history.newest(31), Some(fingerprint(1)));
        assert_eq!(history.newest(32), None);
    }

    #[test]
    fn the_ring_continues_when_its_counter_overflows() {
        let mut history = History::<2>::new();
        history.pushed = u32::MAX;
        for steps in 0..100 {
            history.push(fingerprint(steps));
        }
        assert!(history.iter().eq((36..100).map(fingerprint)));
    }
}
