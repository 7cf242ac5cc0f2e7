//! Growing the beam of the ordered filter by one place.

use super::choice::{Choice, Gain, Target};
use super::hypothesis::Hypothesis;
use super::model::Model;
use super::record::Record;
use crate::filter::beam::{self, Candidate, Ranked as _};
use crate::map::NONE;

/// Exits that cost more than this are not considered on line, in nats.
const WORST_EXIT: f32 = -8.0;

/// Any choice.
const FILLER: (Choice, Gain) = (Choice { exit: NONE, target: Target::Known }, Gain { labels: 0.0, rest: 0.0 });

/// Up to `N` hypotheses. No two have the same map and the same place.
pub(crate) type Beam<const N: usize, const V: usize, const D: usize, const T: usize> =
    beam::Beam<Hypothesis<V, D, T>, N>;

impl<const N: usize, const V: usize, const D: usize, const T: usize> Beam<N, V, D, T> {
    /// Takes observation `index` of the record: of all explanations by all hypotheses the best `N` distinct ones stay. Returns
    /// whether the best of all, or a way that was seen, found no room.
    pub(super) fn grow(&mut self, model: &Model, record: &Record<T>, index: usize) -> bool {
        let mut chosen = Candidate::none(FILLER);
        let mut missed = f32::NEG_INFINITY;
        for (slot, parent) in self.parents() {
            parent.propose(model, record, index, WORST_EXIT, |choice, gain| {
                let score = parent.score() + gain.total();
                if parent.has_room(choice) {
                    let key = parent.key_with(choice);
                    Candidate { score, key, parent: slot, choice: (choice, gain) }.insert_into(&mut chosen, N);
                } else {
                    missed = missed.max(score);
                }
            });
        }
        let Some(best) = chosen.as_slice().first() else { return true };
        let mut lacks_room = missed > best.score;
        let entry = record.get(index);
        self.replace(&mut chosen, |hypothesis, &(choice, gain), rank| {
            let is_full = hypothesis.extend(&entry, index, choice, gain, 0);
            let is_off_map = !hypothesis.is_on_map() && !hypothesis.has_room_for_vertex();
            lacks_room |= (is_full || is_off_map) && rank == 0;
        });
        lacks_room
    }

    /// Takes observation `index` of the record for a visit on the map that all hypotheses have.
    pub(super) fn localise(&mut self, model: &Model, record: &Record<T>, index: usize) {
        let mut chosen = Candidate::none(FILLER);
        for (rank, (slot, parent)) in self.parents().enumerate() {
            parent.localisations(model, record, index, rank == 0, |at, gain| {
                let choice = Choice { exit: NONE, target: Target::At(at) };
                let score = parent.score() + gain.total();
                Candidate { score, key: at.into(), parent: slot, choice: (choice, gain) }.insert_into(&mut chosen, N);
            });
        }
        self.replace(&mut chosen, |hypothesis, &(choice, gain), _| {
            if let Target::At(at) = choice.target {
                hypothesis.follow_to(index, at, gain);
            }
        });
    }
}
