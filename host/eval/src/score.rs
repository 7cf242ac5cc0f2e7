//! Scores a map against the smallest equivalent of the traversed environment.

use super::{graph::Graph, rotation::RotationSystem};
use std::collections::BTreeSet;

/// The scores of one map. A map vertex represents the class at which it was mostly visited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapScore {
    /// The vertices match the classes one to one and the edges are the same.
    pub exact: bool,
    /// The map and the true graph are isomorphic, regardless of labels.
    pub isomorphic: bool,
    /// Harmonic mean of precision and recall of the pairs of classes that the map connects: `2 c / (m + t)` with `m`
    /// pairs in the map, `t` in truth and `c` in both. A class that the map holds twice does not count against it here.
    pub edge_f1: f64,
    /// The share of all steps at which the visited vertex represents the class of the robot.
    pub location: f64,
}

/// Scores a map against the truth.
///
/// `path` is the map vertex of every step, `classes` the true class of every step. When a vertex was visited at two
/// classes equally often, the lower class wins.
///
/// # Panics
/// When the path visits a vertex that the map does not have, or a class that the truth does not have.
pub fn score_map(map: &Graph, path: &[usize], truth: &Graph, classes: &[usize]) -> MapScore {
    score_map_from(map, path, truth, classes, 0)
}

/// As [`score_map`], but the location is judged from step `first` on; earlier steps only assign classes to vertices.
///
/// # Panics
/// As [`score_map`].
pub fn score_map_from(map: &Graph, path: &[usize], truth: &Graph, classes: &[usize], first: usize) -> MapScore {
    let class_of_vertex = majority_classes(map.vertex_count(), truth.vertex_count(), path, classes);
    // The image of the map's edges. A vertex that was never visited represents no class.
    let image: BTreeSet<(usize, usize)> = map
        .edges()
        .iter()
        .filter_map(|&(a, b)| Some((class_of_vertex[a]?, class_of_vertex[b]?)))
        .map(|(a, b)| (a.min(b), a.max(b)))
        .collect();
    let hit: BTreeSet<usize> = class_of_vertex.iter().copied().flatten().collect();
    // With as many vertices as classes, a match that covers every class is one to one.
    let one_to_one = map.vertex_count() == truth.vertex_count() && hit.len() == truth.vertex_count();
    let common = image.intersection(truth.edges()).count();
    let pairs = image.len() + truth.edges().len();
    let judged = path.iter().zip(classes).skip(first);
    let steps = judged.len();
    let right = judged.filter(|&(&vertex, &class)| class_of_vertex[vertex] == Some(class)).count();
    MapScore {
        exact: one_to_one && image == *truth.edges(),
        isomorphic: map.is_isomorphic_to(truth),
        edge_f1: if pairs == 0 { 1.0 } else { 2.0 * common as f64 / pairs as f64 },
        location: if steps == 0 { 0.0 } else { right as f64 / steps as f64 },
    }
}

/// Whether a map has the vertices, the edges and the order of the ways of the truth, one for each: the vertices by the class at
/// which they were mostly visited, and the edges up to their numbers. Loops and parallel edges are distinguished.
///
/// # Panics
/// As [`score_map`].
pub fn has_the_same_ways(map: &RotationSystem, path: &[usize], truth: &RotationSystem, classes: &[usize]) -> bool {
    image(map, path, truth, classes).is_some_and(|image| truth.equals(map, &image))
}

/// As [`has_the_same_ways`], without regard to the order of the ways: each edge once between the right vertices.
///
/// # Panics
/// As [`score_map`].
pub fn has_the_same_edges(map: &RotationSystem, path: &[usize], truth: &RotationSystem, classes: &[usize]) -> bool {
    let Some(image) = image(map, path, truth, classes) else { return false };
    let ends = |system: &RotationSystem, number: &dyn Fn(usize) -> usize| {
        let pair = |edge| {
            let (a, b) = (number(system.vertex(2 * edge)), number(system.vertex(2 * edge + 1)));
            (a.min(b), a.max(b))
        };
        let mut pairs: Vec<(usize, usize)> = (0..system.dart_count() / 2).map(pair).collect();
        pairs.sort_unstable();
        pairs
    };
    map.vertex_count() == truth.vertex_count() && ends(truth, &|class| image[class]) == ends(map, &|vertex| vertex)
}

/// The vertex of each class; `None` if a class has none.
fn image(map: &RotationSystem, path: &[usize], truth: &RotationSystem, classes: &[usize]) -> Option<Vec<usize>> {
    let class_of_vertex = majority_classes(map.vertex_count(), truth.vertex_count(), path, classes);
    let vertex_of = |class| class_of_vertex.iter().position(|&other| other == Some(class));
    (0..truth.vertex_count()).map(vertex_of).collect()
}

/// Whether the last vertex of a path represents the class of the robot, judged only by the path so far.
pub fn is_localised(path: &[usize], classes: &[usize]) -> bool {
    let (Some(&vertex), Some(&class)) = (path.last(), classes.last()) else { return false };
    let class_count = classes.iter().max().map_or(0, |last| last + 1);
    let visits = path.iter().zip(classes).filter(|&(&visited, _)| visited == vertex).map(|(_, &class)| class);
    most_frequent(visits, class_count) == Some(class)
}

fn majority_classes(vertices: usize, class_count: usize, path: &[usize], classes: &[usize]) -> Vec<Option<usize>> {
    let mut visited_at = vec![Vec::new(); vertices];
    for (&vertex, &class) in path.iter().zip(classes) {
        visited_at[vertex].push(class);
    }
    visited_at.into_iter().map(|visits| most_frequent(visits.into_iter(), class_count)).collect()
}

/// The most frequent class, the lowest one on a tie; `None` without visits.
fn most_frequent(visits: impl Iterator<Item = usize>, class_count: usize) -> Option<usize> {
    let mut counts = vec![0_usize; class_count];
    visits.for_each(|class| counts[class] += 1);
    let (class, &count) = counts.iter().enumerate().rev().max_by_key(|&(_, count)| count)?;
    (count > 0).then_some(class)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The truth: a triangle with a tail, 0-1-2-0 and 2-3.
    fn truth() -> Graph {
        Graph::from_edges(4, [(0, 1), (1, 2), (0, 2), (2, 3)])
    }

    const CLASSES: [usize; 8] = [0, 1, 2, 3, 2, 0, 1, 2];

    #[test]
    fn a_renumbered_truth_is_exact() {
        // 0 -> 2, 1 -> 0, 2 -> 3, 3 -> 1
        let map = Graph::from_edges(4, [(2, 0), (0, 3), (2, 3), (3, 1)]);
        let score = score_map(&map, &[2, 0, 3, 1, 3, 2, 0, 3], &truth(), &CLASSES);
        assert_eq!(score, MapScore { exact: true, isomorphic: true, edge_f1: 1.0, location: 1.0 });
    }

    #[test]
    fn one_wrong_visit_lowers_the_location_score_only() {
        let score = score_map(&truth(), &[0, 1, 2, 3, 2, 0, 1, 1], &truth(), &CLASSES);
        assert_eq!(score, MapScore { exact: true, isomorphic: true, edge_f1: 1.0, location: 7.0 / 8.0 });
    }

    #[test]
    fn a_missing_edge_is_not_exact() {
        let map = Graph::from_edges(4, [(0, 1), (1, 2), (2, 3)]);
        let score = score_map(&map, &CLASSES, &truth(), &CLASSES);
        assert_eq!(score, MapScore { exact: false, isomorphic: false, edge_f1: 6.0 / 7.0, location: 1.0 });
    }

    #[test]
    fn the_right_graph_on_the_wrong_places_is_isomorphic_but_not_exact() {
        // The tail hangs off place 0 instead of place 2.
        let map = Graph::from_edges(4, [(0, 1), (1, 2), (0, 2), (0, 3)]);
        let score = score_map(&map, &CLASSES, &truth(), &CLASSES);
        assert_eq!(score, MapScore { exact: false, isomorphic: true, edge_f1: 6.0 / 8.0, location: 1.0 });
    }

    #[test]
    fn a_duplicate_place_is_not_exact_even_when_all_its_edges_are_right() {
        // Vertex 4 is a duplicate of place 2.
        let map = Graph::from_edges(5, [(0, 1), (1, 2), (0, 2), (2, 3), (3, 4), (0, 4)]);
        let score = score_map(&map, &[0, 1, 2, 3, 4, 0, 1, 2], &truth(), &CLASSES);
        assert_eq!(score, MapScore { exact: false, isomorphic: false, edge_f1: 1.0, location: 1.0 });
    }

    #[test]
    fn two_places_in_one_vertex_are_not_exact_even_when_the_counts_agree() {
        // Vertices 0 and 3 both represent place 0; place 3 has no vertex of its own and shares that of place 2.
        let map = Graph::from_edges(4, [(0, 1), (1, 2), (2, 2), (2, 3), (1, 3)]);
        let score = score_map(&map, &[0, 1, 2, 2, 2, 3, 1, 2], &truth(), &CLASSES);
        assert!(!score.exact);
        assert_eq!(score.location, 7.0 / 8.0);
    }

    #[test]
    fn steps_before_the_first_judged_one_only_assign_classes_to_vertices() {
        let score = score_map_from(&truth(), &[0, 1, 2, 3, 2, 0, 1, 1], &truth(), &CLASSES, 6);
        assert_eq!(score, MapScore { exact: true, isomorphic: true, edge_f1: 1.0, location: 1.0 / 2.0 });
    }

    #[test]
    fn ways_are_the_same_up_to_numbers_but_not_with_an_edge_elsewhere() {
        // The triangle with a tail, and a map with other numbers of vertices and edges.
        let truth = RotationSystem::new(vec![vec![5, 0], vec![1, 2], vec![3, 6, 4], vec![7]]);
        let map = RotationSystem::new(vec![vec![2, 5], vec![6], vec![0, 3], vec![1, 4, 7]]);
        let path = [2, 0, 3, 1, 3, 2, 0, 3];
        assert!(has_the_same_ways(&map, &path, &truth, &CLASSES));
        // Another visit does not matter, but most visits.
        assert!(has_the_same_ways(&map, &[2, 0, 3, 1, 3, 2, 0, 0], &truth, &CLASSES));
        assert!(!has_the_same_ways(&map, &[0, 2, 3, 1, 3, 0, 0, 3], &truth, &CLASSES));
        // The tail is at another vertex.
        let wrong = RotationSystem::new(vec![vec![2, 5, 7], vec![6], vec![0, 3], vec![1, 4]]);
        assert!(!has_the_same_ways(&wrong, &path, &truth, &CLASSES));
        assert!(!has_the_same_edges(&wrong, &path, &truth, &CLASSES));
        // The tail leaves on the other side of the triangle.
        let mirrored = RotationSystem::new(vec![vec![2, 5], vec![6], vec![0, 3], vec![4, 1, 7]]);
        assert!(!has_the_same_ways(&mirrored, &path, &truth, &CLASSES));
        assert!(has_the_same_edges(&mirrored, &path, &truth, &CLASSES));
        // A second edge between two vertices.
        let doubled = RotationSystem::new(vec![vec![2, 5, 8], vec![6], vec![0, 9, 3], vec![1, 4, 7]]);
        assert!(!has_the_same_edges(&doubled, &path, &truth, &CLASSES));
    }

    #[test]
    fn localisation_is_judged_by_the_majority_so_far() {
        assert!(is_localised(&[0], &[3]));
        assert!(is_localised(&[0, 1, 0], &[3, 2, 3]));
        // Twice at class 3, now at class 1 in the same vertex.
        assert!(!is_localised(&[0, 1, 0, 1, 0], &[3, 2, 3, 2, 1]));
    }
}
