//! The faces of a graph whose neighbours have an order.

use super::graph::Graph;

/// The faces that follow from the order: each is a walk that may pass a vertex several times. In a drawing the outer face is
/// walked counter-clockwise and every other one clockwise.
pub(super) fn faces(graph: &Graph) -> Vec<Vec<usize>> {
    let next = |from: usize, at: usize| {
        let around = graph.neighbours(at);
        let position = around.iter().position(|&other| other == from).unwrap_or(0);
        around[(position + 1) % around.len()]
    };
    let mut faces = Vec::new();
    let mut passed = std::collections::HashSet::new();
    for start in graph.edges().iter().flat_map(|&(a, b)| [(a, b), (b, a)]) {
        let (mut face, mut side) = (Vec::new(), start);
        while passed.insert(side) {
            face.push(side.0);
            side = (side.1, next(side.0, side.1));
        }
        if !face.is_empty() {
            faces.push(face);
        }
    }
    faces
}

/// Whether the graph can be drawn in the plane with its order (Euler's formula).
pub(super) fn is_planar(graph: &Graph) -> bool {
    let isolated = (0..graph.vertices()).filter(|&vertex| graph.neighbours(vertex).is_empty()).count();
    let faces = faces(graph).len() + isolated;
    graph.vertices() + faces == graph.edges().len() + 2 * graph.parts_without(&[]).len()
}

/// A biconnected graph and its faces.
pub(super) struct Faces {
    pub(super) graph: Graph,
    /// Every face, as the cycle around it, without `triangles`.
    pub(super) cycles: Vec<Vec<usize>>,
    /// The faces that additional edges cut off.
    pub(super) triangles: Vec<[usize; 3]>,
}

/// Makes a graph biconnected by additional edges; the order of the others stays. `None` if the order is not planar.
pub(super) fn biconnected(graph: &Graph) -> Option<Faces> {
    if !is_planar(graph) {
        return None;
    }
    // An edge between two parts preserves planarity at any position in the order.
    let mut neighbours: Vec<Vec<usize>> =
        (0..graph.vertices()).map(|vertex| graph.neighbours(vertex).to_vec()).collect();
    for parts in graph.parts_without(&[]).windows(2) {
        let (a, b) = (parts[0][0], parts[1][0]);
        neighbours[a].push(b);
        neighbours[b].push(a);
    }
    let connected = Graph::ordered(neighbours);
    let mut cycles = faces(&connected);
    let mut graph = connected.without_order();
    let mut triangles = Vec::new();
    for face in &mut cycles {
        while let Some(repeated) = (0..face.len()).find(|&index| is_repeated(face, index)) {
            // A vertex that a face passes twice is a cut vertex; an edge past it joins two of the parts that it separates.
            let vertex = face[repeated];
            let around = |index: usize| {
                let length = face.len();
                [face[(index + length - 1) % length], face[index], face[(index + 1) % length]]
            };
            let free = |&index: &usize| {
                let [before, at, after] = around(index);
                at == vertex && before != after && !graph.connects(before, after)
            };
            let corner = (0..face.len()).find(free)?;
            let triangle = around(corner);
            graph.connect(triangle[0], triangle[2]);
            triangles.push(triangle);
            face.remove(corner);
        }
    }
    Some(Faces { graph, cycles, triangles })
}

fn is_repeated(face: &[usize], index: usize) -> bool {
    face[index + 1..].contains(&face[index])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_has_one_face_and_crossed_cycles_are_not_planar() {
        let star = Graph::ordered(vec![vec![1, 2, 3], vec![0], vec![0], vec![0]]);
        assert_eq!(faces(&star), [[0, 1, 0, 2, 0, 3]]);
        let cycle = Graph::ordered(vec![vec![1, 2], vec![0, 2], vec![0, 1], vec![]]);
        assert!(is_planar(&cycle));
        // K4 in the plane, and with two neighbours exchanged.
        let inside = vec![vec![1, 2, 3], vec![2, 0, 3], vec![0, 1, 3], vec![0, 1, 2]];
        let k4 = [vec![1, 3, 2], vec![2, 3, 0], vec![0, 3, 1], vec![0, 1, 2]];
        assert!(is_planar(&Graph::ordered(k4.to_vec())));
        assert!(!is_planar(&Graph::ordered(inside)));
    }

    #[test]
    fn every_face_of_a_biconnected_graph_is_a_cycle() {
        let star = Graph::ordered(vec![vec![1, 2, 3], vec![0], vec![0], vec![0], vec![5], vec![4]]);
        let Faces { graph, cycles, triangles } = biconnected(&star).unwrap();
        assert_eq!(graph.parts_without(&[]).len(), 1);
        for face in &cycles {
            assert!(face.len() > 2 && !(0..face.len()).any(|index| is_repeated(face, index)), "{face:?}");
        }
        assert_eq!(graph.vertices() + cycles.len() + triangles.len(), graph.edges().len() + 2);
    }
}
