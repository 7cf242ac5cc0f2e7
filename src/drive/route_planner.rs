//! Which way out of a place: exploring, or going to a vertex of the map.

use rand_core::Rng;

use super::departures::{Departures, WAYS, Way};
use super::local_planner::Exits;
use crate::filter::draws;
use crate::map::PerVertex;
use crate::{Filter, Update, VertexId, VertexSet};

/// A robot is at a vertex when the filter believes so with at least this probability, in units of 2⁻¹⁶.
const CONFIRMED_Q16: u32 = 1 << 15;

/// What the drive is asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Goal {
    /// Leave every place by the way that was used least.
    Explore,
    /// Drive to this vertex of the best map and stand there.
    Vertex(VertexId),
    /// Stand at the next place.
    Stop,
}

/// How the way to a vertex goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum GoalStatus {
    /// None was asked for.
    Inactive,
    /// The robot is on its way.
    Active,
    /// The robot stands at the vertex: the filter believes so.
    Reached,
    /// The vertex is not part of the best map any more.
    VertexRemoved,
    /// After many more places than the map has vertices the robot is not there.
    TimedOut,
}

/// Decides at places; remembers one byte for each of `HISTORY` places.
#[derive(Clone, Debug)]
pub(super) struct RoutePlanner<const V: usize, const HISTORY: usize> {
    seed: u64,
    goal: Goal,
    goal_status: GoalStatus,
    /// Places since the goal was set.
    places: u16,
    /// How many decisions were made.
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
        self.departures.forget();
    }

    #[cfg(feature = "snapshot")]
    pub(super) fn departures(&self) -> impl ExactSizeIterator<Item = u8> + '_ {
        self.departures.iter()
    }

    /// Explores from here on, with these departures and no others.
    #[cfg(feature = "snapshot")]
    pub(super) fn resume(&mut self, departures: impl Iterator<Item = u8>) {
        self.set_goal(Goal::Explore);
        self.departures.replace(departures);
    }

    /// The filter has taken in a place.
    pub(super) fn arrive(&mut self, filter: &impl Filter<V>, _update: &Update) {
        self.departures.arrive();
        self.places = self.places.saturating_add(1);
        if let (Goal::Vertex(target), GoalStatus::Active) = (self.goal, self.goal_status) {
            match filter.renamed(target) {
                Some(target) => self.goal = Goal::Vertex(target),
                None => self.goal_status = GoalStatus::VertexRemoved,
            }
        }
    }

    /// Chooses the way out of the place that the robot stands at; `None` to stay.
    pub(super) fn choose(&mut self, filter: &impl Filter<V>, ways: Exits) -> Option<u8> {
        let known = self.departures.ways(filter, if ways.is_entry_first { ways.count } else { 0 });
        self.decisions = self.decisions.wrapping_add(1);
        let chosen = match self.goal {
            Goal::Stop => None,
            Goal::Explore => self.least_used(&known, ways.count),
            Goal::Vertex(target) => {
                self.look_around(filter, target);
                if self.goal_status == GoalStatus::Active {
                    self.towards(filter, target, &known, ways.count)
                } else {
                    None
                }
            }
        };
        if let Some(exit) = chosen {
            self.departures.depart(ways, exit);
        }
        chosen
    }

    /// Whether the goal_status is over.
    fn look_around(&mut self, filter: &impl Filter<V>, target: VertexId) {
        if self.goal_status != GoalStatus::Active {
            return;
        }
        let is_there = filter.recent(0) == Some(target) && filter.place_probability_q16(target) >= CONFIRMED_Q16;
        if is_there {
            self.goal_status = GoalStatus::Reached;
        } else if !filter.map().contains(target) {
            self.goal_status = GoalStatus::VertexRemoved;
        } else if usize::from(self.places) > 8 * V {
            self.goal_status = GoalStatus::TimedOut;
        }
    }

    /// The way that was used least, at random among equals.
    fn least_used(&self, known: &[Way; WAYS], count: u8) -> Option<u8> {
        let least = known.iter().take(usize::from(count)).map(|way| way.uses).min()?;
        self.at_random(known, count, |way| way.uses == least)
    }

    /// The way to the neighbour that is nearest to the target; if it is not known which way leads there, one of which it is not
    /// known where it leads.
    fn towards(&self, filter: &impl Filter<V>, target: VertexId, known: &[Way; WAYS], count: u8) -> Option<u8> {
        let steps_to = steps_to(filter, target);
        let steps = |vertex: VertexId| steps_to[vertex];
        let way_steps = |way: &Way| way.leads_to.and_then(steps);
        let nearest = known.iter().take(usize::from(count)).filter_map(way_steps).min();
        let here = filter.recent(0).and_then(steps);
        match (nearest, here) {
            (Some(nearest), Some(here)) if nearest < here => {
                self.at_random(known, count, |way| way_steps(way) == Some(nearest))
            }
            _ => self
                .at_random(known, count, |way| way.leads_to.is_none())
                .or_else(|| self.at_random(known, count, |_| true)),
        }
    }

    /// One of the ways that suit, each with the same probability.
    fn at_random(&self, known: &[Way; WAYS], count: u8, suits: impl Fn(&Way) -> bool) -> Option<u8> {
        let suitable = || (0..count).zip(known).filter(|(_, way)| suits(way)).map(|(number, _)| number);
        let draw = draws(self.seed, u64::from(self.decisions)).next_u32() as usize;
        suitable().nth(draw.checked_rem(suitable().count())?)
    }
}

/// Whether the best map has a way from where the robot is to a vertex.
pub(super) fn leads_to<const V: usize>(filter: &impl Filter<V>, vertex: VertexId) -> bool {
    filter.recent(0).is_some_and(|here| steps_to(filter, vertex)[here].is_some())
}

/// How many edges each vertex of the best map is away from another. Time O(V²).
fn steps_to<const V: usize>(filter: &impl Filter<V>, target: VertexId) -> PerVertex<Option<u8>, V> {
    let map = filter.map();
    let mut steps_to = PerVertex::filled(None);
    let mut reached = VertexSet::EMPTY;
    let mut newly = VertexSet::from(target);
    for steps in 0..V as u8 {
        let mut next = VertexSet::EMPTY;
        for vertex in map.vertices().filter(|&vertex| newly.contains(vertex)) {
            steps_to[vertex] = Some(steps);
            next |= map.neighbours(vertex);
        }
        reached |= newly;
        newly = next - reached;
    }
    steps_to
}
