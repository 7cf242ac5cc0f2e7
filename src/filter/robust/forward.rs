//! The evidence of a map over all paths, not the best one alone: the forward pass over pairs of successive places.
//!
//! With labels weighed by the expectation of their log density under the posterior of each vertex, the collapsed evidence
//! of a path plus −ln of the probability of that path among all paths of the map is a lower bound of the evidence of the
//! map (the variational bound with the labels' posterior held at what the path says). It needs no second pass.

use super::hypothesis::{Hypothesis, NOWHERE};
use super::lattice::{Column, Model, WIDTH, Weighing};
use super::prices::{Prices, SURPLUS_SHARE};
use super::record::Record;

/// Products of likelihoods are turned into logarithms when they leave this range.
const SMALL: f32 = 1e-12;

/// The working memory of the forward pass.
#[derive(Clone, Debug)]
pub(super) struct Forward<const V: usize> {
    cells: [[[f32; WIDTH]; WIDTH]; 2],
    /// The probability of each vertex at the newest place.
    pub(super) belief: [f32; V],
}

impl<const V: usize> Forward<V> {
    pub(super) const fn new() -> Self {
        Self { cells: [[[0.0; WIDTH]; WIDTH]; 2], belief: [0.0; V] }
    }

    /// Computes how much the map of a hypothesis gains from its other paths, and the distribution of its newest place.
    pub(super) fn soften<const T: usize>(
        &mut self,
        prices: &Prices,
        record: &Record<T>,
        model: &mut Model<V>,
        hypothesis: &mut Hypothesis<V, T>,
    ) {
        model.read(prices, record, hypothesis, Weighing::Expected);
        hypothesis.surplus = SURPLUS_SHARE * self.surplus(prices, record, model, hypothesis);
    }

    /// −ln of the probability of the path of a hypothesis among all paths of its map, 0 or more. Leaves the distribution
    /// of the newest place in `belief`. Cost: O(T · (V + WIDTH²)).
    fn surplus<const T: usize>(
        &mut self,
        prices: &Prices,
        record: &Record<T>,
        model: &Model<V>,
        hypothesis: &Hypothesis<V, T>,
    ) -> f32 {
        let mut columns = [Column::EMPTY; 3];
        let [cells, next] = &mut self.cells;
        let start = 1.0 / f32::from(hypothesis.vertices.max(1));
        let mut second_of_sequence = false;
        let mut ln_all = 0.0_f32;
        let mut ln_path = 0.0_f32;
        let mut scale = 1.0_f32;
        let mut on_path = NOWHERE;
        let mut before_path = NOWHERE;
        let mut rows = 0;
        for (index, (entry, &on_path_now)) in record.iter().zip(&hypothesis.path).enumerate() {
            let [earlier, here, there] = &mut columns;
            model.column(prices, entry, u32::MAX, there);
            if there.position(on_path_now) == WIDTH {
                there.include(on_path_now, model.fit(prices, on_path_now, entry));
            }
            let best_fit = there.fits.first().copied().unwrap_or(0.0);
            let mut weights = [0.0_f32; WIDTH];
            for (weight, (vertex, fit)) in weights.iter_mut().zip(there.iter()) {
                *weight = if fit == best_fit { 1.0 } else { libm::expf(fit - best_fit) };
                if vertex == on_path_now {
                    ln_path += fit - best_fit;
                }
            }
            let begins = entry.begins() || index == 0;
            let mut total = 0.0;
            *next = [[0.0; WIDTH]; WIDTH];
            if begins {
                let from = if entry.begins() { NOWHERE } else { hypothesis.before };
                for (slot, (&vertex, weight)) in there.vertices().iter().zip(weights).enumerate() {
                    let way = match from {
                        NOWHERE => start,
                        from if model.is_edge(from, vertex) => model.exit(from),
                        _ => 0.0,
                    };
                    if vertex == on_path_now {
                        ln_path += libm::logf(way);
                    }
                    // All paths of the sequence before lead here.
                    let probability = way * weight;
                    total += probability;
                    if let Some(cell) = next.first_mut().and_then(|row| row.get_mut(slot)) {
                        *cell = probability;
                    }
                }
            } else {
                let hint = if second_of_sequence { None } else { entry.turn() };
                let (ln_on, ln_back) = (prices.turn(hint, false), prices.turn(hint, true));
                let (on, back) = if hint.is_some() { (libm::expf(ln_on), libm::expf(ln_back)) } else { (1.0, 1.0) };
                ln_path += model.ln_exit(on_path) + if before_path == on_path_now { ln_back } else { ln_on };
                let mut earlier_slots = [WIDTH; WIDTH];
                if hint.is_some() {
                    for (slot, &vertex) in earlier_slots.iter_mut().zip(there.vertices()) {
                        *slot = earlier.position(vertex);
                    }
                }
                // Without a turn hint behind, the ways to a vertex need not be told apart.
                let together = record.forgets_way(index);
                for (slot, &from) in here.vertices().iter().enumerate() {
                    let sum: f32 = cells.iter().take(rows).filter_map(|row| row.get(slot)).sum();
                    if sum <= 0.0 {
                        continue;
                    }
                    let exit = model.exit(from);
                    for (to_slot, ((&to, weight), &earlier_slot)) in
                        there.vertices().iter().zip(weights).zip(&earlier_slots).enumerate()
                    {
                        if !model.is_edge(from, to) {
                            continue;
                        }
                        let returning = cells.get(earlier_slot).and_then(|row| row.get(slot)).copied().unwrap_or(0.0);
                        let probability = exit * weight * (on * (sum - returning) + back * returning);
                        total += probability;
                        if let Some(cell) =
                            next.get_mut(if together { 0 } else { slot }).and_then(|row| row.get_mut(to_slot))
                        {
                            *cell += probability;
                        }
                    }
                }
            }
            if total <= 0.0 || !total.is_finite() {
                return 0.0;
            }
            let normaliser = 1.0 / total;
            rows = if begins || record.forgets_way(index) { 1 } else { here.len };
            for row in next.iter_mut().take(rows) {
                row.iter_mut().for_each(|cell| *cell *= normaliser);
            }
            scale *= total;
            if scale < SMALL {
                ln_all += libm::logf(scale);
                scale = 1.0;
            }
            (before_path, on_path) = (if begins { NOWHERE } else { on_path }, on_path_now);
            second_of_sequence = begins;
            core::mem::swap(cells, next);
            columns.rotate_left(1);
        }
        ln_all += libm::logf(scale);
        self.belief = [0.0; V];
        if let Some(column) = columns.get(1) {
            for (slot, &vertex) in column.vertices().iter().enumerate() {
                let probability = self.cells[0].iter().filter_map(|row| row.get(slot)).sum();
                if let Some(belief) = self.belief.get_mut(usize::from(vertex)) {
                    *belief = probability;
                }
            }
        }
        (ln_all - ln_path).max(0.0)
    }
}
