//! The best path of the history through the map of a hypothesis: the Viterbi algorithm over pairs of successive vertices.

use super::column::{Column, PerSlot, Slot, State, WIDTH};
use super::history::ObservationHistory;
use super::hmm::Hmm;
use super::hypothesis::{Hypothesis, ln};
use super::lattice::{Cells, Lattice, Semiring, Stage};
use super::model::{Model, NEW_EDGE_COST};
use super::special_functions::gumbel;
use crate::filter::Exit;
use crate::map::{VertexId, VertexSet32};
use rand_core::Rng;
use rand_xoshiro::Xoshiro128PlusPlus;

/// Where the best paths into a slot come from: the two best slots before, and for each slot of the next column
/// whether the best path to it turned back.
#[derive(Clone, Copy, Debug)]
struct Back {
    best: Slot,
    second: Slot,
    turned: u8,
}

impl Back {
    fn packed(self) -> u16 {
        self.best.bits() | self.second.bits() << 3 | u16::from(self.turned) << 8
    }

    fn unpacked(packed: u16) -> Self {
        Self { best: Slot::of_bits(packed), second: Slot::of_bits(packed >> 3), turned: (packed >> 8) as u8 }
    }
}

/// The memory of the decoder: `2 · WIDTH` bytes an observation.
#[derive(Clone, Debug)]
pub(super) struct Viterbi<const T: usize> {
    backs: [PerSlot<u16>; T],
}

impl<const T: usize> Viterbi<T> {
    pub(super) const fn new() -> Self {
        Self { backs: [PerSlot([0; WIDTH]); T] }
    }

    /// Writes the best path into a hypothesis. Only the `allowed` vertices are visited. With `noise`, Gumbel noise is added to
    /// the emissions, so that the path is a draw. Cost: O(T · (V + WIDTH²)).
    ///
    /// A transition costs −[`Hmm::ln_exit`], and [`NEW_EDGE_COST`] unless it follows an edge that was driven more than once.
    pub(super) fn decode<const V: usize>(
        &mut self,
        lattice: &mut Lattice,
        (model, history, hmm): (&Model, &ObservationHistory<T>, &Hmm<V>),
        allowed: VertexSet32,
        noise: Option<&mut Xoshiro128PlusPlus>,
        hypothesis: &mut Hypothesis<V, T>,
    ) {
        let mut paths = BestPath {
            model,
            hmm,
            noise,
            backs: &mut self.backs,
            ln_start: -ln(hypothesis.vertices.max(1)),
            turned: 0,
            origins: PerSlot([Slot::FIRST; WIDTH]),
            next_origins: PerSlot([Slot::FIRST; WIDTH]),
        };
        let end = lattice.walk(&mut paths, (model, history, hmm), allowed, hypothesis.before);
        if let Some((column, cells, rows)) = end {
            let (from, at, _) = best_pair(&column, cells, rows);
            self.trace((model, history, hmm), allowed, hypothesis, (from, at));
        }
    }

    /// Follows the best path back from its last pair of slots. The columns are computed again, which costs less than to store
    /// them.
    fn trace<const V: usize>(
        &self,
        (model, history, hmm): (&Model, &ObservationHistory<T>, &Hmm<V>),
        allowed: VertexSet32,
        hypothesis: &mut Hypothesis<V, T>,
        last: (Slot, Slot),
    ) {
        let starts = |index: usize| index == 0 || history.get(index).is_some_and(|here| here.starts_sequence());
        let back_of = |index: usize, slot: Slot| Back::unpacked(self.backs.get(index).map_or(0, |backs| backs[slot]));
        let fill = |index: Option<usize>, column: &mut Column| {
            column.clear();
            if let Some(observation) = index.and_then(|index| history.get(index)) {
                hmm.fill(model, observation, allowed, column);
            }
        };
        let len = history.len();
        let mut columns = [Column::EMPTY; 3];
        for (column, ago) in columns.iter_mut().zip(1..) {
            fill(len.checked_sub(ago), column);
        }
        let (mut from, mut at) = last;
        for index in (0..len).rev() {
            let [here, before, earlier] = &mut columns;
            let vertex = here.vertex(at).unwrap_or(VertexId::FIRST);
            hypothesis.set_vertex_of(index, vertex);
            if index == 0 {
                return;
            }
            if starts(index) {
                let back = back_of(index - 1, Slot::FIRST);
                (from, at) = (back.best, back.second);
            } else {
                // `from` is the slot of the observation before; its own predecessor is wanted.
                let back = back_of(index - 1, from);
                let slot = if starts(index - 1) {
                    Slot::FIRST
                } else if back.turned >> at.bits() & 1 == 1 {
                    earlier.slot_of(vertex).unwrap_or(Slot::FIRST)
                } else if earlier.vertex(back.best) == Some(vertex) {
                    back.second
                } else {
                    back.best
                };
                (from, at) = (slot, from);
            }
            core::mem::swap(here, before);
            core::mem::swap(before, earlier);
            fill(index.checked_sub(3), earlier);
        }
    }
}

/// The max-plus semiring of log probabilities, which notes where the best paths come from.
struct BestPath<'a, const V: usize> {
    model: &'a Model,
    hmm: &'a Hmm<V>,
    noise: Option<&'a mut Xoshiro128PlusPlus>,
    backs: &'a mut [PerSlot<u16>],
    /// ln of the probability of each vertex at the start of a sequence.
    ln_start: f32,
    /// For each next slot, whether the best path to it turned back in the current one.
    turned: u8,
    /// Where the best path to each slot comes from, when the cells are one row.
    origins: PerSlot<Slot>,
    next_origins: PerSlot<Slot>,
}

/// The two best slots before, with the scores of their paths, and ln of the probability of each exit.
#[derive(Clone, Copy)]
struct TwoBest {
    best: (Slot, f32),
    second: (Slot, f32),
    ln_exit: f32,
}

impl<const V: usize> BestPath<'_, V> {
    fn note(&mut self, index: usize, slot: Slot, back: Back) {
        if let Some(backs) = self.backs.get_mut(index) {
            backs[slot] = back.packed();
        }
    }

    /// ln of the probability of a transition.
    fn ln_transition(&self, ln_exit: f32, from: VertexId, to: VertexId) -> f32 {
        ln_exit - if self.hmm.is_established(from, to) { 0.0 } else { NEW_EDGE_COST }
    }
}

impl<const V: usize> Semiring for BestPath<'_, V> {
    const ZERO: f32 = f32::NEG_INFINITY;

    type Incoming = TwoBest;

    fn enter(&mut self, _: &Stage, column: &mut Column) {
        if let Some(random) = &mut self.noise {
            for state in column.states_mut() {
                // Gumbel noise: the best of perturbed sums is a draw.
                state.ln_emission += gumbel(random.next_u32());
            }
        }
    }

    fn close(&mut self, stage: &Stage, column: &Column, cells: &Cells, rows: usize) -> f32 {
        let Some(before) = stage.index.checked_sub(1) else { return 0.0 };
        let (best, second, score) = best_pair(column, cells, rows);
        self.note(before, Slot::FIRST, Back { best, second, turned: 0 });
        score
    }

    fn start(&mut self, closed: f32, from: Option<VertexId>, _: Slot, state: &State) -> f32 {
        let ln_transition = match from {
            None => self.ln_start,
            Some(from) if from == state.vertex => f32::NEG_INFINITY,
            Some(from) => self.ln_transition(self.hmm.ln_exit(from), from, state.vertex),
        };
        closed + state.ln_emission + ln_transition
    }

    fn turns(&mut self, hint: Option<Exit>) -> [f32; 2] {
        self.next_origins = PerSlot([Slot::FIRST; WIDTH]);
        [self.model.ln_turn(hint, false), self.model.ln_turn(hint, true)]
    }

    fn incoming(
        &mut self,
        cells: &Cells,
        rows: usize,
        is_first_order: bool,
        (slot, from): (Slot, &State),
    ) -> Option<TwoBest> {
        self.turned = 0;
        let ln_exit = self.hmm.ln_exit(from.vertex);
        if is_first_order {
            let only = (self.origins[slot], cells[Slot::FIRST][slot]);
            return Some(TwoBest { best: only, second: only, ln_exit });
        }
        let mut best = (Slot::FIRST, f32::NEG_INFINITY);
        let mut second = best;
        for row in Slot::first(rows) {
            let score = cells[row][slot];
            if score > best.1 {
                second = best;
                best = (row, score);
            } else if score > second.1 {
                second = (row, score);
            }
        }
        Some(TwoBest { best, second, ln_exit })
    }

    fn transition(
        &mut self,
        TwoBest { best, second, ln_exit }: TwoBest,
        (back, returning): (Option<Slot>, f32),
        [on, turn]: [f32; 2],
        from: &State,
        (slot, to): (Slot, &State),
    ) -> Option<f32> {
        if from.vertex == to.vertex {
            return None;
        }
        let straight = if back == Some(best.0) { second.1 } else { best.1 } + on;
        let returning = returning + turn;
        if returning > straight {
            self.turned |= 1 << slot.bits();
        }
        Some(returning.max(straight) + self.ln_transition(ln_exit, from.vertex, to.vertex) + to.ln_emission)
    }

    fn advance(
        &mut self,
        stage: &Stage,
        (here, paths): (&Column, &PerSlot<f32>),
        there: &Column,
        next: &mut PerSlot<f32>,
    ) {
        const NONE: (f32, Slot) = (f32::NEG_INFINITY, Slot::FIRST);
        let mut leaving = PerSlot([f32::NEG_INFINITY; WIDTH]);
        let (mut best, mut second) = (NONE, NONE);
        for (slot, from) in here.iter() {
            let value = paths[slot] + self.hmm.ln_exit(from.vertex);
            leaving[slot] = value;
            if value > best.0 {
                (best, second) = ((value, slot), best);
            } else if value > second.0 {
                second = (value, slot);
            }
            let origin = self.origins[slot];
            self.note(stage.index.wrapping_sub(1), slot, Back { best: origin, second: origin, turned: 0 });
        }
        for (slot, to) in there.iter() {
            // Over an edge that is not established the best path is the best of all.
            let (value, from) = if here.vertex(best.1) == Some(to.vertex) { second } else { best };
            let mut highest = (value - NEW_EDGE_COST, from);
            let established = self.hmm.established(to.vertex);
            for (from, state) in here.iter() {
                if established.contains(state.vertex) && leaving[from] > highest.0 {
                    highest = (leaving[from], from);
                }
            }
            next[slot] = highest.0 + to.ln_emission;
            self.next_origins[slot] = highest.1;
        }
    }

    fn add(&mut self, cell: &mut f32, value: f32, from: Slot, to: Slot) {
        if value > *cell {
            *cell = value;
            self.next_origins[to] = from;
        }
    }

    fn leave(&mut self, stage: &Stage, slot: Slot, TwoBest { best, second, .. }: TwoBest) {
        let back = Back { best: best.0, second: second.0, turned: self.turned };
        self.note(stage.index.wrapping_sub(1), slot, back);
    }

    fn finish(&mut self, stage: &Stage, _: &mut Cells, _: usize) -> Option<()> {
        if !stage.starts {
            self.origins = self.next_origins;
        }
        Some(())
    }
}

/// The best pair of the cells of a column.
#[inline(never)]
fn best_pair(column: &Column, cells: &Cells, rows: usize) -> (Slot, Slot, f32) {
    let mut best = (Slot::FIRST, Slot::FIRST, f32::NEG_INFINITY);
    for from in Slot::first(rows) {
        for at in Slot::first(column.len()) {
            let score = cells[from][at];
            if score > best.2 {
                best = (from, at, score);
            }
        }
    }
    best
}
