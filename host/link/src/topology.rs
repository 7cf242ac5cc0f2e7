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

use std::collections::BTreeMap;

use petgraph::graph::UnGraph;
use toposlam::wire::{MapReplica, Names, VertexWays, Way, WayId, crc32};
use toposlam::{Filter, Map, VertexId};

/// The vertices of a map and the edges between them; with their ways, if the robot knows them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct TopologicalMap {
    /// Vertices 0, 1, … with their labels.
    pub vertices: Vec<Vertex>,
    /// Each pair of vertices that an edge joins, smaller vertex first, in ascending order; equal ends are a self-loop.
    pub edges: Vec<(u8, u8)>,
    /// The ways of each vertex in counter-clockwise order; empty if the robot knows edges only.
    pub ways: Vec<Vec<Way>>,
    /// The names that an operator has given to vertices.
    pub names: BTreeMap<u8, String>,
}

/// An edge between two ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct WayEdge {
    /// Its ends, the smaller first.
    pub ends: [WayId; 2],
    /// The mean travel time in ring frames, if it is known.
    pub travel_frames: Option<u16>,
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
    /// The number of a vertex, with its name if it has one.
    pub fn vertex_text(&self, vertex: u8) -> String {
        self.names.get(&vertex).map_or_else(|| vertex.to_string(), |name| format!("{vertex} {name}"))
    }

    /// The vertex with a number as text, which the map need not have yet, or with a name.
    pub fn find_vertex(&self, text: &str) -> Option<u8> {
        let named = || self.names.iter().find(|(_, name)| *name == text).map(|(&vertex, _)| vertex);
        text.parse().ok().or_else(named)
    }

    /// Converts to a graph of `petgraph`, in which node `n` is vertex `n`. An edge is that of [`TopologicalMap::all_edges`].
    pub fn to_petgraph(&self) -> UnGraph<Vertex, Option<WayEdge>> {
        let mut graph = UnGraph::with_capacity(self.vertices.len(), self.edges.len());
        let nodes: Vec<_> = self.vertices.iter().map(|vertex| graph.add_node(*vertex)).collect();
        for ([a, b], edge) in self.all_edges() {
            graph.add_edge(nodes[usize::from(a)], nodes[usize::from(b)], edge);
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
        for ways in &self.ways {
            bytes.push(ways.len() as u8);
            for way in ways {
                bytes.extend(way.bearing_mrad.to_le_bytes());
                bytes.extend(way.leads_to.map_or([u8::MAX; 2], |end| [end.vertex, end.way]));
                bytes.extend(way.travel_frames.unwrap_or(0).to_le_bytes());
            }
        }
        crc32(&bytes)
    }

    /// The map of a filter, with its ways if it knows them.
    pub fn of<const V: usize>(filter: &impl Filter<V>) -> Self {
        let map = filter.map();
        let ways = filter.darts().map_or_else(Vec::new, |darts| {
            map.vertices().map(|vertex| VertexWays::of(darts, vertex).ways.as_slice().to_vec()).collect()
        });
        Self { ways, ..Self::from(map) }.without_empty_ways()
    }

    /// A map in which no vertex has a way is one without ways.
    fn without_empty_ways(mut self) -> Self {
        if self.ways.iter().all(Vec::is_empty) {
            self.ways.clear();
        }
        self
    }

    /// A way; `None` if the map has no such way.
    pub fn way(&self, id: WayId) -> Option<&Way> {
        self.ways.get(usize::from(id.vertex))?.get(usize::from(id.way))
    }

    /// Every way with its id, vertex by vertex in counter-clockwise order.
    pub fn all_ways(&self) -> impl Iterator<Item = (WayId, &Way)> {
        let of = |(vertex, ways): (u8, _)| (0..).zip(ways).map(move |(way, data)| (WayId { vertex, way }, data));
        (0..).zip(&self.ways).flat_map(of)
    }

    /// Every edge between two ways once: parallel edges and loops each count. Until the whole map has arrived, an edge of which
    /// only one end is known is left out.
    pub fn way_edges(&self) -> impl Iterator<Item = WayEdge> {
        self.all_ways().filter_map(|(id, way)| {
            let end = way.leads_to.filter(|&end| id < end)?;
            let is_mutual = self.way(end)?.leads_to == Some(id);
            is_mutual.then_some(WayEdge { ends: [id, end], travel_frames: way.travel_frames })
        })
    }

    /// Every edge once, as the two vertices that it joins, with its ways. Edges between ways are followed by those of which
    /// only the vertices are known, all of them if the map has no ways.
    pub fn all_edges(&self) -> Vec<([u8; 2], Option<WayEdge>)> {
        let mut edges: Vec<_> = self.way_edges().map(|edge| (edge.ends.map(|end| end.vertex), Some(edge))).collect();
        for &(a, b) in &self.edges {
            if !edges.iter().any(|&(ends, _)| ends == [a, b] || ends == [b, a]) {
                edges.push(([a, b], None));
            }
        }
        edges
    }

    /// The positions of the frontiers among the ways of a vertex.
    pub fn frontiers_of(&self, vertex: u8) -> Vec<u8> {
        self.frontiers().filter(|way| way.vertex == vertex).map(|way| way.way).collect()
    }

    /// Every frontier, a way that nobody has driven.
    pub fn frontiers(&self) -> impl Iterator<Item = WayId> {
        self.all_ways().filter(|(_, way)| way.leads_to.is_none()).map(|(id, _)| id)
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

/// The names of vertices.
pub(crate) fn names<const V: usize>(names: &Names<V>) -> BTreeMap<u8, String> {
    names.iter().map(|(vertex, name)| (vertex, name.to_string())).collect()
}

/// The map as received so far.
impl<const V: usize> From<&MapReplica<V>> for TopologicalMap {
    fn from(replica: &MapReplica<V>) -> Self {
        let label = |vertex| {
            replica.row(vertex).map_or(Vertex::default(), |row| Vertex { radius_mm: row.radius_mm, visits: row.visits })
        };
        let ways = (0..replica.vertices()).map(|vertex| replica.ways(vertex).to_vec()).collect();
        let vertices = (0..replica.vertices()).map(label).collect();
        let names = names(replica.names());
        Self { vertices, edges: replica.edges().collect(), ways, names }.without_empty_ways()
    }
}

/// The map without its ways; [`TopologicalMap::of`] has them.
impl<const V: usize> From<&Map<V>> for TopologicalMap {
    fn from(map: &Map<V>) -> Self {
        let label = |(vertex, label): (VertexId, &toposlam::Fingerprint)| Vertex {
            radius_mm: label.radius_mm(),
            visits: map.visits(vertex),
        };
        let edges = map.edges().map(|(a, b)| (a.into(), b.into()));
        let vertices = map.vertices().zip(map.labels()).map(label).collect();
        Self { vertices, edges: edges.collect(), ..Self::default() }
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
        assert_eq!(TopologicalMap::from(&map).digest(), toposlam::wire::map_digest(&map, None));
        assert_eq!(TopologicalMap::default().digest(), toposlam::wire::map_digest(&Map::<8>::new(), None));
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
