//! Faces, connected parts and genus of an edge-ordered map.
//!
//! A *face* is the orbit of "follow the edge, take the next way counter-clockwise"; frontiers are left out. For a connected map of V
//! vertices, E edges and F faces, V − E + F = 2 − 2 · genus (Euler), and a map that can be drawn in the plane has genus 0.

use super::darts::DartMap;
use super::{VertexId, VertexSet};

/// A set of darts by their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DartSet([u32; 8]);

impl DartSet {
    pub(crate) const EMPTY: Self = Self([0; 8]);

    pub(crate) fn contains(&self, dart: u8) -> bool {
        self.0.get(usize::from(dart / 32)).is_some_and(|word| word >> (dart % 32) & 1 == 1)
    }

    fn insert(&mut self, dart: u8) {
        if let Some(word) = self.0.get_mut(usize::from(dart / 32)) {
            *word |= 1 << (dart % 32);
        }
    }
}

impl<const V: usize, const D: usize> DartMap<V, D> {
    /// The darts that a walk around the face of a frontier passes. An edge between two frontiers of one face leaves the genus as it
    /// is. Two frontiers of parts of the map that are not connected lie in different faces. Cost: O(D).
    pub(crate) fn face_of(&self, frontier: u8) -> DartSet {
        let mut face = DartSet::EMPTY;
        let mut dart = frontier;
        for _ in 0..=2 * u16::from(self.darts()) {
            dart = self.next_way(dart);
            face.insert(dart);
            if dart == frontier {
                break;
            }
            // Along an edge the walk arrives by the partner and takes the way next to it.
            dart = self.partner(dart).unwrap_or(dart);
        }
        face
    }

    /// How many faces the map has; a vertex without edges has one. Cost: O(D).
    pub fn faces(&self) -> u16 {
        let mut passed = [false; D];
        let mut faces = 0;
        for start in 0..self.darts() {
            if self.partner(start).is_none() || passed.get(usize::from(start)).is_none_or(|&passed| passed) {
                continue;
            }
            faces += 1;
            let mut dart = start;
            while let (Some(partner), Some(passed)) =
                (self.partner(dart), passed.get_mut(usize::from(dart)).filter(|passed| !**passed))
            {
                *passed = true;
                dart = self.next_way(partner);
                while self.partner(dart).is_none() {
                    dart = self.next_way(dart);
                }
            }
        }
        let alone = |&vertex: &u8| self.ways(vertex).iter().all(|&way| self.partner(way).is_none());
        faces + (0..self.vertices()).filter(alone).count() as u16
    }

    /// The vertices that edges connect with one. Cost: O(D).
    pub(crate) fn component_of(&self, vertex: u8) -> VertexSet {
        let mut open = VertexId::new(vertex).map_or(VertexSet::EMPTY, VertexSet::from);
        let mut reached = open;
        while let Some(vertex) = open.pop_first() {
            let partners = self.ways(vertex.into()).iter().filter_map(|&way| self.partner(way));
            for next in partners.filter_map(|partner| VertexId::new(self.vertex(partner))) {
                if !reached.contains(next) {
                    reached.insert(next);
                    open.insert(next);
                }
            }
        }
        reached
    }

    /// How many parts that no edge connects the map has. Cost: O(V · D).
    pub fn components(&self) -> u8 {
        let mut component = [0_u8; V];
        for (number, slot) in (0..self.vertices()).zip(&mut component) {
            *slot = number;
        }
        let of = |component: &[u8; V], vertex: u8| component.get(usize::from(vertex)).copied().unwrap_or(0);
        let mut components = self.vertices();
        for (a, b) in self.edges() {
            let (kept, joined) = (of(&component, self.vertex(a)), of(&component, self.vertex(b)));
            if kept != joined {
                components -= 1;
                component.iter_mut().filter(|of| **of == joined).for_each(|of| *of = kept);
            }
        }
        components
    }

    /// The genus, summed over the parts of the map: 0 for a map that can be drawn in the plane as it is. Cost: O(V · D).
    pub fn genus(&self) -> u8 {
        let edges = self.edges().count() as i32;
        let euler = i32::from(self.vertices()) - edges + i32::from(self.faces());
        ((2 * i32::from(self.components()) - euler) / 2).max(0) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Small = DartMap<8, 24>;

    /// A map from the numbers of ways of its vertices and the edges between ways, both numbered from 0 in order.
    fn map(ways: &[usize], edges: &[(u8, u8)]) -> Small {
        let mut map = Small::EMPTY;
        for &count in ways {
            let vertex = map.add_vertex().unwrap();
            (0..count).for_each(|way| {
                map.add_way(vertex, (way * 8000) as u16).unwrap();
            });
        }
        edges.iter().for_each(|&(a, b)| map.join(a, b));
        map
    }

    /// The faces as orbits of a permutation, counted without any shortcut.
    fn orbits(map: &Small) -> usize {
        let driven = |vertex| -> Vec<u8> {
            map.ways(vertex).iter().copied().filter(|&way| map.partner(way).is_some()).collect()
        };
        let next = |dart: u8| {
            let arrival = map.partner(dart).unwrap();
            let around = driven(map.vertex(arrival));
            around[(around.iter().position(|&way| way == arrival).unwrap() + 1) % around.len()]
        };
        let darts: Vec<u8> = (0..map.vertices()).flat_map(driven).collect();
        let orbit = |&start: &u8| {
            let mut orbit = vec![start];
            let mut dart = next(start);
            while dart != start {
                orbit.push(dart);
                dart = next(dart);
            }
            orbit.into_iter().min()
        };
        darts.iter().filter(|&dart| orbit(dart) == Some(*dart)).count()
    }

    #[test]
    fn a_tree_has_one_face_and_a_ring_two() {
        let tree = map(&[3, 1, 1, 1], &[(0, 3), (1, 4), (2, 5)]);
        assert_eq!((tree.faces(), tree.genus()), (1, 0));
        let ring = map(&[2, 2, 2], &[(1, 2), (3, 4), (5, 0)]);
        assert_eq!((ring.faces(), ring.genus()), (2, 0));
    }

    #[test]
    fn crossed_loops_do_not_lie_in_the_plane() {
        assert_eq!(map(&[4], &[(0, 2), (1, 3)]).genus(), 1);
        assert_eq!(map(&[4], &[(0, 1), (2, 3)]).genus(), 0);
        // Three parallel edges, in opposite order at the two ends and in the same.
        assert_eq!(map(&[3, 3], &[(0, 5), (1, 4), (2, 3)]).genus(), 0);
        assert_eq!(map(&[3, 3], &[(0, 3), (1, 4), (2, 5)]).genus(), 1);
    }

    #[test]
    fn an_edge_keeps_the_genus_exactly_when_its_ends_share_a_face() {
        let mut state = 1_u32;
        let mut below = |bound: usize| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 16) as usize * bound) >> 16
        };
        let (mut same, mut other) = (0, 0);
        for _ in 0..2000 {
            let ways: Vec<usize> = (0..6).map(|_| 1 + below(4)).collect();
            let mut map = map(&ways, &[]);
            for _ in 0..12 {
                let frontiers: Vec<u8> = map.frontiers().collect();
                if frontiers.len() < 2 {
                    break;
                }
                let (a, b) = (frontiers[below(frontiers.len())], frontiers[below(frontiers.len())]);
                if a == b {
                    continue;
                }
                let (genus, components, share) = (map.genus(), map.components(), map.face_of(a).contains(b));
                assert_eq!(share, map.face_of(b).contains(a));
                let is_connected = map.component_of(map.vertex(a)).contains(VertexId::new(map.vertex(b)).unwrap());
                map.join(a, b);
                let lone = (0..map.vertices()).filter(|&v| map.ways(v).iter().all(|&way| map.partner(way).is_none()));
                assert_eq!(usize::from(map.faces()), orbits(&map) + lone.count());
                assert_eq!(is_connected, map.components() == components);
                if map.components() < components {
                    assert!(!share);
                    assert_eq!(map.genus(), genus);
                } else {
                    assert_eq!(map.genus(), genus + u8::from(!share));
                    if share { same += 1 } else { other += 1 }
                }
            }
        }
        assert!(same > 100 && other > 100);
    }
}
