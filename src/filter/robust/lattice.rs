//! The lattice of a history: for each observation a column of vertices that may explain it, and one walk along the columns that
//! computes a sum over all paths in a semiring. [`Viterbi`](super::viterbi::Viterbi) walks with the maximum and the sum of
//! logarithms, the [forward pass](super::forward::Forward) with the sum and the product of probabilities.
//!
//! A turn hint speaks of three successive vertices, so a cell of the walk stands for a pair of successive vertices. Where the
//! next observation has no turn hint the vertex before does not matter, and one row of cells holds all pairs.

use super::column::{Column, PerSlot, Slot, State, WIDTH};
use super::history::{ObservationHistory, PackedObservation};
use super::hmm::Hmm;
use super::model::Model;
use crate::filter::Exit;
use crate::map::{VertexId, VertexSet32};

/// A value for each pair of a slot in the column before and one in this column.
pub(super) type Cells = PerSlot<PerSlot<f32>>;

const fn cells(value: f32) -> Cells {
    PerSlot([PerSlot([value; WIDTH]); WIDTH])
}

/// An observation of the walk.
#[derive(Clone, Copy)]
pub(super) struct Stage {
    pub(super) index: usize,
    pub(super) observation: PackedObservation,
    /// Whether a sequence starts here, or the history.
    pub(super) starts: bool,
    /// Whether the observation before was the first of its sequence.
    pub(super) is_second: bool,
}

/// A semiring, and the results that are noted on the walk.
pub(super) trait Semiring {
    /// The value of no path.
    const ZERO: f32;

    /// All paths into a slot, over the slots before.
    type Incoming: Copy;

    /// Takes the column of the next observation: adds states to it, weighs it.
    fn enter(&mut self, stage: &Stage, column: &mut Column);

    /// The value of all paths to the last observation of a sequence, whose column and cells are given: a factor of the
    /// paths that start after it. `rows` of the cells are in use.
    fn close(&mut self, stage: &Stage, column: &Column, cells: &Cells, rows: usize) -> f32;

    /// The value of the paths that start with a state, from the vertex before the history if there is one.
    fn start(&mut self, closed: f32, from: Option<VertexId>, slot: Slot, state: &State) -> f32;

    /// The weights of a transition that does not turn back, and of one that does.
    fn turns(&mut self, hint: Option<Exit>) -> [f32; 2];

    /// All paths into a slot of the column before; `None` when there is none. `rows` of the cells are in use; the slots before
    /// do not matter when `is_first_order`.
    fn incoming(
        &mut self,
        cells: &Cells,
        rows: usize,
        is_first_order: bool,
        from: (Slot, &State),
    ) -> Option<Self::Incoming>;

    /// The value of all paths over one transition; `None` when there is none. `back` is the slot, two columns before, of the vertex
    /// that the transition goes to, and the value of the paths that come from it and would turn back.
    fn transition(
        &mut self,
        incoming: Self::Incoming,
        back: (Option<Slot>, f32),
        turns: [f32; 2],
        from: &State,
        to: (Slot, &State),
    ) -> Option<f32>;

    /// The values of all paths to each slot of a column, from those to each slot of the column before, where no turn hint
    /// speaks of the transition nor of the next one: the same as by [`Semiring::transition`], for the row of all pairs.
    fn advance(&mut self, stage: &Stage, before: (&Column, &PerSlot<f32>), to: &Column, next: &mut PerSlot<f32>);

    /// Adds the value of paths from a slot to those of a cell.
    fn add(&mut self, cell: &mut f32, value: f32, from: Slot, to: Slot);

    /// All transitions from a slot have been added.
    fn leave(&mut self, stage: &Stage, slot: Slot, incoming: Self::Incoming);

    /// All paths to an observation have been added. `None` ends the walk.
    fn finish(&mut self, stage: &Stage, cells: &mut Cells, rows: usize) -> Option<()>;
}

/// The working memory of a walk.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    cells: [Cells; 2],
}

impl Lattice {
    pub(super) const fn new() -> Self {
        Self { cells: [cells(0.0); 2] }
    }

    /// Walks along the history. Returns the column of the newest observation, its cells, and how many rows of them are in use.
    ///
    /// Cost: O(T · (V + WIDTH²)).
    #[inline(always)]
    pub(super) fn walk<S: Semiring, const V: usize, const T: usize>(
        &mut self,
        semiring: &mut S,
        (model, history, hmm): (&Model, &ObservationHistory<T>, &Hmm<V>),
        allowed: VertexSet32,
        before: Option<VertexId>,
    ) -> Option<(Column, &Cells, usize)> {
        let mut columns = [Column::EMPTY; 3];
        let [mut earlier, mut here, mut there] = columns.each_mut();
        let [mut cells, mut next] = self.cells.each_mut();
        let mut rows = 0;
        let mut is_second = false;
        for (index, observation) in history.iter().enumerate() {
            let starts = observation.starts_sequence() || index == 0;
            let is_first_order = history.is_first_order(index);
            let stage = Stage { index, observation, starts, is_second };
            hmm.fill(model, observation, allowed, there);
            semiring.enter(&stage, there);
            let hint = if is_second { None } else { observation.exit() };
            if starts {
                let closed = semiring.close(&stage, here, cells, rows);
                let from = if observation.starts_sequence() { None } else { before };
                for (slot, state) in there.iter() {
                    next[Slot::FIRST][slot] = semiring.start(closed, from, slot, state);
                }
            } else if is_first_order && hint.is_none() && rows == 1 {
                semiring.advance(&stage, (here, &cells[Slot::FIRST]), there, &mut next[Slot::FIRST]);
            } else {
                *next = self::cells(S::ZERO);
                let turns = semiring.turns(hint);
                // Where the paths come from that turn back to a vertex.
                let mut back = PerSlot([None; WIDTH]);
                if hint.is_some() {
                    for (slot, state) in there.iter() {
                        back[slot] = earlier.slot_of(state.vertex);
                    }
                }
                for (slot, from) in here.iter() {
                    let Some(incoming) = semiring.incoming(cells, rows, hint.is_none(), (slot, from)) else { continue };
                    let row = if is_first_order { Slot::FIRST } else { slot };
                    for (to_slot, to) in there.iter() {
                        let back = back[to_slot];
                        let returning = back.map_or(S::ZERO, |back| cells[back][slot]);
                        let value = semiring.transition(incoming, (back, returning), turns, from, (to_slot, to));
                        if let Some(value) = value {
                            semiring.add(&mut next[row][to_slot], value, slot, to_slot);
                        }
                    }
                    semiring.leave(&stage, slot, incoming);
                }
            }
            rows = if starts || is_first_order { 1 } else { here.len() };
            semiring.finish(&stage, next, rows)?;
            is_second = starts;
            (cells, next) = (next, cells);
            (earlier, here, there) = (here, there, earlier);
        }
        Some((*here, cells, rows))
    }
}
