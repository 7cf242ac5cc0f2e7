//! Two vertices of a hypothesis become one: what that gains, and how it is done.

use super::hypothesis::{Hypothesis, join, ln};
use super::prices::{EDGE, Prices, VERTEX};
use super::tally::Tally;
use crate::map::bits;

/// A loss of evidence by the labels alone that nothing makes up for.
const HOPELESS: f32 = -30.0;

impl<const V: usize, const T: usize> Hypothesis<V, T> {
    /// Makes one vertex of two, in the path and in what left the record; the path may then hold the vertex twice in a row.
    pub(super) fn merge(&mut self, kept: u8, gone: u8, len: usize) {
        self.path.iter_mut().take(len).filter(|vertex| **vertex == gone).for_each(|vertex| *vertex = kept);
        if self.before == gone {
            self.before = kept;
        }
        let (Some(&tally), Some(&row)) =
            (self.settled.get(usize::from(gone)), self.settled_neighbours.get(usize::from(gone)))
        else {
            return;
        };
        if let Some(settled) = self.settled.get_mut(usize::from(kept)) {
            settled.add(&tally);
        }
        if let Some(settled) = self.settled.get_mut(usize::from(gone)) {
            *settled = Tally::NONE;
        }
        for neighbour in bits(u64::from(row)) {
            join(&mut self.settled_neighbours, kept, neighbour);
            if let Some(row) = self.settled_neighbours.get_mut(usize::from(neighbour)) {
                *row &= !(1 << (gone & 31));
            }
        }
        if let Some(row) = self.settled_neighbours.get_mut(usize::from(gone)) {
            *row = 0;
        }
    }

    /// How the evidence changes when two vertices that are no neighbours become one, but for the turn hints; −∞ for
    /// neighbours.
    pub(super) fn merge_gain(&self, prices: &Prices, a: u8, b: u8) -> f32 {
        if self.is_edge(a, b) {
            return f32::NEG_INFINITY;
        }
        let (one, other) = (self.tally(a), self.tally(b));
        let mut merged = one;
        merged.add(&other);
        let (row_a, row_b) = (self.row(a), self.row(b));
        let mut gain = prices.label_evidence(&merged) - prices.label_evidence(&one) - prices.label_evidence(&other);
        if gain < HOPELESS {
            return gain;
        }
        gain += prices.exit_evidence(&merged, (row_a | row_b).count_ones())
            - prices.exit_evidence(&one, row_a.count_ones())
            - prices.exit_evidence(&other, row_b.count_ones());
        for neighbour in bits(u64::from(row_a & row_b)) {
            let tally = self.tally(neighbour);
            let degree = self.degree(neighbour);
            gain += EDGE + prices.exit_evidence(&tally, degree - 1) - prices.exit_evidence(&tally, degree);
        }
        gain + VERTEX + f32::from(self.starts) * (ln(self.vertices) - ln(self.vertices.max(2) - 1))
    }

    /// Makes one vertex of two in everything but the numbers of the others; a path that visits both in a row then stays.
    pub(super) fn unite(&mut self, kept: u8, gone: u8, len: usize) {
        self.merge(kept, gone, len);
        self.tally_merged(kept, gone);
        if let Some(tally) = self.tallies.get_mut(usize::from(gone)) {
            *tally = Tally::NONE;
        }
        if let Some(row) = self.neighbours.get_mut(usize::from(gone)) {
            *row = 0;
        }
    }

    /// Counts what was merged together, before the path is found anew.
    pub(super) fn tally_merged(&mut self, kept: u8, gone: u8) {
        let merged = self.tally(gone);
        if let Some(tally) = self.tallies.get_mut(usize::from(kept)) {
            tally.add(&merged);
        }
        for neighbour in bits(u64::from(self.row(gone))).filter(|&neighbour| neighbour != kept) {
            join(&mut self.neighbours, kept, neighbour);
        }
        for row in &mut self.neighbours {
            *row &= !(1 << (gone & 31));
        }
    }
}
