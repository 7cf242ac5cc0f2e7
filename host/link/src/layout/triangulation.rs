//! Triangulation of a planar embedding by additional edges.

use std::collections::HashMap;

use super::embedding;
use super::graph::Graph;
use super::rotation::{self, Faces};

/// A planar embedding in which all faces, the outer one included, are triangles.
pub(super) struct Triangulation {
    /// The graph, including the added edges.
    pub(super) graph: Graph,
    /// The face with the most edges, before triangulation.
    pub(super) rim: Vec<usize>,
    /// The outer face, a triangle of that face.
    pub(super) outer: [usize; 3],
    /// For each directed edge the third vertex of the triangle on its side.
    third: HashMap<(usize, usize), usize>,
}

impl Triangulation {
    /// `None` if the graph is not planar or has fewer than three vertices. The order of the neighbours is kept if there is one.
    ///
    /// The outer face is a triangle of the face with the most edges.
    pub(super) fn of(graph: &Graph) -> Option<Self> {
        if graph.vertices() < 3 {
            return None;
        }
        let Faces { mut graph, cycles: mut faces, triangles: cut_off } = if graph.is_ordered() {
            rotation::biconnected(graph)?
        } else {
            let graph = biconnected(graph);
            Faces { cycles: embedding::faces(&graph)?, graph, triangles: Vec::new() }
        };
        faces.sort_by_key(|face| std::cmp::Reverse(face.len()));
        let rim = faces.first()?.clone();
        let mut triangles = Vec::new();
        for face in faces {
            cut(&mut graph, face, &mut triangles);
        }
        let outer = *triangles.first()?;
        triangles.extend(cut_off);
        let sides = |[a, b, c]: [usize; 3]| [((a, b), c), ((b, c), a), ((c, a), b)];
        Some(Self { graph, rim, outer, third: triangles.into_iter().flat_map(sides).collect() })
    }

    /// The third vertex of the triangle that contains this directed edge.
    pub(super) fn third(&self, from: usize, to: usize) -> usize {
        self.third[&(from, to)]
    }
}

/// Makes the graph biconnected by adding edges. The result is planar if and only if the graph is.
///
/// An edge between two components preserves planarity. So does an edge between two neighbours of a cut vertex in
/// different components, because each component can be embedded with its neighbour on the outer face.
fn biconnected(graph: &Graph) -> Graph {
    let mut graph = graph.clone();
    for parts in graph.parts_without(&[]).windows(2) {
        graph.connect(parts[0][0], parts[1][0]);
    }
    for vertex in 0..graph.vertices() {
        let parts = graph.parts_without(&[vertex]);
        let touching = |part: &[usize]| graph.neighbours(vertex).iter().copied().find(|other| part.contains(other));
        let ends: Vec<usize> = parts.iter().filter_map(|part| touching(part)).collect();
        for pair in ends.windows(2) {
            graph.connect(pair[0], pair[1]);
        }
    }
    graph
}

/// Triangulates a face. At most one of the two diagonals of a quadrangle exists outside the face, so that one is always
/// available; of the available ones, that between the vertices with the fewest edges is added.
fn cut(graph: &mut Graph, mut face: Vec<usize>, triangles: &mut Vec<[usize; 3]>) {
    while face.len() > 3 {
        let around = |index: usize| {
            let length = face.len();
            [face[(index + length - 1) % length], face[index], face[(index + 1) % length]]
        };
        let free = (0..face.len()).filter(|&index| {
            let [before, _, after] = around(index);
            !graph.connects(before, after)
        });
        let edges = |vertex: usize| graph.neighbours(vertex).len();
        let ear = free.min_by_key(|&index| {
            let [before, _, after] = around(index);
            edges(before) + edges(after)
        });
        let Some(ear) = ear else { unreachable!("a face of four vertices or more has a diagonal") };
        let triangle = around(ear);
        triangles.push(triangle);
        graph.connect(triangle[0], triangle[2]);
        face.remove(ear);
    }
    triangles.push([face[0], face[1], face[2]]);
}
