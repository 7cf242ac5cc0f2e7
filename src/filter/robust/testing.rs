//! For tests and evaluations alone: a search that starts at a given path.

use super::RobustFilter;
use crate::filter::beam::Ranked as _;
use crate::map::VertexId;

impl<const N: usize, const V: usize, const HISTORY: usize> RobustFilter<N, V, HISTORY> {
    /// Replaces all hypotheses by one, given the vertex of each place of the history, the oldest first, numbered from 0 without
    /// gaps. Returns its score. Nothing happens when there are not as many vertices as places, or more than a map has.
    #[doc(hidden)]
    pub fn assume_path(&mut self, path: &[VertexId]) -> Option<f32> {
        let vertices = path.iter().max().map_or(0, |last| last.index() + 1);
        if path.len() != self.history.len() || vertices > V {
            return None;
        }
        self.draft.clear();
        self.draft.vertices = vertices as u8;
        for (index, &vertex) in path.iter().enumerate() {
            self.draft.set_vertex_of(index, vertex);
        }
        self.draft.rebuild(&self.model, &self.history);
        self.beam.start_with(&self.draft);
        self.refresh();
        self.beam.best().map(|best| best.score())
    }
}
