//! The graph that is drawn: the vertices of a map, and bends of its parallel edges and loops.

use toposlam::wire::WayId;

use super::graph::Graph;
use super::rotation;
use crate::topology::TopologicalMap;

/// A bend, by the two vertices of its edge, the number of the edge among those between the two, and its number on the edge. So
/// it keeps its position when other edges change.
pub(super) type Bend = (u8, u8, usize, usize);

/// An edge, as a path from vertex to vertex through its bends.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Path {
    pub(super) ends: [u8; 2],
    /// The two ways that it joins, if the map has ways.
    pub(super) ways: Option<[WayId; 2]>,
    /// Nodes of the graph. A self-loop of a map without ways is its vertex alone.
    pub(super) nodes: Vec<usize>,
}

/// The graph of a map. Its first nodes are the vertices of the map, the others are bends.
#[derive(Clone, Debug, Default)]
pub(super) struct Network {
    pub(super) graph: Graph,
    pub(super) bends: Vec<Bend>,
    pub(super) paths: Vec<Path>,
}

impl Network {
    /// A loop has two bends. Of parallel edges all but the first have one. The ways of a vertex have an order if the map can be
    /// drawn in the plane with it and the whole map is known.
    pub(super) fn of(map: &TopologicalMap) -> Self {
        let mut network = Self::default();
        let edges = map.all_edges();
        let is_whole = edges.iter().all(|(_, edge)| edge.is_some());
        for (ends, edge) in edges {
            network.add(map.vertices.len(), ends, edge.map(|edge| edge.ends));
        }
        let nodes = map.vertices.len() + network.bends.len();
        let mut graph = Graph::new(nodes);
        for path in &network.paths {
            path.nodes.windows(2).for_each(|step| graph.connect(step[0], step[1]));
        }
        network.graph = graph;
        if is_whole && !map.ways.is_empty() {
            let ordered = Graph::ordered((0..nodes).map(|node| network.order(map, node)).collect());
            if rotation::is_planar(&ordered) {
                network.graph = ordered;
            }
        }
        network
    }

    fn add(&mut self, vertices: usize, ends: [u8; 2], ways: Option<[WayId; 2]>) {
        let [a, b] = ends;
        let parallel = self.paths.iter().filter(|path| path.ends == ends || path.ends == [b, a]).count();
        let bends = match (a == b, parallel, ways) {
            (false, 0, _) | (true, _, None) => 0,
            (false, ..) => 1,
            (true, ..) => 2,
        };
        let mut nodes = vec![usize::from(a)];
        for number in 0..bends {
            nodes.push(vertices + self.bends.len());
            self.bends.push((a.min(b), a.max(b), parallel, number));
        }
        if a != b || bends > 0 {
            nodes.push(b.into());
        }
        self.paths.push(Path { ends, ways, nodes });
    }

    /// The neighbours of a node in counter-clockwise order.
    fn order(&self, map: &TopologicalMap, node: usize) -> Vec<usize> {
        if node >= map.vertices.len() {
            return self.graph.neighbours(node).to_vec();
        }
        let ways = (0..).zip(&map.ways[node]).map(|(way, _)| WayId { vertex: node as u8, way });
        ways.filter_map(|way| self.first_step(way)).map(|step| step[1]).collect()
    }

    /// The first two nodes of the path that leaves by a way; `None` for a frontier.
    pub(super) fn first_step(&self, way: WayId) -> Option<[usize; 2]> {
        self.paths.iter().find_map(|path| {
            let nodes = &path.nodes;
            match path.ways? {
                [from, _] if from == way => Some([nodes[0], nodes[1]]),
                [_, to] if to == way => Some([nodes[nodes.len() - 1], nodes[nodes.len() - 2]]),
                _ => None,
            }
        })
    }
}
