//! Building a map again from the record: along a given path, or by decisions that look ahead.

use super::choice::{Choice, Gain, OFF_MAP, ReportedExit, Target, UNSEEN};
use super::hypothesis::Hypothesis;
use super::model::Model;
use super::record::Record;
use super::translation::Translation;
use crate::filter::Exit;
use crate::map::NONE;

/// A visit whose gain is below the typical one by more than this calls for a decision, in nats.
const SURPRISE: f32 = -6.0;

/// What one place of a rollout can cost at most: about what an explanation by a wrong exit costs, in nats.
const ROLLOUT_WORST: f32 = -9.0;

/// A place of a rollout whose gain is below the typical one by more than this calls for another exit than the reported one, in nats.
const DOUBT: f32 = -4.0;

/// Exits that cost more than this are not considered, in nats.
pub(super) const WORST_EXIT: f32 = -8.0;

/// How many places a rollout looks ahead.
const LOOKAHEAD: usize = 10;

/// What a rollout loses that ends at a frontier, in nats: it needs another decision.
const OPEN: f32 = 3.0;

/// How many choices are followed ahead.
const FOLLOWED: usize = 8;

/// How a hypothesis explains one observation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub(super) choice: Choice,
    pub(super) gain: Gain,
    /// Whether it is not what known ways say, or fits badly.
    pub(super) is_decision: bool,
}

/// What building works with.
pub(super) struct Builder<'a, const V: usize, const D: usize, const T: usize> {
    pub(super) model: &'a Model,
    pub(super) record: &'a Record<T>,
    pub(super) translation: &'a mut Translation<V, D>,
}

impl<const V: usize, const D: usize, const T: usize> Builder<'_, V, D, T> {
    /// Extends `to` by observation `index` as `from` explains it; `None` when that contradicts the map so far.
    pub(super) fn follow(
        &mut self,
        from: &Hypothesis<V, D, T>,
        to: &mut Hypothesis<V, D, T>,
        index: usize,
    ) -> Option<()> {
        let step = self.step(from, to, index)?;
        self.take(from, to, index, step);
        Some(())
    }

    /// How `from` explains observation `index`, as a choice of `to` with what it gains.
    pub(super) fn step(
        &mut self,
        from: &Hypothesis<V, D, T>,
        to: &mut Hypothesis<V, D, T>,
        index: usize,
    ) -> Option<Step> {
        let choice = self.translated(from, to, index).filter(|&choice| to.has_room(choice))?;
        let entry = self.record.get(index);
        let reported = match choice.exit {
            NONE => ReportedExit::Unknown,
            _ => to.reported_exit(self.record, index, to.at),
        };
        let gain = to.gain(self.model, &entry, reported, choice);
        let typical = self.model.typical_gain(entry.count(), entry.ln_travel > 0) + SURPRISE;
        let is_expected = choice.target == Target::Known
            && reported == ReportedExit::Way(choice.exit)
            && gain.total() > typical - 1.0;
        Some(Step { choice, gain, is_decision: !is_expected && index > 0 })
    }

    /// Extends `to` by a step of `from`.
    pub(super) fn take(&mut self, from: &Hypothesis<V, D, T>, to: &mut Hypothesis<V, D, T>, index: usize, step: Step) {
        let came_by = from.came_by(index);
        to.extend(&self.record.get(index), index, step.choice, step.gain, from.map.bearing(came_by));
        if step.choice.target == Target::New {
            let vertex = from.map.vertex(came_by);
            self.translation.set_vertex(vertex, to.map.vertex(to.at));
            self.translation.set(came_by, to.at);
        }
    }

    /// How `from` explains observation `index`, as a choice of `to`.
    fn translated(&mut self, from: &Hypothesis<V, D, T>, to: &mut Hypothesis<V, D, T>, index: usize) -> Option<Choice> {
        let came_by = from.came_by(index);
        if came_by == OFF_MAP {
            return self.off_the_map(to, index);
        }
        if came_by >= UNSEEN {
            return None;
        }
        let exit = if self.record.get(index).starts() {
            NONE
        } else if to.is_on_map() {
            let exit = from.map.partner(came_by)?;
            let exit = self.translation.image(from, to, exit)?;
            if to.map.vertex(exit) != to.map.vertex(to.at) {
                let first = to.exit_before(self.record, index, to.at, exit)?;
                let dart = self.translation.image(from, to, came_by)?;
                return (to.map.partner(exit) == Some(dart))
                    .then_some(Choice { exit: first, target: Target::Beyond(dart) });
            }
            exit
        } else if let Some(edge) = to.edge_under(self.record, index) {
            if self.translation.vertex(from.map.vertex(came_by)).is_some()
                && self.translation.image(from, to, came_by)? == edge
            {
                return Some(Choice { exit: edge, target: Target::Back });
            }
            match from.map.partner(came_by) {
                Some(exit)
                    if self.translation.vertex(from.map.vertex(exit)).is_some()
                        && self.translation.image(from, to, exit)? == edge =>
                {
                    edge
                }
                _ => NONE,
            }
        } else {
            NONE
        };
        if self.translation.vertex(from.map.vertex(came_by)).is_none() {
            let is_open = exit == NONE || to.map.partner(exit).is_none();
            return is_open.then_some(Choice { exit, target: Target::New });
        }
        let image = self.translation.image(from, to, came_by)?;
        let target = match (exit, to.map.partner(exit)) {
            (NONE, _) => Target::At(image),
            (_, Some(partner)) if partner == image => Target::Known,
            (_, None) if to.map.partner(image).is_none() && image != exit => Target::At(image),
            _ => return None,
        };
        Some(Choice { exit, target })
    }

    /// How a place that is not on the map of another hypothesis is explained: as none, or as one for which the map has no room.
    fn off_the_map(&self, to: &Hypothesis<V, D, T>, index: usize) -> Option<Choice> {
        if self.record.get(index).starts() && to.map.vertices() > 0 {
            return Some(Choice { exit: NONE, target: Target::Spurious(false) });
        }
        if to.is_on_map()
            && let ReportedExit::Way(exit) = to.reported_exit(self.record, index, to.at)
        {
            let again = to.is_spurious_again(self.record, index, exit);
            return Some(Choice { exit, target: Target::Spurious(again) });
        }
        (!to.has_room_for_vertex()).then_some(Choice { exit: NONE, target: Target::OffMap })
    }

    /// Extends a hypothesis by observation `index` with the choice that explains it and what follows best, but not with a
    /// forbidden one; `noise` is added to each choice. Where it got to, and whether it just followed a known way; `None` when
    /// there is no choice.
    pub(super) fn decide(
        &mut self,
        to: &mut Hypothesis<V, D, T>,
        index: usize,
        forbidden: Option<Choice>,
        mut noise: impl FnMut() -> f32,
    ) -> Option<(Target, bool)> {
        let entry = self.record.get(index);
        let typical = self.model.typical_gain(entry.count(), entry.ln_travel > 0);
        if to.is_on_map()
            && !entry.starts()
            && let reported @ ReportedExit::Way(exit) = to.reported_exit(self.record, index, to.at)
            && to.map.partner(exit).is_some()
        {
            let choice = Choice { exit, target: Target::Known };
            let gain = to.gain(self.model, &entry, reported, choice);
            let ways = self.model.ln_of(to.map.ways(to.map.vertex(to.at)).len());
            if gain.total() > typical + SURPRISE - ways && forbidden != Some(choice) {
                to.extend(&entry, index, choice, gain, 0);
                return Some((choice.target, true));
            }
        }
        let nothing = (f32::NEG_INFINITY, Choice { exit: NONE, target: Target::Known }, Gain::default());
        let mut best = [nothing; FOLLOWED];
        to.propose(self.model, self.record, index, WORST_EXIT, |choice, gain| {
            if forbidden == Some(choice) || !to.has_room(choice) {
                return;
            }
            let mut moved = (gain.total(), choice, gain);
            for slot in &mut best {
                if moved.0 > slot.0 {
                    core::mem::swap(slot, &mut moved);
                }
            }
        });
        let mut chosen = nothing;
        for &(score, choice, gain) in best.iter().filter(|(score, ..)| *score > f32::NEG_INFINITY) {
            let total = score + self.rollout(to, index, choice) + noise();
            if total > chosen.0 {
                chosen = (total, choice, gain);
            }
        }
        let (total, choice, gain) = chosen;
        if total == f32::NEG_INFINITY {
            return None;
        }
        to.extend(&entry, index, choice, gain, 0);
        Some((choice.target, false))
    }

    /// Whether `to` is where `from` is at observation `index`, after a decision. A new vertex is taken for the one that `from`
    /// came to then for the first time.
    pub(super) fn is_back(
        &mut self,
        from: &Hypothesis<V, D, T>,
        to: &mut Hypothesis<V, D, T>,
        index: usize,
        target: Target,
    ) -> bool {
        let came_by = from.came_by(index);
        if came_by == OFF_MAP && matches!(target, Target::Spurious(_)) {
            // On the same edge, if they come from the same place.
            let before = index.checked_sub(1).map(|before| (from.came_by(before), to.came_by(before)));
            return before.is_some_and(|(from_before, to_before)| {
                self.translation.vertex(from.map.vertex(from_before)).is_some()
                    && self.translation.image(from, to, from_before) == Some(to_before)
            });
        }
        if came_by >= UNSEEN || !to.is_on_map() {
            return false;
        }
        let vertex = from.map.vertex(came_by);
        match (self.translation.vertex(vertex), target) {
            (Some(_), _) => self.translation.image(from, to, came_by) == Some(to.at),
            (None, Target::New) => {
                self.translation.set_vertex(vertex, to.map.vertex(to.at));
                to.map.turn_vertex(to.map.vertex(to.at), from.map.bearing(came_by).wrapping_sub(to.map.bearing(to.at)));
                self.translation.set(came_by, to.at);
                true
            }
            (None, _) => false,
        }
    }

    /// The gain of the places after observation `index`, compared with the typical one, as far as
    /// known ways lead.
    fn rollout(&self, on: &mut Hypothesis<V, D, T>, index: usize, choice: Choice) -> f32 {
        match choice.target {
            Target::Known => self.follow_known(on, index, on.map.partner(choice.exit).unwrap_or(NONE)),
            Target::At(dart) if choice.exit == NONE => self.follow_known(on, index, dart),
            Target::At(dart) => {
                on.map.join(choice.exit, dart);
                let gain = self.follow_known(on, index, dart);
                on.map.part(dart);
                gain
            }
            // From a new vertex the only known way leads back.
            Target::New if choice.exit < UNSEEN && self.record.get(index + 1).exit().is_some_and(Exit::is_back) => {
                self.arrive(on, index + 1, choice.exit) + self.follow_known(on, index + 1, choice.exit)
            }
            Target::Back => self.follow_known(on, index, choice.exit),
            Target::Beyond(dart) => self.follow_known(on, index, dart),
            Target::Spurious(_) if choice.exit == NONE => -OPEN,
            Target::Spurious(_) => self.follow_along(on, index + 1, choice.exit),
            Target::New | Target::Unseen(..) | Target::OffMap => -OPEN,
        }
    }

    /// As [`Builder::follow_known`], of a robot that comes to observation `index` along an edge on which a place was none.
    fn follow_along(&self, on: &Hypothesis<V, D, T>, index: usize, edge: u8) -> f32 {
        let entry = self.record.get(index);
        let ends = on.ends_ahead(&entry, edge);
        let gains = ends.map(|end| self.arrive(on, index, end) + self.follow_known(on, index, end));
        gains.reduce(f32::max).unwrap_or(-OPEN)
    }

    fn arrive(&self, on: &Hypothesis<V, D, T>, index: usize, at: u8) -> f32 {
        let entry = self.record.get(index);
        let typical = self.model.typical_gain(entry.count(), false);
        (on.arrival(self.model, &entry, at).total() - typical).max(ROLLOUT_WORST)
    }

    fn follow_known(&self, on: &Hypothesis<V, D, T>, index: usize, mut at: u8) -> f32 {
        let mut sum = 0.0;
        let last = (index + LOOKAHEAD).min(self.record.len().saturating_sub(1));
        for next in index + 1..=last {
            if self.record.get(next).starts() {
                break;
            }
            let (gain, partner) = self.known_step(on, next, at);
            sum += gain.max(ROLLOUT_WORST);
            if gain < ROLLOUT_WORST || partner == NONE {
                break;
            }
            at = partner;
        }
        sum
    }

    /// Where the robot got to at observation `index` by a known way, having come to the place before by `at`, and what that gains
    /// compared with the typical gain; [`NONE`] at a frontier.
    fn known_step(&self, on: &Hypothesis<V, D, T>, index: usize, at: u8) -> (f32, u8) {
        let entry = self.record.get(index);
        let reported = on.reported_exit(self.record, index, at);
        let typical = self.model.typical_gain(entry.count(), entry.ln_travel > 0);
        let gain = |partner: u8| {
            on.arrival(self.model, &entry, partner).total() + self.model.travel(on.map.travel(partner), entry.ln_travel)
                - typical
        };
        let mut best = (f32::NEG_INFINITY, NONE);
        if reported == ReportedExit::Unseen {
            return (-OPEN, NONE);
        }
        if let ReportedExit::Way(exit) = reported {
            let Some(partner) = on.map.partner(exit) else { return (-OPEN, NONE) };
            best = (gain(partner), partner);
        }
        if best.0 < DOUBT {
            // Another exit than the reported one.
            let ways = on.map.ways(on.map.vertex(at));
            let others = ways.len().saturating_sub(1);
            for &exit in ways.iter().filter(|&&exit| reported != ReportedExit::Way(exit)) {
                let cost = match reported {
                    ReportedExit::Way(_) => self.model.ln_wrong_exit(others),
                    ReportedExit::NotBack(came_by) if exit == came_by => self.model.ln_wrong_exit(1),
                    _ => 0.0,
                };
                let other = match on.map.partner(exit) {
                    Some(partner) => (cost + gain(partner), partner),
                    // It may have led anywhere.
                    None if !matches!(reported, ReportedExit::Way(_)) => (cost - OPEN, NONE),
                    None => continue,
                };
                if other.0 > best.0 {
                    best = other;
                }
            }
        }
        best
    }

    /// Draws another way by which the robot may have come to place `from`, and lets the path follow known ways from there
    /// until it is where it was, or none leads on. The map stays as it is. `false` when no way fits.
    pub(super) fn relocate(&self, on: &mut Hypothesis<V, D, T>, from: usize, mut noise: impl FnMut() -> f32) -> bool {
        let first = self.record.get(from);
        let mut best = (f32::NEG_INFINITY, NONE);
        for dart in 0..on.map.darts() {
            if dart != on.came_by(from) && !on.is_far(self.model, first.steps, on.map.vertex(dart)) {
                let gain = self.arrive(on, from, dart) + self.follow_known(on, from, dart) + noise();
                if gain > best.0 {
                    best = (gain, dart);
                }
            }
        }
        let mut at = best.1;
        if at == NONE {
            return false;
        }
        let mut reached = 0_u64;
        let mut index = from;
        while index < self.record.len() {
            set(&mut on.path, index, at);
            reached |= 1 << (on.map.vertex(at) & 63);
            index += 1;
            let (gain, partner) = self.known_step(on, index, at);
            if on.came_by(index) == partner {
                return true;
            }
            if gain < ROLLOUT_WORST || partner == NONE {
                break;
            }
            at = partner;
        }
        // What follows is open until the path is among vertices that were reached.
        while index < self.record.len() && reached >> (on.map.vertex(on.came_by(index)) & 63) & 1 == 0 {
            set(&mut on.path, index, NONE);
            index += 1;
        }
        true
    }
}

fn set(path: &mut [u8], index: usize, dart: u8) {
    if let Some(slot) = path.get_mut(index) {
        *slot = dart;
    }
}
