//! A random planar embedding of a graph: the rotation system of a drawing without crossings.
//!
//! Each block (part that no single vertex separates) is embedded face by face after Demoucron, Malgrange and Pertuiset:
//! Graphes planaires, reconnaissance et construction de représentations planaires topologiques (1964). The rotations of
//! the blocks are joined at the vertices that they share.

use super::{
    rotation::{RotationSystem, partner},
    walk::PathRng,
};
use rand::{RngExt, seq::SliceRandom};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// A pair of vertices, the smaller one first.
type Pair = (usize, usize);

fn pair(a: usize, b: usize) -> Pair {
    (a.min(b), a.max(b))
}

/// Draws an embedding of a graph in the plane; `None` for a graph that has none. Loops and parallel edges are possible; edge
/// `e` has the darts `2 e` at its first vertex and `2 e + 1` at its second.
///
/// # Panics
/// When an edge ends outside of `0..vertices`.
pub(super) fn draw_embedding(vertices: usize, edges: &[(usize, usize)], rng: &mut PathRng) -> Option<RotationSystem> {
    let mut first_of: BTreeMap<Pair, usize> = BTreeMap::new();
    for (edge, &(a, b)) in edges.iter().enumerate().filter(|(_, (a, b))| a != b) {
        first_of.entry(pair(a, b)).or_insert(edge);
    }
    let mut ways: Vec<Vec<usize>> = vec![Vec::new(); vertices];
    for block in blocks(vertices, first_of.keys().copied()) {
        for (vertex, around) in rotations(&block, rng)? {
            let dart = |&other: &usize| {
                let edge = first_of[&pair(vertex, other)];
                2 * edge + usize::from(edges[edge].0 != vertex)
            };
            let mut darts: Vec<usize> = around.iter().map(dart).collect();
            darts.rotate_left(rng.random_range(0..around.len()));
            insert(&mut ways[vertex], &darts, rng);
        }
    }
    for (edge, &(a, b)) in edges.iter().enumerate() {
        let darts = [2 * edge, 2 * edge + 1];
        if a == b {
            insert(&mut ways[a], &darts, rng);
        } else if first_of[&pair(a, b)] != edge {
            // Beside the first edge of the pair: after it at one end, before it at the other.
            let beside = 2 * first_of[&pair(a, b)] + usize::from(edges[first_of[&pair(a, b)]].0 != a);
            let position = |ways: &[usize], dart| ways.iter().position(|&way| way == dart).unwrap_or(0);
            let here = position(&ways[a], beside) + 1;
            ways[a].insert(here, darts[0]);
            let there = position(&ways[b], partner(beside));
            ways[b].insert(there, darts[1]);
        }
    }
    Some(RotationSystem::new(ways))
}

/// Inserts darts into a cyclic list, side by side at a random position.
fn insert(ways: &mut Vec<usize>, darts: &[usize], rng: &mut PathRng) {
    let position = rng.random_range(0..=ways.len());
    ways.splice(position..position, darts.iter().copied());
}

/// The blocks of a graph without loops and parallel edges, as lists of edges (Hopcroft and Tarjan 1973).
fn blocks(vertices: usize, edges: impl Iterator<Item = Pair>) -> Vec<Vec<Pair>> {
    let mut search = BlockSearch {
        around: vec![Vec::new(); vertices],
        depth: vec![None; vertices],
        open: Vec::new(),
        found: Vec::new(),
    };
    for (a, b) in edges {
        search.around[a].push(b);
        search.around[b].push(a);
    }
    for vertex in 0..vertices {
        if search.depth[vertex].is_none() {
            search.visit(vertex, None, 0);
        }
    }
    search.found
}

struct BlockSearch {
    around: Vec<Vec<usize>>,
    depth: Vec<Option<usize>>,
    open: Vec<Pair>,
    found: Vec<Vec<Pair>>,
}

impl BlockSearch {
    /// Visits a vertex and all below it; returns the smallest depth that an edge from there leads back to.
    fn visit(&mut self, vertex: usize, parent: Option<usize>, depth: usize) -> usize {
        self.depth[vertex] = Some(depth);
        let mut lowest = depth;
        for position in 0..self.around[vertex].len() {
            let next = self.around[vertex][position];
            match self.depth[next] {
                _ if Some(next) == parent => {}
                Some(reached) => {
                    lowest = lowest.min(reached);
                    if reached < depth {
                        self.open.push(pair(vertex, next));
                    }
                }
                None => {
                    let before = self.open.len();
                    self.open.push(pair(vertex, next));
                    let below = self.visit(next, Some(vertex), depth + 1);
                    lowest = lowest.min(below);
                    if below >= depth {
                        self.found.push(self.open.split_off(before));
                    }
                }
            }
        }
        lowest
    }
}

/// The neighbours of each vertex of a block in counter-clockwise order; `None` if the block is not planar.
fn rotations(block: &[Pair], rng: &mut PathRng) -> Option<BTreeMap<usize, Vec<usize>>> {
    if let &[(a, b)] = block {
        return Some(BTreeMap::from([(a, vec![b]), (b, vec![a])]));
    }
    let faces = faces(block, rng)?;
    // A face arrives at a vertex from one neighbour and leaves it by the next one, counter-clockwise.
    let mut next: BTreeMap<usize, BTreeMap<usize, usize>> = BTreeMap::new();
    for face in &faces {
        for position in 0..face.len() {
            let at = |offset: usize| face[(position + offset) % face.len()];
            next.entry(at(1)).or_default().insert(at(0), at(2));
        }
    }
    let around = |next: &BTreeMap<usize, usize>| -> Vec<usize> {
        let first = next.keys().next().copied();
        let mut order: Vec<usize> = first.into_iter().collect();
        while let Some(&following) = order.last().and_then(|last| next.get(last)).filter(|&&it| Some(it) != first) {
            order.push(following);
        }
        order
    };
    Some(next.iter().map(|(&vertex, next)| (vertex, around(next))).collect())
}

/// A part of a block that is not embedded: one edge, or a component of what is left without the embedded vertices, and the
/// embedded vertices that it is attached to.
struct Fragment {
    inner: BTreeSet<usize>,
    contacts: BTreeSet<usize>,
}

/// The faces of an embedding of a block of two edges or more, as cycles of vertices; `None` if it is not planar.
fn faces(block: &[Pair], rng: &mut PathRng) -> Option<Vec<Vec<usize>>> {
    let mut around: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for &(a, b) in block {
        around.entry(a).or_default().push(b);
        around.entry(b).or_default().push(a);
    }
    around.values_mut().for_each(|around| around.shuffle(rng));
    let (a, b) = block[rng.random_range(0..block.len())];
    // The first cycle: an edge of the block, and another way between its ends.
    let cycle = path(&around, a, b, |from, to| pair(from, to) != (a, b))?;
    let mut drawn: BTreeSet<Pair> = cycle.windows(2).map(|step| pair(step[0], step[1])).chain([(a, b)]).collect();
    let mut reached: BTreeSet<usize> = cycle.iter().copied().collect();
    let mut faces = vec![cycle.clone(), cycle.into_iter().rev().collect()];
    while drawn.len() < block.len() {
        let mut fragments = fragments(block, &around, &drawn, &reached);
        fragments.shuffle(rng);
        let admissible = |fragment: &Fragment| -> Vec<usize> {
            let holds = |face: &usize| fragment.contacts.iter().all(|contact| faces[*face].contains(contact));
            (0..faces.len()).filter(holds).collect()
        };
        // A fragment with the fewest choices comes first.
        let (fragment, choices) =
            fragments.iter().map(|fragment| (fragment, admissible(fragment))).min_by_key(|(_, faces)| faces.len())?;
        let face = *choices.get(rng.random_range(0..choices.len().max(1)))?;
        let mut contacts = fragment.contacts.iter().copied();
        let (from, to) = (contacts.next()?, contacts.next()?);
        let inner = &fragment.inner;
        let within = |a: usize, b: usize| {
            let is_inside = |vertex: usize| vertex == from || vertex == to || inner.contains(&vertex);
            // The edge between the contacts is a fragment of its own.
            is_inside(a) && is_inside(b) && inner.is_empty() == (pair(a, b) == pair(from, to))
        };
        let path = path(&around, from, to, within)?;
        drawn.extend(path.windows(2).map(|step| pair(step[0], step[1])));
        reached.extend(&path);
        let split = faces.swap_remove(face);
        faces.extend(split_face(split, &path));
    }
    Some(faces)
}

/// Splits a face along a path between two of its vertices.
fn split_face(mut face: Vec<usize>, path: &[usize]) -> [Vec<usize>; 2] {
    let (Some((&from, rest)), Some(&to)) = (path.split_first(), path.last()) else { return [face, Vec::new()] };
    let inner = &rest[..rest.len() - 1];
    let start = face.iter().position(|&vertex| vertex == from).unwrap_or(0);
    face.rotate_left(start);
    let end = face.iter().position(|&vertex| vertex == to).unwrap_or(0);
    let before = face[..=end].iter().chain(inner.iter().rev()).copied().collect();
    let after = face[end..].iter().chain([&from]).chain(inner).copied().collect();
    [before, after]
}

/// The shortest path between two vertices over edges for which `is_open` holds.
fn path(
    around: &BTreeMap<usize, Vec<usize>>,
    from: usize,
    to: usize,
    is_open: impl Fn(usize, usize) -> bool,
) -> Option<Vec<usize>> {
    let mut before = BTreeMap::from([(from, from)]);
    let mut open = VecDeque::from([from]);
    while let Some(vertex) = open.pop_front() {
        for &next in around[&vertex].iter().filter(|&&next| is_open(vertex, next)) {
            if let std::collections::btree_map::Entry::Vacant(entry) = before.entry(next) {
                entry.insert(vertex);
                open.push_back(next);
            }
        }
    }
    let mut path = vec![to];
    while path.last() != Some(&from) {
        path.push(*before.get(path.last()?)?);
    }
    path.reverse();
    Some(path)
}

fn fragments(
    block: &[Pair],
    around: &BTreeMap<usize, Vec<usize>>,
    drawn: &BTreeSet<Pair>,
    reached: &BTreeSet<usize>,
) -> Vec<Fragment> {
    let is_chord = |&&(a, b): &&Pair| !drawn.contains(&(a, b)) && reached.contains(&a) && reached.contains(&b);
    let chord = |&(a, b): &Pair| Fragment { inner: BTreeSet::new(), contacts: BTreeSet::from([a, b]) };
    let mut fragments: Vec<Fragment> = block.iter().filter(is_chord).map(chord).collect();
    let mut seen = reached.clone();
    for &start in around.keys() {
        if seen.contains(&start) {
            continue;
        }
        let mut fragment = Fragment { inner: BTreeSet::new(), contacts: BTreeSet::new() };
        let mut open = vec![start];
        while let Some(vertex) = open.pop() {
            if reached.contains(&vertex) {
                fragment.contacts.insert(vertex);
            } else if seen.insert(vertex) {
                fragment.inner.insert(vertex);
                open.extend(&around[&vertex]);
            }
        }
        fragments.push(fragment);
    }
    fragments
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{planar::draw_planar, walk::path_rng};

    fn complete(vertices: usize) -> Vec<(usize, usize)> {
        (0..vertices).flat_map(|a| (a + 1..vertices).map(move |b| (a, b))).collect()
    }

    #[test]
    fn planar_graphs_have_embeddings_of_genus_0() {
        let mut rng = path_rng(3, 0);
        for (vertices, edges) in [(3, 3), (8, 10), (20, 30), (60, 80), (40, 200)] {
            for _ in 0..20 {
                let (graph, _) = draw_planar(vertices, edges, &mut rng);
                let mut edges: Vec<(usize, usize)> = graph.edges().iter().map(|&(a, b)| (b, a)).collect();
                edges.shuffle(&mut rng);
                // Loops and parallel edges.
                edges.extend([(0, 0), edges[0], (edges[0].1, edges[0].0), (1, 1), edges[1]]);
                let embedding = draw_embedding(vertices, &edges, &mut rng).unwrap();
                assert_eq!((embedding.vertex_count(), embedding.dart_count()), (vertices, 2 * edges.len()));
                assert_eq!(embedding.genus(), 0);
                for (edge, &(a, b)) in edges.iter().enumerate() {
                    assert_eq!((embedding.vertex(2 * edge), embedding.vertex(2 * edge + 1)), (a, b));
                }
            }
        }
    }

    #[test]
    fn graphs_that_are_not_planar_have_no_embedding() {
        let mut rng = path_rng(4, 0);
        let utilities: Vec<(usize, usize)> = (0..3).flat_map(|a| (3..6).map(move |b| (a, b))).collect();
        let petersen = (0..5).flat_map(|v| [(v, (v + 1) % 5), (v, v + 5), (v + 5, (v + 2) % 5 + 5)]).collect();
        for (vertices, edges) in [(5, complete(5)), (6, utilities), (10, petersen), (7, complete(7))] {
            for _ in 0..10 {
                assert_eq!(draw_embedding(vertices, &edges, &mut rng), None);
            }
            // Without one edge, the first two are planar.
            let is_planar = draw_embedding(vertices, &edges[1..], &mut rng).is_some();
            assert_eq!(is_planar, vertices < 7, "{vertices}");
        }
    }

    #[test]
    fn embeddings_of_a_graph_differ() {
        let ladder = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 4), (4, 5), (5, 1), (3, 6)];
        let mut rng = path_rng(5, 0);
        let drawn: Vec<_> = (0..20).map(|_| draw_embedding(7, &ladder, &mut rng).unwrap()).collect();
        let all: Vec<usize> = (0..7).collect();
        assert!(drawn.iter().any(|embedding| !embedding.equals(&drawn[0], &all)));
    }
}
