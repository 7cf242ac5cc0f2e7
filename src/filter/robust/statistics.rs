//! The sufficient statistics of a vertex.

use super::history::{DEGREE_MAX, PackedObservation};
use crate::place::Fingerprint;

/// Marginalised statistics of this many visits decay by half, so that the map forgets what changed long ago.
pub(crate) const DECAY_VISITS: u16 = 512;

/// What a hypothesis has to know of the visits of a vertex: 20 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VertexStatistics {
    /// The mean label, in steps.
    pub(crate) mean: f32,
    /// Q: the sum of squared distances of the labels from their mean, in steps².
    pub(crate) scatter: f32,
    /// n: how many observations belong to the vertex.
    pub(crate) visits: u16,
    /// How many transitions leave the vertex.
    pub(crate) exits: u16,
    /// How often each degree was observed, degree 1 first.
    pub(crate) degrees: [u8; DEGREE_MAX as usize],
}

impl VertexStatistics {
    pub(crate) const NONE: Self =
        Self { mean: 0.0, scatter: 0.0, visits: 0, exits: 0, degrees: [0; DEGREE_MAX as usize] };

    /// The statistics of a vertex of a known map: `visits` labels with this mean and standard deviation.
    pub(crate) fn known(label: Fingerprint, visits: u16, deviation_steps: f32) -> Self {
        let visits = visits.clamp(1, DECAY_VISITS);
        let scatter = f32::from(visits - 1) * deviation_steps * deviation_steps;
        Self { mean: f32::from(label.steps()), scatter, visits, exits: visits, ..Self::NONE }
    }

    /// Adds a visit, by Welford's update of mean and scatter.
    pub(crate) fn include(&mut self, observation: PackedObservation) {
        let Some(visits) = self.visits.checked_add(1) else { return };
        let off = f32::from(observation.steps) - self.mean;
        self.mean += off / f32::from(visits);
        self.scatter += off * (f32::from(observation.steps) - self.mean);
        self.visits = visits;
        if let Some(degree) = observation.degree().checked_sub(1) {
            if self.degrees.contains(&u8::MAX) {
                self.degrees.iter_mut().for_each(|count| *count /= 2);
            }
            if let Some(count) = self.degrees.get_mut(usize::from(degree)) {
                *count += 1;
            }
        }
    }

    /// Adds the visits of another vertex: the parallel form of Welford's update.
    pub(crate) fn add(&mut self, other: &Self) {
        if other.visits == 0 {
            return;
        }
        let (here, there) = (f32::from(self.visits), f32::from(other.visits));
        let off = other.mean - self.mean;
        self.mean += off * there / (here + there);
        self.scatter += other.scatter + off * off * here * there / (here + there);
        self.visits = self.visits.saturating_add(other.visits);
        self.exits = self.exits.saturating_add(other.exits);
        for (count, more) in self.degrees.iter_mut().zip(other.degrees) {
            *count = count.saturating_add(more);
        }
    }

    /// Halves the counts from [`DECAY_VISITS`] visits on; returns whether it did.
    pub(crate) fn decay(&mut self) -> bool {
        let is_more = self.visits >= DECAY_VISITS;
        if is_more {
            self.scatter *= 0.5;
            self.visits /= 2;
            self.exits /= 2;
            self.degrees.iter_mut().for_each(|count| *count /= 2);
        }
        is_more
    }

    /// Whether a degree was observed.
    pub(crate) fn has_degrees(&self) -> bool {
        self.degrees.iter().any(|&count| count > 0)
    }

    /// The mean label as a fingerprint.
    pub(crate) fn mean_label(&self) -> Fingerprint {
        Fingerprint::from_steps(libm::roundf(self.mean) as u16).unwrap_or(Fingerprint::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{Observation, Ways};

    fn statistics(visits: impl IntoIterator<Item = (u16, u8)>) -> VertexStatistics {
        let mut statistics = VertexStatistics::NONE;
        for (steps, degree) in visits {
            let fingerprint = Fingerprint::from_steps(steps).unwrap();
            let observation = Observation { ways: Ways::from_count(degree).ok(), ..Observation::new(fingerprint) };
            statistics.include(PackedObservation::new(&observation));
        }
        statistics
    }

    #[test]
    fn adding_statistics_equals_including_visits_one_by_one() {
        let visits: Vec<(u16, u8)> = (0..40).map(|visit| (500 + visit * 37 % 61, (visit % 8) as u8)).collect();
        let whole = statistics(visits.iter().copied());
        for split in 0..=visits.len() {
            let (first, second) = visits.split_at(split);
            let mut sum = statistics(first.iter().copied());
            sum.add(&statistics(second.iter().copied()));
            assert_eq!((sum.visits, sum.degrees), (whole.visits, whole.degrees));
            assert!((sum.mean - whole.mean).abs() < 1e-3, "{} {}", sum.mean, whole.mean);
            assert!((sum.scatter - whole.scatter).abs() < 1e-4 * whole.scatter);
        }
    }

    #[test]
    fn an_unknown_degree_is_not_counted() {
        assert_eq!(statistics([(1, 7), (1, 0), (1, 7)]).degrees, [0, 0, 0, 0, 0, 0, 2]);
        assert!(!statistics([(1, 0)]).has_degrees());
    }

    #[test]
    fn a_known_vertex_keeps_its_label_and_at_most_512_visits() {
        let label = Fingerprint::from_steps(600).unwrap();
        let known = VertexStatistics::known(label, 9, 10.0);
        assert_eq!((known.mean_label(), known.visits, known.scatter), (label, 9, 800.0));
        assert_eq!(VertexStatistics::known(label, u16::MAX, 10.0).visits, DECAY_VISITS);
        assert_eq!(VertexStatistics::known(label, 0, 10.0).visits, 1);
    }
}
