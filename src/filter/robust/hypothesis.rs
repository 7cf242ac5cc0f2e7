//! One hypothesis: the vertex of each observation, and the map and statistics that follow from it.

use super::history::ObservationHistory;
use super::model::{LN_EDGE, LN_VERTEX, Model};
use super::statistics::VertexStatistics;
use crate::filter::beam::Ranked;
use crate::map::{PerVertex, VertexId, VertexSet32};

/// The cost of a path that stays at one vertex for two observations, in nats: such a hypothesis is never kept.
const SELF_LOOP_COST: f32 = 1e6;

/// A partition of the newest `T` observations, and of all that were marginalised, into at most `V` vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hypothesis<const V: usize, const T: usize> {
    /// How many vertices the map has.
    pub(crate) vertices: u8,
    /// The vertex of the newest observation.
    pub(crate) at: Option<VertexId>,
    /// The vertex of the observation before the history, from which the robot drove to the oldest one.
    pub(crate) before: Option<VertexId>,
    /// How many sequences start in the history.
    pub(crate) starts: u16,
    /// ln P of all turn hints.
    pub(crate) ln_hints: f32,
    /// The evidence of map and path.
    pub(crate) evidence: f32,
    /// The bound of the map's other paths when it was last updated: a share of −ln P(path | map, observations), which is how
    /// much the evidence of all paths of the map exceeds that of this path, at least.
    pub(crate) other_paths: f32,
    /// The evidence that decayed with marginalised statistics.
    pub(crate) decayed: f32,
    /// A hash of the edges. Vertices are numbered in the order of their first visit.
    pub(crate) map_key: u32,
    /// The vertex of each observation of the history.
    pub(crate) path: [VertexId; T],
    /// The statistics of all observations.
    pub(crate) statistics: PerVertex<VertexStatistics, V>,
    /// The statistics of the observations that left the history.
    pub(crate) marginalised: PerVertex<VertexStatistics, V>,
    /// The edges.
    pub(crate) neighbours: PerVertex<VertexSet32, V>,
    /// The edges that were driven before the history.
    pub(crate) marginalised_neighbours: PerVertex<VertexSet32, V>,
}

impl<const V: usize, const T: usize> Ranked for Hypothesis<V, T> {
    const UNUSED: Self = Self {
        vertices: 0,
        at: None,
        before: None,
        starts: 0,
        ln_hints: 0.0,
        evidence: 0.0,
        other_paths: 0.0,
        decayed: 0.0,
        map_key: 0,
        path: [VertexId::FIRST; T],
        statistics: PerVertex::filled(VertexStatistics::NONE),
        marginalised: PerVertex::filled(VertexStatistics::NONE),
        neighbours: PerVertex::filled(VertexSet32::EMPTY),
        marginalised_neighbours: PerVertex::filled(VertexSet32::EMPTY),
    };

    fn clear(&mut self) {
        self.vertices = 0;
        self.at = None;
        self.before = None;
        self.starts = 0;
        self.ln_hints = 0.0;
        self.evidence = 0.0;
        self.other_paths = 0.0;
        self.decayed = 0.0;
        self.map_key = 0;
        self.statistics.fill(VertexStatistics::NONE);
        self.marginalised.fill(VertexStatistics::NONE);
        self.neighbours.fill(VertexSet32::EMPTY);
        self.marginalised_neighbours.fill(VertexSet32::EMPTY);
    }

    fn score(&self) -> f32 {
        // The evidence of the map, with the share of its other paths.
        self.evidence + self.other_paths
    }

    fn key(&self) -> u32 {
        keyed(self.map_key, self.vertices, self.at)
    }
}

impl<const V: usize, const T: usize> Hypothesis<V, T> {
    /// Identifies the map alone.
    pub(crate) fn map_alone_key(&self) -> u32 {
        keyed(self.map_key, self.vertices, Some(VertexId::FIRST))
    }

    /// The vertices of the map.
    pub(crate) fn vertices(&self) -> impl ExactSizeIterator<Item = VertexId> + DoubleEndedIterator + Clone + use<V, T> {
        VertexId::first(self.vertices.into())
    }

    /// The vertex that the map would get next; `None` when it is full.
    pub(crate) fn next_vertex(&self) -> Option<VertexId> {
        VertexId::new(self.vertices).filter(|vertex| vertex.index() < V)
    }

    /// The vertex of an observation of the history.
    pub(crate) fn vertex_of(&self, index: usize) -> Option<VertexId> {
        self.path.get(index).copied()
    }

    /// Sets the vertex of an observation of the history.
    pub(crate) fn set_vertex_of(&mut self, index: usize, vertex: VertexId) {
        if let Some(slot) = self.path.get_mut(index) {
            *slot = vertex;
        }
    }

    /// How many neighbours a vertex has.
    pub(crate) fn degree(&self, vertex: VertexId) -> u32 {
        self.neighbours[vertex].bits().count_ones()
    }

    /// Whether an edge joins two vertices.
    pub(crate) fn is_edge(&self, a: VertexId, b: VertexId) -> bool {
        self.neighbours[a].contains(b)
    }

    /// Follows from a path that was changed: numbers the vertices by first visit, drops those without visits, and computes
    /// statistics, edges and evidence. Cost: O(T + V).
    pub(crate) fn rebuild(&mut self, model: &Model, history: &ObservationHistory<T>) {
        self.renumber(history.len());
        self.recount(model, history);
    }

    /// As [`Hypothesis::rebuild`], with the vertices as they are numbered.
    pub(crate) fn recount(&mut self, model: &Model, history: &ObservationHistory<T>) {
        self.statistics = self.marginalised;
        self.neighbours = self.marginalised_neighbours;
        self.starts = 0;
        self.ln_hints = 0.0;
        let mut from = self.before;
        for (index, (observation, &vertex)) in history.iter().zip(&self.path).enumerate() {
            self.statistics[vertex].include(observation);
            match from {
                Some(from) if !observation.starts_sequence() => {
                    // The exit to the oldest observation was counted when the one before it was marginalised.
                    if index > 0 {
                        let exits = &mut self.statistics[from].exits;
                        *exits = exits.saturating_add(1);
                    }
                    join(&mut self.neighbours, from, vertex);
                    self.ln_hints += self.ln_hint(model, history, index, observation, vertex);
                }
                _ => self.starts = self.starts.saturating_add(1),
            }
            from = Some(vertex);
        }
        self.at = from;
        self.map_key = self.key_of_edges();
        self.evidence = self.total(model);
    }

    /// The hash of the edges.
    pub(crate) fn key_of_edges(&self) -> u32 {
        let mut key = 0;
        for vertex in self.vertices() {
            for neighbour in self.neighbours[vertex].iter().filter(|&neighbour| neighbour > vertex) {
                key ^= edge_key(vertex, neighbour);
            }
        }
        key
    }

    /// The evidence that the statistics give.
    pub(crate) fn total(&self, model: &Model) -> f32 {
        self.decayed + self.factors(model).iter().sum::<f32>()
    }

    /// The factors of the evidence, without what decayed, for K vertices:
    ///
    /// - of the labels, [`Model::label_evidence`] of each vertex;
    /// - of the transitions, [`Model::exit_evidence`] of each vertex, the turn hints ([`Model::ln_turn`]), and −ln K for each
    ///   start of a sequence;
    /// - of the size of the map, [`LN_VERTEX`] for each vertex and [`LN_EDGE`] for each edge.
    pub(crate) fn factors(&self, model: &Model) -> [f32; 3] {
        let mut labels = 0.0;
        let mut transitions = self.ln_hints - f32::from(self.starts) * ln(self.vertices.max(1));
        let mut degrees = 0;
        for vertex in self.vertices() {
            let (statistics, degree) = (&self.statistics[vertex], self.degree(vertex));
            labels += model.label_evidence(statistics);
            transitions += model.exit_evidence(statistics, degree);
            degrees += degree;
            if self.is_edge(vertex, vertex) {
                transitions -= SELF_LOOP_COST;
            }
        }
        [labels, transitions, f32::from(self.vertices) * LN_VERTEX + (degrees / 2) as f32 * LN_EDGE]
    }

    /// Numbers the vertices in the order of their first visit, and drops those without visits.
    fn renumber(&mut self, len: usize) {
        let mut numbers = PerVertex::<Option<VertexId>, V>::filled(None);
        let mut count = 0;
        let visited = self.path.iter().take(len).copied().chain(self.before);
        let marginalised = self.vertices().filter(|&vertex| self.marginalised[vertex].visits > 0);
        for vertex in visited.chain(marginalised) {
            let number = &mut numbers[vertex];
            if number.is_none() {
                *number = VertexId::new(count);
                count += 1;
            }
        }
        let number = |vertex| numbers[vertex].unwrap_or(VertexId::FIRST);
        self.path.iter_mut().take(len).for_each(|vertex| *vertex = number(*vertex));
        self.before = self.before.map(number);
        if self.marginalised.values().iter().any(|statistics| statistics.visits > 0) {
            let (statistics, neighbours) = (self.marginalised, self.marginalised_neighbours);
            self.marginalised.fill(VertexStatistics::NONE);
            self.marginalised_neighbours.fill(VertexSet32::EMPTY);
            for ((old, statistics), neighbours) in statistics.iter().zip(neighbours.values()) {
                if let Some(new) = numbers[old] {
                    self.marginalised[new] = *statistics;
                    self.marginalised_neighbours[new] = neighbours.iter().map(number).collect();
                }
            }
        }
        self.vertices = count;
    }

    /// Whether there are visits or edges that are not in the history.
    pub(crate) fn has_marginalised(&self) -> bool {
        self.before.is_some() || self.marginalised.values().iter().any(|statistics| statistics.visits > 0)
    }

    /// Whether all visits of a vertex are in the history.
    pub(crate) fn is_recent(&self, vertex: VertexId) -> bool {
        self.marginalised[vertex].visits == 0 && self.before != Some(vertex)
    }
}

/// Joins two vertices by an edge.
pub(crate) fn join<const V: usize>(neighbours: &mut PerVertex<VertexSet32, V>, a: VertexId, b: VertexId) {
    neighbours[a].insert(b);
    neighbours[b].insert(a);
}

/// ln of a count.
pub(crate) fn ln(count: u8) -> f32 {
    libm::logf(f32::from(count))
}

fn mix(value: u32) -> u32 {
    let value = (value ^ value >> 16).wrapping_mul(0x7FEB_352D);
    let value = (value ^ value >> 15).wrapping_mul(0x846C_A68B);
    value ^ value >> 16
}

/// The part of an edge in the hash of a map.
pub(crate) fn edge_key(a: VertexId, b: VertexId) -> u32 {
    let [a, b] = [a, b].map(|vertex| u32::from(u8::from(vertex)));
    mix(0x1_0000 | a.min(b) << 8 | a.max(b))
}

/// The hash of a map and the robot's vertex.
pub(crate) fn keyed(map_key: u32, vertices: u8, at: Option<VertexId>) -> u32 {
    let at = at.map_or(u8::MAX, u8::from);
    map_key ^ mix(0x2_0000 | u32::from(vertices) << 8 | u32::from(at))
}
