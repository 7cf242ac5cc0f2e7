//! The newest observations, packed: what every hypothesis explains.

use crate::{Fingerprint, Observation, Turn};

/// The largest degree that is told apart; larger ones count as this.
pub(crate) const DEGREE_MAX: u8 = 7;

const TURN_BACK: u8 = 1;
const TURN_ON: u8 = 2;
const DEGREE_SHIFT: u8 = 2;
const BEGINS: u8 = 1 << 5;
const CARRIED: u8 = 1 << 6;

/// The newest `T` observations, the oldest first: 3 bytes each.
#[derive(Clone, Debug)]
pub(crate) struct Record<const T: usize> {
    pub(crate) steps: [u16; T],
    /// Turn in bits 0 and 1, degree in bits 2 to 4, bit 5 for the first place of a sequence, bit 6 where
    /// the robot seems to have been carried.
    pub(crate) hints: [u8; T],
    pub(crate) len: usize,
}

/// One observation as the inference reads it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Entry {
    pub(crate) steps: u16,
    hints: u8,
}

impl Entry {
    pub(crate) const fn begins(self) -> bool {
        self.hints & (BEGINS | CARRIED) != 0
    }

    pub(crate) const fn turn(self) -> Option<Turn> {
        match self.hints & 3 {
            TURN_BACK => Some(Turn::Back),
            TURN_ON => Some(Turn::On),
            _ => None,
        }
    }

    /// Whether an entry can have these hints.
    #[cfg(feature = "snapshot")]
    pub(crate) const fn is_possible(hints: u8) -> bool {
        hints & 3 <= TURN_ON && hints < 1 << 7
    }

    /// The degree, 1 to [`DEGREE_MAX`]; 0 when it is unknown.
    pub(crate) const fn degree(self) -> u8 {
        self.hints >> DEGREE_SHIFT & DEGREE_MAX
    }
}

impl<const T: usize> Record<T> {
    pub(crate) const fn new() -> Self {
        Self { steps: [0; T], hints: [0; T], len: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(crate) fn is_full(&self) -> bool {
        self.len == T
    }

    /// Drops the oldest observation. The hypotheses must have taken leave of it.
    pub(crate) fn drop_oldest(&mut self) {
        self.steps.copy_within(1.., 0);
        self.hints.copy_within(1.., 0);
        self.len = self.len.saturating_sub(1);
    }

    /// Appends an observation; nothing happens when the record is full.
    pub(crate) fn push(&mut self, observation: &Observation) {
        let entry = packed(observation);
        if let (Some(steps), Some(hints)) = (self.steps.get_mut(self.len), self.hints.get_mut(self.len)) {
            (*steps, *hints) = (entry.steps, entry.hints);
            self.len += 1;
        }
    }

    /// Notes whether the robot seems to have been carried to a place.
    pub(crate) fn set_carried(&mut self, index: usize, carried: bool) {
        if let Some(hints) = self.hints.get_mut(index) {
            *hints = if carried { *hints | CARRIED } else { *hints & !CARRIED };
        }
    }

    pub(crate) fn get(&self, index: usize) -> Option<Entry> {
        match (self.steps.get(index), self.hints.get(index)) {
            (Some(&steps), Some(&hints)) if index < self.len => Some(Entry { steps, hints }),
            _ => None,
        }
    }

    /// Whether what follows an observation does not depend on the place before it: the next one comes without turn hint.
    pub(crate) fn forgets_way(&self, index: usize) -> bool {
        self.get(index + 1).is_some_and(|next| next.turn().is_none() && !next.begins())
    }

    /// All observations, the oldest first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = Entry> + '_ {
        let all = self.steps.iter().zip(&self.hints).take(self.len);
        all.map(|(&steps, &hints)| Entry { steps, hints })
    }
}

/// An observation as an entry of the record.
pub(crate) fn packed(observation: &Observation) -> Entry {
    let turn = match observation.turn {
        None => 0,
        Some(Turn::Back) => TURN_BACK,
        Some(Turn::On) => TURN_ON,
    };
    let degree = observation.degree.unwrap_or(0).min(DEGREE_MAX);
    let begins = if observation.starts_sequence { BEGINS } else { 0 };
    Entry {
        steps: observation.fingerprint.steps().min(Fingerprint::MAX.steps()),
        hints: turn | degree << DEGREE_SHIFT | begins,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn observations_come_back_as_they_went_in() {
        let mut record = Record::<8>::new();
        let turns = [None, Some(Turn::Back), Some(Turn::On)];
        for (steps, turn) in [0, 1, Fingerprint::MAX.steps()].into_iter().zip(turns) {
            for (degree, kept) in [(None, 0), (Some(0), 0), (Some(1), 1), (Some(7), 7), (Some(8), 7), (Some(255), 7)] {
                for begins in [false, true] {
                    let fingerprint = Fingerprint::from_steps(steps).unwrap();
                    record.clear();
                    record.push(&Observation { fingerprint, turn, degree, starts_sequence: begins });
                    let entry = record.get(0).unwrap();
                    assert_eq!((entry.steps, entry.turn()), (steps, turn));
                    assert_eq!((entry.degree(), entry.begins()), (kept, begins));
                    assert_eq!(record.get(1), None);
                }
            }
        }
    }

    #[test]
    fn a_full_record_takes_nothing_until_the_oldest_is_dropped() {
        let mut record = Record::<8>::new();
        let at = |steps| Observation::new(Fingerprint::from_steps(steps).unwrap());
        (0..9).for_each(|steps| record.push(&at(steps)));
        assert!(record.is_full() && record.iter().map(|entry| entry.steps).eq(0..8));
        record.drop_oldest();
        record.push(&at(9));
        record.set_carried(record.len() - 1, true);
        assert!(record.iter().map(|entry| entry.steps).eq([1, 2, 3, 4, 5, 6, 7, 9]));
        assert!(record.iter().map(Entry::begins).eq((0..8).map(|index| index == 7)));
    }
}
