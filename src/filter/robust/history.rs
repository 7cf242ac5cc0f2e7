//! The history: the newest observations, packed. Every hypothesis explains all of them.

use crate::filter::{Exit, Observation};
use crate::place::Fingerprint;

/// The largest degree; a larger one counts as this.
pub(crate) const DEGREE_MAX: u8 = 7;

const EXIT_BACK: u8 = 1;
const EXIT_ON: u8 = 2;
const DEGREE_SHIFT: u8 = 2;
const STARTS_SEQUENCE: u8 = 1 << 5;
const KIDNAPPED: u8 = 1 << 6;

/// The newest `T` observations, the oldest first: 3 bytes each.
#[derive(Clone, Debug)]
pub(crate) struct ObservationHistory<const T: usize> {
    pub(crate) steps: [u16; T],
    /// Bits 0 and 1: the exit. Bits 2 to 4: the degree. Bit 5: the first place of a sequence. Bit 6: the robot seems to
    /// have been kidnapped on the way here.
    pub(crate) hints: [u8; T],
    pub(crate) len: usize,
}

/// One observation of the history.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PackedObservation {
    pub(crate) steps: u16,
    hints: u8,
}

impl PackedObservation {
    pub(crate) fn new(observation: &Observation) -> Self {
        let exit = match observation.exit {
            None => 0,
            Some(exit) if exit.is_back() => EXIT_BACK,
            Some(_) => EXIT_ON,
        };
        let degree = observation.degree().min(DEGREE_MAX);
        let start = if observation.starts_sequence { STARTS_SEQUENCE } else { 0 };
        Self {
            steps: observation.fingerprint.steps().min(Fingerprint::MAX.steps()),
            hints: exit | degree << DEGREE_SHIFT | start,
        }
    }

    /// Whether the robot did not drive here from the observation before.
    pub(crate) const fn starts_sequence(self) -> bool {
        self.hints & (STARTS_SEQUENCE | KIDNAPPED) != 0
    }

    /// The exit by which the robot left the place before: [`Exit::Back`] or [`Exit::On`].
    pub(crate) const fn exit(self) -> Option<Exit> {
        match self.hints & 3 {
            EXIT_BACK => Some(Exit::Back),
            EXIT_ON => Some(Exit::On),
            _ => None,
        }
    }

    /// Whether an observation can have these hints.
    #[cfg(feature = "snapshot")]
    pub(crate) const fn is_possible(hints: u8) -> bool {
        hints & 3 <= EXIT_ON && hints < 1 << 7
    }

    /// The degree, 1 to [`DEGREE_MAX`]; 0 when it is unknown.
    pub(crate) const fn degree(self) -> u8 {
        self.hints >> DEGREE_SHIFT & DEGREE_MAX
    }
}

impl<const T: usize> ObservationHistory<T> {
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

    /// Drops the oldest observation, which the hypotheses must have marginalised.
    pub(crate) fn drop_oldest(&mut self) {
        self.steps.copy_within(1.., 0);
        self.hints.copy_within(1.., 0);
        self.len = self.len.saturating_sub(1);
    }

    /// Appends an observation; nothing happens when the history is full.
    pub(crate) fn push(&mut self, observation: &Observation) {
        let packed = PackedObservation::new(observation);
        if let (Some(steps), Some(hints)) = (self.steps.get_mut(self.len), self.hints.get_mut(self.len)) {
            (*steps, *hints) = (packed.steps, packed.hints);
            self.len += 1;
        }
    }

    /// Notes whether the robot seems to have been kidnapped on the way to an observation.
    pub(crate) fn set_kidnapped(&mut self, index: usize, kidnapped: bool) {
        if let Some(hints) = self.hints.get_mut(index) {
            *hints = if kidnapped { *hints | KIDNAPPED } else { *hints & !KIDNAPPED };
        }
    }

    /// The observation at a position, the oldest at 0.
    pub(crate) fn get(&self, index: usize) -> Option<PackedObservation> {
        match (self.steps.get(index), self.hints.get(index)) {
            (Some(&steps), Some(&hints)) if index < self.len => Some(PackedObservation { steps, hints }),
            _ => None,
        }
    }

    /// Whether the vertex of the next observation depends on that of this one alone: the next one has no exit.
    pub(crate) fn is_first_order(&self, index: usize) -> bool {
        self.get(index + 1).is_some_and(|next| next.exit().is_none() && !next.starts_sequence())
    }

    /// All observations, the oldest first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = PackedObservation> + '_ {
        let all = self.steps.iter().zip(&self.hints).take(self.len);
        all.map(|(&steps, &hints)| PackedObservation { steps, hints })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::Ways;

    #[test]
    fn packed_observations_round_trip() {
        let mut history = ObservationHistory::<8>::new();
        let exits = [None, Some(Exit::Back), Some(Exit::On)];
        for (steps, exit) in [0, 1, Fingerprint::MAX.steps()].into_iter().zip(exits) {
            for (ways, kept) in [(None, 0), (Ways::from_count(1).ok(), 1), (Ways::from_count(7).ok(), 7)] {
                for starts_sequence in [false, true] {
                    let fingerprint = Fingerprint::from_steps(steps).unwrap();
                    history.clear();
                    history.push(&Observation { ways, exit, starts_sequence, ..Observation::new(fingerprint) });
                    let packed = history.get(0).unwrap();
                    assert_eq!((packed.steps, packed.exit()), (steps, exit));
                    assert_eq!((packed.degree(), packed.starts_sequence()), (kept, starts_sequence));
                    assert_eq!(history.get(1), None);
                }
            }
        }
    }

    #[test]
    fn a_full_history_ignores_observations_until_the_oldest_is_dropped() {
        let mut history = ObservationHistory::<8>::new();
        let at = |steps| Observation::new(Fingerprint::from_steps(steps).unwrap());
        (0..9).for_each(|steps| history.push(&at(steps)));
        assert!(history.is_full() && history.iter().map(|packed| packed.steps).eq(0..8));
        history.drop_oldest();
        history.push(&at(9));
        history.set_kidnapped(history.len() - 1, true);
        assert!(history.iter().map(|packed| packed.steps).eq([1, 2, 3, 4, 5, 6, 7, 9]));
        assert!(history.iter().map(PackedObservation::starts_sequence).eq((0..8).map(|index| index == 7)));
    }
}
