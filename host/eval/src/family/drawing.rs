//! The drawing of a random environment in the plane: straight corridors between points, and corridors beside and around them.

use crate::{graph::Graph, planar::Point, walk::PathRng};
use rand::RngExt;
use toposlam::WAYS_MAX;

/// The edges of an environment, and its ways in counter-clockwise order as positions in the edges.
pub(super) struct Drawing {
    pub(super) edges: Vec<[u32; 2]>,
    pub(super) ways: Vec<Vec<usize>>,
}

impl Drawing {
    /// The straight edges of a graph between points of the plane.
    pub(super) fn of_points(graph: &Graph, points: &[Point]) -> Self {
        let edges: Vec<[usize; 2]> = graph.edges().iter().map(|&(a, b)| [a, b]).collect();
        let ways = |(place, from): (usize, &Point)| {
            let angle = |&way: &usize| {
                let [a, b] = edges[way];
                let to = points[if a == place { b } else { a }];
                (to.1 - from.1).atan2(to.0 - from.0)
            };
            let mut ways: Vec<usize> = (0..edges.len()).filter(|&way| edges[way].contains(&place)).collect();
            ways.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
            ways
        };
        let ways = points.iter().enumerate().map(ways).collect();
        Self { edges: edges.iter().map(|edge| edge.map(|place| place as u32)).collect(), ways }
    }

    /// Adds parallel edges and loops, each to about a sixth of the places. Returns whether there is one of each and a dead end.
    pub(super) fn extend(&mut self, rng: &mut PathRng) -> bool {
        let (mut parallels, mut loops) = (0, 0);
        for _ in 0..=self.ways.len() / 6 {
            parallels += usize::from(self.add_parallel(rng));
            loops += usize::from(self.add_loop(rng));
        }
        parallels > 0 && loops > 0 && self.ways.iter().any(|ways| ways.len() == 1)
    }

    /// Adds an edge beside a random one; `false` if an end has no room.
    fn add_parallel(&mut self, rng: &mut PathRng) -> bool {
        let beside = rng.random_range(0..self.edges.len());
        let [a, b] = self.edges[beside].map(|place| place as usize);
        if a == b || self.ways[a].len().max(self.ways[b].len()) >= WAYS_MAX - 2 {
            return false;
        }
        let position = |ways: &[usize]| ways.iter().position(|&way| way == beside).unwrap_or(0);
        // After the edge at one end, before it at the other.
        let [here, there] = [position(&self.ways[a]) + 1, position(&self.ways[b])];
        self.ways[a].insert(here, self.edges.len());
        self.ways[b].insert(there, self.edges.len());
        self.edges.push(self.edges[beside]);
        true
    }

    /// Adds an edge from a random place to itself; `false` if the place has no room.
    fn add_loop(&mut self, rng: &mut PathRng) -> bool {
        let place = rng.random_range(0..self.ways.len());
        let ways = &mut self.ways[place];
        if ways.len() >= WAYS_MAX - 3 {
            return false;
        }
        let position = rng.random_range(0..=ways.len());
        ways.splice(position..position, [self.edges.len(); 2]);
        self.edges.push([place as u32; 2]);
        true
    }
}
