//! One more place: what a hypothesis gains when the newest observation is at a vertex.

use super::hypothesis::{Hypothesis, NOWHERE, edge_key, join, keyed, ln};
use super::prices::{EDGE, Prices, VERTEX};
use super::record::{Entry, Record};

/// What it costs to believe that the robot was carried to another place of a map that is kept as it is, in nats.
const CARRIED: f32 = 8.0;

impl<const V: usize, const T: usize> Hypothesis<V, T> {
    /// How the evidence changes when the newest observation, number `index` of the record, is at a vertex, and the key
    /// of the map then. A vertex behind the last is a new one.
    #[inline(never)]
    pub(super) fn gain(
        &self,
        prices: &Prices,
        record: &Record<T>,
        index: usize,
        entry: Entry,
        vertex: u8,
    ) -> (f32, u32) {
        let is_new = vertex == self.vertices;
        let vertices = self.vertices + u8::from(is_new);
        let from = if entry.begins() { NOWHERE } else { self.place };
        let mut seen = self.tally(vertex);
        seen.include(entry);
        let mut gain = prices.label_evidence(&seen) - prices.label_evidence(&self.tally(vertex));
        let degree = self.degree(vertex);
        let mut map_key = self.map_key;
        let mut degree_then = degree;
        if from == NOWHERE {
            let starts = f32::from(self.starts);
            gain -= (starts + 1.0) * ln(vertices) - starts * ln(self.vertices.max(1));
        } else {
            let mut left = self.tally(from);
            let before = prices.exit_evidence(&left, self.degree(from));
            left.exits = left.exits.saturating_add(1);
            let is_new_edge = !self.is_edge(from, vertex);
            gain += prices.exit_evidence(&left, self.degree(from) + u32::from(is_new_edge)) - before;
            if is_new_edge {
                gain -= EDGE;
                degree_then += 1;
                map_key ^= edge_key(from, vertex);
            }
            gain += self.hint(prices, record, index, entry, vertex);
            if is_new {
                gain -= f32::from(self.starts) * (ln(vertices) - ln(self.vertices));
            }
        }
        if degree_then != degree || entry.degree() > 0 {
            gain += prices.exit_evidence(&seen, degree_then) - prices.exit_evidence(&self.tally(vertex), degree);
        }
        if is_new {
            gain -= VERTEX;
        }
        (gain, keyed(map_key, vertices, vertex))
    }

    /// Whether a vertex for observation `index` is the place before the last.
    fn goes_back(&self, index: usize, vertex: u8) -> bool {
        match index {
            0 => false,
            1 => self.before == vertex,
            _ => self.at(index - 2) == vertex,
        }
    }

    /// As [`Hypothesis::gain`], for a map that is kept as it is: how well the newest observation fits a vertex, and what the
    /// way there costs. Where there is no edge the robot may have been carried.
    #[inline(never)]
    pub(super) fn arrival(
        &self,
        prices: &Prices,
        record: &Record<T>,
        index: usize,
        entry: Entry,
        vertex: u8,
    ) -> (f32, u32) {
        let tally = self.tally(vertex);
        let mut seen = tally;
        seen.include(entry);
        let fit = prices.label_evidence(&seen) - prices.label_evidence(&tally)
            + prices.degree(entry.degree(), prices.likely_degree(&tally, self.degree(vertex)));
        let way = if self.place == NOWHERE || entry.begins() {
            -ln(self.vertices)
        } else if self.is_edge(self.place, vertex) {
            let ways = prices.likely_degree(&self.tally(self.place), self.degree(self.place));
            self.hint(prices, record, index, entry, vertex) - libm::logf(ways as f32)
        } else {
            -ln(self.vertices) - CARRIED
        };
        (fit + way, keyed(self.map_key, self.vertices, vertex))
    }

    /// Takes the newest observation as one of a vertex of a map that is kept as it is.
    pub(super) fn arrive(&mut self, index: usize, vertex: u8, gain: f32) {
        self.evidence += gain;
        if let Some(slot) = self.path.get_mut(index) {
            *slot = vertex;
        }
        self.place = vertex;
    }

    /// Takes the newest observation, number `index` of the record, as one of a vertex, for a gain that was computed before.
    pub(super) fn extend(
        &mut self,
        prices: &Prices,
        record: &Record<T>,
        index: usize,
        entry: Entry,
        vertex: u8,
        gain: f32,
    ) {
        self.evidence += gain;
        if vertex == self.vertices {
            self.vertices += 1;
        }
        if entry.begins() || self.place == NOWHERE {
            self.starts = self.starts.saturating_add(1);
        } else {
            self.hints += self.hint(prices, record, index, entry, vertex);
            if let Some(left) = self.tallies.get_mut(usize::from(self.place)) {
                left.exits = left.exits.saturating_add(1);
            }
            if !self.is_edge(self.place, vertex) {
                self.map_key ^= edge_key(self.place, vertex);
                join(&mut self.neighbours, self.place, vertex);
            }
        }
        if let Some(tally) = self.tallies.get_mut(usize::from(vertex)) {
            tally.include(entry);
        }
        if let Some(slot) = self.path.get_mut(index) {
            *slot = vertex;
        }
        self.place = vertex;
    }

    /// ln P of the turn hint of observation `index`, were it at a vertex.
    pub(super) fn hint(&self, prices: &Prices, record: &Record<T>, index: usize, entry: Entry, vertex: u8) -> f32 {
        let begins_before = index.checked_sub(1).and_then(|before| record.get(before)).is_some_and(Entry::begins);
        if entry.begins() || begins_before { 0.0 } else { prices.turn(entry.turn(), self.goes_back(index, vertex)) }
    }
}
