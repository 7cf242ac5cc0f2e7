//! A robot on a random walk through an environment, and the comparison of a robust filter's map with the environment.

use super::drive::Random;
use std::collections::BTreeSet;
use toposlam::{Exit, Filter, Fingerprint, Observation, RobustFilter, Ways};
use toposlam_eval::{environment::Environment, equivalence::SmallestEquivalent, graph::Graph, score::score_map};

/// The hints of the robot besides fingerprints, and how often they are missing or wrong.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hints {
    /// Whether it gives turns.
    pub turn: bool,
    /// Whether it gives degrees; one in ten is wrong by one.
    pub degree: bool,
    /// How often a hint is missing, in percent.
    pub missing_percent: usize,
    /// How often a turn is wrong, in percent.
    pub wrong_percent: usize,
}

/// Turn hints that are never missing and always right.
pub const TURNS: Hints = Hints { turn: true, degree: false, missing_percent: 0, wrong_percent: 0 };

/// A robot in an environment.
pub struct Robot<'a> {
    environment: &'a Environment,
    hints: Hints,
    random: Random,
    /// The places it visited, in order.
    pub walk: Vec<usize>,
    /// Index in `walk` at which the present sequence starts.
    put_down: usize,
    next: Option<(usize, bool)>,
}

impl<'a> Robot<'a> {
    /// A robot at a random place.
    pub fn new(environment: &'a Environment, hints: Hints, seed: u64) -> Self {
        Self { environment, hints, random: Random(seed), walk: Vec::new(), put_down: 0, next: None }
    }

    /// Kidnaps the robot: its next place is this one. It may report that or not.
    pub fn carry_to(&mut self, place: usize, is_told: bool) {
        self.next = Some((place, is_told));
    }

    /// Kidnaps the robot to a random place that is neither its own nor a neighbour.
    pub fn carry_off(&mut self, is_told: bool) {
        let here = *self.walk.last().expect("it has been somewhere");
        let near = &self.environment.neighbours()[here];
        let places = self.environment.places().len();
        let far: Vec<usize> = (0..places).filter(|place| *place != here && !near.contains(place)).collect();
        let place = far[self.random.below(far.len())];
        self.carry_to(place, is_told);
    }

    /// Drives to a random neighbour, possibly back, and returns the observation.
    pub fn step(&mut self) -> Observation {
        let carried = self.next.take();
        let place = match (carried, self.walk.last()) {
            (Some((place, _)), _) => place,
            (None, None) => self.random.below(self.environment.places().len()),
            (None, Some(&here)) => {
                let ways = &self.environment.neighbours()[here];
                ways[self.random.below(ways.len())]
            }
        };
        if carried.is_some() {
            self.put_down = self.walk.len();
        }
        self.walk.push(place);
        let turned_back = self.walk.iter().skip(self.put_down).rev().nth(2).map(|&before| before == place);
        let [missing_turn, wrong_turn, missing_degree] = [(); 3].map(|()| self.random.below(100));
        let turn = turned_back.filter(|_| self.hints.turn && missing_turn >= self.hints.missing_percent);
        let turn = turn.map(|back| if back != (wrong_turn < self.hints.wrong_percent) { Exit::Back } else { Exit::On });
        let ways = self.environment.neighbours()[place].len() as u8;
        let reported = match self.random.below(20) {
            0 => ways.saturating_sub(1).max(1),
            1 => ways + 1,
            _ => ways,
        };
        let degree = (self.hints.degree && missing_degree >= self.hints.missing_percent).then_some(reported);
        let begins = carried.is_some_and(|(_, is_told)| is_told);
        let ways = degree.and_then(|degree| Ways::from_count(degree).ok());
        Observation { ways, exit: turn, starts_sequence: begins, ..Observation::new(self.look(place)) }
    }

    /// The fingerprint of a place with Gaussian noise, the sum of twelve uniform numbers.
    pub fn look(&mut self, place: usize) -> Fingerprint {
        let place = self.environment.places()[place];
        let uniform = |_| self.random.below(1 << 20) as f64 / f64::from(1 << 20) - 0.5;
        let radius_mm = place.mean_mm + place.sd_mm * (0..12).map(uniform).sum::<f64>();
        let steps = (radius_mm / f64::from(Fingerprint::STEP_MM)).round();
        Fingerprint::from_steps(steps as u16).unwrap_or(Fingerprint::MAX)
    }

    /// Whether the map of a filter is isomorphic to the traversed part of the environment, with places merged that no walk
    /// distinguishes.
    pub fn is_mapped_by<const N: usize, const V: usize, const HISTORY: usize>(
        &self,
        filter: &RobustFilter<N, V, HISTORY>,
    ) -> bool {
        let truth = SmallestEquivalent::of_traversed(self.environment, &self.walk);
        self.is_exact(filter, &truth)
    }

    /// Whether the map of a filter is isomorphic to the whole environment.
    pub fn is_all_mapped_by<const N: usize, const V: usize, const HISTORY: usize>(
        &self,
        filter: &RobustFilter<N, V, HISTORY>,
    ) -> bool {
        self.is_exact(filter, &SmallestEquivalent::of_environment(self.environment))
    }

    fn is_exact<const N: usize, const V: usize, const HISTORY: usize>(
        &self,
        filter: &RobustFilter<N, V, HISTORY>,
        truth: &SmallestEquivalent,
    ) -> bool {
        let map = filter.map();
        let edges = map.edges().map(|(a, b)| (usize::from(a), usize::from(b)));
        let graph = Graph::from_edges(map.vertices().len(), edges);
        let path: Vec<usize> = filter.path().map(usize::from).collect();
        let newest = &self.walk[self.walk.len() - path.len()..];
        let classes: Vec<usize> = newest.iter().filter_map(|&place| truth.class_of_place[place]).collect();
        score_map(&graph, &path, &truth.graph, &classes).exact
    }

    /// The place of most visits of a vertex on the path.
    pub fn place_of(&self, path: &[u8], vertex: u8) -> Option<usize> {
        let newest = &self.walk[self.walk.len() - path.len()..];
        let visits = || path.iter().zip(newest).filter(|&(&visited, _)| visited == vertex).map(|(_, &place)| place);
        let places: BTreeSet<usize> = visits().collect();
        places.into_iter().max_by_key(|&place| visits().filter(|&visited| visited == place).count())
    }
}
