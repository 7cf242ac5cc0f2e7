//! What a hypothesis counts at a vertex.

use super::record::{DEGREE_MAX, Entry};
use crate::Fingerprint;

/// Counts of what left the record are halved beyond this many visits, so that old places fade.
pub(crate) const FADE_VISITS: u16 = 512;

/// The sufficient statistics of one vertex: 20 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tally {
    pub(crate) mean: f32,
    pub(crate) scatter: f32,
    pub(crate) visits: u16,
    /// How many moves left the vertex.
    pub(crate) exits: u16,
    /// How often each degree was seen, that of 1 first.
    pub(crate) degrees: [u8; DEGREE_MAX as usize],
}

impl Tally {
    pub(crate) const NONE: Self =
        Self { mean: 0.0, scatter: 0.0, visits: 0, exits: 0, degrees: [0; DEGREE_MAX as usize] };

    /// The counts that a known vertex stands for: so many visits with a mean label and a standard deviation, in steps.
    pub(crate) fn known(label: Fingerprint, visits: u16, deviation_steps: f32) -> Self {
        let visits = visits.clamp(1, FADE_VISITS);
        let scatter = f32::from(visits - 1) * deviation_steps * deviation_steps;
        Self { mean: f32::from(label.steps()), scatter, visits, exits: visits, ..Self::NONE }
    }

    /// Takes in a visit (Welford's update).
    pub(crate) fn include(&mut self, entry: Entry) {
        let Some(visits) = self.visits.checked_add(1) else { return };
        let off = f32::from(entry.steps) - self.mean;
        self.mean += off / f32::from(visits);
        self.scatter += off * (f32::from(entry.steps) - self.mean);
        self.visits = visits;
        if let Some(degree) = entry.degree().checked_sub(1) {
            if self.degrees.contains(&u8::MAX) {
                self.degrees.iter_mut().for_each(|count| *count /= 2);
            }
            if let Some(count) = self.degrees.get_mut(usize::from(degree)) {
                *count += 1;
            }
        }
    }

    /// Takes in all that another vertex counted.
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

    /// Halves what was counted when it is more than a vertex needs; tells whether it was.
    pub(crate) fn fade(&mut self) -> bool {
        let is_more = self.visits >= FADE_VISITS;
        if is_more {
            self.scatter *= 0.5;
            self.visits /= 2;
            self.exits /= 2;
            self.degrees.iter_mut().for_each(|count| *count /= 2);
        }
        is_more
    }

    pub(crate) fn knows_degrees(&self) -> bool {
        self.degrees.iter().any(|&count| count > 0)
    }

    /// The mean label in steps.
    pub(crate) const fn mean(&self) -> f32 {
        self.mean
    }

    pub(crate) fn mean_label(&self) -> Fingerprint {
        Fingerprint::from_steps(libm::roundf(self.mean) as u16).unwrap_or(Fingerprint::MAX)
    }

    /// The sum of squared distances of the labels from their mean, in steps².
    pub(crate) const fn scatter(&self) -> f32 {
        self.scatter
    }
}

#[cfg(test)]
mod tests {
    use super::super::record::packed;
    use super::*;
    use crate::Observation;

    fn tally(visits: impl IntoIterator<Item = (u16, u8)>) -> Tally {
        let mut tally = Tally::NONE;
        for (steps, degree) in visits {
            let fingerprint = Fingerprint::from_steps(steps).unwrap();
            tally.include(packed(&Observation { degree: Some(degree), ..Observation::new(fingerprint) }));
        }
        tally
    }

    #[test]
    fn adding_is_including_one_by_one() {
        let visits: Vec<(u16, u8)> = (0..40).map(|visit| (500 + visit * 37 % 61, (visit % 9) as u8)).collect();
        let whole = tally(visits.iter().copied());
        for split in 0..=visits.len() {
            let (first, second) = visits.split_at(split);
            let mut sum = tally(first.iter().copied());
            sum.add(&tally(second.iter().copied()));
            assert_eq!((sum.visits, sum.degrees), (whole.visits, whole.degrees));
            assert!((sum.mean() - whole.mean()).abs() < 1e-3, "{} {}", sum.mean(), whole.mean());
            assert!((sum.scatter() - whole.scatter()).abs() < 1e-4 * whole.scatter());
        }
    }

    #[test]
    fn degrees_above_seven_count_as_seven_and_0_as_unknown() {
        assert_eq!(tally([(1, 7), (1, 8), (1, 255), (1, 0)]).degrees, [0, 0, 0, 0, 0, 0, 3]);
        assert!(!tally([(1, 0)]).knows_degrees());
    }

    #[test]
    fn a_known_vertex_keeps_its_label_and_its_visits_are_limited() {
        let label = Fingerprint::from_steps(600).unwrap();
        let known = Tally::known(label, 9, 10.0);
        assert_eq!((known.mean_label(), known.visits, known.scatter()), (label, 9, 800.0));
        assert_eq!(Tally::known(label, u16::MAX, 10.0).visits, FADE_VISITS);
        assert_eq!(Tally::known(label, 0, 10.0).visits, 1);
    }
}
