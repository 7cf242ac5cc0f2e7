//! Planarity test and planar embedding by the algorithm of Demoucron, Malgrange and Pertuiset.

use super::graph::Graph;

/// The faces of a planar embedding of a biconnected graph of at least three vertices; `None` if it is not planar.
///
/// Each face is the cycle around it. All cycles have the same orientation, so that each edge occurs once in each
/// direction. Cost: O(edges · (vertices + edges)).
pub(super) fn faces(graph: &Graph) -> Option<Vec<Vec<usize>>> {
    let vertices = graph.vertices();
    if graph.edges().len() > (3 * vertices).saturating_sub(6) {
        return None;
    }
    let cycle = cycle(graph);
    let mut drawn = Drawn::new(vertices);
    drawn.add(&cycle, true);
    let backwards = cycle.iter().rev().copied().collect();
    let mut faces = vec![cycle, backwards];
    loop {
        let fragments = fragments(graph, &drawn);
        // The fragment with the fewest admissible faces is drawn first: if only one face fits, it must still be free.
        let mut best: Option<(usize, usize, &Fragment)> = None;
        for fragment in &fragments {
            let fits = |face: &[usize]| fragment.attachments.iter().all(|attachment| face.contains(attachment));
            let mut fitting = faces.iter().enumerate().filter(|(_, face)| fits(face)).map(|(index, _)| index);
            let first = fitting.next()?;
            let choice = 1 + fitting.count();
            if best.is_none_or(|(least, _, _)| choice < least) {
                best = Some((choice, first, fragment));
            }
        }
        let Some((_, face, fragment)) = best else { return Some(faces) };
        let path = fragment.path(graph, &drawn);
        drawn.add(&path, false);
        let (one, other) = split(&faces[face], &path);
        faces[face] = one;
        faces.push(other);
    }
}

/// The part of the graph that is already embedded.
struct Drawn {
    vertices: Vec<bool>,
    edges: Vec<Vec<bool>>,
}

impl Drawn {
    fn new(vertices: usize) -> Self {
        Self { vertices: vec![false; vertices], edges: vec![vec![false; vertices]; vertices] }
    }

    fn add(&mut self, path: &[usize], closed: bool) {
        let ends = path.first().zip(path.last()).filter(|_| closed);
        for (&a, &b) in path.iter().zip(path.iter().skip(1)).chain(ends) {
            self.vertices[a] = true;
            self.vertices[b] = true;
            self.edges[a][b] = true;
            self.edges[b][a] = true;
        }
    }
}

/// A connected component of the remaining graph, with the embedded vertices to which it is attached.
struct Fragment {
    /// Its vertices that are not embedded; none for a single edge.
    inner: Vec<usize>,
    attachments: Vec<usize>,
}

impl Fragment {
    /// A path through it from one embedded vertex to another.
    fn path(&self, graph: &Graph, drawn: &Drawn) -> Vec<usize> {
        if self.inner.is_empty() {
            return self.attachments.clone();
        }
        let start = self.attachments[0];
        let mut from = vec![usize::MAX; graph.vertices()];
        let mut open = std::collections::VecDeque::from([start]);
        while let Some(vertex) = open.pop_front() {
            for &next in graph.neighbours(vertex) {
                if next == start || from[next] != usize::MAX || (vertex == start && !self.inner.contains(&next)) {
                    continue;
                }
                from[next] = vertex;
                if drawn.vertices[next] {
                    let mut path = vec![next];
                    while let Some(&last) = path.last().filter(|&&last| last != start) {
                        path.push(from[last]);
                    }
                    return path;
                }
                open.push_back(next);
            }
        }
        unreachable!("in a biconnected graph every fragment is attached to two vertices")
    }
}

fn fragments(graph: &Graph, drawn: &Drawn) -> Vec<Fragment> {
    let mut fragments = Vec::new();
    for &(a, b) in graph.edges() {
        if drawn.vertices[a] && drawn.vertices[b] && !drawn.edges[a][b] {
            fragments.push(Fragment { inner: Vec::new(), attachments: vec![a, b] });
        }
    }
    let left_out: Vec<usize> = (0..graph.vertices()).filter(|&vertex| drawn.vertices[vertex]).collect();
    for inner in graph.parts_without(&left_out) {
        let around = inner.iter().flat_map(|&vertex| graph.neighbours(vertex)).copied();
        let mut attachments: Vec<usize> = around.filter(|&vertex| drawn.vertices[vertex]).collect();
        attachments.sort_unstable();
        attachments.dedup();
        fragments.push(Fragment { inner, attachments });
    }
    fragments
}

/// Any cycle of a biconnected graph: the first edge and another path between its ends.
fn cycle(graph: &Graph) -> Vec<usize> {
    let (a, b) = graph.edges()[0];
    let mut from = vec![usize::MAX; graph.vertices()];
    from[a] = a;
    let mut open = std::collections::VecDeque::from([a]);
    while let Some(vertex) = open.pop_front() {
        for &next in graph.neighbours(vertex) {
            if from[next] == usize::MAX && (vertex, next) != (a, b) {
                from[next] = vertex;
                open.push_back(next);
            }
        }
    }
    let mut cycle = vec![b];
    while let Some(&last) = cycle.last().filter(|&&last| last != a) {
        cycle.push(from[last]);
    }
    cycle
}

/// The two faces into which a path between two vertices of a face divides it.
fn split(face: &[usize], path: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let index = |vertex: usize| face.iter().position(|&other| other == vertex).unwrap_or(0);
    let (from, to) = (index(path[0]), index(path[path.len() - 1]));
    let inner = &path[1..path.len() - 1];
    let arc = |from: usize, to: usize| {
        let length = (to + face.len() - from) % face.len();
        (0..=length).map(move |step| face[(from + step) % face.len()])
    };
    (arc(from, to).chain(inner.iter().rev().copied()).collect(), arc(to, from).chain(inner.iter().copied()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(vertices: usize, edges: impl IntoIterator<Item = (usize, usize)>) -> Graph {
        let mut graph = Graph::new(vertices);
        edges.into_iter().for_each(|(a, b)| graph.connect(a, b));
        graph
    }

    fn complete(vertices: usize) -> Graph {
        graph(vertices, (0..vertices).flat_map(|a| (0..a).map(move |b| (a, b))))
    }

    #[test]
    fn the_smallest_non_planar_graphs_are_refused() {
        assert!(faces(&complete(5)).is_none());
        let houses_and_wells = (0..3).flat_map(|house| (3..6).map(move |well| (house, well)));
        assert!(faces(&graph(6, houses_and_wells)).is_none());
        let petersen = (0..5).flat_map(|i| [(i, (i + 1) % 5), (i, i + 5), (i + 5, 5 + (i + 2) % 5)]);
        assert!(faces(&graph(10, petersen)).is_none());
    }

    #[test]
    fn faces_use_each_edge_once_per_direction_and_satisfy_eulers_formula() {
        let wheel = graph(9, (0..8).flat_map(|i| [(i, (i + 1) % 8), (i, 8)]));
        let ladder =
            graph(12, (0..6).flat_map(|i| [(i, i + 6)]).chain((0..5).flat_map(|i| [(i, i + 1), (i + 6, i + 7)])));
        let cube = graph(8, (0..8).flat_map(|v: usize| [1, 2, 4].map(|bit| (v, v ^ bit))));
        for graph in [complete(3), complete(4), wheel, ladder, cube] {
            let faces = faces(&graph).unwrap();
            assert_eq!(graph.vertices() + faces.len(), graph.edges().len() + 2);
            let mut passes: Vec<(usize, usize)> =
                faces.iter().flat_map(|face| (0..face.len()).map(|i| (face[i], face[(i + 1) % face.len()]))).collect();
            passes.sort_unstable();
            let mut ways: Vec<(usize, usize)> = graph.edges().iter().flat_map(|&(a, b)| [(a, b), (b, a)]).collect();
            ways.sort_unstable();
            assert_eq!(passes, ways);
        }
    }
}
