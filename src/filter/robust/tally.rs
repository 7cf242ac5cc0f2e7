//! What a hypothesis counts at a vertex.

use super::record::Entry;
use crate::Fingerprint;

/// Labels are summed relative to this one, the middle of the range.
const CENTRE_STEPS: i32 = 2048;

/// Counts of what left the record are halved beyond this many visits, so that old places fade.
const FADE_VISITS: u16 = 512;

/// The sufficient statistics of one vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tally {
    squares: u64,
    sum: i32,
    pub(super) visits: u16,
    /// How many moves left the vertex.
    pub(super) exits: u16,
    /// How often each degree was seen; the first counts nothing.
    pub(super) degrees: [u8; 8],
}

impl Tally {
    pub(super) const NONE: Self = Self { squares: 0, sum: 0, visits: 0, exits: 0, degrees: [0; 8] };

    pub(super) fn include(&mut self, entry: Entry) {
        let label = i32::from(entry.steps) - CENTRE_STEPS;
        self.sum += label;
        self.squares += u64::from(label.unsigned_abs().pow(2));
        self.visits = self.visits.saturating_add(1);
        if entry.degree() > 0 {
            if self.degrees.iter().any(|&count| count == u8::MAX) {
                self.degrees.iter_mut().for_each(|count| *count /= 2);
            }
            if let Some(count) = self.degrees.get_mut(usize::from(entry.degree())) {
                *count += 1;
            }
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.squares += other.squares;
        self.sum += other.sum;
        self.visits = self.visits.saturating_add(other.visits);
        self.exits = self.exits.saturating_add(other.exits);
        for (count, more) in self.degrees.iter_mut().zip(other.degrees) {
            *count = count.saturating_add(more);
        }
    }

    /// Halves what was counted when it is more than a vertex needs.
    pub(super) fn fade(&mut self) {
        if self.visits >= FADE_VISITS {
            self.squares /= 2;
            self.sum /= 2;
            self.visits /= 2;
            self.exits /= 2;
            self.degrees.iter_mut().for_each(|count| *count /= 2);
        }
    }

    pub(super) fn knows_degrees(&self) -> bool {
        u64::from_le_bytes(self.degrees) != 0
    }

    /// The mean label in steps.
    pub(super) fn mean(&self) -> f32 {
        CENTRE_STEPS as f32 + self.sum as f32 / f32::from(self.visits.max(1))
    }

    pub(super) fn mean_label(&self) -> Fingerprint {
        Fingerprint::from_steps(libm::roundf(self.mean()) as u16).unwrap_or(Fingerprint::MAX)
    }

    /// The sum of squared distances of the labels from their mean, in steps².
    pub(super) fn scatter(&self) -> f32 {
        let visits = u64::from(self.visits.max(1));
        let product = i64::from(self.sum).unsigned_abs().pow(2);
        (visits * self.squares).saturating_sub(product) as f32 / visits as f32
    }
}
