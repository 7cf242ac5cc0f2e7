//! Chooses the exit of a place: to explore, or to drive to a vertex of the map.

use rand_core::Rng;

use super::departures::{Departures, Exit, MAX_EXITS};
use super::local_planner::Exits;
use crate::filter::Filter;
use crate::filter::draws;
use crate::map::PerVertex;
use crate::map::{VertexId, VertexSet};

/// Minimum probability of a vertex that counts as reached, in units of 2⁻¹⁶.
const REACHED_Q16: u32 = 1 << 15;

/// What the drive is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Goal {
    /// Explore: leave every place by the exit with the fewest uses.
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

/// The goal and the departures of the history. Memory: one byte for each of `HISTORY` places, and some 30 bytes.
#[derive(Clone, Debug)]
pub(super) struct RoutePlanner<const V: usize, const HISTORY: usize> {
    seed: u64,
    goal: Goal,
    goal_status: GoalStatus,
    /// Places since the goal was set.
    places: u16,
    /// Number of choices since the start, the index of the random draws.
    decisions: u32,
    departures: Departures<HISTORY>,
}

impl<const V: usize, const HISTORY: usize> RoutePlanner<V, HISTORY> {
    pub(super) const fn new() -> Self {
        Self {
            seed: 0,
            goal: Goal::Explore,
            goal_status: GoalStatus::Inactive,
            places: 0,
            decisions: 0,
            departures: Departures::new(),
        }
    }

    pub(super) fn start(&mut self, seed: u64) {
        self.seed = seed;
        self.goal = Goal::Explore;
        self.goal_status = GoalStatus::Inactive;
        self.places = 0;
        self.decisions = 0;
        self.departures.clear();
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

    pub(super) fn forget_departure(&mut self) {
        self.departures.forget_newest();
    }

    #[cfg(feature = "snapshot")]
    pub(super) fn departures(&self) -> impl ExactSizeIterator<Item = u8> + '_ {
        self.departures.iter()
    }

    /// Replaces the departures, oldest first, and explores.
    #[cfg(feature = "snapshot")]
    pub(super) fn resume(&mut self, departures: impl Iterator<Item = u8>) {
        self.set_goal(Goal::Explore);
        self.departures.replace(departures);
    }

    /// The filter has observed a place.
    pub(super) fn arrive(&mut self, filter: &impl Filter<V>) {
        self.departures.arrive();
        self.places = self.places.saturating_add(1);
        if let (Goal::Vertex(target), GoalStatus::Active) = (self.goal, self.goal_status) {
            match filter.remapped(target) {
                Some(target) => self.goal = Goal::Vertex(target),
                None => self.goal_status = GoalStatus::VertexRemoved,
            }
        }
    }

    /// Chooses the exit of the present place; `None` to stop there. Time O(V² + exits · HISTORY).
    pub(super) fn choose(&mut self, filter: &impl Filter<V>, exits: Exits) -> Option<u8> {
        let known = self.departures.exits(filter, if exits.is_entry_first { exits.count } else { 0 });
        self.decisions = self.decisions.wrapping_add(1);
        let chosen = match self.goal {
            Goal::Stop => None,
            Goal::Explore => self.least_used(&known, exits.count),
            Goal::Vertex(target) => {
                self.update_status(filter, target);
                if self.goal_status == GoalStatus::Active {
                    self.towards(filter, target, &known, exits.count)
                } else {
                    None
                }
            }
        };
        if let Some(exit) = chosen {
            self.departures.depart(exits, exit);
        }
        chosen
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

    /// The exit with the fewest uses, at random among equals.
    fn least_used(&self, known: &[Exit; MAX_EXITS], count: u8) -> Option<u8> {
        let least = known.iter().take(usize::from(count)).map(|exit| exit.uses).min()?;
        self.at_random(known, count, |exit| exit.uses == least)
    }

    /// The exit to the neighbour with the fewest edges to the target. If that exit is unknown, one of those that lead to an
    /// unknown vertex.
    fn towards(&self, filter: &impl Filter<V>, target: VertexId, known: &[Exit; MAX_EXITS], count: u8) -> Option<u8> {
        let distances = distances_to(filter, target);
        let distance = |vertex: VertexId| distances[vertex];
        let exit_distance = |exit: &Exit| exit.leads_to.and_then(distance);
        let nearest = known.iter().take(usize::from(count)).filter_map(exit_distance).min();
        let here = filter.recent(0).and_then(distance);
        match (nearest, here) {
            (Some(nearest), Some(here)) if nearest < here => {
                self.at_random(known, count, |exit| exit_distance(exit) == Some(nearest))
            }
            _ => self
                .at_random(known, count, |exit| exit.leads_to.is_none())
                .or_else(|| self.at_random(known, count, |_| true)),
        }
    }

    /// One of the exits that `suits` accepts, each with the same probability.
    fn at_random(&self, known: &[Exit; MAX_EXITS], count: u8, suits: impl Fn(&Exit) -> bool) -> Option<u8> {
        let suitable = || (0..count).zip(known).filter(|(_, exit)| suits(exit)).map(|(number, _)| number);
        let draw = draws(self.seed, u64::from(self.decisions)).next_u32() as usize;
        suitable().nth(draw.checked_rem(suitable().count())?)
    }
}

/// Whether the best map has a path from the robot's vertex to another one.
pub(super) fn leads_to<const V: usize>(filter: &impl Filter<V>, vertex: VertexId) -> bool {
    filter.recent(0).is_some_and(|here| distances_to(filter, vertex)[here].is_some())
}

/// Number of edges from each vertex of the best map to `target`, by breadth-first search. Time O(V²).
fn distances_to<const V: usize>(filter: &impl Filter<V>, target: VertexId) -> PerVertex<Option<u8>, V> {
    let map = filter.map();
    let mut distances = PerVertex::filled(None);
    let mut reached = VertexSet::EMPTY;
    let mut newly = VertexSet::from(target);
    for steps in 0..V as u8 {
        let mut next = VertexSet::EMPTY;
        for vertex in map.vertices().filter(|&vertex| newly.contains(vertex)) {
            distances[vertex] = Some(steps);
            next |= map.neighbours(vertex);
        }
        reached |= newly;
        newly = next - reached;
    }
    distances
}
