//! The exact search for the smallest maps that explain a walk and have the n-grams of an environment.

use crate::graph::Graph;
use petgraph::algo::is_isomorphic_matching;
use std::collections::BTreeSet;

/// How many bits of an n-gram a label takes.
const LABEL_BITS: u32 = 6;
/// Labels are below this.
const LABELS: u8 = 1 << LABEL_BITS;

/// A graph whose vertices have labels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LabelledGraph {
    pub(super) labels: Vec<u8>,
    pub(super) graph: Graph,
}

impl LabelledGraph {
    /// The label strings of all walks of `length` places.
    pub(super) fn ngrams(&self, length: usize) -> BTreeSet<u64> {
        strings(&self.labels, &self.graph.neighbours(), 0..self.labels.len(), length, false)
    }

    /// Whether two graphs have walks with the same labels, of any length. Follows the sets of places that a walk may have reached.
    pub(super) fn has_same_walks(&self, other: &Self) -> bool {
        let graphs = [self, other];
        let neighbours = graphs.map(|graph| graph.graph.neighbours());
        let with_label =
            |graph: &Self, label: u8| (0..graph.labels.len()).filter(|&at| graph.labels[at] == label).collect();
        let mut open: Vec<[BTreeSet<usize>; 2]> = Vec::new();
        let mut seen = BTreeSet::new();
        for label in 0..LABELS {
            let starts: [BTreeSet<usize>; 2] = graphs.map(|graph| with_label(graph, label));
            if starts[0].is_empty() != starts[1].is_empty() {
                return false;
            }
            open.push(starts);
        }
        while let Some(reached) = open.pop() {
            let next = [0, 1].map(|side| -> BTreeSet<usize> {
                reached[side].iter().flat_map(|&at| &neighbours[side][at]).copied().collect()
            });
            let labels: BTreeSet<u8> =
                (0..2).flat_map(|side| next[side].iter().map(move |&at| graphs[side].labels[at])).collect();
            for label in labels {
                let reached = [0, 1].map(|side| -> BTreeSet<usize> {
                    next[side].iter().copied().filter(|&at| graphs[side].labels[at] == label).collect()
                });
                if reached[0].is_empty() || reached[1].is_empty() {
                    return false;
                }
                if seen.insert(reached.clone()) {
                    open.push(reached);
                }
            }
        }
        true
    }

    /// Whether two graphs are isomorphic, labels included.
    pub(super) fn is_isomorphic_to(&self, other: &Self) -> bool {
        let [one, other] = [self, other].map(|graph| graph.graph.to_petgraph(|vertex| graph.labels[vertex]));
        is_isomorphic_matching(&one, &other, |a, b| a == b, |(), ()| true)
    }
}

/// The label strings of all walks of `length` places from these starts, read from the far end if `reversed`.
fn strings(
    labels: &[u8],
    neighbours: &[Vec<usize>],
    starts: impl IntoIterator<Item = usize>,
    length: usize,
    reversed: bool,
) -> BTreeSet<u64> {
    let mut walks: BTreeSet<(usize, u64)> = starts.into_iter().map(|at| (at, labels[at].into())).collect();
    for step in 1..length {
        let next = |&(at, string): &(usize, u64)| {
            neighbours[at].iter().map(move |&next| {
                let label = u64::from(labels[next]);
                let longer =
                    if reversed { string | label << (LABEL_BITS * step as u32) } else { string << LABEL_BITS | label };
                (next, longer)
            })
        };
        walks = walks.iter().flat_map(next).collect();
    }
    walks.into_iter().map(|(_, string)| string).collect()
}

/// What a search found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// One smallest map.
    One(LabelledGraph),
    /// Smallest maps that are not isomorphic, or none up to the size.
    Several,
    /// The search reached its limit.
    Ended,
}

/// Finds the smallest maps that contain a walk with these labels, and whose n-grams are these. Returns also how many nodes it
/// expanded.
///
/// A depth-first search along the walk: each label leads to a vertex with this label or to a new one. A branch ends when the
/// map has an n-gram that the environment does not have. The number of vertices is deepened from the number of labels to
/// `most_vertices`. Of maps with equally many vertices those with the fewest edges are the smallest: an edge that adds no n-gram is
/// never seen.
pub(super) fn smallest_maps(
    walk: &[u8],
    ngrams: &BTreeSet<u64>,
    length: usize,
    most_vertices: usize,
    most_nodes: u64,
) -> (Found, u64) {
    let least = walk.iter().collect::<BTreeSet<_>>().len();
    let mut search = Search {
        walk,
        ngrams,
        length,
        most_vertices: least,
        nodes_left: most_nodes,
        map: Map::default(),
        found: vec![],
    };
    for most in least..=most_vertices {
        search.most_vertices = most;
        let is_complete = search.start();
        let nodes = most_nodes - search.nodes_left;
        if !is_complete {
            return (Found::Ended, nodes);
        }
        if search.found.len() > 1 {
            return (Found::Several, nodes);
        }
        if let Some(map) = search.found.pop() {
            return (Found::One(map), nodes);
        }
    }
    (Found::Several, most_nodes - search.nodes_left)
}

/// A map under construction.
#[derive(Clone, Debug, Default)]
struct Map {
    labels: Vec<u8>,
    neighbours: Vec<Vec<usize>>,
    edges: usize,
}

impl Map {
    fn add_vertex(&mut self, label: u8) -> usize {
        self.labels.push(label);
        self.neighbours.push(Vec::new());
        self.labels.len() - 1
    }

    fn remove_last_vertex(&mut self) {
        self.labels.pop();
        self.neighbours.pop();
    }

    fn add_edge(&mut self, a: usize, b: usize) {
        self.edges += 1;
        self.neighbours[a].push(b);
        if a != b {
            self.neighbours[b].push(a);
        }
    }

    /// Removes the edge that was added last.
    fn remove_edge(&mut self, a: usize, b: usize) {
        self.edges -= 1;
        self.neighbours[a].pop();
        if a != b {
            self.neighbours[b].pop();
        }
    }

    /// The label strings of all walks of `length` places from a vertex, read from the far end if `reversed`.
    fn strings(&self, from: usize, length: usize, reversed: bool) -> BTreeSet<u64> {
        strings(&self.labels, &self.neighbours, [from], length, reversed)
    }

    fn finished(&self) -> LabelledGraph {
        let edges = self.neighbours.iter().enumerate().flat_map(|(a, around)| around.iter().map(move |&b| (a, b)));
        LabelledGraph { labels: self.labels.clone(), graph: Graph::from_edges(self.labels.len(), edges) }
    }
}

struct Search<'a> {
    walk: &'a [u8],
    ngrams: &'a BTreeSet<u64>,
    length: usize,
    most_vertices: usize,
    nodes_left: u64,
    map: Map,
    /// The maps with the fewest edges so far, two at most.
    found: Vec<LabelledGraph>,
}

impl Search<'_> {
    /// Searches from the start of the walk. Returns `false` when the search reached its limit.
    fn start(&mut self) -> bool {
        self.map = Map::default();
        let Some((&first, rest)) = self.walk.split_first() else { return true };
        let at = self.map.add_vertex(first);
        self.extend(rest, at)
    }

    /// Explains the rest of the walk from a vertex. Returns `false` when the search reached its limit.
    fn extend(&mut self, rest: &[u8], at: usize) -> bool {
        if self.nodes_left == 0 {
            return false;
        }
        self.nodes_left -= 1;
        let Some((&label, rest)) = rest.split_first() else {
            self.finish();
            return true;
        };
        let (neighbours, others): (Vec<usize>, Vec<usize>) = (0..self.map.labels.len())
            .filter(|&vertex| self.map.labels[vertex] == label)
            .partition(|vertex| self.map.neighbours[at].contains(vertex));
        if !neighbours.into_iter().all(|next| self.extend(rest, next))
            || !others.into_iter().all(|next| self.extend_over_new_edge(rest, at, next))
        {
            return false;
        }
        if self.map.labels.len() == self.most_vertices {
            return true;
        }
        let next = self.map.add_vertex(label);
        let is_complete = self.extend_over_new_edge(rest, at, next);
        self.map.remove_last_vertex();
        is_complete
    }

    /// Adds an edge, explains the rest of the walk from its end if the map is still possible, and removes the edge.
    fn extend_over_new_edge(&mut self, rest: &[u8], at: usize, next: usize) -> bool {
        self.map.add_edge(at, next);
        let is_complete = !self.is_possible(at, next) || self.extend(rest, next);
        self.map.remove_edge(at, next);
        is_complete
    }

    /// Whether the environment has all n-grams that lead over an edge, and no map with fewer edges is known.
    fn is_possible(&self, a: usize, b: usize) -> bool {
        if self.found.first().is_some_and(|known| known.graph.edges().len() < self.map.edges) {
            return false;
        }
        (1..self.length).all(|before| {
            let after = self.length - before;
            let ends = self.map.strings(b, after, false);
            let starts = self.map.strings(a, before, true);
            starts
                .iter()
                .all(|start| ends.iter().all(|end| self.ngrams.contains(&(start << (LABEL_BITS * after as u32) | end))))
        })
    }

    /// Takes a map that explains the walk, if it has all n-grams.
    fn finish(&mut self) {
        let map = self.map.finished();
        if map.ngrams(self.length) == *self.ngrams {
            let fewest = self.found.first().map(|known| known.graph.edges().len());
            if fewest.is_some_and(|fewest| self.map.edges < fewest) {
                self.found.clear();
            }
            if self.found.len() < 2 && self.found.iter().all(|known| !known.is_isomorphic_to(&map)) {
                self.found.push(map);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labelled(labels: &[u8], edges: &[(usize, usize)]) -> LabelledGraph {
        LabelledGraph { labels: labels.to_vec(), graph: Graph::from_edges(labels.len(), edges.iter().copied()) }
    }

    #[test]
    fn n_grams_are_the_label_strings_of_all_walks() {
        let path = labelled(&[1, 2, 3], &[(0, 1), (1, 2)]);
        let string = |labels: &[u8]| labels.iter().fold(0, |string, &label| string << LABEL_BITS | u64::from(label));
        let expected = [[1, 2, 1], [1, 2, 3], [2, 1, 2], [2, 3, 2], [3, 2, 1], [3, 2, 3]];
        assert_eq!(path.ngrams(3), expected.iter().map(|labels| string(labels)).collect());
    }

    #[test]
    fn every_smallest_map_is_found_once() {
        // Two places 0 with a neighbour 1 between them are one place, for 2-grams.
        let (found, _) = smallest_maps(&[0, 1, 0], &labelled(&[0, 1], &[(0, 1)]).ngrams(2), 2, 3, 1000);
        assert_eq!(found, Found::One(labelled(&[0, 1], &[(0, 1)])));
        let ring = labelled(&[0, 1, 2, 1], &[(0, 1), (1, 2), (2, 3), (0, 3)]);
        let (found, _) = smallest_maps(&[0, 1, 2, 1, 0], &ring.ngrams(4), 4, 4, 1000);
        assert_eq!(found, Found::One(labelled(&[0, 1, 2], &[(0, 1), (1, 2)])));
    }

    #[test]
    fn a_search_ends_at_its_limit() {
        let ring = labelled(&[0, 1, 2, 1], &[(0, 1), (1, 2), (2, 3), (0, 3)]);
        assert_eq!(smallest_maps(&[0, 1, 2, 1, 0], &ring.ngrams(4), 4, 4, 3), (Found::Ended, 3));
    }
}
