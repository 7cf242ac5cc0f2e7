//! The factors of a particle's weight (Eq. 7 to 9), as integer logarithms.
//!
//! A log weight is an `i32` in units of 2⁻¹⁶ nats, so that sums are exact, incremental and the same on every target.

use crate::filter::PaperConfig;
use crate::place::Fingerprint;

/// One nat in the unit of log weights.
pub(crate) const NAT: i32 = 1 << 16;

/// The number of label differences in the table of the penalty.
const PENALTIES: usize = 256;

/// From this many `sigma_label_mm` on, the penalty of Eq. 9 is taken as 0: e^(−4.5²) is 2·10⁻⁹.
const PENALTY_REACH: f32 = 4.5;

/// The constants of Eq. 7 to 9, computed once from a checked configuration.
#[derive(Clone, Debug)]
pub(crate) struct Likelihood {
    label_scale: Scale,
    consistency_scale: Scale,
    /// ln of one factor of Eq. 9 over the difference of two labels, in units of `1 << penalty_stride` steps.
    penalties: [i32; PENALTIES],
    penalty_stride: u32,
}

impl Likelihood {
    /// Constants that must be set before use.
    pub(crate) const fn new() -> Self {
        Self {
            label_scale: Scale::UNSET,
            consistency_scale: Scale::UNSET,
            penalties: [0; PENALTIES],
            penalty_stride: 0,
        }
    }

    pub(crate) fn configure(&mut self, config: &PaperConfig) {
        self.label_scale = Scale::new(config.sigma_label_mm);
        self.consistency_scale = Scale::new(config.sigma_consistency_mm);
        let sigma_label_mm = f32::from(config.sigma_label_mm.max(1));
        let reach_steps = (PENALTY_REACH * sigma_label_mm) as u32 / u32::from(Fingerprint::STEP_MM);
        self.penalty_stride = (reach_steps / PENALTIES as u32).checked_ilog2().map_or(0, |stride| stride + 1);
        let penalty_weight = f32::from(config.penalty_permille) / 1000.0;
        for (index, penalty) in self.penalties.iter_mut().enumerate() {
            let difference_mm = (index as u32) << self.penalty_stride;
            let difference_mm = (difference_mm * u32::from(Fingerprint::STEP_MM)) as f32;
            let ratio = difference_mm / sigma_label_mm;
            let factor = 1.0 - penalty_weight * libm::expf(-ratio * ratio);
            *penalty = libm::roundf(libm::logf(factor) * NAT as f32) as i32;
        }
    }

    /// ln of **Eq. 7**: how well an observation fits the label of the vertex it is predicted at.
    pub(crate) fn ln_label(&self, observation: Fingerprint, label: Fingerprint) -> i32 {
        let difference_mm = u32::from(observation.distance_steps(label)) * u32::from(Fingerprint::STEP_MM);
        self.label_scale.ln_gaussian(difference_mm)
    }

    /// ln of **Eq. 8**: how consistent the map is with the evidence, for a distance of Eq. 2 in millimetres.
    pub(crate) fn ln_consistency(&self, distance_mm: u16) -> i32 {
        self.consistency_scale.ln_gaussian(u32::from(distance_mm))
    }

    /// A distance of Eq. 2, in millimetres, whose Eq. 8 surely loses more than `loss` (in the unit of log weights);
    /// `u16::MAX` where Eq. 8 saturates before it loses that much.
    pub(crate) fn consistency_reach_mm(&self, loss: i32) -> u16 {
        if loss >= LARGEST_LOSS {
            return u16::MAX;
        }
        let sigma_mm = u64::from(self.consistency_scale.sigma);
        let reach_mm = ((loss.max(0) as u64 + 1) * sigma_mm * sigma_mm).isqrt() >> 8;
        u16::try_from(reach_mm + 2).unwrap_or(u16::MAX)
    }

    /// ln of one factor of Eq. 9: the penalty for two similar labels.
    pub(crate) fn ln_penalty(&self, a: Fingerprint, b: Fingerprint) -> i32 {
        let difference = usize::from(a.distance_steps(b));
        let index = difference >> self.penalty_stride;
        let Some(&at) = self.penalties.get(index) else { return 0 };
        if self.penalty_stride == 0 {
            return at;
        }
        let behind = self.penalties.get(index + 1).copied().unwrap_or(0);
        let part = (difference & ((1 << self.penalty_stride) - 1)) as i32;
        at + (((behind - at) * part) >> self.penalty_stride)
    }

    /// The change of ln of **Eq. 9**, the size of a map, when the label of a vertex changes; `None` stands for a vertex that is not
    /// there yet. `others` are the labels of all other vertices. Cost: O(V).
    ///
    /// As printed, the product runs over all ordered pairs, a = b included: every vertex has a factor of 1 − φ even when no other
    /// label is similar, and each pair counts twice. The code follows the print, because the factor of a = b is the only one
    /// that penalises a vertex as such. For φ = 1 every map would be impossible, so the configuration excludes it.
    pub(crate) fn ln_size_change(
        &self,
        others: impl Iterator<Item = Fingerprint>,
        before: Option<Fingerprint>,
        after: Fingerprint,
    ) -> i32 {
        let alone = self.ln_penalty(after, after);
        let pairs =
            others.map(|other| self.ln_penalty(after, other) - before.map_or(0, |label| self.ln_penalty(label, other)));
        2 * pairs.sum::<i32>() + if before.is_none() { alone } else { 0 }
    }
}

/// A standard deviation and the reciprocal of its square, so that the MCU need not divide.
#[derive(Clone, Copy, Debug)]
struct Scale {
    sigma: u16,
    /// 2⁴⁰ / sigma².
    reciprocal: u64,
}

impl Scale {
    const UNSET: Self = Self { sigma: 0, reciprocal: 0 };

    const fn new(sigma: u16) -> Self {
        let sigma = if sigma == 0 { 1 } else { sigma };
        Self { sigma, reciprocal: (1 << 40) / (sigma as u64 * sigma as u64) }
    }

    /// −(difference / sigma)² as a log weight; saturates at −4096 nats.
    fn ln_gaussian(self, difference: u32) -> i32 {
        let ratio = u64::from(difference).pow(2).saturating_mul(self.reciprocal) >> 24;
        -i32::try_from(ratio).unwrap_or(i32::MAX).min(LARGEST_LOSS)
    }
}

/// Where the logarithms of Eq. 7 and 8 saturate: at −4096 nats.
const LARGEST_LOSS: i32 = 4096 * NAT;

#[cfg(test)]
mod tests {
    use super::*;

    fn likelihood(config: PaperConfig) -> Likelihood {
        let mut likelihood = Likelihood::new();
        likelihood.configure(&config);
        likelihood
    }

    fn fingerprint(radius_mm: u16) -> Fingerprint {
        Fingerprint::from_radius_mm(radius_mm).unwrap()
    }

    /// Eq. 9 of a whole map, vertex by vertex.
    fn ln_size(likelihood: &Likelihood, labels: &[Fingerprint]) -> i32 {
        let brought = |(index, &label)| likelihood.ln_size_change(labels[..index].iter().copied(), None, label);
        labels.iter().enumerate().map(brought).sum()
    }

    fn nats(log: i32) -> f64 {
        f64::from(log) / f64::from(NAT)
    }

    #[test]
    fn a_single_vertex_has_the_penalty_of_its_similarity_to_itself() {
        for penalty_permille in [0, 100, 500, 999] {
            let likelihood = likelihood(PaperConfig { penalty_permille, ..PaperConfig::DEFAULT });
            let expected = (1.0 - f64::from(penalty_permille) / 1000.0).ln();
            assert!((nats(ln_size(&likelihood, &[fingerprint(1000)])) - expected).abs() < 1e-4);
        }
    }

    #[test]
    fn a_pair_of_vertices_counts_in_both_orders() {
        let likelihood = likelihood(PaperConfig::DEFAULT);
        let (a, b) = (fingerprint(1000), fingerprint(1050));
        let pair = (1.0 - 0.1 * (-1_f64).exp()).ln();
        let expected = 2.0 * 0.9_f64.ln() + 2.0 * pair;
        assert!((nats(ln_size(&likelihood, &[a, b])) - expected).abs() < 1e-4);
    }

    #[test]
    fn a_changed_label_changes_the_size_penalty_exactly() {
        let labels = [1000, 1050, 1010, 3000].map(fingerprint);
        for sigma_label_mm in [20, 50, 300, 5000] {
            let likelihood = likelihood(PaperConfig { sigma_label_mm, ..PaperConfig::DEFAULT });
            let moved = likelihood.ln_size_change(labels[1..].iter().copied(), Some(labels[0]), fingerprint(1036));
            let after = [fingerprint(1036), labels[1], labels[2], labels[3]];
            assert_eq!(ln_size(&likelihood, &labels) + moved, ln_size(&likelihood, &after));
        }
    }

    #[test]
    fn gaussian_factors_are_right_to_a_ten_thousandth_of_a_nat() {
        for sigma_mm in [2, 30, 70, 999] {
            let config =
                PaperConfig { sigma_label_mm: sigma_mm, sigma_consistency_mm: sigma_mm, ..PaperConfig::DEFAULT };
            let likelihood = likelihood(config);
            for difference_mm in [0, 2, 18, 100, 998, 4000] {
                let exact = -(f64::from(difference_mm) / f64::from(sigma_mm)).powi(2);
                let expected = exact.max(-4096.0);
                let tolerance = 1e-4 * (1.0 + expected.abs() / 100.0);
                let ln = likelihood.ln_label(fingerprint(4000), fingerprint(4000 - difference_mm));
                assert!((nats(ln) - expected).abs() < tolerance, "{sigma_mm} {difference_mm} {}", nats(ln));
                assert_eq!(likelihood.ln_consistency(difference_mm), ln);
            }
        }
    }

    #[test]
    fn beyond_its_reach_a_distance_loses_more_than_was_allowed() {
        let likelihood = likelihood(PaperConfig::DEFAULT);
        for loss in [0, 1, NAT / 3, NAT, 15 * NAT, 300 * NAT] {
            let reach_mm = likelihood.consistency_reach_mm(loss);
            assert!(likelihood.ln_consistency(reach_mm) < -loss);
        }
    }
}
