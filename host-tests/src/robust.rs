//! The evidence of a hypothesis of the robust filter, from its definition (docs/inference.md).
//!
//! A hypothesis is the vertex of each observation, a [`Path`]. Within a sequence of observations the robot drove from each place
//! to the next. With `K` vertices, and `E` edges between the pairs of vertices that follow each other in a sequence, the
//! evidence is
//!
//! ```text
//! S = Σ_v ln labels(v)  +  Σ_v ln exits(v)  +  Σ_t ln turn(t)  −  sequences · ln K  +  LN_VERTEX · K  +  LN_EDGE · E
//! ```
//!
//! with the terms of [`ln_labels`], [`ln_exits`] and [`ln_turn`]. A share of [`AllPaths::bound`], the bound of the map's other
//! paths, counts as well. Labels are in steps of 2 mm; logarithms are natural.

use std::collections::BTreeSet;

/// The range over which the mean label of a vertex is uniform a priori, in steps: 2 m.
pub const LABEL_RANGE: f64 = 1000.0;
/// The shape of the inverse-gamma prior of the variance of a vertex.
pub const SHAPE: f64 = 2.0;
/// The log prior of a vertex.
pub const LN_VERTEX: f64 = 1.0;
/// The log prior of an edge.
pub const LN_EDGE: f64 = -1.5;
/// The share of the bound of the other paths that counts.
pub const OTHER_PATHS_SHARE: f64 = 0.7;
/// A priori a vertex has 1 to 7 exits; more are observed as 7.
pub const MOST_EXITS: usize = 7;

/// An observation of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The label, in steps.
    pub label: f64,
    /// The turn hint: whether the robot drove back along the edge by which it had come.
    pub turned_back: Option<bool>,
    /// The observed degree, 1 to 7.
    pub degree: Option<usize>,
    /// Whether a sequence starts here.
    pub starts_sequence: bool,
}

/// The noise of the observations.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    /// The standard deviation of a label, in steps.
    pub deviation: f64,
    /// The probability that a turn hint is wrong.
    pub wrong_turn: f64,
    /// The probability that a degree is wrong.
    pub wrong_degree: f64,
}

/// The vertex of each observation; vertices are numbered from 0 without gaps.
pub type Path = [usize];

/// A hypothesis: observations, the vertex of each, and the noise.
#[derive(Clone, Copy, Debug)]
pub struct Hypothesis<'a> {
    /// The observations; the first one starts a sequence.
    pub observations: &'a [Observation],
    /// The vertex of each observation.
    pub path: &'a Path,
    /// The noise.
    pub noise: Noise,
}

/// The log density of labels that share an unknown mean, uniform over `R` = [`LABEL_RANGE`], and an unknown variance,
/// inverse-gamma with shape `a` = [`SHAPE`] and scale `b` = a · deviation². With `n` labels and `SS` the sum of squared
/// distances from their mean
///
/// ```text
/// -ln R - (n-1)/2 · ln 2π - ½ ln n + lnΓ(a + (n-1)/2) - lnΓ(a) + a ln b - (a + (n-1)/2) · ln(b + SS/2)
/// ```
pub fn ln_labels(labels: &[f64], deviation: f64) -> f64 {
    let n = labels.len() as f64;
    let scale = SHAPE * deviation.powi(2);
    let shape = SHAPE + (n - 1.0) / 2.0;
    -LABEL_RANGE.ln() - (n - 1.0) / 2.0 * (2.0 * std::f64::consts::PI).ln() - n.ln() / 2.0 + ln_gamma(shape)
        - ln_gamma(SHAPE)
        + SHAPE * scale.ln()
        - shape * (scale + scatter(labels) / 2.0).ln()
}

/// The log probability of the transitions out of a vertex with `degree` edges, each by one of its exits with the same probability.
///
/// A vertex without an observed degree has no other exits than its edges: −exits · ln degree. Otherwise it has `d` exits,
/// `degree` to 7, each number with probability 1/7: ln Σ_d 1/7 · d^−exits · Π P(observed | d), [`degree_probability`].
pub fn ln_exits(exits: usize, degree: usize, seen: &[usize], noise: Noise) -> f64 {
    let degree = degree.max(1);
    if seen.is_empty() {
        return -(exits as f64) * (degree as f64).ln();
    }
    let ln_term = |degree: usize| ln_exits_by(degree, exits, seen, noise);
    ln_sum((degree..=degree.max(MOST_EXITS)).map(ln_term)) - (MOST_EXITS as f64).ln()
}

fn ln_exits_by(degree: usize, exits: usize, seen: &[usize], noise: Noise) -> f64 {
    let ln_seen = seen.iter().map(|&seen| degree_probability(seen, degree, noise.wrong_degree).ln());
    ln_seen.sum::<f64>() - exits as f64 * (degree as f64).ln()
}

/// The probability of an observed degree: `1 − e` for the right one, `e/2` for one that is off by one, `e/100` for any other.
/// More than 7 exits are observed as 7.
pub fn degree_probability(observed: usize, degree: usize, wrong: f64) -> f64 {
    match observed.abs_diff(degree.min(MOST_EXITS)) {
        0 => 1.0 - wrong,
        1 => wrong / 2.0,
        _ => wrong / 100.0,
    }
}

/// The log probability of a turn hint, given whether the path is back at the second last vertex.
pub fn ln_turn(turned_back: Option<bool>, is_back: bool, wrong: f64) -> f64 {
    match turned_back {
        None => 0.0,
        Some(said) if said == is_back => (1.0 - wrong).ln(),
        Some(_) => wrong.ln(),
    }
}

/// The observations of a vertex.
#[derive(Clone, Debug, Default)]
struct Vertex {
    labels: Vec<f64>,
    degrees: Vec<usize>,
    exits: usize,
    neighbours: BTreeSet<usize>,
}

/// All paths through a map.
#[derive(Clone, Debug)]
pub struct AllPaths {
    /// The bound of the other paths: −ln P(path | map, observations).
    pub bound: f64,
    /// The probability of each vertex at the newest observation.
    pub belief: Vec<f64>,
}

impl Hypothesis<'_> {
    /// The number of vertices.
    pub fn vertices(&self) -> usize {
        self.path.iter().max().map_or(0, |last| last + 1)
    }

    /// Every edge once, the smaller vertex first, in ascending order.
    pub fn edges(&self) -> BTreeSet<(usize, usize)> {
        let follows = |at: &usize| !self.observations[*at].starts_sequence;
        let edge = |at: usize| (self.path[at - 1].min(self.path[at]), self.path[at - 1].max(self.path[at]));
        (1..self.path.len()).filter(follows).map(edge).collect()
    }

    fn observed_vertices(&self) -> Vec<Vertex> {
        let mut vertices = vec![Vertex::default(); self.vertices()];
        for (at, (seen, &vertex)) in self.observations.iter().zip(self.path).enumerate() {
            vertices[vertex].labels.push(seen.label);
            vertices[vertex].degrees.extend(seen.degree);
            if !seen.starts_sequence {
                vertices[self.path[at - 1]].exits += 1;
            }
        }
        for (a, b) in self.edges() {
            vertices[a].neighbours.insert(b);
            vertices[b].neighbours.insert(a);
        }
        vertices
    }

    /// The labels of each vertex.
    pub fn labels(&self) -> Vec<Vec<f64>> {
        self.observed_vertices().into_iter().map(|vertex| vertex.labels).collect()
    }

    /// `S`: the log evidence of the path and its map.
    pub fn evidence(&self) -> f64 {
        let vertices = self.observed_vertices();
        let of_vertex = |vertex: &Vertex| {
            ln_labels(&vertex.labels, self.noise.deviation)
                + ln_exits(vertex.exits, vertex.neighbours.len(), &vertex.degrees, self.noise)
        };
        let sequences = self.observations.iter().filter(|seen| seen.starts_sequence).count() as f64;
        let size = vertices.len() as f64;
        vertices.iter().map(of_vertex).sum::<f64>() + self.ln_turns(self.path, 0) - sequences * size.ln()
            + LN_VERTEX * size
            + LN_EDGE * self.edges().len() as f64
    }

    /// The log probability of all turn hints along a path from an observation on. At the first two places of a sequence a hint has
    /// no meaning.
    fn ln_turns(&self, path: &Path, first: usize) -> f64 {
        let starts = |at: usize| self.observations[first + at].starts_sequence;
        let counts = |at: &usize| !starts(*at) && !starts(at - 1);
        let ln = |at: usize| {
            ln_turn(self.observations[first + at].turned_back, path[at] == path[at - 2], self.noise.wrong_turn)
        };
        (2..path.len()).filter(counts).map(ln).sum()
    }

    /// All paths: every walk through the map for each sequence, by enumeration.
    ///
    /// A path starts a sequence at any of the `K` vertices with the same probability, and takes each exit of a vertex, of the most
    /// likely number of exits, with the same probability. The likelihood of a label at a vertex is the expectation of its log
    /// density under the posterior of the vertex by the path of the hypothesis. With `n` labels of mean `m`, shape
    /// `a' = a + (n-1)/2` and scale `b' = b + SS/2` it is, up to a constant,
    ///
    /// ```text
    /// -½ (ln b' - ψ(a') + 1/n) - (label - m)² a' / 2b'
    /// ```
    ///
    /// Vertices that are less likely than the best one by more than `reach` are left out, except those of the path. `None` when a
    /// sequence has more than `limit` walks.
    pub fn all_paths(&self, reach: f64, limit: usize) -> Option<AllPaths> {
        let vertices = self.observed_vertices();
        let has_degrees = vertices.iter().any(|vertex| !vertex.degrees.is_empty());
        let degrees: Vec<usize> = vertices.iter().map(|vertex| likely_degree(vertex, self.noise)).collect();
        let fit = |at: usize, vertex: usize| {
            let Vertex { labels, .. } = &vertices[vertex];
            let seen = self.observations[at];
            let n = labels.len() as f64;
            let shape = SHAPE + (n - 1.0) / 2.0;
            let scale = SHAPE * self.noise.deviation.powi(2) + scatter(labels) / 2.0;
            let off = seen.label - mean(labels);
            let degree = seen.degree.filter(|_| has_degrees);
            degree.map_or(0.0, |seen| degree_probability(seen, degrees[vertex], self.noise.wrong_degree).ln())
                - (scale.ln() - digamma(shape) + 1.0 / n) / 2.0
                - off.powi(2) * shape / (2.0 * scale)
        };
        let fits: Vec<Vec<f64>> = (0..self.path.len())
            .map(|at| {
                let mut fits: Vec<f64> = (0..vertices.len()).map(|vertex| fit(at, vertex)).collect();
                let best = fits.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                for (vertex, fit) in fits.iter_mut().enumerate() {
                    if *fit < best - reach && vertex != self.path[at] {
                        *fit = f64::NEG_INFINITY;
                    }
                }
                fits
            })
            .collect();
        let ln_probability = |walk: &Path, first: usize| {
            let ln_fits = walk.iter().enumerate().map(|(at, &vertex)| fits[first + at][vertex]).sum::<f64>();
            let ln_exits = walk[..walk.len() - 1].iter().map(|&vertex| (degrees[vertex] as f64).ln()).sum::<f64>();
            ln_fits - ln_exits - (vertices.len() as f64).ln() + self.ln_turns(walk, first)
        };
        let mut result = AllPaths { bound: 0.0, belief: Vec::new() };
        for (first, length) in self.sequences() {
            let walks = walks(&vertices, length, limit)?;
            let ln_walks: Vec<f64> = walks.iter().map(|walk| ln_probability(walk, first)).collect();
            let ln_all = ln_sum(ln_walks.iter().copied());
            result.bound += ln_all - ln_probability(&self.path[first..first + length], first);
            result.belief = vec![0.0; vertices.len()];
            for (walk, ln_walk) in walks.iter().zip(ln_walks) {
                result.belief[walk[length - 1]] += (ln_walk - ln_all).exp();
            }
        }
        Some(result)
    }

    /// The first observation of each sequence, and its length.
    pub fn sequences(&self) -> Vec<(usize, usize)> {
        let mut starts: Vec<usize> = (0..self.path.len()).filter(|&at| self.observations[at].starts_sequence).collect();
        starts.push(self.path.len());
        starts.windows(2).map(|pair| (pair[0], pair[1] - pair[0])).collect()
    }
}

/// The degree of a vertex that maximises the terms of [`ln_exits`].
fn likely_degree(vertex: &Vertex, noise: Noise) -> usize {
    let least = vertex.neighbours.len().max(1);
    if vertex.degrees.is_empty() {
        return least;
    }
    let ln = |degree: usize| ln_exits_by(degree, vertex.exits, &vertex.degrees, noise);
    (least..=least.max(MOST_EXITS)).rev().max_by(|&a, &b| ln(a).total_cmp(&ln(b))).unwrap_or(least)
}

/// Every walk of `length` vertices; `None` when there are more than `limit`.
fn walks(vertices: &[Vertex], length: usize, limit: usize) -> Option<Vec<Vec<usize>>> {
    let mut walks: Vec<Vec<usize>> = (0..vertices.len()).map(|start| vec![start]).collect();
    for _ in 1..length {
        let longer = |walk: &Vec<usize>| -> Vec<Vec<usize>> {
            vertices[walk[walk.len() - 1]].neighbours.iter().map(|&next| [walk.as_slice(), &[next]].concat()).collect()
        };
        walks = walks.iter().flat_map(longer).collect();
        if walks.len() > limit {
            return None;
        }
    }
    Some(walks)
}

/// The mean of some numbers.
pub fn mean(of: &[f64]) -> f64 {
    of.iter().sum::<f64>() / of.len() as f64
}

/// The sum of squared distances of some numbers from their mean.
pub fn scatter(of: &[f64]) -> f64 {
    of.iter().map(|number| (number - mean(of)).powi(2)).sum()
}

fn ln_sum(logarithms: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = logarithms.clone().fold(f64::NEG_INFINITY, f64::max);
    largest + logarithms.map(|ln| (ln - largest).exp()).sum::<f64>().ln()
}

/// ln Γ for positive numbers: Γ(x + 1) = x Γ(x), then Stirling's series.
pub fn ln_gamma(x: f64) -> f64 {
    if x < 16.0 {
        return ln_gamma(x + 1.0) - x.ln();
    }
    let series = 1.0 / (12.0 * x) - 1.0 / (360.0 * x.powi(3)) + 1.0 / (1260.0 * x.powi(5));
    (x - 0.5) * x.ln() - x + (2.0 * std::f64::consts::PI).ln() / 2.0 + series
}

/// The derivative of ln Γ for positive numbers.
pub fn digamma(x: f64) -> f64 {
    if x < 16.0 {
        return digamma(x + 1.0) - 1.0 / x;
    }
    x.ln() - 1.0 / (2.0 * x) - 1.0 / (12.0 * x.powi(2)) + 1.0 / (120.0 * x.powi(4)) - 1.0 / (252.0 * x.powi(6))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: Noise = Noise { deviation: 10.0, wrong_turn: 0.02, wrong_degree: 0.1 };

    fn seen(labels: &[f64]) -> Vec<Observation> {
        let observation =
            |(at, &label)| Observation { label, turned_back: None, degree: None, starts_sequence: at == 0 };
        labels.iter().enumerate().map(observation).collect()
    }

    #[test]
    fn the_gamma_function_has_its_known_values() {
        assert!((ln_gamma(0.5) - std::f64::consts::PI.sqrt().ln()).abs() < 1e-11);
        assert!((ln_gamma(11.0) - 3_628_800_f64.ln()).abs() < 1e-11);
        assert!((digamma(1.0) + 0.577_215_664_901_532_9).abs() < 1e-11);
        assert!((digamma(0.5) + 0.577_215_664_901_532_9 + 4_f64.ln()).abs() < 1e-11);
    }

    /// The integral that the closed form stands for, over mean and logarithm of the variance, by the trapezoidal rule.
    #[test]
    fn the_density_of_labels_is_the_integral_over_mean_and_variance() {
        let labels = [500.0, 512.0, 497.0];
        let (scale, points) = (SHAPE * 100.0, 400);
        let mut integral = 0.0;
        for mean in 0..points {
            let mean = 380.0 + 240.0 * f64::from(mean) / f64::from(points);
            for variance in 0..points {
                let ln_variance = 10.0 * f64::from(variance) / f64::from(points);
                let variance = ln_variance.exp();
                let ln_prior = SHAPE * scale.ln() - ln_gamma(SHAPE) - SHAPE * ln_variance - scale / variance;
                let of_label = |label: &f64| {
                    -(2.0 * std::f64::consts::PI * variance).ln() / 2.0 - (label - mean).powi(2) / (2.0 * variance)
                };
                integral += (ln_prior - LABEL_RANGE.ln() + labels.iter().map(of_label).sum::<f64>()).exp();
            }
        }
        integral *= 240.0 / f64::from(points) * 10.0 / f64::from(points);
        assert!((integral.ln() - ln_labels(&labels, 10.0)).abs() < 1e-3, "{}", integral.ln());
    }

    #[test]
    fn a_single_path_has_bound_0_and_two_equal_paths_share_the_probability() {
        // From one end of a line to the other: the way back would fit as well if the labels were alike.
        let hypothesis = |labels: &'static [f64]| {
            let observations = seen(labels);
            let path: Vec<usize> = (0..labels.len()).collect();
            Hypothesis { observations: &observations, path: &path, noise: NOISE }
                .all_paths(f64::INFINITY, 1000)
                .unwrap()
        };
        let apart = hypothesis(&[100.0, 400.0, 700.0]);
        assert!(apart.bound.abs() < 1e-6 && apart.belief[2] > 1.0 - 1e-6, "{apart:?}");
        let alike = hypothesis(&[100.0, 400.0, 100.0]);
        // 0-1-2 and 2-1-0, 0-1-0 and 2-1-2 are as likely.
        assert!((alike.bound - 4_f64.ln()).abs() < 1e-6, "{alike:?}");
        assert!((alike.belief[0] - 0.5).abs() < 1e-6);
    }
}
