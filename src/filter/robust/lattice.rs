//! What a decoder needs of a hypothesis: how well each vertex explains a place, and what a move costs.

use super::hypothesis::{Hypothesis, NOWHERE};
use super::prices::{Prices, SHAPE, digamma};
use super::record::{Entry, Record};

/// How many vertices are considered for one place: those that explain its label best.
pub(super) const WIDTH: usize = 8;

/// A vertex that explains a label so many nats worse than the best one is not considered.
const REACH: f32 = 15.0;

/// The vertices considered for one place, the best first, and ln of how well they explain it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub(super) len: usize,
    pub(super) vertices: [u8; WIDTH],
    pub(super) fits: [f32; WIDTH],
}

impl Column {
    pub(super) const EMPTY: Self = Self { len: 0, vertices: [NOWHERE; WIDTH], fits: [f32::NEG_INFINITY; WIDTH] };

    pub(super) fn vertices(&self) -> &[u8] {
        self.vertices.get(..self.len).unwrap_or(&[])
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (u8, f32)> + '_ {
        self.vertices.iter().copied().zip(self.fits.iter().copied()).take(self.len)
    }

    pub(super) fn position(&self, vertex: u8) -> usize {
        self.vertices().iter().position(|&held| held == vertex).unwrap_or(WIDTH)
    }

    /// Makes a vertex one of those considered, in place of the last when there is no room.
    pub(super) fn include(&mut self, vertex: u8, fit: f32) {
        self.len = self.len.min(WIDTH - 1);
        self.insert(vertex, fit);
    }

    fn insert(&mut self, vertex: u8, fit: f32) {
        let mut slot = self.len.min(WIDTH - 1);
        if self.len == WIDTH && self.fits.last().is_some_and(|&worst| fit <= worst) {
            return;
        }
        while slot > 0 {
            let Some(&before) = self.fits.get(slot - 1) else { break };
            if before >= fit {
                break;
            }
            if let Some(to) = self.fits.get_mut(slot) {
                *to = before;
            }
            let moved = self.vertices.get(slot - 1).copied().unwrap_or(NOWHERE);
            if let Some(to) = self.vertices.get_mut(slot) {
                *to = moved;
            }
            slot -= 1;
        }
        if let (Some(to), Some(held)) = (self.fits.get_mut(slot), self.vertices.get_mut(slot)) {
            *to = fit;
            *held = vertex;
        }
        self.len = (self.len + 1).min(WIDTH);
    }
}

/// The noise model of a vertex: its mean label, half the precision, and what does not depend on the label.
#[derive(Clone, Copy, Debug)]
struct Emission {
    mean: f32,
    half_precision: f32,
    constant: f32,
}

/// The model of one hypothesis.
#[derive(Clone, Debug)]
pub(super) struct Model<const V: usize> {
    vertices: u8,
    emissions: [Emission; V],
    ways: [u32; V],
    /// ln of the probability of each way out of a vertex.
    ln_exit: [f32; V],
    exit: [f32; V],
    neighbours: [u32; V],
    /// Edges that were driven more than once.
    firm: [u32; V],
    has_degrees: bool,
}

/// Which emission a model has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Weighing {
    /// The density that the next label of the vertex would have: for decoding.
    Predictive,
    /// The expectation of the logarithm of the density under the posterior of the vertex: for the evidence.
    Expected,
}

impl<const V: usize> Model<V> {
    pub(super) const fn new() -> Self {
        Self {
            vertices: 0,
            emissions: [Emission { mean: 0.0, half_precision: 0.0, constant: 0.0 }; V],
            ways: [0; V],
            ln_exit: [0.0; V],
            exit: [0.0; V],
            neighbours: [0; V],
            firm: [0; V],
            has_degrees: false,
        }
    }

    pub(super) fn read<const T: usize>(
        &mut self,
        prices: &Prices,
        record: &Record<T>,
        hypothesis: &Hypothesis<V, T>,
        weighing: Weighing,
    ) {
        self.vertices = hypothesis.vertices;
        self.neighbours = hypothesis.neighbours;
        self.has_degrees = false;
        for vertex in 0..hypothesis.vertices {
            let slot = usize::from(vertex);
            let tally = hypothesis.tally(vertex);
            let visits = f32::from(tally.visits);
            let shape = SHAPE + 0.5 * (visits - 1.0).max(0.0);
            let scale = prices.scale + 0.5 * tally.scatter();
            self.has_degrees |= tally.knows_degrees();
            let ways = prices.likely_degree(&tally, hypothesis.degree(vertex));
            let (half_precision, constant) = match weighing {
                Weighing::Predictive => {
                    let variance = scale / shape * (1.0 + 1.0 / visits.max(1.0));
                    (0.5 / variance, -0.5 * libm::logf(variance))
                }
                Weighing::Expected => {
                    (0.5 * shape / scale, -0.5 * (libm::logf(scale) - digamma(shape) + 1.0 / visits.max(1.0)))
                }
            };
            if let (Some(emission), Some(ln_exit), Some(exit), Some(way)) = (
                self.emissions.get_mut(slot),
                self.ln_exit.get_mut(slot),
                self.exit.get_mut(slot),
                self.ways.get_mut(slot),
            ) {
                *emission = Emission { mean: tally.mean(), half_precision, constant };
                *ln_exit = -libm::logf(ways as f32);
                *exit = 1.0 / ways as f32;
                *way = ways;
            }
        }
        // The evidence counts every edge alike.
        if weighing == Weighing::Predictive {
            self.find_firm(record, hypothesis);
        }
    }

    fn find_firm<const T: usize>(&mut self, record: &Record<T>, hypothesis: &Hypothesis<V, T>) {
        let mut once = [0_u32; V];
        self.firm = [0; V];
        for vertex in 0..hypothesis.vertices {
            if let Some(firm) = self.firm.get_mut(usize::from(vertex)) {
                *firm = hypothesis.settled_row(vertex);
            }
        }
        let mut from = hypothesis.before;
        for (entry, &vertex) in record.iter().zip(&hypothesis.path) {
            if !entry.begins() && from != NOWHERE {
                for (a, b) in [(from, vertex), (vertex, from)] {
                    let bit = 1 << (b & 31);
                    if let (Some(once), Some(firm)) = (once.get_mut(usize::from(a)), self.firm.get_mut(usize::from(a)))
                    {
                        *firm |= *once & bit;
                        *once |= bit;
                    }
                }
            }
            from = vertex;
        }
    }

    /// ln of the probability of a move, without the choice of the way: 0 along an established edge.
    pub(super) fn is_firm(&self, from: u8, to: u8) -> bool {
        self.firm.get(usize::from(from)).is_some_and(|row| row >> (to & 31) & 1 == 1)
    }

    pub(super) fn is_edge(&self, from: u8, to: u8) -> bool {
        self.neighbours.get(usize::from(from)).is_some_and(|row| row >> (to & 31) & 1 == 1)
    }

    pub(super) fn ln_exit(&self, from: u8) -> f32 {
        self.ln_exit.get(usize::from(from)).copied().unwrap_or(0.0)
    }

    pub(super) fn exit(&self, from: u8) -> f32 {
        self.exit.get(usize::from(from)).copied().unwrap_or(0.0)
    }

    /// ln of how well a vertex explains a place.
    pub(super) fn fit(&self, prices: &Prices, vertex: u8, entry: Entry) -> f32 {
        let slot = usize::from(vertex);
        let Some(emission) = self.emissions.get(slot) else { return f32::NEG_INFINITY };
        let off = f32::from(entry.steps) - emission.mean;
        let fit = emission.constant - off * off * emission.half_precision;
        if !self.has_degrees || entry.degree() == 0 {
            return fit;
        }
        fit + prices.degree(entry.degree(), self.ways.get(slot).copied().unwrap_or(1))
    }

    /// The vertices to consider for a place; `allowed` is a bit row.
    pub(super) fn column(&self, prices: &Prices, entry: Entry, allowed: u32, column: &mut Column) {
        column.len = 0;
        for vertex in (0..self.vertices).filter(|vertex| allowed >> (vertex & 31) & 1 == 1) {
            let fit = self.fit(prices, vertex, entry);
            let best = if column.len == 0 { f32::NEG_INFINITY } else { column.fits.first().copied().unwrap_or(0.0) };
            // Two stay in any case: no place follows itself, so one alone would lead nowhere.
            if fit >= best - REACH || column.len < 2 {
                column.insert(vertex, fit);
            }
        }
    }
}
