//! The forward pass over all paths of a map: the distribution of the newest vertex, and the bound of the map's other paths.

use super::column::{Column, PerSlot, Slot, State, WIDTH};
use super::history::ObservationHistory;
use super::hmm::{Emissions, Hmm};
use super::hypothesis::Hypothesis;
use super::lattice::{Cells, Lattice, Semiring, Stage};
use super::model::{Model, OTHER_PATHS_SHARE};
use crate::filter::Exit;
use crate::map::{PerVertex, VertexId, VertexSet32};

/// The product of the normalisers is turned into a logarithm below this.
const SMALL: f32 = 1e-12;

/// The belief of the last forward pass.
#[derive(Clone, Debug)]
pub(super) struct Forward<const V: usize> {
    /// The probability of each vertex at the newest observation.
    pub(super) belief: PerVertex<f32, V>,
}

impl<const V: usize> Forward<V> {
    pub(super) const fn new() -> Self {
        Self { belief: PerVertex::filled(0.0) }
    }

    /// Updates the bound of the map's other paths, and the belief.
    ///
    /// Take the labels' posterior given the path of the hypothesis, and weigh each label by the expectation of its log
    /// density under it ([`Emissions::Expected`]). Then the evidence of the path plus
    ///
    /// ```text
    /// −ln P(path | map, observations) = ln Σ_paths P(path, observations) − ln P(path, observations)
    /// ```
    ///
    /// is a lower bound of the evidence of the map: the variational bound. [`OTHER_PATHS_SHARE`] of it counts. It takes no
    /// backward pass. Cost: O(T · (V + WIDTH²)).
    pub(super) fn update_bound<const T: usize>(
        &mut self,
        lattice: &mut Lattice,
        model: &Model,
        history: &ObservationHistory<T>,
        hmm: &mut Hmm<V>,
        hypothesis: &mut Hypothesis<V, T>,
    ) {
        hmm.read(model, history, hypothesis, Emissions::Expected);
        hypothesis.other_paths = OTHER_PATHS_SHARE * self.other_paths(lattice, model, history, hmm, hypothesis);
    }

    /// −ln P(path | map, observations), 0 or more.
    fn other_paths<const T: usize>(
        &mut self,
        lattice: &mut Lattice,
        model: &Model,
        history: &ObservationHistory<T>,
        hmm: &Hmm<V>,
        hypothesis: &Hypothesis<V, T>,
    ) -> f32 {
        let mut sum = AllPaths {
            model,
            hmm,
            path: &hypothesis.path,
            start: 1.0 / f32::from(hypothesis.vertices.max(1)),
            weights: PerSlot([0.0; WIDTH]),
            total: 0.0,
            scale: 1.0,
            ln_all: 0.0,
            ln_path: 0.0,
            now: VertexId::FIRST,
            before: None,
            earlier: None,
        };
        let Some((column, cells, rows)) =
            lattice.walk(&mut sum, (model, history, hmm), VertexSet32::ALL, hypothesis.before)
        else {
            return 0.0;
        };
        self.belief.fill(0.0);
        for (slot, state) in column.iter() {
            self.belief[state.vertex] = Slot::first(rows).map(|row| cells[row][slot]).sum();
        }
        (sum.ln_all + libm::logf(sum.scale) - sum.ln_path).max(0.0)
    }
}

/// The semiring of probabilities, which also follows one path. The cells are normalised at each observation.
struct AllPaths<'a, const V: usize> {
    model: &'a Model,
    hmm: &'a Hmm<V>,
    /// The path that is followed.
    path: &'a [VertexId],
    /// The probability of each vertex at the start of a sequence.
    start: f32,
    /// The likelihood of each state of the column, relative to the best one.
    weights: PerSlot<f32>,
    /// The sum of the cells.
    total: f32,
    /// The product of the sums, as far as it is not in `ln_all` yet.
    scale: f32,
    /// ln of the sum over all paths.
    ln_all: f32,
    /// ln of the path.
    ln_path: f32,
    /// The vertices of the path at this observation, the one before, and the one before that in the same sequence.
    now: VertexId,
    before: Option<VertexId>,
    earlier: Option<VertexId>,
}

impl<const V: usize> Semiring for AllPaths<'_, V> {
    const ZERO: f32 = 0.0;

    /// The sum of all paths into a slot, and the probability of each exit.
    type Incoming = (f32, f32);

    fn enter(&mut self, stage: &Stage, column: &mut Column) {
        self.earlier = if stage.is_second { None } else { self.before };
        self.before = if stage.index == 0 { None } else { Some(self.now) };
        self.now = self.path.get(stage.index).copied().unwrap_or(VertexId::FIRST);
        if column.slot_of(self.now).is_none() {
            let ln_emission = self.hmm.ln_emission(self.model, self.now, stage.observation);
            column.insert_always(self.now, ln_emission);
        }
        let best = column.best();
        self.total = 0.0;
        for (slot, state) in column.iter() {
            let behind = state.ln_emission - best;
            self.weights[slot] = if state.ln_emission == best { 1.0 } else { libm::expf(behind) };
            if state.vertex == self.now {
                self.ln_path += behind;
            }
        }
    }

    fn close(&mut self, _: &Stage, _: &Column, _: &Cells, _: usize) -> f32 {
        // The cells are normalised: all paths of the sequence before lead here.
        1.0
    }

    fn start(&mut self, _: f32, from: Option<VertexId>, slot: Slot, state: &State) -> f32 {
        let transition = match from {
            None => self.start,
            Some(from) if self.hmm.is_edge(from, state.vertex) => self.hmm.exit(from),
            Some(_) => 0.0,
        };
        if state.vertex == self.now {
            self.ln_path += libm::logf(transition);
        }
        let probability = transition * self.weights[slot];
        self.total += probability;
        probability
    }

    fn turns(&mut self, hint: Option<Exit>) -> [f32; 2] {
        let [ln_on, ln_back] = [self.model.ln_turn(hint, false), self.model.ln_turn(hint, true)];
        let ln_exit = self.before.map_or(0.0, |before| self.hmm.ln_exit(before));
        self.ln_path += ln_exit + if self.earlier == Some(self.now) { ln_back } else { ln_on };
        if hint.is_some() { [libm::expf(ln_on), libm::expf(ln_back)] } else { [1.0; 2] }
    }

    fn incoming(
        &mut self,
        cells: &Cells,
        rows: usize,
        _: bool,
        (slot, from): (Slot, &State),
    ) -> Option<Self::Incoming> {
        let sum: f32 = Slot::first(rows).map(|row| cells[row][slot]).sum();
        if sum <= 0.0 { None } else { Some((sum, self.hmm.exit(from.vertex))) }
    }

    fn transition(
        &mut self,
        (sum, exit): Self::Incoming,
        (_, returning): (Option<Slot>, f32),
        [on, turn]: [f32; 2],
        from: &State,
        (slot, to): (Slot, &State),
    ) -> Option<f32> {
        if !self.hmm.is_edge(from.vertex, to.vertex) {
            return None;
        }
        Some(exit * self.weights[slot] * (on * (sum - returning) + turn * returning))
    }

    fn advance(&mut self, _: &Stage, (here, paths): (&Column, &PerSlot<f32>), there: &Column, next: &mut PerSlot<f32>) {
        self.ln_path += self.before.map_or(0.0, |before| self.hmm.ln_exit(before));
        let mut leaving = PerSlot([0.0; WIDTH]);
        for (slot, from) in here.iter() {
            leaving[slot] = paths[slot] * self.hmm.exit(from.vertex);
        }
        for (slot, to) in there.iter() {
            let neighbours = self.hmm.neighbours(to.vertex);
            let mut sum = 0.0;
            for (from, state) in here.iter() {
                if neighbours.contains(state.vertex) {
                    sum += leaving[from];
                }
            }
            next[slot] = sum * self.weights[slot];
            self.total += next[slot];
        }
    }

    fn add(&mut self, cell: &mut f32, value: f32, _: Slot, _: Slot) {
        self.total += value;
        *cell += value;
    }

    fn leave(&mut self, _: &Stage, _: Slot, _: Self::Incoming) {}

    fn finish(&mut self, _: &Stage, cells: &mut Cells, rows: usize) -> Option<()> {
        if self.total <= 0.0 || !self.total.is_finite() {
            return None;
        }
        let normaliser = 1.0 / self.total;
        for row in Slot::first(rows) {
            cells[row].0.iter_mut().for_each(|cell| *cell *= normaliser);
        }
        self.scale *= self.total;
        if self.scale < SMALL {
            self.ln_all += libm::logf(self.scale);
            self.scale = 1.0;
        }
        Some(())
    }
}
