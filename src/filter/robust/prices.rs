//! The prior of maps and the noise model: what vertices, edges, labels and moves between places cost, in nats.

use super::config::RobustConfig;
use super::record::DEGREE_MAX;
use super::tally::Tally;
use crate::{Fingerprint, Turn};

/// The range of labels on which the mean of a vertex is uniform a priori, in steps: 2 m.
const LABEL_RANGE_STEPS: f32 = 1000.0;

/// Shape of the inverse-gamma prior of a vertex's variance.
pub(crate) const SHAPE: f32 = 2.0;

/// The price of a vertex. It is negative because a map of K vertices stands for the K! ways to number them.
pub(crate) const VERTEX: f32 = -1.0;

/// The price of an edge: about ln of the odds against an edge in a sparse graph of a dozen vertices.
pub(crate) const EDGE: f32 = 1.5;

/// What the decoder charges for a move along no edge, or along one that was driven once.
pub(crate) const NEW_EDGE: f32 = 3.0;

/// How much of what all paths of a map add to the evidence of its best one counts. At 0 maps that fold look-alike branches
/// onto each other win, at 1 maps that hold a place twice do; chosen on random families.
pub(crate) const SURPLUS_SHARE: f32 = 0.7;

const HALF_LN_2_PI: f32 = 0.918_938_5;

/// The prices of one run; the scale of the noise changes with what the best map shows.
#[derive(Clone, Debug)]
pub(crate) struct Prices {
    /// Scale of the inverse-gamma prior of a vertex's variance, in steps²: shape · (standard deviation)².
    pub(crate) scale: f32,
    /// What does not depend on the vertex in its label evidence.
    label_constant: f32,
    /// ln P of a turn hint that is right, and of one that is wrong.
    turn: [f32; 2],
    /// ln P of a degree that is right, off by one, and off by more.
    degree: [f32; 3],
}

impl Prices {
    pub(crate) const fn new() -> Self {
        Self { scale: 0.0, label_constant: 0.0, turn: [0.0; 2], degree: [0.0; 3] }
    }

    pub(crate) fn configure(&mut self, config: &RobustConfig) {
        let wrong = f32::from(config.wrong_turn_permille) / 1000.0;
        self.turn = [libm::logf(1.0 - wrong), libm::logf(wrong)];
        let wrong = f32::from(config.wrong_degree_permille) / 1000.0;
        self.degree = [libm::logf(1.0 - wrong), libm::logf(wrong / 2.0), libm::logf(wrong / 100.0)];
        self.set_noise(f32::from(config.noise_mm) / f32::from(Fingerprint::STEP_MM));
    }

    /// Takes a new standard deviation of the labels, in steps.
    pub(crate) fn set_noise(&mut self, deviation_steps: f32) {
        self.set_scale(SHAPE * deviation_steps * deviation_steps);
    }

    /// Takes a new scale, in steps².
    pub(crate) fn set_scale(&mut self, scale: f32) {
        self.scale = scale;
        self.label_constant =
            HALF_LN_2_PI - libm::logf(LABEL_RANGE_STEPS) - ln_gamma(SHAPE) + SHAPE * libm::logf(self.scale);
    }

    /// The standard deviation in force, in steps.
    pub(crate) fn noise_steps(&self) -> f32 {
        libm::sqrtf(self.scale / SHAPE)
    }

    /// ln of the density of all labels seen at a vertex, its mean and variance integrated out.
    pub(crate) fn label_evidence(&self, tally: &Tally) -> f32 {
        if tally.visits == 0 {
            return 0.0;
        }
        let visits = f32::from(tally.visits);
        let shape = SHAPE + 0.5 * (visits - 1.0);
        self.label_constant - visits * HALF_LN_2_PI - 0.5 * libm::logf(visits) + ln_gamma(shape)
            - shape * libm::logf(self.scale + 0.5 * tally.scatter())
    }

    /// ln of the probability of the moves that left a vertex, and of the degrees seen at it: uniform over its ways.
    pub(crate) fn exit_evidence(&self, tally: &Tally, degree: u32) -> f32 {
        let exits = f32::from(tally.exits);
        let ln_ways = |ways: u32| libm::logf(ways.max(1) as f32);
        if !tally.knows_degrees() {
            return -exits * ln_ways(degree);
        }
        let most = u32::from(DEGREE_MAX).max(degree);
        let terms = (degree.max(1)..=most).map(|ways| self.degree_evidence(tally, ways) - exits * ln_ways(ways));
        let best = terms.clone().fold(f32::NEG_INFINITY, f32::max);
        let sum: f32 = terms.map(|term| libm::expf(term - best)).sum();
        best + libm::logf(sum) - ln_ways(u32::from(DEGREE_MAX))
    }

    /// The number of ways of a vertex that explains its exits and degrees best, at least those on the map.
    pub(crate) fn likely_degree(&self, tally: &Tally, degree: u32) -> u32 {
        let least = degree.max(1);
        if !tally.knows_degrees() {
            return least;
        }
        let exits = f32::from(tally.exits);
        let mut best = (f32::NEG_INFINITY, least);
        for ways in least..=u32::from(DEGREE_MAX).max(least) {
            let evidence = self.degree_evidence(tally, ways) - exits * libm::logf(ways as f32);
            if evidence > best.0 {
                best = (evidence, ways);
            }
        }
        best.1
    }

    fn degree_evidence(&self, tally: &Tally, ways: u32) -> f32 {
        let seen = (1..).zip(&tally.degrees);
        seen.filter(|(_, count)| **count > 0).map(|(degree, &count)| f32::from(count) * self.degree(degree, ways)).sum()
    }

    /// ln P of a degree that was seen at a place with so many ways; 0 for an unknown degree.
    pub(crate) fn degree(&self, seen: u8, ways: u32) -> f32 {
        let [right, near, far] = self.degree;
        match (seen, u32::from(seen).abs_diff(ways.min(u32::from(DEGREE_MAX)))) {
            (0, _) => 0.0,
            (_, 0) => right,
            (_, 1) => near,
            _ => far,
        }
    }

    /// ln P of a turn hint, given whether the robot went back.
    pub(crate) fn turn(&self, hint: Option<Turn>, went_back: bool) -> f32 {
        let [right, wrong] = self.turn;
        match hint {
            None => 0.0,
            Some(hint) => {
                if (hint == Turn::Back) == went_back {
                    right
                } else {
                    wrong
                }
            }
        }
    }
}

/// ln Γ for arguments from 0.25 on, to 10⁻⁵ (Stirling's series behind a shift by 4).
pub(crate) fn ln_gamma(x: f32) -> f32 {
    let (shifted, shift) =
        if x < 4.0 { (x + 4.0, libm::logf(x * (x + 1.0) * (x + 2.0) * (x + 3.0))) } else { (x, 0.0) };
    let inverse = 1.0 / shifted;
    (shifted - 0.5) * libm::logf(shifted) - shifted + HALF_LN_2_PI + inverse * (1.0 / 12.0 - inverse * inverse / 360.0)
        - shift
}

/// The derivative of ln Γ for arguments from 0.25 on, to 10⁻⁴.
pub(crate) fn digamma(x: f32) -> f32 {
    let mut shifted = x;
    let mut shift = 0.0;
    while shifted < 4.0 {
        shift += 1.0 / shifted;
        shifted += 1.0;
    }
    let inverse = 1.0 / shifted;
    libm::logf(shifted) - 0.5 * inverse - inverse * inverse / 12.0 - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ln Γ and its derivative in f64, by Stirling's series behind a shift to 20.
    fn in_f64(x: f64) -> (f64, f64) {
        let (mut x, mut ln_product, mut sum) = (x, 0.0, 0.0);
        while x < 20.0 {
            ln_product += x.ln();
            sum += 1.0 / x;
            x += 1.0;
        }
        let stirling = (x - 0.5) * x.ln() - x + 0.5 * (2.0 * core::f64::consts::PI).ln();
        let series = 1.0 / (12.0 * x) - 1.0 / (360.0 * x.powi(3));
        let derivative = x.ln() - 1.0 / (2.0 * x) - 1.0 / (12.0 * x.powi(2)) + 1.0 / (120.0 * x.powi(4));
        (stirling + series - ln_product, derivative - sum)
    }

    #[test]
    fn the_gamma_function_is_as_exact_as_stated() {
        let (mut worst, mut worst_relative, mut worst_derivative) = (0.0_f64, 0.0_f64, 0.0_f64);
        // From 0.25 to 16 by 1/64, then the halves that visits give, as far as they are counted.
        let grid = (16..1024).map(|step| step as f32 / 64.0).chain((32..131_072).map(|half| half as f32 / 2.0));
        for x in grid {
            let (expected, derivative) = in_f64(x.into());
            let off = (f64::from(ln_gamma(x)) - expected).abs();
            if x <= 16.0 {
                worst = worst.max(off)
            } else {
                worst_relative = worst_relative.max(off / expected)
            }
            worst_derivative = worst_derivative.max((f64::from(digamma(x)) - derivative).abs());
        }
        println!(
            "ln Γ off by {worst:e} up to 16, by {worst_relative:e} of it beyond; derivative by {worst_derivative:e}"
        );
        assert!(worst < 1e-5 && worst_relative < 3e-7 && worst_derivative < 1e-4);
    }
}
