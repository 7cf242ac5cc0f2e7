//! A topological map as plain data, from any source: a robot's stream or the library on this computer.
//!
//! ```
//! use petgraph::algo::connected_components;
//! use toposlam::{Fingerprint, Map};
//! use toposlam_link::topology::TopologicalMap;
//!
//! let mut map: Map<8> = Map::new();
//! let hall = map.add_vertex(Fingerprint::from_radius_mm(1200)?)?;
//! let door = map.add_vertex(Fingerprint::from_radius_mm(400)?)?;
//! map.add_edge(hall, door);
//!
//! let topology = TopologicalMap::from(&map);
//! assert_eq!(topology.edges, [(0, 1)]);
//! assert_eq!(topology.vertices[1].radius_mm, 400);
//! assert_eq!(connected_components(&topology.to_petgraph()), 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use petgraph::graph::UnGraph;
use toposlam::wire::{MapReplica, crc32};
use toposlam::{Map, VertexId};

/// The vertices of a map and the edges between them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct TopologicalMap {
    /// Vertices 0, 1, … with their labels.
    pub vertices: Vec<Vertex>,
    /// Each edge once, smaller vertex first, in ascending order; equal ends are a self-loop.
    pub edges: Vec<(u8, u8)>,
}

/// One vertex, with its label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Vertex {
    /// Mean observed radius, in millimetres; 0 until received.
    pub radius_mm: u16,
    /// Number of observations in the mean; 0 until received.
    pub visits: u32,
}

impl TopologicalMap {
    /// Converts to a graph of `petgraph`, in which node `n` is vertex `n`.
    pub fn to_petgraph(&self) -> UnGraph<Vertex, ()> {
        let mut graph = UnGraph::with_capacity(self.vertices.len(), self.edges.len());
        let nodes: Vec<_> = self.vertices.iter().map(|vertex| graph.add_node(*vertex)).collect();
        for &(a, b) in &self.edges {
            graph.add_edge(nodes[usize::from(a)], nodes[usize::from(b)], ());
        }
        graph
    }

    /// Digest of this map, as the robot computes it; see [`toposlam::wire::map_digest`].
    pub fn digest(&self) -> u32 {
        let mut bytes = vec![self.vertices.len() as u8];
        for (label, neighbours) in self.vertices.iter().zip(self.neighbours()) {
            let row = neighbours.iter().fold(0_u64, |row, vertex| row | 1 << vertex);
            bytes.extend(label.radius_mm.to_le_bytes());
            bytes.extend(label.visits.to_le_bytes());
            bytes.extend(row.to_le_bytes());
        }
        crc32(&bytes)
    }

    /// Neighbours of each vertex in ascending order; a vertex with a self-loop is its own neighbour.
    pub fn neighbours(&self) -> Vec<Vec<usize>> {
        let mut neighbours = vec![Vec::new(); self.vertices.len()];
        for &(a, b) in &self.edges {
            let (a, b) = (usize::from(a), usize::from(b));
            neighbours[a].push(b);
            if a != b {
                neighbours[b].push(a);
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
        }
        neighbours
    }
}

/// The map as received so far.
impl<const V: usize> From<&MapReplica<V>> for TopologicalMap {
    fn from(replica: &MapReplica<V>) -> Self {
        let label = |vertex| {
            replica.row(vertex).map_or(Vertex::default(), |row| Vertex { radius_mm: row.radius_mm, visits: row.visits })
        };
        Self { vertices: (0..replica.vertices()).map(label).collect(), edges: replica.edges().collect() }
    }
}

impl<const V: usize> From<&Map<V>> for TopologicalMap {
    fn from(map: &Map<V>) -> Self {
        let label = |(vertex, label): (VertexId, &toposlam::Fingerprint)| Vertex {
            radius_mm: label.radius_mm(),
            visits: map.visits(vertex),
        };
        let edges = map.edges().map(|(a, b)| (a.into(), b.into()));
        Self { vertices: map.vertices().zip(map.labels()).map(label).collect(), edges: edges.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_equals_the_robots_digest_of_the_same_map() {
        let mut map: Map<8> = Map::new();
        let radius = |radius_mm| toposlam::Fingerprint::from_radius_mm(radius_mm).unwrap();
        let [a, b, c] = [1200, 400, 700].map(|radius_mm| map.add_vertex(radius(radius_mm)).unwrap());
        map.add_edge(a, c);
        map.add_edge(b, b);
        assert_eq!(TopologicalMap::from(&map).digest(), toposlam::wire::map_digest(&map));
        assert_eq!(TopologicalMap::default().digest(), toposlam::wire::map_digest(&Map::<8>::new()));
    }

    #[test]
    fn a_partially_received_map_includes_the_vertices_of_its_edges() {
        use toposlam::wire::{Arrival, Header, Message};
        let mut replica = MapReplica::<64>::new();
        replica.apply(Header { sequence: 0, arrival: Arrival::First }, &Message::Edge { a: 1, b: 3, present: true });
        let topology = TopologicalMap::from(&replica);
        assert_eq!((topology.vertices.len(), &topology.edges[..]), (4, &[(1, 3)][..]));
        assert_eq!(topology.neighbours(), [vec![], vec![3], vec![], vec![1]]);
        assert_eq!(topology.to_petgraph().edge_count(), 1);
    }
}
