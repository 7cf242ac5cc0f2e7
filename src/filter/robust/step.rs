//! One more place: the steps from an observation to the published map.

use super::{RobustFilter, noise};
use crate::fault::FaultKind;
use crate::filter::Observation;
use crate::filter::beam::Ranked as _;
use crate::filter::{Filter, Update};

/// The noise is estimated from this place on.
const NOISE_FROM: u32 = 10;
/// Until this place it is estimated at every fifth place, then at every tenth.
const NOISE_OFTEN_UNTIL: u32 = 40;

/// For how many hypotheses the bound of the other paths is updated at a place, until that of the best one is.
const BOUND_UPDATES: u8 = 3;

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// As [`Filter::observe`].
    pub(super) fn step(&mut self, observation: Observation) -> Update {
        if self.localise_only && self.beam.best().is_none_or(|best| best.vertices == 0) {
            // No hypothesis has a vertex for it.
            let place_index = self.observed;
            self.observed = self.observed.wrapping_add(1);
            return Update { place_index, ..Update::NONE };
        }
        self.extend(observation);
        self.refinements = 0;
        if self.localise_only {
            self.detect_kidnapping();
        } else {
            self.trials.add_place();
            for _ in 0..self.config.moves {
                self.refine();
            }
        }
        self.observed = self.observed.wrapping_add(1);
        self.estimate_noise();
        self.refresh()
    }

    /// Adds an observation to the history and to all hypotheses.
    fn extend(&mut self, mut observation: Observation) {
        observation.starts_sequence |= self.history.is_empty();
        if self.history.is_full() {
            self.faults.record(FaultKind::HistoryFull);
            self.marginalise_oldest();
        }
        let index = self.history.len();
        self.history.push(&observation);
        let wanted = usize::from(self.config.hypotheses);
        if let Some(newest) = self.history.get(index)
            && self.beam.grow(&self.model, &self.history, (index, newest), wanted, self.localise_only)
        {
            self.faults.record(FaultKind::VerticesFull);
        }
    }

    /// Moves the oldest observation out of the history.
    fn marginalise_oldest(&mut self) {
        self.fold.cancel();
        let history = &self.history;
        let mut has_decayed = false;
        self.beam.for_each(|hypothesis| has_decayed |= hypothesis.marginalise_oldest(history));
        self.published_path.copy_within(1.., 0);
        self.history.drop_oldest();
        // While the filter only localises, the statistics of the map do not change.
        if has_decayed && !self.localise_only {
            let (model, history) = (&self.model, &self.history);
            self.beam.for_each(|hypothesis| hypothesis.rebase(model, history));
            let common = self.beam.best().map_or(0.0, |best| best.decayed);
            self.beam.for_each(|hypothesis| hypothesis.subtract_decayed(common));
        }
    }

    /// Notes where the robot was kidnapped: where the best path does not follow an edge of the map.
    fn detect_kidnapping(&mut self) {
        let Some(best) = self.beam.best() else { return };
        for index in 1..self.history.len() {
            if let (Some(from), Some(to)) = (best.vertex_of(index - 1), best.vertex_of(index)) {
                self.history.set_kidnapped(index, !best.is_edge(from, to));
            }
        }
    }

    /// Updates the bound of the other paths of the best hypotheses, until that of the best one is up to date, and the belief.
    pub(super) fn update_bound(&mut self) {
        for round in 1..=BOUND_UPDATES {
            let Some(best) = self.beam.best_mut() else { return };
            self.forward.update_bound(&mut self.lattice, &self.model, &self.history, &mut self.hmm, best);
            let key = best.key();
            // The last one is published even if another is better now, because the belief is its own.
            if self.localise_only || round == BOUND_UPDATES {
                return;
            }
            self.beam.sort();
            if self.beam.best().is_some_and(|best| best.key() == key) {
                return;
            }
        }
    }

    /// Estimates the noise when it is due, and computes the evidence of all hypotheses with it.
    fn estimate_noise(&mut self) {
        let interval = if self.observed < NOISE_OFTEN_UNTIL { 5 } else { 10 };
        if self.localise_only || self.observed < NOISE_FROM || !self.observed.is_multiple_of(interval) {
            return;
        }
        let resolution = self.config.resolution_steps();
        if let Some(deviation) =
            self.beam.best().and_then(|best| noise::deviation_steps(&self.history, best, resolution))
        {
            self.set_noise(deviation);
        }
    }
}
