//! The smallest equivalent of the traversed part of an environment: the best map that labels alone can give.

use super::{environment::Environment, graph::Graph};
use std::collections::{BTreeMap, BTreeSet};

/// The traversed part of an environment, with places merged that no walk can distinguish.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SmallestEquivalent {
    /// One vertex for each class of places, and an edge for each traversed corridor between two classes. Two neighbours
    /// of one class give a self-loop.
    pub graph: Graph,
    /// The class of every place of the environment; `None` for a place that was not visited.
    pub class_of_place: Vec<Option<usize>>,
}

impl SmallestEquivalent {
    /// The smallest equivalent of the part of an environment that a walk traversed.
    ///
    /// Places start in one class when their labels are equal (same mean and standard deviation), and classes are split
    /// until all places of a class have the same *set* of neighbour classes. Classes are numbered by their first place.
    ///
    /// # Panics
    /// When the walk visits a place that the environment does not have.
    pub fn of_traversed(environment: &Environment, walk: &[usize]) -> Self {
        let mut traversed = Graph::new(environment.places().len());
        for step in walk.windows(2) {
            traversed.add_edge(step[0], step[1]);
        }
        Self::of_part(environment, &traversed, &walk.iter().copied().collect())
    }

    /// The smallest equivalent of a whole environment.
    pub fn of_environment(environment: &Environment) -> Self {
        Self::of_part(environment, environment.graph(), &(0..environment.places().len()).collect())
    }

    fn of_part(environment: &Environment, traversed: &Graph, visited: &BTreeSet<usize>) -> Self {
        let neighbours = traversed.neighbours();

        let mut classes = number(visited, |place| {
            let label = environment.places()[place];
            (label.mean_mm.to_bits(), label.sd_mm.to_bits())
        });
        loop {
            let refined = number(visited, |place| {
                let around: BTreeSet<usize> = neighbours[place].iter().map(|next| classes[next]).collect();
                (classes[&place], around)
            });
            // A refinement never merges, so an equal number of classes is the same partition.
            if class_count(&refined) == class_count(&classes) {
                break;
            }
            classes = refined;
        }

        let edges = traversed.edges().iter().map(|(a, b)| (classes[a], classes[b]));
        Self {
            graph: Graph::from_edges(class_count(&classes), edges),
            class_of_place: (0..environment.places().len()).map(|place| classes.get(&place).copied()).collect(),
        }
    }
}

/// Numbers the places from 0 on so that equal keys get equal numbers, in order of first appearance.
fn number<K: Ord>(visited: &BTreeSet<usize>, key: impl Fn(usize) -> K) -> BTreeMap<usize, usize> {
    let mut numbers = BTreeMap::new();
    let mut classes = BTreeMap::new();
    for &place in visited {
        let next = numbers.len();
        classes.insert(place, *numbers.entry(key(place)).or_insert(next));
    }
    classes
}

fn class_count(classes: &BTreeMap<usize, usize>) -> usize {
    classes.values().max().map_or(0, |last| last + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::Place;

    fn environment(means_mm: &[f64], edges: &[[u32; 2]]) -> Environment {
        let places = (0..).zip(means_mm).map(|(id, &mean_mm)| Place { id, mean_mm, sd_mm: 10.0 }).collect();
        Environment::new("test".into(), places, edges).unwrap()
    }

    #[test]
    fn a_ring_of_four_look_alikes_is_one_vertex_with_a_self_loop() {
        let ring = environment(&[900.0; 4], &[[0, 1], [1, 2], [2, 3], [3, 0]]);
        let smallest = SmallestEquivalent::of_traversed(&ring, &[0, 1, 2, 3, 0]);
        assert_eq!(smallest.graph, Graph::from_edges(1, [(0, 0)]));
        assert_eq!(smallest.class_of_place, [Some(0); 4]);
    }

    #[test]
    fn look_alikes_with_different_neighbours_stay_distinct() {
        // A1-B-A2-C: the two A differ because only one of them is next to C.
        let line = environment(&[900.0, 1500.0, 900.0, 2000.0], &[[0, 1], [1, 2], [2, 3]]);
        let smallest = SmallestEquivalent::of_traversed(&line, &[0, 1, 2, 3]);
        assert_eq!(&smallest.graph, line.graph());
    }

    #[test]
    fn a_distant_difference_distinguishes_the_places_of_a_corridor() {
        let corridor = environment(&[900.0, 900.0, 900.0, 900.0, 2000.0], &[[0, 1], [1, 2], [2, 3], [3, 4]]);
        let smallest = SmallestEquivalent::of_traversed(&corridor, &[0, 1, 2, 3, 4]);
        assert_eq!(&smallest.graph, corridor.graph());
    }

    #[test]
    fn untraversed_parts_are_ignored() {
        let ring = environment(&[900.0, 1500.0, 900.0, 2000.0], &[[0, 1], [1, 2], [2, 3], [3, 0]]);
        let smallest = SmallestEquivalent::of_traversed(&ring, &[0, 1, 2]);
        assert_eq!(smallest.graph, Graph::from_edges(2, [(0, 1)]));
        assert_eq!(smallest.class_of_place, [Some(0), Some(1), Some(0), None]);
    }

    #[test]
    fn a_whole_environment_has_the_equivalent_of_an_exhaustive_walk() {
        let ring = environment(&[900.0, 1500.0, 900.0, 2000.0], &[[0, 1], [1, 2], [2, 3], [3, 0]]);
        let whole = SmallestEquivalent::of_environment(&ring);
        assert_eq!(whole, SmallestEquivalent::of_traversed(&ring, &[0, 1, 2, 3, 0]));
        assert_eq!(whole.graph.vertex_count(), 3);
    }

    #[test]
    fn equal_means_with_different_deviations_are_different_labels() {
        let places = [(1, 10.0), (2, 20.0)].map(|(id, sd_mm)| Place { id, mean_mm: 900.0, sd_mm }).to_vec();
        let pair = Environment::new("test".into(), places, &[[1, 2]]).unwrap();
        assert_eq!(SmallestEquivalent::of_traversed(&pair, &[0, 1]).graph.vertex_count(), 2);
    }
}
