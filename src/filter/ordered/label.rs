//! The statistics of one vertex.

use super::model::Model;
use crate::place::Fingerprint;

/// Counts of this many visits are halved when places leave the record, so that the map forgets what changed long ago.
const VISITS_MAX: u16 = 512;

/// The statistics of one vertex: 12 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Label {
    pub(crate) mean: f32,
    pub(crate) scatter: f32,
    pub(crate) visits: u16,
    /// At how many visits the ways were seen; saturates.
    pub(crate) looks: u8,
}

impl Label {
    pub(crate) const NONE: Self = Self { mean: 0.0, scatter: 0.0, visits: 0, looks: 0 };

    /// The statistics of a vertex of a known map: `visits` labels with this mean and standard deviation.
    pub(super) fn known(label: Fingerprint, visits: u32, deviation_steps: f32) -> Self {
        let visits = visits.clamp(1, VISITS_MAX.into()) as u16;
        let scatter = f32::from(visits - 1) * deviation_steps * deviation_steps;
        Self { mean: f32::from(label.steps()), scatter, visits, looks: visits.min(u8::MAX.into()) as u8 }
    }

    /// Halves the counts of a vertex that was visited more often than its mean needs.
    pub(super) fn fade(&mut self) {
        if self.visits >= VISITS_MAX {
            self.visits /= 2;
            self.scatter *= 0.5;
        }
    }

    /// With one more label (Welford's update).
    pub(super) fn including(mut self, steps: u16) -> Self {
        self.visits = self.visits.saturating_add(1);
        let off = f32::from(steps) - self.mean;
        self.mean += off / f32::from(self.visits);
        self.scatter += off * (f32::from(steps) - self.mean);
        self
    }

    /// The statistics of both.
    pub(super) fn with(&self, other: &Self) -> Self {
        if self.visits == 0 || other.visits == 0 {
            return if self.visits == 0 { *other } else { *self };
        }
        let (here, there) = (f32::from(self.visits), f32::from(other.visits));
        let off = other.mean - self.mean;
        Self {
            mean: self.mean + off * there / (here + there),
            scatter: self.scatter + other.scatter + off * off * here * there / (here + there),
            visits: self.visits.saturating_add(other.visits),
            looks: self.looks.saturating_add(other.looks),
        }
    }

    /// The rounded mean.
    pub(super) fn fingerprint(&self) -> Fingerprint {
        Fingerprint::from_steps((self.mean + 0.5) as u16).unwrap_or(Fingerprint::MAX)
    }

    pub(super) fn evidence(&self, model: &Model) -> f32 {
        model.evidence_of_labels(self.visits, self.scatter)
    }
}
