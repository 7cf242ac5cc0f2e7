//! The generative model: the priors of a map, and the likelihoods of labels, transitions and hints. All values are natural
//! logarithms (nats).

use super::config::RobustConfig;
use super::history::DEGREE_MAX;
use super::special_functions::{HALF_LN_2_PI, ln_gamma};
use super::statistics::VertexStatistics;
use crate::filter::Exit;
use crate::place::Fingerprint;

/// R: the range of labels over which the mean of a vertex is uniform a priori, in steps (2 m).
const LABEL_RANGE_STEPS: f32 = 1000.0;

/// a: the shape of the inverse-gamma prior of a vertex's variance.
pub(crate) const SHAPE: f32 = 2.0;

/// The log prior of a vertex. It is positive because a map of K vertices stands for the K! ways to number them.
pub(crate) const LN_VERTEX: f32 = 1.0;

/// The log prior of an edge: about the log odds of an edge in a sparse graph of a dozen vertices.
pub(crate) const LN_EDGE: f32 = -1.5;

/// What the decoder charges for a transition without an edge, or along an edge that was driven once.
pub(crate) const NEW_EDGE_COST: f32 = 3.0;

/// The share of the bound of the map's other paths that counts. At 0 maps win that fold branches that look alike onto each
/// other, at 1 maps win that contain a place twice. The share was chosen on random families (docs/inference.md).
pub(crate) const OTHER_PATHS_SHARE: f32 = 0.7;

/// The parameters of the model. The scale of the noise is estimated from the best map (`noise.rs`).
#[derive(Clone, Debug)]
pub(crate) struct Model {
    /// b = a s²: the scale of the inverse-gamma prior of a vertex's variance, in steps².
    pub(crate) scale: f32,
    /// The terms of the label evidence that are the same for all vertices.
    pub(crate) label_constant: f32,
    /// ln P of a right turn hint, and of a wrong one.
    turn: [f32; 2],
    /// ln P of a right degree, of one that is off by one, and of one that is off by more.
    degree: [f32; 3],
}

impl Model {
    pub(crate) const fn new() -> Self {
        Self { scale: 0.0, label_constant: 0.0, turn: [0.0; 2], degree: [0.0; 3] }
    }

    /// Takes the parameters of a configuration.
    pub(crate) fn configure(&mut self, config: &RobustConfig) {
        let wrong = f32::from(config.wrong_turn_permille) / 1000.0;
        self.turn = [libm::logf(1.0 - wrong), libm::logf(wrong)];
        let wrong = f32::from(config.wrong_degree_permille) / 1000.0;
        self.degree = [libm::logf(1.0 - wrong), libm::logf(wrong / 2.0), libm::logf(wrong / 100.0)];
        self.set_noise(f32::from(config.noise_mm) / f32::from(Fingerprint::STEP_MM));
    }

    /// Sets s, the standard deviation of the labels, in steps.
    pub(crate) fn set_noise(&mut self, deviation_steps: f32) {
        self.set_scale(SHAPE * deviation_steps * deviation_steps);
    }

    /// Sets b, in steps².
    pub(crate) fn set_scale(&mut self, scale: f32) {
        self.scale = scale;
        self.label_constant =
            HALF_LN_2_PI - libm::logf(LABEL_RANGE_STEPS) - ln_gamma(SHAPE) + SHAPE * libm::logf(self.scale);
    }

    /// s, the standard deviation of the labels, in steps.
    pub(crate) fn noise_steps(&self) -> f32 {
        libm::sqrtf(self.scale / SHAPE)
    }

    /// The evidence of the labels of a vertex, with its mean and variance integrated out. For n labels of scatter Q, a mean
    /// that is uniform over the range R, and a variance that is inverse-gamma with shape a and scale b:
    ///
    /// ```text
    /// −ln R − (n−1)/2 ln 2π − ½ ln n + ln Γ(a + (n−1)/2) − ln Γ(a) + a ln b − (a + (n−1)/2) ln(b + Q/2)
    /// ```
    pub(crate) fn label_evidence(&self, vertex: &VertexStatistics) -> f32 {
        self.evidence_of_labels(vertex.visits, vertex.scatter)
    }

    /// As [`Model::label_evidence`], from the number of labels and their scatter.
    pub(crate) fn evidence_of_labels(&self, visits: u16, scatter: f32) -> f32 {
        if visits == 0 {
            return 0.0;
        }
        let visits = f32::from(visits);
        let shape = SHAPE + 0.5 * (visits - 1.0);
        self.label_constant - visits * HALF_LN_2_PI - 0.5 * libm::logf(visits) + ln_gamma(shape)
            - shape * libm::logf(self.scale + 0.5 * scatter)
    }

    /// The evidence of the transitions out of a vertex and of the degrees observed there. A transition takes each of the d
    /// exits of the vertex with the same probability. Without observed degrees, d is the degree on the map:
    ///
    /// ```text
    /// −exits · ln d
    /// ```
    ///
    /// With them, d is summed over 1 to 7, uniform a priori, but not below the degree on the map:
    ///
    /// ```text
    /// ln Σ_d ⅐ d^(−exits) Π P(observed degree | d)
    /// ```
    pub(crate) fn exit_evidence(&self, vertex: &VertexStatistics, map_degree: u32) -> f32 {
        let exits = f32::from(vertex.exits);
        let ln = |degree: u32| libm::logf(degree.max(1) as f32);
        if !vertex.has_degrees() {
            return -exits * ln(map_degree);
        }
        let most = u32::from(DEGREE_MAX).max(map_degree);
        let terms = (map_degree.max(1)..=most).map(|degree| self.degree_evidence(vertex, degree) - exits * ln(degree));
        let best = terms.clone().fold(f32::NEG_INFINITY, f32::max);
        let sum: f32 = terms.map(|term| libm::expf(term - best)).sum();
        best + libm::logf(sum) - ln(u32::from(DEGREE_MAX))
    }

    /// The degree that maximises the terms of [`Model::exit_evidence`], at least that on the map.
    pub(crate) fn likely_degree(&self, vertex: &VertexStatistics, map_degree: u32) -> u32 {
        let least = map_degree.max(1);
        if !vertex.has_degrees() {
            return least;
        }
        let exits = f32::from(vertex.exits);
        let mut best = (f32::NEG_INFINITY, least);
        for degree in least..=u32::from(DEGREE_MAX).max(least) {
            let evidence = self.degree_evidence(vertex, degree) - exits * libm::logf(degree as f32);
            if evidence > best.0 {
                best = (evidence, degree);
            }
        }
        best.1
    }

    /// ln P of all degrees observed at a vertex of some degree.
    fn degree_evidence(&self, vertex: &VertexStatistics, degree: u32) -> f32 {
        let observed = (1..).zip(&vertex.degrees).filter(|(_, count)| **count > 0);
        observed.map(|(observed, &count)| f32::from(count) * self.ln_degree(observed, degree)).sum()
    }

    /// ln P of an observed degree at a vertex of some degree: `ln(1 − ε)` for the right one, `ln ε/2` for one that is off by
    /// one, `ln ε/100` for others; 0 for an unknown degree.
    pub(crate) fn ln_degree(&self, observed: u8, degree: u32) -> f32 {
        let [right, near, far] = self.degree;
        match (observed, u32::from(observed).abs_diff(degree.min(u32::from(DEGREE_MAX)))) {
            (0, _) => 0.0,
            (_, 0) => right,
            (_, 1) => near,
            _ => far,
        }
    }

    /// ln P of a turn hint: `ln(1 − ε)` when it agrees with the path, `ln ε` when it does not, 0 without a hint.
    pub(crate) fn ln_turn(&self, hint: Option<Exit>, turned_back: bool) -> f32 {
        let [right, wrong] = self.turn;
        match hint {
            None => 0.0,
            Some(hint) => {
                if (hint == Exit::Back) == turned_back {
                    right
                } else {
                    wrong
                }
            }
        }
    }
}
