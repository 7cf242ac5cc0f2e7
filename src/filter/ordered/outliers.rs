//! Outliers of the place detector: places that are none, and vertices that it did not detect.
//!
//! A place that is none has no vertex. The robot is on the edge that it took, and comes to one of its ends next. A vertex that was
//! not detected is passed: the robot comes to a vertex beyond it.

use super::choice::{Choice, Gain, OFF_MAP, ReportedExit, Target, UNSEEN};
use super::hypothesis::Hypothesis;
use super::logarithm::{exp, ln};
use super::model::{LN_ANY_LABEL, LN_MISSED_PLACE, LN_SPURIOUS, LN_SPURIOUS_AGAIN, LN_SPURIOUS_START, LN_WAYS, Model};
use super::record::{Entry, Record};
use crate::filter::Exit;
use crate::map::LN_TRAVEL_UNIT;

/// The robot leaves a place that is none straight on or back, up to this: an eighth of a turn, in the unit of exits.
const STRAIGHT: u8 = 32;

/// The logarithm of the sum of two travel times, from their logarithms.
fn ln_sum(a: u16, b: u16) -> u16 {
    let (longer, shorter) = (a.max(b), a.min(b));
    let more = ln(1.0 + exp(-f32::from(longer - shorter) / LN_TRAVEL_UNIT));
    longer.saturating_add((more * LN_TRAVEL_UNIT) as u16)
}

/// Whether the robot may have turned back on the edge, and whether it may have driven on.
fn courses(entry: &Entry) -> (bool, bool) {
    match entry.exit() {
        None => (true, true),
        Some(Exit::Back) => (true, false),
        Some(Exit::On) => (false, true),
        Some(Exit::Bearing(bearing)) => {
            (bearing.min(bearing.wrapping_neg()) <= STRAIGHT, bearing.abs_diff(128) <= STRAIGHT)
        }
    }
}

impl<const V: usize, const D: usize, const T: usize> Hypothesis<V, D, T> {
    /// What it gains if the place is none, apart from the exit; `again` if one on the same edge was none before.
    pub(super) fn spurious(&self, model: &Model, entry: &Entry, again: bool) -> Gain {
        let others = f32::from(entry.count().saturating_sub(1));
        let number = if entry.count() == 0 { 0.0 } else { -LN_WAYS };
        let share = match again {
            _ if entry.starts() => LN_SPURIOUS_START,
            true => LN_SPURIOUS_AGAIN,
            false => LN_SPURIOUS,
        };
        // Nothing else is known of what is seen there. This stays as it is when the scale of the noise changes.
        Gain { labels: 0.0, rest: share + LN_ANY_LABEL + others * model.way_new(0) + number }
    }

    /// Whether a place before observation `index` was none on the same edge: what is seen again there is rather a place. Cost: O(T).
    pub(super) fn is_spurious_again(&self, record: &Record<T>, index: usize, edge: u8) -> bool {
        let partner = self.map.partner(edge);
        let places = self.path.iter().zip(self.path.iter().skip(1)).take(index.saturating_sub(1)).zip(1..);
        places.filter(|&((_, &came_by), _)| came_by == OFF_MAP).any(|((&from, _), place)| {
            self.edge_between(record, place, from).is_some_and(|other| other == edge || Some(other) == partner)
        })
    }

    /// The edge on which the robot is before observation `index`, as its way of the vertex that the robot left, if the place before was
    /// none.
    pub(super) fn edge_under(&self, record: &Record<T>, index: usize) -> Option<u8> {
        if self.at != OFF_MAP || record.get(index).starts() {
            return None;
        }
        let before = index.checked_sub(1)?;
        self.edge_between(record, before, self.came_by(before.checked_sub(1)?))
    }

    /// The reported way by which the robot left the place before observation `index`, to which it came by `from`.
    pub(super) fn edge_between(&self, record: &Record<T>, index: usize, from: u8) -> Option<u8> {
        if from >= UNSEEN || record.get(index).starts() {
            return None;
        }
        match self.reported_exit(record, index, from) {
            ReportedExit::Way(edge) => Some(edge),
            _ => None,
        }
    }

    /// The ends of an edge to which the robot may come next, if it is on the edge.
    pub(super) fn ends_ahead(&self, entry: &Entry, edge: u8) -> impl Iterator<Item = u8> {
        let (may_be_back, may_be_on) = courses(entry);
        let ahead = if may_be_on { self.map.partner(edge) } else { None };
        may_be_back.then_some(edge).into_iter().chain(ahead)
    }

    /// Proposes both ends of the edge on which the robot is.
    pub(super) fn propose_along(
        &self,
        model: &Model,
        record: &Record<T>,
        index: usize,
        edge: u8,
        mut proposed: impl FnMut(Choice, Gain),
    ) {
        let entry = record.get(index);
        let reported = self.reported_exit(record, index, self.at);
        let mut propose = |target| {
            let choice = Choice { exit: edge, target };
            proposed(choice, self.gain(model, &entry, reported, choice));
        };
        let (may_be_back, may_be_on) = courses(&entry);
        if may_be_back {
            propose(Target::Back);
        }
        if may_be_on && self.map.partner(edge).is_some() {
            propose(Target::Known);
        } else if may_be_on {
            propose(Target::New);
            self.near_frontiers(model, &entry, edge).for_each(|frontier| propose(Target::At(frontier)));
        }
    }

    /// The ways by which the robot may come to the vertices beyond that at the other end of an edge. None for a loop: the path does not show
    /// that the robot passed its own vertex.
    pub(super) fn ways_beyond(&self, exit: u8) -> impl Iterator<Item = u8> + '_ {
        let passed = self.map.partner(exit).filter(|&passed| self.map.vertex(passed) != self.map.vertex(exit));
        let ways = passed.map_or(&[][..], |passed| self.map.ways(self.map.vertex(passed)));
        ways.iter().filter(move |&&way| Some(way) != passed).filter_map(|&way| self.map.partner(way))
    }

    /// What it gains to have passed the vertex at the other end of an edge, and to have come to one beyond it by `dart`.
    pub(super) fn arrival_beyond(&self, model: &Model, entry: &Entry, exit: u8, dart: u8) -> Gain {
        let mut gain = self.arrival(model, entry, dart);
        gain.rest += self.passing(model, exit);
        gain
    }

    /// ln P of passing the vertex at the other end of an edge without a detection, and of leaving it by one of its other ways.
    pub(super) fn passing(&self, model: &Model, exit: u8) -> f32 {
        let ways = self.map.partner(exit).map_or(0, |passed| self.map.ways(self.map.vertex(passed)).len());
        LN_MISSED_PLACE - model.ln_of(ways.saturating_sub(1))
    }

    /// ln of the density of the travel time by an edge to its other end, all of it or what is left behind a place that was none.
    pub(super) fn travel_along(&self, model: &Model, entry: &Entry, reported: ReportedExit, exit: u8) -> f32 {
        match reported {
            ReportedExit::Before(0) => model.travel((0, 0), entry.ln_travel),
            ReportedExit::Before(first) if entry.ln_travel > 0 => {
                model.travel(self.map.travel(exit), ln_sum(first, entry.ln_travel))
            }
            _ => model.travel(self.map.travel(exit), entry.ln_travel),
        }
    }

    /// ln of the density of the travel time back from a place that was none.
    pub(super) fn travel_back(&self, model: &Model, entry: &Entry, reported: ReportedExit) -> f32 {
        let first = if let ReportedExit::Before(first) = reported { first } else { 0 };
        model.travel((u8::from(first > 0), first), entry.ln_travel)
    }

    /// ln of the density of the travel time by two edges.
    pub(super) fn travel_beyond(&self, model: &Model, entry: &Entry, exit: u8, dart: u8) -> f32 {
        let ((timed, first), (timed_beyond, second)) = (self.map.travel(exit), self.map.travel(dart));
        let timed = timed.min(timed_beyond);
        let sum = if timed > 0 { ln_sum(first, second) } else { 0 };
        model.travel((timed, sum), entry.ln_travel)
    }

    /// The exit that the robot took, if it passed a vertex between observation `index` and the one before, and left it by `way`.
    pub(super) fn exit_before(&self, record: &Record<T>, index: usize, from: u8, way: u8) -> Option<u8> {
        let exit = self.edge_between(record, index, from)?;
        let passed = self.map.partner(exit)?;
        (passed != way && self.map.vertex(passed) == self.map.vertex(way)).then_some(exit)
    }
}
