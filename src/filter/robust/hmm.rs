//! A hypothesis as a hidden Markov model: the emission of each vertex and the transitions between vertices.

use super::column::{Column, Slot};
use super::history::{ObservationHistory, PackedObservation};
use super::hypothesis::Hypothesis;
use super::model::{Model, SHAPE};
use super::special_functions::digamma;
use crate::map::{PerVertex, VertexId, VertexSet32};

/// A vertex whose emission is this much less likely than the best one is left out of a column, in nats.
const REACH: f32 = 15.0;

/// The log density of a label at a vertex, `constant − half_precision (label − mean)²`.
#[derive(Clone, Copy, Debug)]
struct Emission {
    mean: f32,
    half_precision: f32,
    constant: f32,
}

/// The transitions out of a vertex: each exit has the same probability.
#[derive(Clone, Copy, Debug)]
struct Exits {
    degree: u32,
    probability: f32,
    ln_probability: f32,
}

/// Which emissions a model has. For n labels of scatter Q, with a_n = a + (n−1)/2 and b_n = b + Q/2:
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Emissions {
    /// The normal density of the variance of the next label, `b_n / a_n (1 + 1/n)`: for decoding.
    Predictive,
    /// The expectation of the log density under the posterior of mean and variance:
    /// `−½ (ln b_n − ψ(a_n) + 1/n) − ½ a_n / b_n (label − mean)²`. For the bound of the other paths.
    Expected,
}

/// The hidden Markov model of one hypothesis.
#[derive(Clone, Debug)]
pub(super) struct Hmm<const V: usize> {
    vertices: u8,
    emissions: PerVertex<Emission, V>,
    exits: PerVertex<Exits, V>,
    neighbours: PerVertex<VertexSet32, V>,
    /// The neighbours along edges that were driven more than once.
    established: PerVertex<VertexSet32, V>,
    has_degrees: bool,
}

impl<const V: usize> Hmm<V> {
    pub(super) const fn new() -> Self {
        Self {
            vertices: 0,
            emissions: PerVertex::filled(Emission { mean: 0.0, half_precision: 0.0, constant: 0.0 }),
            exits: PerVertex::filled(Exits { degree: 0, probability: 0.0, ln_probability: 0.0 }),
            neighbours: PerVertex::filled(VertexSet32::EMPTY),
            established: PerVertex::filled(VertexSet32::EMPTY),
            has_degrees: false,
        }
    }

    /// Takes the statistics and edges of a hypothesis. Cost: O(V), and O(T) for predictive emissions.
    pub(super) fn read<const T: usize>(
        &mut self,
        model: &Model,
        history: &ObservationHistory<T>,
        hypothesis: &Hypothesis<V, T>,
        emissions: Emissions,
    ) {
        self.vertices = hypothesis.vertices;
        self.neighbours = hypothesis.neighbours;
        self.has_degrees = false;
        for vertex in hypothesis.vertices() {
            let statistics = &hypothesis.statistics[vertex];
            let visits = f32::from(statistics.visits);
            let shape = SHAPE + 0.5 * (visits - 1.0).max(0.0);
            let scale = model.scale + 0.5 * statistics.scatter;
            self.has_degrees |= statistics.has_degrees();
            let degree = model.likely_degree(statistics, hypothesis.degree(vertex));
            let (half_precision, constant) = match emissions {
                Emissions::Predictive => {
                    let variance = scale / shape * (1.0 + 1.0 / visits.max(1.0));
                    (0.5 / variance, -0.5 * libm::logf(variance))
                }
                Emissions::Expected => {
                    (0.5 * shape / scale, -0.5 * (libm::logf(scale) - digamma(shape) + 1.0 / visits.max(1.0)))
                }
            };
            self.emissions[vertex] = Emission { mean: statistics.mean, half_precision, constant };
            self.exits[vertex] =
                Exits { degree, probability: 1.0 / degree as f32, ln_probability: -libm::logf(degree as f32) };
        }
        // The bound counts all edges alike.
        if emissions == Emissions::Predictive {
            self.find_established(history, hypothesis);
        }
    }

    fn find_established<const T: usize>(&mut self, history: &ObservationHistory<T>, hypothesis: &Hypothesis<V, T>) {
        let mut driven = PerVertex::<VertexSet32, V>::filled(VertexSet32::EMPTY);
        self.established = hypothesis.marginalised_neighbours;
        let mut from = hypothesis.before;
        for (observation, &vertex) in history.iter().zip(&hypothesis.path) {
            if let Some(from) = from
                && !observation.starts_sequence()
            {
                for (a, b) in [(from, vertex), (vertex, from)] {
                    let edge = VertexSet32::from(b);
                    self.established[a] |= driven[a] & edge;
                    driven[a] |= edge;
                }
            }
            from = Some(vertex);
        }
    }

    /// The neighbours of a vertex along edges that were driven more than once. A vertex is not its own neighbour.
    pub(super) fn established(&self, vertex: VertexId) -> VertexSet32 {
        self.established[vertex] - VertexSet32::from(vertex)
    }

    /// The neighbours of a vertex.
    pub(super) fn neighbours(&self, vertex: VertexId) -> VertexSet32 {
        self.neighbours[vertex]
    }

    /// Whether an edge joins two vertices that was driven more than once.
    pub(super) fn is_established(&self, from: VertexId, to: VertexId) -> bool {
        self.established[from].contains(to)
    }

    /// Whether an edge joins two vertices.
    pub(super) fn is_edge(&self, from: VertexId, to: VertexId) -> bool {
        self.neighbours[from].contains(to)
    }

    /// The probability of each exit of a vertex.
    pub(super) fn exit(&self, from: VertexId) -> f32 {
        self.exits[from].probability
    }

    /// ln of [`Hmm::exit`].
    pub(super) fn ln_exit(&self, from: VertexId) -> f32 {
        self.exits[from].ln_probability
    }

    /// The log likelihood of an observation at a vertex, of label and degree.
    pub(super) fn ln_emission(&self, model: &Model, vertex: VertexId, observation: PackedObservation) -> f32 {
        let emission = &self.emissions[vertex];
        let off = f32::from(observation.steps) - emission.mean;
        let ln_label = emission.constant - off * off * emission.half_precision;
        if !self.has_degrees || observation.degree() == 0 {
            return ln_label;
        }
        ln_label + model.ln_degree(observation.degree(), self.exits[vertex].degree)
    }

    /// Fills a column with the vertices of the highest likelihoods.
    pub(super) fn fill(
        &self,
        model: &Model,
        observation: PackedObservation,
        allowed: VertexSet32,
        column: &mut Column,
    ) {
        let vertices = VertexId::first(self.vertices.into()).filter(|&vertex| allowed.contains(vertex));
        let mut ln_emissions = PerVertex::<f32, V>::filled(f32::NEG_INFINITY);
        let mut best = f32::NEG_INFINITY;
        for vertex in vertices.clone() {
            let ln_emission = self.ln_emission(model, vertex, observation);
            ln_emissions[vertex] = ln_emission;
            if ln_emission > best {
                best = ln_emission;
            }
        }
        column.clear();
        for vertex in vertices.clone().filter(|&vertex| ln_emissions[vertex] >= best - REACH) {
            column.insert(vertex, ln_emissions[vertex]);
        }
        if column.len() == 1 {
            // Two stay in any case: no path stays at a vertex, so one alone would lead nowhere.
            let only = column.vertex(Slot::FIRST);
            let others = vertices.filter(|&vertex| Some(vertex) != only).map(|vertex| (vertex, ln_emissions[vertex]));
            if let Some((vertex, ln_emission)) = others.reduce(|one, other| if other.1 > one.1 { other } else { one }) {
                column.insert(vertex, ln_emission);
            }
        }
    }
}
