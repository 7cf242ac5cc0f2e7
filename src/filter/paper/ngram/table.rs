//! A bounded set of n-grams, sorted in fixed memory: Grams_H of the paper, built as the history grows.

use super::{Ngram, NgramLength};
use crate::filter::History;
use crate::place::Fingerprint;

/// A sorted set of at most `16 · WORDS` n-grams: 128 bytes a word.
///
/// The unit of the capacity is a word because the consistency measure computes with sets of n-grams, one bit for each n-gram and
/// direction of travel, in 32-bit words.
///
/// ```
/// use toposlam::{Fingerprint, History, NgramLength, NgramTable};
///
/// // A corridor from 800 mm to 1200 mm to 1500 mm: the robot may drive on or turn back anywhere.
/// let mut history = History::<1>::new();
/// let mut grams = NgramTable::<2>::new(NgramLength::new(3)?);
/// for radius_mm in [800, 1200, 1500] {
///     history.push(Fingerprint::from_radius_mm(radius_mm)?);
///     grams.extend(&history)?;
/// }
/// // 800-1200-1500 and the U-turns 800-1200-800, 1200-800-1200, 1200-1500-1200, 1500-1200-1500.
/// assert_eq!(grams.len(), 5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct NgramTable<const WORDS: usize> {
    length: NgramLength,
    ngrams: [[Ngram; 16]; WORDS],
    count: u16,
}

impl<const WORDS: usize> NgramTable<WORDS> {
    /// The largest number of n-grams.
    pub const CAPACITY: usize = 16 * WORDS;

    /// An empty table of n-grams of one length.
    pub const fn new(length: NgramLength) -> Self {
        const { assert!(WORDS.is_multiple_of(2) && WORDS <= 1024, "each direction of travel takes half of the words") };
        Self { length, ngrams: [[Ngram(0); 16]; WORDS], count: 0 }
    }

    /// The length of the n-grams.
    pub const fn length(&self) -> NgramLength {
        self.length
    }

    /// How many n-grams there are.
    pub fn len(&self) -> usize {
        usize::from(self.count)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The n-grams in ascending order.
    pub fn ngrams(&self) -> &[Ngram] {
        self.ngrams.as_flattened().get(..self.len()).unwrap_or(&[])
    }

    /// Adds an n-gram of the table's length; returns whether it is new. Cost: O(capacity).
    ///
    /// # Errors
    /// [`NgramsFull`] if there is no room for it; the table does not change then.
    pub fn insert(&mut self, ngram: Ngram) -> Result<bool, NgramsFull> {
        let Err(place) = self.ngrams().binary_search(&ngram) else { return Ok(false) };
        if self.len() >= Self::CAPACITY {
            return Err(NgramsFull);
        }
        let behind = self.len() - place;
        let mut next = ngram;
        for slot in self.ngrams.as_flattened_mut().iter_mut().skip(place).take(behind + 1) {
            core::mem::swap(slot, &mut next);
        }
        self.count += 1;
        Ok(true)
    }

    /// Adds the n-grams that the newest observation of a history adds: the labels of all walks of `n` places along the history,
    /// with turns anywhere, that reach the newest observation. Called after
    /// every observation, the table is Grams_H of the whole history (Definition 4). Cost: O(n² · 2ⁿ) plus an insertion
    /// for each new n-gram.
    ///
    /// # Errors
    /// [`NgramsFull`] if some did not fit; the others were added.
    pub fn extend<const POSITIONS: usize>(&mut self, history: &History<POSITIONS>) -> Result<(), NgramsFull> {
        let labels = self.length.get();
        let mut result = Ok(());
        for turns in 0..1_u8 << (labels - 1) {
            for start_age in 0..labels {
                if let Some(ngram) = self.walk(history, turns, start_age)
                    && let Err(full) = self.insert(ngram)
                {
                    result = Err(full);
                }
            }
        }
        result
    }

    /// The n-gram of one walk on the line of the history: it starts `start_age` places ago and goes to an older place
    /// where a bit of `turns` is set, else to a newer one. `None` when it leaves the history or misses its newest place.
    fn walk<const POSITIONS: usize>(&self, history: &History<POSITIONS>, turns: u8, start_age: u8) -> Option<Ngram> {
        let mut labels = [Fingerprint::ZERO; NgramLength::MAX.0 as usize];
        let mut age = start_age;
        let mut youngest = start_age;
        for (step, label) in labels.iter_mut().take(usize::from(self.length.get())).enumerate() {
            if step > 0 {
                let older = turns >> (step - 1) & 1 == 1;
                age = if older { age + 1 } else { age.checked_sub(1)? };
            }
            youngest = youngest.min(age);
            *label = history.newest(usize::from(age))?;
        }
        let walked = labels.get(..usize::from(self.length.get()))?;
        (youngest == 0).then(|| Ngram::pack(self.length, walked.iter().copied()))
    }

    /// Forgets all n-grams.
    pub fn clear(&mut self) {
        self.count = 0;
    }
}

/// The table already has as many n-grams as it can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NgramsFull;

impl core::fmt::Display for NgramsFull {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the n-gram table has no room for another n-gram")
    }
}

impl core::error::Error for NgramsFull {}

#[cfg(test)]
mod tests {
    use super::*;

    fn ngram(length: NgramLength, steps: &[u16]) -> Ngram {
        let labels: Vec<_> = steps.iter().map(|&steps| Fingerprint::from_steps(steps).unwrap()).collect();
        Ngram::new(length, &labels).unwrap()
    }

    #[test]
    fn ngrams_are_sorted_and_held_once() {
        let length = NgramLength::new(2).unwrap();
        let mut table = NgramTable::<2>::new(length);
        for steps in [[5, 6], [1, 2], [6, 5], [3, 3]] {
            table.insert(ngram(length, &steps)).unwrap();
        }
        assert_eq!(table.ngrams(), [ngram(length, &[1, 2]), ngram(length, &[3, 3]), ngram(length, &[5, 6])]);
        assert_eq!(table.insert(ngram(length, &[2, 1])), Ok(false));
    }

    #[test]
    fn a_full_table_reports_it_and_keeps_its_ngrams() {
        let length = NgramLength::new(2).unwrap();
        let mut table = NgramTable::<2>::new(length);
        for steps in 0..32 {
            assert_eq!(table.insert(ngram(length, &[steps, 100])), Ok(true));
        }
        let before = table.ngrams().to_vec();
        assert_eq!(table.insert(ngram(length, &[40, 100])), Err(NgramsFull));
        assert_eq!(table.insert(ngram(length, &[7, 100])), Ok(false));
        assert_eq!(table.ngrams(), before);
    }

    #[test]
    fn a_table_of_a_history_has_its_walks_with_turns() {
        let length = NgramLength::new(3).unwrap();
        let mut history = History::<1>::new();
        let mut table = NgramTable::<2>::new(length);
        for steps in [1, 2, 3] {
            history.push(Fingerprint::from_steps(steps).unwrap());
            table.extend(&history).unwrap();
        }
        let expected = [[1, 2, 1], [1, 2, 3], [2, 1, 2], [2, 3, 2], [3, 2, 3]].map(|steps| ngram(length, &steps));
        assert_eq!(table.ngrams(), expected);
    }
}
