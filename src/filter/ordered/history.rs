//! The end of the history: what is marginalised.

use super::OrderedFilter;
use super::hypothesis::Hypothesis;

/// A way that was seen at fewer than one of this many visits may be none.
const DOUBTFUL_LOOKS: u16 = 6;

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// Drops the oldest quarter of the record. The best hypothesis decides what it meant; its counts stay, as the base of all
    /// hypotheses from now on. Cost: as a refinement of all places.
    pub(super) fn drop_oldest(&mut self) {
        self.repair_nothing();
        // The vertices of the base keep their ids, so those of the best hypothesis need ids first.
        self.publish();
        self.vertex_ids.defer();
        let (len, dropped) = (self.record.len(), (self.record.len() / 4).max(1));
        if let Some(best) = self.beam.best() {
            self.source.clone_from(best);
        }
        let before = self.rebuild(0, dropped);
        let forgotten = self.draft.rest;
        self.draft.fade(&self.model);
        self.remove_doubtful_ways(dropped - 1);
        self.base.clone_from(&self.draft);
        self.base.rest = 0.0;
        if before.is_some() && self.rebuild(dropped, len).is_some() {
            self.draft.rest -= forgotten;
            self.draft.forget_oldest(dropped);
            self.record.drop_oldest(dropped);
            self.path.copy_within(dropped.min(T).., 0);
        } else {
            self.forget_record();
        }
        self.beam.start_with(&self.draft);
    }

    /// Removes ways from the draft that few visits have shown and that are not driven from place `from` on, so that the map does not fill
    /// with errors of the detector. Cost: O(D · T).
    fn remove_doubtful_ways(&mut self, from: usize) {
        for image in 0..self.draft.map.darts() {
            let source = &self.source;
            let Some(dart) = self.translation.preimage(image) else { continue };
            let Some(partner) = source.map.partner(dart) else { continue };
            let mut later = source.path.iter().take(self.record.len()).skip(from);
            if source.is_doubtful(dart)
                && source.is_doubtful(partner)
                && !later.any(|&came_by| came_by == dart || came_by == partner)
            {
                self.source.map.part(dart);
                self.draft.map.part(image);
            }
        }
        let (source, translation) = (&self.source, &self.translation);
        let is_doubtful = |dart: u8| source.map.partner(dart).is_none() && source.is_doubtful(dart);
        let numbers = self.draft.map.remove_frontiers(|image| translation.preimage(image).is_some_and(is_doubtful));
        self.translation.renumber(&numbers);
        self.draft.at = numbers.get(usize::from(self.draft.at)).copied().unwrap_or(self.draft.at);
        self.draft.rekey();
    }

    /// Makes the source the draft and the base, for a map that contradicts its own path: it stays as it is, and nothing of it can be
    /// explained in another way.
    pub(super) fn forget_record(&mut self) {
        self.base.clone_from(&self.source);
        self.base.rest = 0.0;
        self.draft.clone_from(&self.base);
        self.record.clear();
    }
}

impl<const V: usize, const D: usize, const T: usize> Hypothesis<V, D, T> {
    /// Whether few visits have shown a way.
    fn is_doubtful(&self, dart: u8) -> bool {
        let looks = self.label(self.map.vertex(dart)).looks;
        u16::from(self.map.seen(dart)) * DOUBTFUL_LOOKS < u16::from(looks)
    }
}
