//! The best path of a record through the map of a hypothesis: Viterbi over pairs of successive places, so that a turn
//! hint, which speaks of three places, can be weighed.

use super::hypothesis::{Hypothesis, NOWHERE};
use super::lattice::{Column, Model, WIDTH};
use super::prices::{NEW_EDGE, Prices};
use super::record::Record;

/// Where the best ways to one vertex of a column come from: two slots of the column before, and for each slot of the
/// column behind whether its best way turned back here.
#[derive(Clone, Copy, Debug)]
struct Back {
    best: u8,
    second: u8,
    turned: u8,
}

type Cells = [[f32; WIDTH]; WIDTH];

/// The working memory of the decoder: `2 · WIDTH` bytes a place.
#[derive(Clone, Debug)]
pub(super) struct Decoder<const T: usize> {
    backs: [[u16; WIDTH]; T],
    cells: [Cells; 2],
}

const LOST: Cells = [[f32::NEG_INFINITY; WIDTH]; WIDTH];

impl Back {
    fn packed(self) -> u16 {
        u16::from(self.best & 7) | u16::from(self.second & 7) << 3 | u16::from(self.turned) << 8
    }

    fn unpacked(packed: u16) -> Self {
        Self { best: packed as u8 & 7, second: (packed >> 3) as u8 & 7, turned: (packed >> 8) as u8 }
    }
}

impl<const T: usize> Decoder<T> {
    pub(super) const fn new() -> Self {
        Self { backs: [[0; WIDTH]; T], cells: [[[0.0; WIDTH]; WIDTH]; 2] }
    }

    /// Writes the best path into the hypothesis. `allowed` is the bit row of the vertices it may visit, and `jitter` gives
    /// what is added to the fit of a vertex, to draw another path than the best. Cost: O(T · (V + WIDTH²)).
    pub(super) fn decode<const V: usize>(
        &mut self,
        prices: &Prices,
        record: &Record<T>,
        model: &Model<V>,
        allowed: u32,
        hypothesis: &mut Hypothesis<V, T>,
        mut jitter: impl FnMut() -> f32,
    ) {
        let mut columns = [Column::EMPTY; 3];
        let [cells, next] = &mut self.cells;
        let ln_start = -libm::logf(f32::from(hypothesis.vertices.max(1)));
        let mut second_of_sequence = false;
        // Where the best way to each slot comes from, when the ways are not told apart.
        let mut origins = [0_u8; WIDTH];
        let mut is_together = false;
        for (index, entry) in record.iter().enumerate() {
            let [earlier, here, there] = &mut columns;
            model.column(prices, entry, allowed, there);
            for fit in there.fits.iter_mut().take(there.len) {
                *fit += jitter();
            }
            *next = LOST;
            let begins = entry.begins() || index == 0;
            if begins {
                let base = if index == 0 {
                    0.0
                } else {
                    let (from, at, score) = best_pair(cells, here.len);
                    let back = Back { best: from as u8, second: at as u8, turned: 0 };
                    if let Some(slot) = self.backs.get_mut(index - 1).and_then(|backs| backs.first_mut()) {
                        *slot = back.packed();
                    }
                    score
                };
                for (slot, (vertex, fit)) in there.iter().enumerate() {
                    let way = if entry.begins() || hypothesis.before == NOWHERE {
                        ln_start
                    } else {
                        step(model, hypothesis.before, vertex)
                    };
                    if let Some(cell) = next.first_mut().and_then(|row| row.get_mut(slot)) {
                        *cell = base + fit + way;
                    }
                }
            } else {
                let hint = if second_of_sequence { None } else { entry.turn() };
                let [on, back] = [prices.turn(hint, false), prices.turn(hint, true)];
                // Where each vertex of the column behind stood two places before.
                let mut earlier_slots = [WIDTH; WIDTH];
                for (slot, &vertex) in earlier_slots.iter_mut().zip(there.vertices()) {
                    *slot = if second_of_sequence || is_together { WIDTH } else { earlier.position(vertex) };
                }
                let together = record.forgets_way(index);
                let mut next_origins = [0_u8; WIDTH];
                for (slot, &from) in here.vertices().iter().enumerate() {
                    let (best, second) = if is_together || second_of_sequence {
                        let origin = origins.get(slot).copied().map_or(0, usize::from);
                        let score = cells.first().and_then(|row| row.get(slot)).copied().unwrap_or(f32::NEG_INFINITY);
                        ((origin, score), (origin, score))
                    } else {
                        two_best(cells, earlier.len, slot)
                    };
                    let mut turned = 0;
                    for (to_slot, ((to, fit), &earlier_slot)) in there.iter().zip(&earlier_slots).enumerate() {
                        if to == from {
                            continue;
                        }
                        let straight = if best.0 == earlier_slot { second.1 } else { best.1 } + on;
                        let returning = cells
                            .get(earlier_slot)
                            .and_then(|row| row.get(slot))
                            .map_or(f32::NEG_INFINITY, |&cell| cell + back);
                        if returning > straight {
                            turned |= 1 << to_slot;
                        }
                        let way = step(model, from, to);
                        let row = if together { 0 } else { slot };
                        let score = returning.max(straight) + way + fit;
                        if let Some(cell) = next.get_mut(row).and_then(|row| row.get_mut(to_slot))
                            && score > *cell
                        {
                            *cell = score;
                            if let Some(origin) = next_origins.get_mut(to_slot) {
                                *origin = slot as u8;
                            }
                        }
                    }
                    let back = Back { best: best.0 as u8, second: second.0 as u8, turned };
                    if let Some(packed) = self.backs.get_mut(index - 1).and_then(|backs| backs.get_mut(slot)) {
                        *packed = back.packed();
                    }
                }
                origins = next_origins;
            }
            is_together = !begins && record.forgets_way(index);
            second_of_sequence = begins;
            core::mem::swap(cells, next);
            columns.rotate_left(1);
        }
        let last = columns.get(1).map_or(0, |column| column.len);
        let (from, at, _) = best_pair(&self.cells[0], last);
        self.trace(prices, record, model, allowed, hypothesis, (from, at));
    }

    /// Follows the best path back from its last pair of slots. The columns are made again, which takes less than their
    /// memory is worth.
    fn trace<const V: usize>(
        &self,
        prices: &Prices,
        record: &Record<T>,
        model: &Model<V>,
        allowed: u32,
        hypothesis: &mut Hypothesis<V, T>,
        last: (usize, usize),
    ) {
        let begins = |index: usize| index == 0 || record.get(index).is_some_and(|entry| entry.begins());
        let back_of = |index: usize, slot: usize| {
            Back::unpacked(self.backs.get(index).and_then(|backs| backs.get(slot)).copied().unwrap_or(0))
        };
        let fill = |index: Option<usize>, column: &mut Column| {
            column.len = 0;
            if let Some(entry) = index.and_then(|index| record.get(index)) {
                model.column(prices, entry, allowed, column);
            }
        };
        let mut columns = [Column::EMPTY; 3];
        let len = record.len();
        let [here, before, earlier] = &mut columns;
        fill(len.checked_sub(1), here);
        fill(len.checked_sub(2), before);
        fill(len.checked_sub(3), earlier);
        let (mut from, mut at) = last;
        for index in (0..len).rev() {
            let [here, before, earlier] = &mut columns;
            let vertex = here.vertices().get(at).copied().unwrap_or(0);
            if let Some(slot) = hypothesis.path.get_mut(index) {
                *slot = vertex;
            }
            if index == 0 {
                return;
            }
            if begins(index) {
                let back = back_of(index - 1, 0);
                (from, at) = (back.best.into(), back.second.into());
            } else {
                // The pair before: `from` is the slot at index − 1, and its own predecessor is wanted.
                let back = back_of(index - 1, from);
                let slot = if begins(index - 1) {
                    0
                } else if back.turned >> at & 1 == 1 {
                    earlier.position(vertex)
                } else if earlier.vertices().get(usize::from(back.best)) == Some(&vertex) {
                    back.second.into()
                } else {
                    back.best.into()
                };
                (from, at) = (slot, from);
            }
            core::mem::swap(here, before);
            core::mem::swap(before, earlier);
            fill(index.checked_sub(3), earlier);
        }
    }
}

/// ln of the probability of a move in the eyes of the decoder.
fn step<const V: usize>(model: &Model<V>, from: u8, to: u8) -> f32 {
    if from == to {
        return f32::NEG_INFINITY;
    }
    model.ln_exit(from) - if model.is_firm(from, to) { 0.0 } else { NEW_EDGE }
}

fn best_pair(cells: &Cells, columns: usize) -> (usize, usize, f32) {
    let mut best = (0, 0, f32::NEG_INFINITY);
    for (from, row) in cells.iter().enumerate() {
        for (at, &score) in row.iter().take(columns).enumerate() {
            if score > best.2 {
                best = (from, at, score);
            }
        }
    }
    best
}

/// The two best slots before one of a column, with their scores.
fn two_best(cells: &Cells, rows: usize, slot: usize) -> ((usize, f32), (usize, f32)) {
    let mut best = (0, f32::NEG_INFINITY);
    let mut second = (0, f32::NEG_INFINITY);
    for (row, cell) in cells.iter().take(rows).filter_map(|row| row.get(slot)).enumerate() {
        if *cell > best.1 {
            second = best;
            best = (row, *cell);
        } else if *cell > second.1 {
            second = (row, *cell);
        }
    }
    (best, second)
}
