//! Decoding: the path that explains the record best on the map of the source, where that path is broken.
//!
//! A repair that removes vertices or edges of its source leaves the path of the source broken. The decoder follows the path up to
//! some places before a break, keeps the best few ways by which the robot may have come to each place from there on (the Viterbi
//! algorithm with a beam), and stops where the best of them is on the path again. The map changes only by edges between two
//! frontiers that the decoded path passes.

use super::choice::{OFF_MAP, ReportedExit, UNSEEN};
use super::hypothesis::Hypothesis;
use super::model::{LN_PART, Model};
use super::record::Record;
use super::replay::WORST_EXIT;
use crate::map::{NONE, VertexId, VertexSet};

/// The number of ways that are kept for a place.
const STATES: usize = 8;

/// The number of places that are decided together.
const LAG: usize = 48;

/// The decoder starts this many places before a break.
const BEFORE: usize = 4;

/// Ways that are this much less likely than the best one are dropped, in nats.
const UNLIKELY: f32 = 16.0;

/// The best way is certain when all others are this much less likely, in nats.
const CERTAIN: f32 = 6.0;

/// The cost of leaving the map where neither a frontier nor a way that no visit has shown explains it, in nats.
const LOST: f32 = 10.0;

/// Edges, and places anywhere on the map, are not considered from a state that is this far behind the best next one, in nats.
const BEHIND_BY_EDGE: f32 = 40.0;
const BEHIND_ANYWHERE: f32 = 30.0;

/// A way by which the robot may have come to a place: [`NONE`] for a place that is not on the map, [`OFF_MAP`] for one that is none.
#[derive(Clone, Copy, Debug)]
struct State {
    came_by: u8,
    /// The position of the state before it.
    before: u8,
}

impl State {
    const ZERO: Self = Self { came_by: 0, before: 0 };
}

/// The states of the newest places, and how likely the last ones are.
#[derive(Clone, Debug)]
pub(super) struct Decoder {
    states: [[State; STATES]; LAG],
    scores: [f32; STATES],
    /// How many states the newest place has.
    count: u8,
    /// How many places are decided together so far; 0 when the path is followed.
    places: u8,
    /// Vertices that are no longer on the map.
    removed: VertexSet,
    /// Two frontiers that no edge joins.
    apart: (u8, u8),
}

/// The best few states of the next place.
struct Next {
    states: [State; STATES],
    scores: [f32; STATES],
    count: usize,
    /// How many states were evaluated.
    work: u32,
}

impl Next {
    const fn new() -> Self {
        Self { states: [State::ZERO; STATES], scores: [0.0; STATES], count: 0, work: 0 }
    }

    /// Inserts a state, or replaces the same one if this is better.
    fn insert(&mut self, came_by: u8, before: usize, score: f32) {
        let same = self.states.iter().take(self.count).position(|state| state.came_by == came_by);
        let mut position = match same {
            Some(same) if self.scores.get(same).is_none_or(|&held| held >= score) => return,
            Some(same) => same,
            None if self.count < STATES => {
                self.count += 1;
                self.count - 1
            }
            None if self.scores.last().is_none_or(|&worst| worst >= score) => return,
            None => STATES - 1,
        };
        while let Some(ahead) = position.checked_sub(1)
            && self.scores.get(ahead).is_some_and(|&held| held < score)
        {
            if let (Some(&state), Some(&held)) = (self.states.get(ahead), self.scores.get(ahead)) {
                set(&mut self.states, position, state);
                set(&mut self.scores, position, held);
            }
            position = ahead;
        }
        set(&mut self.states, position, State { came_by, before: before as u8 });
        set(&mut self.scores, position, score);
    }

    /// How far a state with this score would be behind the best one.
    fn behind(&self, score: f32) -> f32 {
        if self.count == 0 { 0.0 } else { self.scores.first().map_or(0.0, |best| best - score) }
    }
}

fn set<S: Copy>(slots: &mut [S], position: usize, item: S) {
    if let Some(slot) = slots.get_mut(position) {
        *slot = item;
    }
}

impl Decoder {
    pub(super) const fn new() -> Self {
        Self {
            states: [[State::ZERO; STATES]; LAG],
            scores: [0.0; STATES],
            count: 0,
            places: 0,
            removed: VertexSet::EMPTY,
            apart: (0, 0),
        }
    }

    /// Starts at the beginning of the record, with vertices that are no longer on the map, and two frontiers that no edge joins.
    pub(super) fn start(&mut self, removed: VertexSet, apart: (u8, u8)) {
        self.removed = removed;
        self.apart = apart;
        self.places = 0;
    }

    fn is_removed(&self, vertex: u8) -> bool {
        VertexId::new(vertex).is_some_and(|vertex| self.removed.contains(vertex))
    }

    /// Decodes from place `index` on until `work` states were evaluated. Returns the next place, which is the length of the record at the
    /// end, and how many states were evaluated.
    pub(super) fn run<const V: usize, const D: usize, const T: usize>(
        &mut self,
        model: &Model,
        record: &Record<T>,
        on: &mut Hypothesis<V, D, T>,
        mut index: usize,
        work: u32,
    ) -> (usize, u32) {
        let mut done = 0;
        while index < record.len() && done < work {
            if self.places == 0 {
                // The next break, from some places before it.
                let Some(broken) = (index..record.len()).find(|&place| self.is_broken(record, on, place)) else {
                    return (record.len(), done);
                };
                index = broken.saturating_sub(BEFORE).max(index);
                if let Some(before) = index.checked_sub(1)
                    && on.came_by(before) < UNSEEN
                {
                    self.begin(State { came_by: on.came_by(before), before: 0 });
                }
            }
            let next = self.step(model, record, on, index);
            done += next.work;
            self.accept(&next);
            index += 1;
            let is_certain = self.count == 1 || self.scores.get(1).is_some_and(|&second| second < -CERTAIN);
            let best = self.best();
            let is_on_path = best == on.came_by(index - 1) && best != NONE;
            if is_certain && is_on_path && !self.is_broken_ahead(record, on, index) {
                self.take(record, on, index);
                self.places = 0;
            } else if usize::from(self.places) == LAG {
                self.take(record, on, index);
                self.begin(State { came_by: best, before: 0 });
            }
        }
        if index == record.len() && self.places > 0 {
            self.take(record, on, index);
            self.places = 0;
        }
        (index, done)
    }

    /// Whether the path is broken at one of the next [`BEFORE`] places.
    fn is_broken_ahead<const V: usize, const D: usize, const T: usize>(
        &self,
        record: &Record<T>,
        on: &Hypothesis<V, D, T>,
        index: usize,
    ) -> bool {
        (index..(index + BEFORE).min(record.len())).any(|place| self.is_broken(record, on, place))
    }

    /// Whether the map has no way by which the path comes to a place.
    fn is_broken<const V: usize, const D: usize, const T: usize>(
        &self,
        record: &Record<T>,
        on: &Hypothesis<V, D, T>,
        index: usize,
    ) -> bool {
        let came_by = on.came_by(index);
        let before = index.checked_sub(1).map_or(NONE, |before| on.came_by(before));
        if came_by == OFF_MAP {
            return !record.get(index).starts() && (before >= UNSEEN || self.is_removed(on.map.vertex(before)));
        }
        if came_by >= UNSEEN || self.is_removed(on.map.vertex(came_by)) {
            return true;
        }
        if record.get(index).starts() || index == 0 || before == OFF_MAP {
            return false;
        }
        let Some(exit) = on.map.partner(came_by) else { return true };
        before < UNSEEN
            && on.map.vertex(exit) != on.map.vertex(before)
            && on.exit_before(record, index, before, exit).is_none()
    }

    fn begin(&mut self, state: State) {
        self.count = 1;
        self.places = 1;
        set(&mut self.scores, 0, 0.0);
        if let Some(first) = self.states.first_mut() {
            set(first, 0, state);
        }
    }

    fn best(&self) -> u8 {
        self.states
            .get(usize::from(self.places).wrapping_sub(1))
            .and_then(|states| states.first())
            .map_or(NONE, |best| best.came_by)
    }

    /// The states of the next place, with scores relative to the best one.
    fn accept(&mut self, next: &Next) {
        let best = next.scores.first().copied().unwrap_or(0.0);
        let likely = next.scores.iter().take(next.count).take_while(|&&score| score > best - UNLIKELY).count();
        self.count = likely as u8;
        for (slot, &score) in self.scores.iter_mut().zip(&next.scores) {
            *slot = score - best;
        }
        if let Some(states) = self.states.get_mut(usize::from(self.places)) {
            *states = next.states;
            self.places += 1;
        }
    }

    /// Writes the best states into the path; `end` is the place after the newest. Joins frontiers between which the path leads.
    fn take<const V: usize, const D: usize, const T: usize>(
        &mut self,
        record: &Record<T>,
        on: &mut Hypothesis<V, D, T>,
        end: usize,
    ) {
        let places = usize::from(self.places);
        let mut position = 0;
        for back in 1..=places {
            let state = self.states.get(places - back).and_then(|states| states.get(position)).copied();
            let state = state.unwrap_or(State::ZERO);
            set(&mut on.path, end - back, state.came_by);
            position = usize::from(state.before);
        }
        for index in end - places + 1..end {
            let (before, now) = (on.came_by(index - 1), on.came_by(index));
            if now >= UNSEEN || record.get(index).starts() || on.map.partner(now).is_some() {
                continue;
            }
            let exit = match before {
                OFF_MAP => index.checked_sub(2).and_then(|before| {
                    on.edge_between(record, index - 1, on.came_by(before)).filter(|&edge| edge != now)
                }),
                _ => on.edge_between(record, index, before),
            };
            if let Some(exit) = exit {
                on.map.join(exit, now);
            }
        }
    }

    /// The edge on which the robot is before place `index`, if the place before is none in a state.
    fn edge_under<const V: usize, const D: usize, const T: usize>(
        &self,
        record: &Record<T>,
        on: &Hypothesis<V, D, T>,
        index: usize,
        state: State,
    ) -> Option<u8> {
        let states = self.states.get(usize::from(self.places).checked_sub(2)?)?;
        let from = states.get(usize::from(state.before)).filter(|_| state.came_by == OFF_MAP)?.came_by;
        if record.get(index).starts() {
            return None;
        }
        on.edge_between(record, index.checked_sub(1)?, from)
    }

    fn step<const V: usize, const D: usize, const T: usize>(
        &self,
        model: &Model,
        record: &Record<T>,
        on: &Hypothesis<V, D, T>,
        index: usize,
    ) -> Next {
        let mut next = Next::new();
        let entry = record.get(index);
        let anywhere = model.ln_of(on.map.darts().into());
        let off_map = on.new_arrival(model, &entry).total() + if entry.starts() { LN_PART } else { 0.0 };
        let spurious = |again| on.spurious(model, &entry, again).total();
        let arrive = |next: &mut Next, dart: u8, before: usize, cost: f32| {
            if on.map.vertex(dart) == NONE
                || self.is_removed(on.map.vertex(dart))
                || on.is_far(model, entry.steps, on.map.vertex(dart))
            {
                return false;
            }
            next.work += 1;
            next.insert(dart, before, cost + on.arrival(model, &entry, dart).total());
            true
        };
        // By an edge between two frontiers.
        let close = |next: &mut Next, exit: u8, before: usize, cost: f32| {
            let cost = cost + model.closure(on.map.frontiers().count(), true) + model.travel((0, 0), entry.ln_travel);
            for frontier in on.map.frontiers() {
                if frontier != exit && ![(exit, frontier), (frontier, exit)].contains(&self.apart) {
                    arrive(next, frontier, before, cost);
                }
            }
        };
        if self.places == 0 {
            for dart in 0..on.map.darts() {
                arrive(&mut next, dart, 0, -anywhere);
            }
            next.insert(NONE, 0, off_map);
            return next;
        }
        let states = self.states.get(usize::from(self.places) - 1).copied().unwrap_or([State::ZERO; STATES]);
        for (before, (state, &score)) in states.iter().zip(&self.scores).take(self.count.into()).enumerate() {
            if state.came_by >= UNSEEN || entry.starts() {
                if let Some(edge) = self.edge_under(record, on, index, *state) {
                    let reported = on.reported_exit(record, index, OFF_MAP);
                    for end in on.ends_ahead(&entry, edge) {
                        let travel = if end == edge {
                            on.travel_back(model, &entry, reported)
                        } else {
                            on.travel_along(model, &entry, reported, edge)
                        };
                        arrive(&mut next, end, before, score + travel);
                    }
                    if on.map.partner(edge).is_none() {
                        close(&mut next, edge, before, score);
                    }
                }
                next.insert(NONE, before, score + off_map);
                if entry.starts() {
                    next.insert(OFF_MAP, before, score + spurious(false));
                }
                if next.behind(score - anywhere) > BEHIND_ANYWHERE {
                    continue;
                }
                for dart in 0..on.map.darts() {
                    arrive(&mut next, dart, before, score - anywhere);
                }
                continue;
            }
            next.insert(NONE, before, score + off_map - LOST);
            let reported = on.reported_exit(record, index, state.came_by);
            let ways = on.map.ways(on.map.vertex(state.came_by));
            if reported == ReportedExit::Unseen {
                let cost = score + reported.ln(model, UNSEEN, ways.len() + 1);
                next.insert(NONE, before, cost + off_map);
            }
            for &exit in ways {
                let exit_cost = reported.ln(model, exit, ways.len());
                let cost = score + exit_cost;
                if exit_cost < WORST_EXIT {
                    continue;
                }
                let is_reported = reported == ReportedExit::Way(exit);
                if is_reported {
                    next.insert(OFF_MAP, before, cost + spurious(on.is_spurious_again(record, index, exit)));
                }
                match on.map.partner(exit) {
                    Some(partner) if !self.is_removed(on.map.vertex(partner)) => {
                        if next.behind(cost) < BEHIND_BY_EDGE {
                            let travel = model.travel(on.map.travel(partner), entry.ln_travel);
                            let is_near = arrive(&mut next, partner, before, cost + travel);
                            if is_reported && !is_near {
                                let missed = on.passing(model, exit);
                                for dart in on.ways_beyond(exit) {
                                    let travel = on.travel_beyond(model, &entry, exit, dart);
                                    arrive(&mut next, dart, before, cost + missed + travel);
                                }
                            }
                        }
                    }
                    _ => {
                        next.insert(NONE, before, cost + off_map);
                        if is_reported {
                            close(&mut next, exit, before, cost);
                        }
                    }
                }
            }
        }
        next
    }
}
