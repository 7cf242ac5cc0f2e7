//! The evidence that the robust filter weighs hypotheses by, from its definition.
//!
//! A hypothesis says of every observation which vertex it was made at: a [`Path`]. Observations come in sequences; within
//! one the robot drove from each place to the next. With `K` vertices and `E` edges, the pairs of vertices that follow each
//! other in a sequence, the evidence is
//!
//! ```text
//! S = Σ_v ln labels(v)  +  Σ_v ln exits(v)  +  Σ_t ln turn(t)  -  sequences · ln K  -  VERTEX · K  -  EDGE · E
//! ```
//!
//! [`ln_labels`], [`ln_exits`], [`ln_turn`] give the terms. To it comes a share of [`AllPaths::surplus`], what the other
//! paths through the same map add. Labels are counted in steps of 2 mm; logarithms are natural.

use std::collections::BTreeSet;

/// The range over which the mean label of a vertex is uniform a priori, in steps: 2 m.
pub const LABEL_RANGE: f64 = 1000.0;
/// The shape of the inverse-gamma prior of the variance of a vertex.
pub const SHAPE: f64 = 2.0;
/// The price of a vertex.
pub const VERTEX: f64 = -1.0;
/// The price of an edge.
pub const EDGE: f64 = 1.5;
/// How much of the surplus counts.
pub const SURPLUS_SHARE: f64 = 0.7;
/// A priori a vertex has 1 to 7 ways; more are seen as 7.
pub const MOST_WAYS: usize = 7;

/// One visit to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The label that was seen, in steps.
    pub label: f64,
    /// Whether the robot says that it drove back along the edge it had come by; `None` when it does not say.
    pub turned_back: Option<bool>,
    /// How many ways the robot counted, 1 to 7.
    pub degree: Option<usize>,
    /// Whether a new sequence starts here.
    pub starts_sequence: bool,
}

/// The noise of what is observed.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    /// The standard deviation of a label that is expected, in steps.
    pub deviation: f64,
    /// The probability that a turn is told wrong.
    pub wrong_turn: f64,
    /// The probability that a degree is told wrong.
    pub wrong_degree: f64,
}

/// Which vertex each observation was made at; vertices are numbered from 0 without gaps.
pub type Path = [usize];

/// Observations, the vertex of each, and the noise: what is weighed.
#[derive(Clone, Copy, Debug)]
pub struct Weighed<'a> {
    /// What was observed; the first observation starts a sequence.
    pub observations: &'a [Observation],
    /// The vertex of each observation.
    pub path: &'a Path,
    /// The noise.
    pub noise: Noise,
}

/// ln of the density of labels that share an unknown mean, uniform over `R` = [`LABEL_RANGE`], and an unknown variance,
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

/// ln of the probability of so many exits of a vertex with `degree` edges, each by one of its ways, all alike.
///
/// A vertex where no degree was seen has no other ways than its edges: −exits · ln degree. Else it may have `w` ways,
/// from `degree` to 7, each number with probability 1/7: ln Σ_w 1/7 · w^−exits · Π P(seen | w), [`degree_probability`].
pub fn ln_exits(exits: usize, degree: usize, seen: &[usize], noise: Noise) -> f64 {
    let degree = degree.max(1);
    if seen.is_empty() {
        return -(exits as f64) * (degree as f64).ln();
    }
    let ln_term = |ways: usize| ln_exits_by(ways, exits, seen, noise);
    ln_sum((degree..=degree.max(MOST_WAYS)).map(ln_term)) - (MOST_WAYS as f64).ln()
}

fn ln_exits_by(ways: usize, exits: usize, seen: &[usize], noise: Noise) -> f64 {
    let ln_seen = seen.iter().map(|&seen| degree_probability(seen, ways, noise.wrong_degree).ln());
    ln_seen.sum::<f64>() - exits as f64 * (ways as f64).ln()
}

/// The probability of a degree that is seen where there are so many ways: `1 − e` for the right one, `e/2` for one more
/// or less, `e/100` for any other; more than 7 ways are seen as 7.
pub fn degree_probability(seen: usize, ways: usize, wrong: f64) -> f64 {
    match seen.abs_diff(ways.min(MOST_WAYS)) {
        0 => 1.0 - wrong,
        1 => wrong / 2.0,
        _ => wrong / 100.0,
    }
}

/// ln of the probability of what the robot says of its turn, given whether it is back at the place before the last.
pub fn ln_turn(turned_back: Option<bool>, is_back: bool, wrong: f64) -> f64 {
    match turned_back {
        None => 0.0,
        Some(said) if said == is_back => (1.0 - wrong).ln(),
        Some(_) => wrong.ln(),
    }
}

/// What a vertex was seen as.
#[derive(Clone, Debug, Default)]
struct Vertex {
    labels: Vec<f64>,
    degrees: Vec<usize>,
    exits: usize,
    neighbours: BTreeSet<usize>,
}

/// What the paths through a map are worth together.
#[derive(Clone, Debug)]
pub struct AllPaths {
    /// −ln of the probability of the one path among all.
    pub surplus: f64,
    /// The probability of each vertex at the newest place.
    pub places: Vec<f64>,
}

impl Weighed<'_> {
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

    fn tallied(&self) -> Vec<Vertex> {
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

    /// The labels that were seen at each vertex.
    pub fn labels(&self) -> Vec<Vec<f64>> {
        self.tallied().into_iter().map(|vertex| vertex.labels).collect()
    }

    /// `S`: ln of the evidence of the path and its map.
    pub fn evidence(&self) -> f64 {
        let vertices = self.tallied();
        let of_vertex = |vertex: &Vertex| {
            ln_labels(&vertex.labels, self.noise.deviation)
                + ln_exits(vertex.exits, vertex.neighbours.len(), &vertex.degrees, self.noise)
        };
        let sequences = self.observations.iter().filter(|seen| seen.starts_sequence).count() as f64;
        let size = vertices.len() as f64;
        vertices.iter().map(of_vertex).sum::<f64>() + self.ln_turns(self.path, 0)
            - sequences * size.ln()
            - VERTEX * size
            - EDGE * self.edges().len() as f64
    }

    /// ln of the probability of all that was said about turns along a path that starts at an observation. Of the first two
    /// places of a sequence nothing can be said.
    fn ln_turns(&self, path: &Path, first: usize) -> f64 {
        let starts = |at: usize| self.observations[first + at].starts_sequence;
        let is_told = |at: &usize| !starts(*at) && !starts(at - 1);
        let ln = |at: usize| {
            ln_turn(self.observations[first + at].turned_back, path[at] == path[at - 2], self.noise.wrong_turn)
        };
        (2..path.len()).filter(is_told).map(ln).sum()
    }

    /// The other paths: every walk through the map for each sequence, by enumeration.
    ///
    /// A path starts a sequence at any of the `K` vertices, leaves each vertex by one of its ways, the most likely number
    /// of them, and explains each label at its vertex by the expectation of the logarithm of its density under what the
    /// path that is weighed says of the vertex. With `n` labels of mean `m`, shape `a' = a + (n-1)/2` and scale
    /// `b' = b + SS/2` that is, up to what all have in common,
    ///
    /// ```text
    /// -½ (ln b' - ψ(a') + 1/n) - (label - m)² a' / 2b'
    /// ```
    ///
    /// Vertices that explain a label so much worse than the best one as `reach` says are left out, but not those of the
    /// path. `None` when a sequence has more than `limit` walks.
    pub fn all_paths(&self, reach: f64, limit: usize) -> Option<AllPaths> {
        let vertices = self.tallied();
        let knows_degrees = vertices.iter().any(|vertex| !vertex.degrees.is_empty());
        let ways: Vec<usize> = vertices.iter().map(|vertex| likely_ways(vertex, self.noise)).collect();
        let fit = |at: usize, vertex: usize| {
            let Vertex { labels, .. } = &vertices[vertex];
            let seen = self.observations[at];
            let n = labels.len() as f64;
            let shape = SHAPE + (n - 1.0) / 2.0;
            let scale = SHAPE * self.noise.deviation.powi(2) + scatter(labels) / 2.0;
            let off = seen.label - mean(labels);
            let degree = seen.degree.filter(|_| knows_degrees);
            degree.map_or(0.0, |seen| degree_probability(seen, ways[vertex], self.noise.wrong_degree).ln())
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
            let ln_exits = walk[..walk.len() - 1].iter().map(|&vertex| (ways[vertex] as f64).ln()).sum::<f64>();
            ln_fits - ln_exits - (vertices.len() as f64).ln() + self.ln_turns(walk, first)
        };
        let mut result = AllPaths { surplus: 0.0, places: Vec::new() };
        for (first, length) in self.sequences() {
            let walks = walks(&vertices, length, limit)?;
            let ln_walks: Vec<f64> = walks.iter().map(|walk| ln_probability(walk, first)).collect();
            let ln_all = ln_sum(ln_walks.iter().copied());
            result.surplus += ln_all - ln_probability(&self.path[first..first + length], first);
            result.places = vec![0.0; vertices.len()];
            for (walk, ln_walk) in walks.iter().zip(ln_walks) {
                result.places[walk[length - 1]] += (ln_walk - ln_all).exp();
            }
        }
        Some(result)
    }

    /// Where each sequence starts, and how many places it has.
    pub fn sequences(&self) -> Vec<(usize, usize)> {
        let mut starts: Vec<usize> = (0..self.path.len()).filter(|&at| self.observations[at].starts_sequence).collect();
        starts.push(self.path.len());
        starts.windows(2).map(|pair| (pair[0], pair[1] - pair[0])).collect()
    }
}

/// The number of ways that explains the exits of a vertex and the degrees seen there best.
fn likely_ways(vertex: &Vertex, noise: Noise) -> usize {
    let least = vertex.neighbours.len().max(1);
    if vertex.degrees.is_empty() {
        return least;
    }
    let ln = |ways: usize| ln_exits_by(ways, vertex.exits, &vertex.degrees, noise);
    (least..=least.max(MOST_WAYS)).rev().max_by(|&a, &b| ln(a).total_cmp(&ln(b))).unwrap_or(least)
}

/// Every walk of so many vertices; `None` when there are more than `limit`.
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

/// ln Γ for positive numbers: Stirling's series behind Γ(x + 1) = x Γ(x).
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
    fn the_gamma_function_is_that_of_the_tables() {
        assert!((ln_gamma(0.5) - std::f64::consts::PI.sqrt().ln()).abs() < 1e-11);
        assert!((ln_gamma(11.0) - 3_628_800_f64.ln()).abs() < 1e-11);
        assert!((digamma(1.0) + 0.577_215_664_901_532_9).abs() < 1e-11);
        assert!((digamma(0.5) + 0.577_215_664_901_532_9 + 4_f64.ln()).abs() < 1e-11);
    }

    /// The integral that the closed form stands for, over mean and logarithm of the variance, by the trapezoidal rule.
    #[test]
    fn labels_have_the_density_of_the_integral_over_mean_and_variance() {
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
    fn a_single_path_has_no_surplus_and_two_that_look_alike_share() {
        // From one end of a line to the other: the way back would fit as well if the labels were alike.
        let weighed = |labels: &'static [f64]| {
            let observations = seen(labels);
            let path: Vec<usize> = (0..labels.len()).collect();
            Weighed { observations: &observations, path: &path, noise: NOISE }.all_paths(f64::INFINITY, 1000).unwrap()
        };
        let apart = weighed(&[100.0, 400.0, 700.0]);
        assert!(apart.surplus.abs() < 1e-6 && apart.places[2] > 1.0 - 1e-6, "{apart:?}");
        let alike = weighed(&[100.0, 400.0, 100.0]);
        // 0-1-2 and 2-1-0, 0-1-0 and 2-1-2 are as likely.
        assert!((alike.surplus - 4_f64.ln()).abs() < 1e-6, "{alike:?}");
        assert!((alike.places[0] - 0.5).abs() < 1e-6);
    }
}
