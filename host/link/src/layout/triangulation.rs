//! A drawing without crossings, cut into triangles by edges that are not there.

use std::collections::HashMap;

use super::{embedding, graph::Graph};

/// A drawing without crossings all of whose faces are triangles, the outer one included.
pub(super) struct Triangulation {
    /// The graph and the edges that were added to it.
    pub(super) graph: Graph,
    /// The face with the most edges, before it was cut.
    pub(super) rim: Vec<usize>,
    /// The outer face, a piece of that.
    pub(super) outer: [usize; 3],
    /// For each edge and way the third vertex of the triangle on the side of that way.
    third: HashMap<(usize, usize), usize>,
}

impl Triangulation {
    /// `None` when the graph cannot be drawn without crossings, or has less than three vertices.
    ///
    /// One triangle of the face with the most edges is the outer one.
    pub(super) fn of(graph: &Graph) -> Option<Self> {
        if graph.vertices() < 3 {
            return None;
        }
        let mut graph = biconnected(graph);
        let mut faces = embedding::faces(&graph)?;
        faces.sort_by_key(|face| std::cmp::Reverse(face.len()));
        let rim = faces.first()?.clone();
        let mut triangles = Vec::new();
        for face in faces {
            cut(&mut graph, face, &mut triangles);
        }
        let outer = *triangles.first()?;
        let sides = |[a, b, c]: [usize; 3]| [((a, b), c), ((b, c), a), ((c, a), b)];
        Some(Self { graph, rim, outer, third: triangles.into_iter().flat_map(sides).collect() })
    }

    /// The third vertex of the triangle that has this edge this way round.
    pub(super) fn third(&self, from: usize, to: usize) -> usize {
        self.third[&(from, to)]
    }
}

/// The graph with edges more, so that no vertex alone holds it together. It is planar if and only if it was.
///
/// An edge between two parts never spoils that; nor does one between two neighbours of a vertex that alone holds their parts
/// together, because each part can be drawn with its neighbour on the outside.
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

/// Cuts a face into triangles. Of two diagonals of a quadrangle one at most is drawn outside of it, so that there is always one to cut
/// along; of those, the one between the vertices with the fewest edges is taken.
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
