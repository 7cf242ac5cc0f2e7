//! Categories of labels: vertices of a hypothesis whose labels are alike, or the labels of a history.

use crate::filter::robust::history::ObservationHistory;
use crate::filter::robust::hypothesis::Hypothesis;
use crate::filter::robust::model::Model;
use crate::map::{PerVertex, VertexId};

/// How many categories there are at most.
pub(super) const CATEGORIES: usize = 16;

/// The visits that the noise of the model counts for in the variance of a category.
const PRIOR_VISITS: f32 = 4.0;

/// The standard deviations by which vertices of few visits may be farther apart.
const UNCERTAINTY: f32 = 0.5;

/// How often labels are assigned to the nearest mean.
const PARTITIONS: usize = 2;

/// The number of a category.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Category(u8);

impl Category {
    pub(super) const FIRST: Self = Self(0);

    pub(super) const fn index(self) -> usize {
        self.0 as usize & (CATEGORIES - 1)
    }

    pub(super) const fn bit(self) -> u16 {
        1 << self.index()
    }

    pub(super) fn all() -> impl Iterator<Item = Self> + Clone {
        (0..CATEGORIES as u8).map(Self)
    }
}

/// The labels of a category: a normal distribution, in steps.
#[derive(Clone, Copy, Debug)]
struct Density {
    mean: f32,
    half_precision: f32,
    constant: f32,
}

/// The categories of a hypothesis.
#[derive(Clone, Debug)]
pub(super) struct Categories {
    len: u8,
    densities: [Density; CATEGORIES],
}

impl Categories {
    pub(super) const fn new() -> Self {
        Self { len: 0, densities: [Density { mean: 0.0, half_precision: 0.0, constant: 0.0 }; CATEGORIES] }
    }

    /// The mean label of a category, in steps.
    pub(super) fn mean(&self, category: Category) -> f32 {
        self.densities[category.index()].mean
    }

    /// The categories with ln of the density of a label.
    pub(super) fn ln_densities(&self, steps: u16) -> impl Iterator<Item = (Category, f32)> {
        Category::all().take(self.len.into()).map(move |category| (category, self.ln_density(category, steps)))
    }

    /// ln of the density of a label in a category, without its constant.
    pub(super) fn ln_density(&self, category: Category, steps: u16) -> f32 {
        let density = &self.densities[category.index()];
        let off = f32::from(steps) - density.mean;
        density.constant - density.half_precision * off * off
    }

    /// Merges vertices of a hypothesis by their labels: those next to each other whose distance, minus
    /// `0.5 s √(1/n₁ + 1/n₂)`, is least, while it is less than `reach` standard deviations of the noise, or more categories are left
    /// than there is room for. Returns the category of each vertex.
    pub(super) fn find<const V: usize, const T: usize>(
        &mut self,
        model: &Model,
        hypothesis: &Hypothesis<V, T>,
        reach: f32,
    ) -> PerVertex<Category, V> {
        let noise = model.noise_steps();
        // Each vertex is a member of the first one of its group.
        let mut statistics = hypothesis.statistics;
        let mut group = PerVertex::<VertexId, V>::filled(VertexId::FIRST);
        hypothesis.vertices().for_each(|vertex| group[vertex] = vertex);
        let mut left = usize::from(hypothesis.vertices);
        loop {
            let mut closest = (f32::INFINITY, VertexId::FIRST, VertexId::FIRST);
            for a in hypothesis.vertices().filter(|&vertex| group[vertex] == vertex) {
                for b in hypothesis.vertices().skip(a.index() + 1).filter(|&vertex| group[vertex] == vertex) {
                    let [one, other] = [&statistics[a], &statistics[b]];
                    let [n1, n2] = [one, other].map(|held| f32::from(held.visits.max(1)));
                    let near = UNCERTAINTY * noise * libm::sqrtf(1.0 / n1 + 1.0 / n2);
                    let distance = (one.mean - other.mean).abs() - near;
                    if distance < closest.0 {
                        closest = (distance, a, b);
                    }
                }
            }
            let (distance, kept, removed) = closest;
            if kept == removed || distance > reach * noise && left <= CATEGORIES {
                break;
            }
            let more = statistics[removed];
            statistics[kept].add(&more);
            for member in hypothesis.vertices() {
                if group[member] == removed {
                    group[member] = kept;
                }
            }
            left -= 1;
        }
        self.len = 0;
        let mut categories = PerVertex::<Category, V>::filled(Category::FIRST);
        for first in hypothesis.vertices() {
            if group[first] != first {
                categories[first] = categories[group[first]];
                continue;
            }
            categories[first] = Category(self.len);
            let held = &statistics[first];
            self.add(held.mean, held.scatter, held.visits.into(), noise);
        }
        categories
    }

    /// Adds a category.
    fn add(&mut self, mean: f32, scatter: f32, visits: f32, noise: f32) {
        let variance = (scatter + PRIOR_VISITS * noise * noise) / (visits + PRIOR_VISITS);
        self.densities[Category(self.len).index()] =
            Density { mean: libm::roundf(mean), half_precision: 0.5 / variance, constant: -0.5 * libm::logf(variance) };
        self.len += 1;
    }

    /// Partitions the labels of a history: the smallest ones up to `2 · reach` standard deviations of the noise apart, then the next ones,
    /// and so on. Then each label joins the category with the nearest mean, twice (Lloyd). Cost: O(T · categories).
    pub(super) fn find_in<const T: usize>(&mut self, model: &Model, history: &ObservationHistory<T>, reach: f32) {
        let noise = model.noise_steps();
        let labels = || history.iter().map(|observation| f32::from(observation.steps));
        let mut means = [0.0; CATEGORIES];
        let mut len = 0;
        let mut above = f32::NEG_INFINITY;
        for mean in &mut means {
            let least = labels().filter(|&label| label > above).fold(f32::INFINITY, f32::min);
            if least == f32::INFINITY {
                break;
            }
            above = least + 2.0 * reach * noise;
            *mean = mean_of(labels().filter(|&label| label >= least && label <= above));
            len += 1;
        }
        let mut sums = [(0.0, 0.0, 0.0); CATEGORIES];
        for _ in 0..PARTITIONS {
            sums = [(0.0, 0.0, 0.0); CATEGORIES];
            for label in labels() {
                let mut nearest = (f32::INFINITY, 0);
                for (number, mean) in means.iter().enumerate().take(len) {
                    let off = (label - mean).abs();
                    if off < nearest.0 {
                        nearest = (off, number);
                    }
                }
                if let (Some((visits, sum, squares)), Some(mean)) = (sums.get_mut(nearest.1), means.get(nearest.1)) {
                    *visits += 1.0;
                    *sum += label - mean;
                    *squares += nearest.0 * nearest.0;
                }
            }
            for (mean, (visits, sum, _)) in means.iter_mut().zip(&sums) {
                *mean += if *visits > 0.0 { sum / visits } else { 0.0 };
            }
        }
        self.len = 0;
        for (mean, (visits, sum, squares)) in means.into_iter().zip(sums).take(len) {
            // The squares are about the mean before.
            self.add(mean, (squares - sum * sum / visits.max(1.0)).max(0.0), visits, noise);
        }
    }
}

/// The mean of some labels.
fn mean_of(labels: impl Iterator<Item = f32>) -> f32 {
    let (sum, count) = labels.fold((0.0, 0.0), |(sum, count), label| (sum + label, count + 1.0_f32));
    sum / count.max(1.0)
}
