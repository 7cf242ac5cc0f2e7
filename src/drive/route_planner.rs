//! Chooses the exit of a place: to explore, or to drive to a vertex of the map.

use rand_core::Rng;

use super::doors::Doors;
use super::local_planner::{Choice, Exits};
use super::routes::{edge_frames, frames_to};
use super::way_back::Gap;
use crate::filter::Filter;
use crate::filter::draws;
use crate::map::{DartId, Darts, PerVertex, VertexId};
use crate::place::Obstacles;

/// Minimum probability of a vertex that counts as reached, in units of 2⁻¹⁶.
const REACHED_Q16: u32 = 1 << 15;
/// Successive places with a way to drive after which a map is no longer complete.
const INCOMPLETE_PLACES: usize = 3;
/// An edge with fewer passages is not confirmed.
const CONFIRMED_PASSAGES: u8 = 2;
/// An exit is matched to the way of the map whose bearing differs by at most this, in units of 2⁻¹⁶ of a turn: 0.55 rad.
const SAME_WAY: u16 = 5736;

/// The number of remembered ways on which the robot turned back.
const REFUSED: usize = 8;
/// After turning back this often on a way, the robot does not explore it.
const REFUSED_TIMES: u8 = 2;

/// The most exits that are considered at a place.
const EXITS: usize = 2 * Obstacles::MAX;

/// What the drive is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Goal {
    /// Explore: drive the nearest way that is new. When the map is complete, drive the ways with the fewest passages.
    Explore,
    /// Drive to this vertex of the best map and stop there.
    Vertex(VertexId),
    /// Stop at the next place.
    Stop,
}

/// Status of a goal that is a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GoalStatus {
    /// The goal is not a vertex.
    Inactive,
    /// The robot is driving to the vertex.
    Active,
    /// The robot stopped at the vertex: the filter gives it a probability of at least one half.
    Reached,
    /// The best map no longer contains the vertex.
    VertexRemoved,
    /// The robot visited more than `8 · V` places without reaching the vertex.
    TimedOut,
}

/// The goal, and whether the map is complete. Memory: some 30 bytes.
#[derive(Clone, Debug)]
pub(super) struct RoutePlanner<const V: usize> {
    seed: u64,
    goal: Goal,
    goal_status: GoalStatus,
    /// Places since the goal was set.
    places: u16,
    /// Number of choices since the start, the index of the random draws.
    decisions: u32,
    is_complete: bool,
    /// Successive places that contradict `is_complete`.
    contrary_places: u8,
    /// The way that was chosen last, if the map has it.
    chosen: RefusedWay,
    /// The ways on which the robot turned back, the newest first.
    refused: [RefusedWay; REFUSED],
    doors: Doors,
}

/// A way on which the robot turned back. With 0 times it is none; so a `static` robot lies in `.bss`.
#[derive(Clone, Copy, Debug)]
struct RefusedWay {
    vertex: VertexId,
    /// Its bearing on the map, in units of 2⁻¹⁶ of a turn.
    bearing: u16,
    times: u8,
}

impl RefusedWay {
    const NONE: Self = Self { vertex: VertexId::FIRST, bearing: 0, times: 0 };

    /// Whether this is a way of the map, refused at least `times` times.
    fn is(&self, darts: Darts<'_>, way: DartId, times: u8) -> bool {
        let off = darts.bearing(way).unwrap_or(0).wrapping_sub(self.bearing) as i16;
        self.times >= times && darts.vertex(way) == Some(self.vertex) && off.unsigned_abs() <= SAME_WAY
    }
}

/// The ways of the map behind the exits of the present place.
#[derive(Clone, Copy)]
struct Here<'a> {
    darts: Darts<'a>,
    /// The bearings of the exits: first those that the sonars show, then those that only the map has.
    exits: [u16; EXITS],
    len: usize,
    ways: [Option<DartId>; EXITS],
}

impl<'a> Here<'a> {
    /// Matches exits and ways that are the nearest to each other in bearing. Without `arrival` no exit has a way. Ways of the map that
    /// no sonar shows are exits too, if `has_door`.
    fn new(darts: Darts<'a>, arrival: Option<DartId>, exits: &Exits, has_door: impl Fn(DartId) -> bool) -> Self {
        let mut here = Self { darts, exits: [0; EXITS], len: 0, ways: [None; EXITS] };
        let exits = exits.as_slice();
        exits.iter().for_each(|&exit_mrad| here.push(exit_mrad, None));
        let Some((vertex, arrival)) =
            arrival.and_then(|arrival| Some((darts.vertex(arrival)?, darts.bearing(arrival)?)))
        else {
            return here;
        };
        let off = |exit_mrad: u16, way: DartId| {
            let expected = arrival.wrapping_add((u32::from(exit_mrad) * 65_536 / 6283) as u16);
            let off = darts.bearing(way).unwrap_or(0).wrapping_sub(expected) as i16;
            off.unsigned_abs()
        };
        for (&exit_mrad, slot) in exits.iter().zip(&mut here.ways) {
            let nearest = darts.ways(vertex).min_by_key(|&way| off(exit_mrad, way));
            *slot = nearest.filter(|&way| {
                let least = exits.iter().map(|&other_mrad| off(other_mrad, way)).min();
                off(exit_mrad, way) <= SAME_WAY && least == Some(off(exit_mrad, way))
            });
        }
        for way in darts.ways(vertex) {
            let is_shown = exits.iter().any(|&exit_mrad| off(exit_mrad, way) <= SAME_WAY);
            if !is_shown && has_door(way) {
                let relative = darts.bearing(way).unwrap_or(0).wrapping_sub(arrival);
                here.push((u32::from(relative) * 6283 / 65_536) as u16, Some(way));
            }
        }
        here
    }

    fn push(&mut self, exit_mrad: u16, way: Option<DartId>) {
        if let (Some(exit), Some(slot)) = (self.exits.get_mut(self.len), self.ways.get_mut(self.len)) {
            (*exit, *slot) = (exit_mrad, way);
            self.len += 1;
        }
    }

    fn way(&self, exit: usize) -> Option<DartId> {
        self.ways.get(exit).copied().flatten()
    }

    /// The travel time through an exit to a target of `frames`, in ring frames.
    fn frames<const V: usize>(&self, exit: usize, frames: &PerVertex<Option<u32>, V>) -> Option<u32> {
        let way = self.way(exit)?;
        let end = self.darts.vertex(self.darts.partner(way)?)?;
        Some(edge_frames(self.darts, way).saturating_add((*frames.get(end)?)?))
    }
}

impl<const V: usize> RoutePlanner<V> {
    pub(super) const fn new() -> Self {
        Self {
            seed: 0,
            goal: Goal::Explore,
            goal_status: GoalStatus::Inactive,
            places: 0,
            decisions: 0,
            is_complete: false,
            contrary_places: 0,
            chosen: RefusedWay::NONE,
            refused: [RefusedWay::NONE; REFUSED],
            doors: Doors::new(),
        }
    }

    pub(super) fn start(&mut self, seed: u64) {
        *self = Self { seed, ..Self::new() };
    }

    pub(super) fn set_goal(&mut self, goal: Goal) {
        self.goal = goal;
        self.places = 0;
        self.goal_status = if matches!(goal, Goal::Vertex(_)) { GoalStatus::Active } else { GoalStatus::Inactive };
    }

    pub(super) const fn goal(&self) -> Goal {
        self.goal
    }

    pub(super) const fn goal_status(&self) -> GoalStatus {
        self.goal_status
    }

    pub(super) const fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// The filter has observed a place. Time O(V² + D).
    pub(super) fn arrive(&mut self, filter: &impl Filter<V>) {
        self.places = self.places.saturating_add(1);
        if let (Goal::Vertex(target), GoalStatus::Active) = (self.goal, self.goal_status) {
            match filter.remapped(target) {
                Some(target) => self.goal = Goal::Vertex(target),
                None => self.goal_status = GoalStatus::VertexRemoved,
            }
        }
        for refused in &mut self.refused {
            match filter.remapped(refused.vertex) {
                Some(vertex) => refused.vertex = vertex,
                None => *refused = RefusedWay::NONE,
            }
        }
        self.doors.arrive();
        self.update_completeness(filter);
    }

    /// The robot turned back on the way that was chosen last.
    pub(super) fn refuse(&mut self, filter: &impl Filter<V>) {
        let Some(darts) = filter.darts() else { return };
        let chosen = core::mem::replace(&mut self.chosen, RefusedWay::NONE);
        if chosen.times == 0 {
            return;
        }
        let way = darts.ways(chosen.vertex).find(|&way| chosen.is(darts, way, 1));
        let known = way.and_then(|way| self.refused.iter_mut().find(|refused| refused.is(darts, way, 1)));
        if let Some(known) = known {
            known.times = known.times.saturating_add(1);
        } else {
            self.refused.rotate_right(1);
            if let Some(first) = self.refused.first_mut() {
                *first = chosen;
            }
        }
    }

    /// Whether a way is to be explored: it is new, and the robot has not turned back on it.
    fn is_open(&self, filter: &impl Filter<V>, darts: Darts<'_>, way: DartId) -> bool {
        is_frontier(filter, darts, way) && !self.refused.iter().any(|refused| refused.is(darts, way, REFUSED_TIMES))
    }

    fn update_completeness(&mut self, filter: &impl Filter<V>) {
        let (Some(darts), Some(here)) = (filter.darts(), filter.recent(0)) else { return };
        let is_due = frames_to_way::<V>(darts, |way| self.is_open(filter, darts, way) || is_unconfirmed(darts, way));
        let is_due = is_due[here].is_some();
        let seems_complete = !is_due && !filter.is_uncertain();
        if seems_complete == self.is_complete || self.is_complete && !is_due {
            self.contrary_places = 0;
            return;
        }
        self.contrary_places = self.contrary_places.saturating_add(1);
        // A map is complete when it has stood a patrol of as many places as it has edges.
        let patrol = darts.edges().count() + 2;
        if usize::from(self.contrary_places) >= if self.is_complete { INCOMPLETE_PLACES } else { patrol } {
            self.is_complete = !self.is_complete;
            self.contrary_places = 0;
        }
    }

    /// Chooses the exit of the present place; `None` to stop there, or without an exit. `door` is that by which the robot came, relative
    /// to that way. Time O(V² + D).
    pub(super) fn choose(&mut self, filter: &impl Filter<V>, exits: &Exits, door: Option<Gap>) -> Option<Choice> {
        self.decisions = self.decisions.wrapping_add(1);
        self.doors.note(filter, door);
        let here = filter.darts().map(|darts| {
            let has_door = |way| self.doors.on(filter, way).is_some();
            Here::new(darts, filter.arrival(), exits, has_door)
        });
        self.chosen = RefusedWay::NONE;
        let exit = match self.goal {
            Goal::Stop => None,
            Goal::Explore => here.and_then(|here| self.explore(filter, &here)).or_else(|| self.any(exits)),
            Goal::Vertex(target) => {
                self.update_status(filter, target);
                if self.goal_status != GoalStatus::Active {
                    return None;
                }
                here.and_then(|here| self.towards(target, &here)).or_else(|| self.any(exits))
            }
        };
        // Without an exit that the sonars show, any way of the map leads out.
        let exit = match (exit, here) {
            (None, Some(here)) if self.goal != Goal::Stop => self.at_random(here.len, |_| true),
            _ => exit,
        }?;
        let mut choice =
            Choice { exit_mrad: exits.as_slice().get(exit).copied().unwrap_or(0), is_hidden: false, door: None };
        if let Some((way, here)) = here.and_then(|here| Some((here.way(exit)?, here)))
            && let (Some(vertex), Some(bearing)) = (here.darts.vertex(way), here.darts.bearing(way))
        {
            self.chosen = RefusedWay { vertex, bearing, times: 1 };
            let exit_mrad = here.exits.get(exit).copied()?;
            let is_hidden = exit >= exits.as_slice().len();
            choice = Choice { exit_mrad, is_hidden, door: self.doors.on(filter, way) };
        }
        Some(choice)
    }

    /// Updates the status of an active goal.
    fn update_status(&mut self, filter: &impl Filter<V>, target: VertexId) {
        if self.goal_status != GoalStatus::Active {
            return;
        }
        let is_reached = filter.recent(0) == Some(target) && filter.vertex_probability_q16(target) >= REACHED_Q16;
        if is_reached {
            self.goal_status = GoalStatus::Reached;
        } else if !filter.map().contains(target) {
            self.goal_status = GoalStatus::VertexRemoved;
        } else if usize::from(self.places) > 8 * V {
            self.goal_status = GoalStatus::TimedOut;
        }
    }

    /// The exit with the shortest travel time to a way that is new, or to one with the fewest passages.
    fn explore(&self, filter: &impl Filter<V>, here: &Here<'_>) -> Option<usize> {
        let darts = here.darts;
        self.towards_way(here, |way| self.is_open(filter, darts, way)).or_else(|| {
            let least = darts.edges().map(|(way, _)| darts.passages(way)).min()?;
            self.towards_way(here, |way| darts.partner(way).is_some() && darts.passages(way) == least)
        })
    }

    /// The exit with the shortest travel time to a way that `is_due`, at random among equals; `None` if there is no path to one.
    fn towards_way(&self, here: &Here<'_>, is_due: impl Fn(DartId) -> bool) -> Option<usize> {
        let frames = frames_to_way::<V>(here.darts, &is_due);
        let to_way = |exit: usize| match here.way(exit) {
            Some(way) if is_due(way) => Some(0),
            _ => here.frames(exit, &frames),
        };
        let least = (0..here.len).filter_map(to_way).min()?;
        self.at_random(here.len, |exit| to_way(exit) == Some(least))
    }

    /// The exit with the shortest travel time to the target. If the map has no path, an exit that is new, or that the map does not
    /// have.
    fn towards(&self, target: VertexId, here: &Here<'_>) -> Option<usize> {
        let frames = frames_to::<V>(here.darts, |vertex| vertex == target);
        let to_target = |exit: usize| here.frames(exit, &frames);
        let least = (0..here.len).filter_map(to_target).min();
        let is_new = |exit: usize| here.way(exit).is_none_or(|way| here.darts.partner(way).is_none());
        match least {
            Some(least) => self.at_random(here.len, |exit| to_target(exit) == Some(least)),
            None => self.at_random(here.len, is_new),
        }
    }

    /// Any exit.
    fn any(&self, exits: &Exits) -> Option<usize> {
        self.at_random(exits.as_slice().len(), |_| true)
    }

    /// One of the first `count` exits that `suits` accepts, each with the same probability.
    fn at_random(&self, count: usize, suits: impl Fn(usize) -> bool) -> Option<usize> {
        let suitable = || (0..count).filter(|&exit| suits(exit));
        let draw = draws(self.seed, u64::from(self.decisions)).next_u32() as usize;
        suitable().nth(draw.checked_rem(suitable().count())?)
    }
}

/// Whether a way of the map is new: nobody has driven it, and more than a third of the visits to its vertex have shown it.
fn is_frontier<const V: usize>(filter: &impl Filter<V>, darts: Darts<'_>, way: DartId) -> bool {
    let visits = darts.vertex(way).map_or(0, |vertex| filter.map().visits(vertex).min(u8::MAX.into()));
    darts.partner(way).is_none() && 3 * u32::from(darts.sightings(way)) > visits
}

/// Whether a way was driven only once: nothing has confirmed yet where it leads to.
fn is_unconfirmed(darts: Darts<'_>, way: DartId) -> bool {
    darts.partner(way).is_some() && darts.passages(way) < CONFIRMED_PASSAGES
}

/// The travel time from each vertex to the nearest one with a way that `is_due`.
fn frames_to_way<const V: usize>(darts: Darts<'_>, is_due: impl Fn(DartId) -> bool) -> PerVertex<Option<u32>, V> {
    frames_to(darts, |vertex| darts.ways(vertex).any(&is_due))
}

/// Whether the best map has a path from the robot's vertex to another one.
pub(super) fn leads_to<const V: usize>(filter: &impl Filter<V>, vertex: VertexId) -> bool {
    let (Some(darts), Some(here)) = (filter.darts(), filter.recent(0)) else { return false };
    frames_to::<V>(darts, |target| target == vertex).get(here).is_some_and(Option::is_some)
}
