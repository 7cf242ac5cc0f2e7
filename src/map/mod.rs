//! The topological map: a labelled graph of places and the connections between them (Section II of the paper).

use crate::Fingerprint;

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
/// Adjacency is one bit row a vertex: bit `w` of row `v` says that an edge joins `v` and `w`. An edge from a vertex to
/// itself is a corridor that leads back to the place it left. Memory: 18 bytes a vertex.
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
    labels: [Label; V],
    /// The rounded means of `labels`, which the inner loops read far more often than they change.
    means: [Fingerprint; V],
    adjacency: [u64; V],
}

impl<const V: usize> Map<V> {
    /// The map without any vertex.
    pub const fn new() -> Self {
        const { assert!(V >= 1 && V <= 64, "a map holds 1 to 64 vertices: an adjacency row is one u64") };
        Self { vertices: 0, labels: [Label::NONE; V], means: [Fingerprint::ZERO; V], adjacency: [0; V] }
    }

    /// How many vertices the map has.
    pub const fn vertices(&self) -> u8 {
        self.vertices
    }

    /// The label of a vertex, the rounded mean of its fingerprints; `None` for a vertex the map does not have.
    pub fn label(&self, vertex: u8) -> Option<Fingerprint> {
        self.labels().get(usize::from(vertex)).copied()
    }

    /// The label of a vertex that the map has.
    pub(crate) fn label_of(&self, vertex: u8) -> Fingerprint {
        self.means.get(usize::from(vertex)).copied().unwrap_or(Fingerprint::ZERO)
    }

    /// The labels of all vertices in the order of their numbers.
    pub fn labels(&self) -> &[Fingerprint] {
        self.means.get(..usize::from(self.vertices)).unwrap_or(&[])
    }

    /// How many observations the label of a vertex is the mean of; 0 for a vertex the map does not have.
    pub fn visits(&self, vertex: u8) -> u32 {
        self.labels.get(usize::from(vertex)).map_or(0, |label| label.visits)
    }

    /// The neighbours of a vertex as a bit row; 0 for a vertex the map does not have.
    pub fn neighbours(&self, vertex: u8) -> u64 {
        self.adjacency.get(usize::from(vertex)).copied().unwrap_or(0)
    }

    /// Every edge once, as pairs of vertices with the smaller number first.
    pub fn edges(&self) -> impl Iterator<Item = (u8, u8)> + '_ {
        (0..self.vertices).flat_map(move |a| bits(self.neighbours(a)).filter(move |&b| a <= b).map(move |b| (a, b)))
    }

    /// Adds a vertex whose label is one fingerprint, and returns its number.
    ///
    /// # Errors
    /// [`VerticesFull`] when the map has `V` vertices; it stays as it is.
    pub fn add_vertex(&mut self, fingerprint: Fingerprint) -> Result<u8, VerticesFull> {
        let vertex = self.vertices;
        let slot = usize::from(vertex);
        let (Some(label), Some(mean)) = (self.labels.get_mut(slot), self.means.get_mut(slot)) else {
            return Err(VerticesFull);
        };
        *label = Label::NONE;
        label.include(fingerprint);
        *mean = fingerprint;
        self.vertices += 1;
        Ok(vertex)
    }

    /// Adds a vertex with a label that so many fingerprints were seen for; the label stays when the number is 0.
    pub(crate) fn add_known_vertex(&mut self, fingerprint: Fingerprint, visits: u32) -> Result<u8, VerticesFull> {
        let vertex = self.add_vertex(fingerprint)?;
        if let Some(label) = self.labels.get_mut(usize::from(vertex)) {
            let visits = visits.clamp(1, Label::FULL);
            *label = Label { sum_steps: u32::from(fingerprint.steps()) * visits, visits };
        }
        Ok(vertex)
    }

    /// Takes one more fingerprint into the label of a vertex; nothing happens for a vertex the map does not have.
    pub fn observe(&mut self, vertex: u8, fingerprint: Fingerprint) {
        let slot = usize::from(vertex);
        if vertex >= self.vertices {
            return;
        }
        if let (Some(label), Some(mean)) = (self.labels.get_mut(slot), self.means.get_mut(slot)) {
            label.include(fingerprint);
            *mean = label.mean();
        }
    }

    /// What the label of a vertex would be with one more fingerprint; that of a new vertex is the fingerprint.
    pub(crate) fn label_with(&self, vertex: u8, fingerprint: Fingerprint) -> Fingerprint {
        if vertex >= self.vertices {
            return fingerprint;
        }
        self.labels.get(usize::from(vertex)).map_or(fingerprint, |label| label.including(fingerprint).mean())
    }

    /// Joins two vertices by an edge; nothing happens when there is one or when the map lacks one of them.
    pub fn add_edge(&mut self, a: u8, b: u8) {
        if a >= self.vertices || b >= self.vertices {
            return;
        }
        for (from, to) in [(a, b), (b, a)] {
            if let Some(row) = self.adjacency.get_mut(usize::from(from)) {
                *row |= 1 << (to & 63);
            }
        }
    }

    /// Forgets all vertices and edges.
    pub fn clear(&mut self) {
        self.vertices = 0;
        self.adjacency = [0; V];
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

/// The numbers of the bits that are set in a row, ascending.
pub(crate) fn bits(mut row: u64) -> impl Iterator<Item = u8> + Clone {
    core::iter::from_fn(move || {
        if row == 0 {
            return None;
        }
        let bit = row.trailing_zeros() as u8;
        row &= row - 1;
        Some(bit)
    })
}

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
            map.observe(0, Fingerprint::MAX);
        }
        assert_eq!(map.label(0), Some(Fingerprint::MAX));
    }

    #[test]
    fn a_full_map_refuses_a_vertex_and_stays_as_it_is() {
        let mut map = Map::<2>::new();
        map.add_vertex(fingerprint(1)).unwrap();
        map.add_vertex(fingerprint(2)).unwrap();
        map.add_edge(0, 1);
        let before = map;
        assert_eq!(map.add_vertex(fingerprint(3)), Err(VerticesFull));
        assert_eq!(map, before);
    }

    #[test]
    fn edges_are_listed_once_and_loops_too() {
        let mut map = Map::<4>::new();
        for steps in 0..4 {
            map.add_vertex(fingerprint(steps)).unwrap();
        }
        for (a, b) in [(2, 1), (1, 2), (3, 3), (0, 3), (0, 9)] {
            map.add_edge(a, b);
        }
        assert_eq!(map.edges().collect::<Vec<_>>(), [(0, 3), (1, 2), (3, 3)]);
        assert_eq!(map.neighbours(1), 0b100);
    }
}
