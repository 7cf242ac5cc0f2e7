//! Whether a map with ways is the part of a building that was driven: the same darts in the same order.

use toposlam::{DartId, Darts};
use toposlam_sim::world::TrueMap;

/// The driven ways of a map: for each dart the next one of its vertex, counter-clockwise, and the other end of its edge.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RotationSystem {
    next: Vec<usize>,
    partner: Vec<usize>,
    /// The number of vertices, those without a driven way included.
    vertices: usize,
}

impl RotationSystem {
    /// The driven ways of the map of a filter; frontiers are left out.
    pub fn of_map(darts: Darts<'_>) -> Self {
        let mut number = vec![None; darts.darts().len()];
        let mut system = Self { vertices: darts.vertices().len(), ..Self::default() };
        for vertex in darts.vertices() {
            let driven: Vec<DartId> = darts.ways(vertex).filter(|&way| darts.partner(way).is_some()).collect();
            let first = system.next.len();
            for (position, dart) in driven.iter().enumerate() {
                number[dart.index()] = Some(first + position);
                system.next.push(first + (position + 1) % driven.len());
            }
        }
        system.partner = vec![0; system.next.len()];
        for dart in darts.darts() {
            let partner = darts.partner(dart).and_then(|partner| number[partner.index()]);
            if let (Some(dart), Some(partner)) = (number[dart.index()], partner) {
                system.partner[dart] = partner;
            }
        }
        system
    }

    /// The driven edges of a true map.
    pub fn of_truth(truth: &TrueMap, is_driven: &[bool]) -> Self {
        let mut system = Self::default();
        let mut number = vec![[0; 2]; truth.edges.len()];
        for node in 0..truth.nodes.len() {
            let driven: Vec<_> = truth.ways(node).into_iter().filter(|way| is_driven[way.edge]).collect();
            let first = system.next.len();
            for (position, way) in driven.iter().enumerate() {
                number[way.edge][usize::from(way.is_reversed)] = first + position;
                system.next.push(first + (position + 1) % driven.len());
            }
            system.vertices += usize::from(!driven.is_empty());
        }
        system.partner = vec![0; system.next.len()];
        for ([one, other], _) in number.into_iter().zip(is_driven).filter(|(_, is_driven)| **is_driven) {
            system.partner[one] = other;
            system.partner[other] = one;
        }
        system.vertices = system.vertices.max(1);
        system
    }

    /// Whether a renumbering of the darts maps one system to the other. Both must be connected. Time O(D²).
    pub fn is_isomorphic_to(&self, other: &Self) -> bool {
        let darts = self.next.len();
        darts == other.next.len()
            && self.vertices == other.vertices
            && (darts == 0 || (0..darts).any(|image| self.maps_to(other, image)))
    }

    /// Whether the renumbering that maps dart 0 to `image` is an isomorphism of connected systems.
    fn maps_to(&self, other: &Self, image: usize) -> bool {
        let mut images = vec![None; self.next.len()];
        let mut open = vec![(0, image)];
        while let Some((dart, image)) = open.pop() {
            match images[dart] {
                None => {
                    images[dart] = Some(image);
                    open.push((self.next[dart], other.next[image]));
                    open.push((self.partner[dart], other.partner[image]));
                }
                Some(known) if known != image => return false,
                Some(_) => {}
            }
        }
        images.iter().all(Option::is_some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toposlam::DartMap;

    /// A map from the numbers of ways of its vertices and the edges between ways, both numbered from 0 in order.
    fn system(ways: &[u16], edges: &[(u8, u8)]) -> RotationSystem {
        let mut map = DartMap::<8, 24>::EMPTY;
        for &count in ways {
            let vertex = map.add_vertex().unwrap();
            (0..count).for_each(|way| {
                map.add_way(vertex, way * 8000).unwrap();
            });
        }
        edges.iter().for_each(|&(one, other)| map.join(one, other));
        RotationSystem::of_map(map.view())
    }

    #[test]
    fn maps_that_differ_in_their_numbering_only_are_isomorphic() {
        let one = system(&[3, 1, 1, 1], &[(0, 3), (1, 4), (2, 5)]);
        let other = system(&[1, 1, 3, 1], &[(0, 4), (1, 2), (3, 5)]);
        assert!(one.is_isomorphic_to(&other));
    }

    #[test]
    fn the_order_of_the_ways_counts() {
        // A junction with a loop and two different ends: the loop is beside itself, or around one of the ends.
        let beside = system(&[4, 2, 1, 1], &[(0, 1), (2, 4), (5, 7), (3, 6)]);
        let around = system(&[4, 2, 1, 1], &[(0, 2), (1, 4), (5, 7), (3, 6)]);
        assert!(beside.is_isomorphic_to(&beside) && !beside.is_isomorphic_to(&around));
    }

    #[test]
    fn frontiers_do_not_count_but_edges_do() {
        let with_frontier = system(&[3, 1], &[(0, 3)]);
        assert!(with_frontier.is_isomorphic_to(&system(&[1, 1], &[(0, 1)])));
        assert!(!with_frontier.is_isomorphic_to(&system(&[2, 1, 1], &[(0, 2), (1, 3)])));
    }

    #[test]
    fn the_true_map_is_isomorphic_to_itself_only() {
        let truth = |name| TrueMap::of(&toposlam_sim::world::Plan::built_in(name).unwrap()).unwrap();
        let (office, ring) = (truth("office"), truth("ring"));
        let whole = |map: &TrueMap| RotationSystem::of_truth(map, &vec![true; map.edges.len()]);
        assert!(whole(&office).is_isomorphic_to(&whole(&office)));
        assert!(!whole(&office).is_isomorphic_to(&whole(&ring)));
    }
}
