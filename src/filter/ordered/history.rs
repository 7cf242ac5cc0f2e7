//! The end of the history: what is marginalised.

use super::OrderedFilter;

/// A way that was seen at fewer than one of this many visits may be none.
const DOUBTFUL_LOOKS: u16 = 6;

impl<const N: usize, const V: usize, const D: usize, const T: usize> OrderedFilter<N, V, D, T> {
    /// Drops the oldest quarter of the record. The best hypothesis decides what it meant; its counts stay, as the base of all
    /// hypotheses from now on. Cost: as a refinement of all places.
    pub(super) fn drop_oldest(&mut self) {
        self.repair_nothing();
        // What the base has keeps its ids: the best hypothesis must have some.
        self.publish();
        self.vertex_ids.defer();
        let (len, dropped) = (self.record.len(), (self.record.len() / 4).max(1));
        if let Some(best) = self.beam.best() {
            self.source.clone_from(best);
        }
        let before = self.rebuild(0, dropped);
        let forgotten = self.draft.rest;
        self.draft.fade(&self.model);
        self.remove_doubtful_ways();
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

    /// Removes ways from the draft that few visits have shown and that were not driven, so that the table of darts does not fill with
    /// errors of the detector.
    fn remove_doubtful_ways(&mut self) {
        let (source, translation) = (&self.source, &self.translation);
        let is_doubtful = |dart: u8| {
            let looks = source.label(source.map.vertex(dart)).looks;
            source.map.partner(dart).is_none() && u16::from(source.map.seen(dart)) * DOUBTFUL_LOOKS < u16::from(looks)
        };
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
