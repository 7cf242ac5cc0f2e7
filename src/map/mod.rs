//! The topological map: a labelled graph of places and the connections between them (Section II of the paper).

mod dart;
mod darts;
mod faces;
mod per_vertex;
mod vertex;
mod vertex_set;

pub use dart::{Bearing, DartId, Darts, WAYS_MAX};
pub use darts::DartMap;
pub use per_vertex::PerVertex;
pub use vertex::VertexId;
pub use vertex_set::VertexSet;

pub(crate) use dart::{LN_TRAVEL_UNIT, NONE};
pub(crate) use faces::DartSet;
pub(crate) use vertex_set::VertexSet32;

use crate::place::Fingerprint;

/// The label of a vertex: the running mean of the fingerprints observed there, kept as sum and count so that it never
/// drifts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Label {
    sum_steps: u32,
    visits: u32,
}

impl Label {
    /// At this many visits both sums are halved, so that they never overflow; the mean stays.
    const FULL: u32 = 1 << 19;

    const NONE: Self = Self { sum_steps: 0, visits: 0 };

    /// The mean in steps, halves rounded up.
    fn mean(self) -> Fingerprint {
        let mean = (self.sum_steps + self.visits / 2).checked_div(self.visits).unwrap_or(0);
        Fingerprint::from_steps(mean as u16).unwrap_or(Fingerprint::MAX)
    }

    fn including(mut self, fingerprint: Fingerprint) -> Self {
        self.include(fingerprint);
        self
    }

    fn include(&mut self, fingerprint: Fingerprint) {
        if self.visits >= Self::FULL {
            self.visits /= 2;
            self.sum_steps /= 2;
        }
        self.visits += 1;
        self.sum_steps += u32::from(fingerprint.steps());
    }
}

/// A labelled graph of at most `V` vertices (`V` ≤ 64), numbered from 0 in the order in which they were added.
///
/// Adjacency is one [`VertexSet`] a vertex. An edge from a vertex to itself is a corridor that leads back to the place it
/// left. Memory: 18 bytes a vertex.
///
/// ```
/// use toposlam::{Fingerprint, Map};
///
/// let mut map = Map::<16>::new();
/// let hall = map.add_vertex(Fingerprint::from_radius_mm(1200)?)?;
/// let office = map.add_vertex(Fingerprint::from_radius_mm(800)?)?;
/// map.add_edge(hall, office);
/// map.observe(hall, Fingerprint::from_radius_mm(1208)?);
/// assert_eq!(map.label(hall).map(Fingerprint::radius_mm), Some(1204));
/// assert!(map.edges().eq([(hall, office)]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Map<const V: usize> {
    vertices: u8,
    labels: PerVertex<Label, V>,
    /// The rounded means of `labels`, which the inner loops read far more often than they change.
    means: PerVertex<Fingerprint, V>,
    adjacency: PerVertex<VertexSet, V>,
}

impl<const V: usize> Map<V> {
    /// The map without any vertex.
    pub const fn new() -> Self {
        Self {
            vertices: 0,
            labels: PerVertex::new([Label::NONE; V]),
            means: PerVertex::new([Fingerprint::ZERO; V]),
            adjacency: PerVertex::new([VertexSet::EMPTY; V]),
        }
    }

    /// All vertices in the order of their numbers; `map.vertices().len()` is how many there are.
    pub fn vertices(&self) -> impl ExactSizeIterator<Item = VertexId> + DoubleEndedIterator + Clone + use<V> {
        VertexId::first(self.vertices.into())
    }

    /// Whether the map has a vertex.
    pub fn contains(&self, vertex: VertexId) -> bool {
        vertex.index() < usize::from(self.vertices)
    }

    /// The label of a vertex, the rounded mean of its fingerprints; `None` for a vertex the map does not have.
    pub fn label(&self, vertex: VertexId) -> Option<Fingerprint> {
        self.contains(vertex).then(|| self.means[vertex])
    }

    /// The label of a vertex that the map has.
    pub(crate) fn label_of(&self, vertex: VertexId) -> Fingerprint {
        self.means[vertex]
    }

    /// The labels of all vertices in the order of their numbers.
    pub fn labels(&self) -> &[Fingerprint] {
        self.means.values().get(..usize::from(self.vertices)).unwrap_or(&[])
    }

    /// How many observations the label of a vertex is the mean of; 0 for a vertex the map does not have.
    pub fn visits(&self, vertex: VertexId) -> u32 {
        if self.contains(vertex) { self.labels[vertex].visits } else { 0 }
    }

    /// The neighbours of a vertex; none for a vertex the map does not have.
    pub fn neighbours(&self, vertex: VertexId) -> VertexSet {
        self.adjacency.get(vertex).copied().unwrap_or(VertexSet::EMPTY)
    }

    /// Every edge once, as pairs of vertices with the smaller number first.
    pub fn edges(&self) -> impl Iterator<Item = (VertexId, VertexId)> + '_ {
        self.vertices().flat_map(move |a| self.neighbours(a).iter().filter(move |&b| a <= b).map(move |b| (a, b)))
    }

    /// Adds a vertex whose label is one fingerprint.
    ///
    /// # Errors
    /// [`VerticesFull`] when the map has `V` vertices; it stays as it is.
    pub fn add_vertex(&mut self, fingerprint: Fingerprint) -> Result<VertexId, VerticesFull> {
        let vertex = self.next_vertex().ok_or(VerticesFull)?;
        self.labels[vertex] = Label::NONE.including(fingerprint);
        self.means[vertex] = fingerprint;
        self.vertices += 1;
        Ok(vertex)
    }

    /// The vertex that would be added next; `None` when the map is full.
    pub(crate) fn next_vertex(&self) -> Option<VertexId> {
        VertexId::new(self.vertices).filter(|vertex| vertex.index() < V)
    }

    /// Adds a vertex with a label that is the mean of `visits` fingerprints, 1 at least.
    pub(crate) fn add_known_vertex(&mut self, fingerprint: Fingerprint, visits: u32) -> Result<VertexId, VerticesFull> {
        let vertex = self.add_vertex(fingerprint)?;
        let visits = visits.clamp(1, Label::FULL);
        self.labels[vertex] = Label { sum_steps: u32::from(fingerprint.steps()) * visits, visits };
        Ok(vertex)
    }

    /// The sum of the fingerprints of a vertex in steps; with the visits it is the label without rounding.
    #[cfg(feature = "snapshot")]
    pub(crate) fn sum_steps(&self, vertex: VertexId) -> u32 {
        if self.contains(vertex) { self.labels[vertex].sum_steps } else { 0 }
    }

    /// Adds a vertex by the sum of its fingerprints and their number; `None` when these are impossible or the map is full.
    #[cfg(feature = "snapshot")]
    pub(crate) fn add_counted_vertex(&mut self, sum_steps: u32, visits: u32) -> Option<VertexId> {
        let label = Label { sum_steps, visits };
        let is_possible =
            (1..=Label::FULL).contains(&visits) && sum_steps <= visits * u32::from(Fingerprint::MAX.steps());
        let vertex = self.next_vertex().filter(|_| is_possible)?;
        self.labels[vertex] = label;
        self.means[vertex] = label.mean();
        self.vertices += 1;
        Some(vertex)
    }

    /// Takes one more fingerprint into the label of a vertex; nothing happens for a vertex the map does not have.
    pub fn observe(&mut self, vertex: VertexId, fingerprint: Fingerprint) {
        if self.contains(vertex) {
            let label = &mut self.labels[vertex];
            label.include(fingerprint);
            self.means[vertex] = label.mean();
        }
    }

    /// What the label of a vertex would be with one more fingerprint; that of a new vertex is the fingerprint.
    pub(crate) fn label_with(&self, vertex: VertexId, fingerprint: Fingerprint) -> Fingerprint {
        if self.contains(vertex) { self.labels[vertex].including(fingerprint).mean() } else { fingerprint }
    }

    /// Joins two vertices by an edge; nothing happens when there is one or when the map lacks one of them.
    pub fn add_edge(&mut self, a: VertexId, b: VertexId) {
        if self.contains(a) && self.contains(b) {
            self.adjacency[a].insert(b);
            self.adjacency[b].insert(a);
        }
    }

    /// Removes all vertices and edges.
    pub fn clear(&mut self) {
        self.vertices = 0;
        self.adjacency = PerVertex::filled(VertexSet::EMPTY);
    }
}

impl<const V: usize> Default for Map<V> {
    fn default() -> Self {
        Self::new()
    }
}

/// The map already has as many vertices as it can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VerticesFull;

impl core::fmt::Display for VerticesFull {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the map has no room for another vertex")
    }
}

impl core::error::Error for VerticesFull {}

#[cfg(test)]
mod tests {
    use super::*;

    fn fingerprint(steps: u16) -> Fingerprint {
        Fingerprint::from_steps(steps).unwrap()
    }

    #[test]
    fn a_label_is_the_rounded_mean_of_what_was_observed() {
        let mut map = Map::<2>::new();
        let vertex = map.add_vertex(fingerprint(10)).unwrap();
        map.observe(vertex, fingerprint(11));
        assert_eq!(map.label(vertex), Some(fingerprint(11)), "10.5 rounds up");
        map.observe(vertex, fingerprint(10));
        assert_eq!(map.label(vertex), Some(fingerprint(10)));
        assert_eq!(map.visits(vertex), 3);
    }

    #[test]
    fn a_label_stays_right_over_millions_of_visits() {
        let mut map = Map::<1>::new();
        map.add_vertex(Fingerprint::MAX).unwrap();
        for _ in 0..3_000_000 {
            map.observe(VertexId::FIRST, Fingerprint::MAX);
        }
        assert_eq!(map.label(VertexId::FIRST), Some(Fingerprint::MAX));
    }

    #[test]
    fn a_full_map_refuses_a_vertex_and_stays_as_it_is() {
        let mut map = Map::<2>::new();
        let [a, b] = [1, 2].map(|steps| map.add_vertex(fingerprint(steps)).unwrap());
        map.add_edge(a, b);
        let before = map;
        assert_eq!(map.add_vertex(fingerprint(3)), Err(VerticesFull));
        assert_eq!(map, before);
    }

    #[test]
    fn edges_are_listed_once_and_loops_too() {
        let mut map = Map::<4>::new();
        let [a, b, c, d] = [0, 1, 2, 3].map(|steps| map.add_vertex(fingerprint(steps)).unwrap());
        let missing = VertexId::new(9).unwrap();
        for (from, to) in [(c, b), (b, c), (d, d), (a, d), (a, missing)] {
            map.add_edge(from, to);
        }
        assert_eq!(map.edges().collect::<Vec<_>>(), [(a, d), (b, c), (d, d)]);
        assert_eq!(map.neighbours(b), VertexSet::from(c));
    }
}
