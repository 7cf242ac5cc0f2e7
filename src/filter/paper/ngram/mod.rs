//! Sequences of `n` fingerprints, packed into one word (Definitions 3 to 5 of the paper).

mod table;

pub use table::{NgramTable, NgramsFull};

use crate::place::Fingerprint;
use core::fmt;

/// How many labels an n-gram has: 2 to 7. An odd `n = 2k + 1` distinguishes places by their neighbourhood of depth `k`.
///
/// An n-gram is one `u64`, so up to `n` = 5 its labels keep all 12 bits of a fingerprint; at 6 they keep 10 (steps of
/// 8 mm) and at 7 they keep 9 (steps of 16 mm).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct NgramLength(u8);

impl NgramLength {
    /// The smallest length.
    pub const MIN: Self = Self(2);
    /// The largest length.
    pub const MAX: Self = Self(7);

    /// A checked length.
    ///
    /// # Errors
    /// [`NgramError::Length`] outside 2 to 7.
    pub const fn new(labels: u8) -> Result<Self, NgramError> {
        if labels < Self::MIN.0 || labels > Self::MAX.0 { Err(NgramError::Length { labels }) } else { Ok(Self(labels)) }
    }

    /// The number of labels.
    pub const fn get(self) -> u8 {
        self.0
    }

    /// How many bits of a label an n-gram keeps.
    pub const fn bits_per_label(self) -> u32 {
        match self.0 {
            7.. => 9,
            6 => 10,
            _ => Fingerprint::BITS,
        }
    }

    /// How many low bits of a fingerprint an n-gram of this length drops.
    pub(crate) const fn coarsening(self) -> u32 {
        Fingerprint::BITS - self.bits_per_label()
    }

    /// The width of one step of a label in an n-gram of this length, in millimetres: the unit of Eq. 2 and 3.
    pub const fn label_step_mm(self) -> u16 {
        Fingerprint::STEP_MM << self.coarsening()
    }
}

/// A sequence of labels, packed into one word and equal to its reversal: the robot may pass it either way.
///
/// ```
/// use toposlam::{Fingerprint, Ngram, NgramLength};
///
/// let [hall, office] = [Fingerprint::from_radius_mm(1200)?, Fingerprint::from_radius_mm(800)?];
/// let length = NgramLength::new(2)?;
/// assert_eq!(Ngram::new(length, &[hall, office])?, Ngram::new(length, &[office, hall])?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ngram(u64);

impl Ngram {
    /// Packs labels, coarsened to what the length leaves room for.
    ///
    /// # Errors
    /// [`NgramError::Labels`] when their number is not the length.
    pub fn new(length: NgramLength, labels: &[Fingerprint]) -> Result<Self, NgramError> {
        if labels.len() != usize::from(length.get()) {
            return Err(NgramError::Labels);
        }
        Ok(Self::pack(length, labels.iter().copied()))
    }

    /// Packs as many labels as it is given; the caller sees to it that they are `length` many.
    pub(crate) fn pack(length: NgramLength, labels: impl DoubleEndedIterator<Item = Fingerprint> + Clone) -> Self {
        let append = |word: u64, label: Fingerprint| {
            word << length.bits_per_label() | u64::from(label.steps() >> length.coarsening())
        };
        let forward = labels.clone().fold(0, append);
        let backward = labels.rev().fold(0, append);
        Self(forward.min(backward))
    }

    /// The label at an index, 0 to `length − 1`, in the steps of [`NgramLength::label_step_mm`].
    pub const fn label(self, length: NgramLength, index: u8) -> u16 {
        let bits = length.bits_per_label();
        let behind = length.0.wrapping_sub(1).wrapping_sub(index) as u32;
        (self.0.wrapping_shr(behind.wrapping_mul(bits)) & ((1 << bits) - 1)) as u16
    }
}

/// Why something is no n-gram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NgramError {
    /// The length is not in 2 to 7.
    Length {
        /// The number of labels that was asked for.
        labels: u8,
    },
    /// The number of labels is not the length of the n-gram.
    Labels,
}

impl fmt::Display for NgramError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { labels } => write!(f, "an n-gram has 2 to 7 labels, not {labels}"),
            Self::Labels => f.write_str("the number of labels is not the length of the n-gram"),
        }
    }
}

impl core::error::Error for NgramError {}

#[cfg(test)]
mod tests {
    use super::*;

    fn fingerprints(steps: &[u16]) -> Vec<Fingerprint> {
        steps.iter().map(|&steps| Fingerprint::from_steps(steps).unwrap()).collect()
    }

    #[test]
    fn an_ngram_equals_its_reversal() {
        let length = NgramLength::new(3).unwrap();
        let there = Ngram::new(length, &fingerprints(&[1, 2, 3])).unwrap();
        let back = Ngram::new(length, &fingerprints(&[3, 2, 1])).unwrap();
        assert_eq!(there, back);
        assert_ne!(there, Ngram::new(length, &fingerprints(&[2, 1, 3])).unwrap());
    }

    #[test]
    fn labels_come_back_as_far_as_their_bits_reach() {
        let steps = [1, 4094, 7, 300, 1024, 1023, 2000];
        for labels in 2..=7 {
            let length = NgramLength::new(labels).unwrap();
            let kept = &steps[..usize::from(labels)];
            let ngram = Ngram::new(length, &fingerprints(kept)).unwrap();
            let unpacked: Vec<_> = (0..labels).map(|index| ngram.label(length, index)).collect();
            let coarse: Vec<_> = kept.iter().map(|steps| steps >> length.coarsening()).collect();
            let reversed: Vec<_> = coarse.iter().rev().copied().collect();
            assert!(unpacked == coarse || unpacked == reversed, "{unpacked:?} {coarse:?}");
        }
    }

    #[test]
    fn wrong_lengths_are_refused() {
        assert_eq!(NgramLength::new(1), Err(NgramError::Length { labels: 1 }));
        assert_eq!(NgramLength::new(8), Err(NgramError::Length { labels: 8 }));
        let length = NgramLength::new(2).unwrap();
        assert_eq!(Ngram::new(length, &fingerprints(&[1, 2, 3])), Err(NgramError::Labels));
    }
}
