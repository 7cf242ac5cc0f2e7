//! A rotation system: the ways of each vertex in counter-clockwise order, and what its maps are compared by.

use std::collections::{BTreeMap, VecDeque};
use toposlam::Darts;
use toposlam_sim::world::TrueMap;

/// The ways of each vertex in counter-clockwise order.
///
/// One end of an edge is a *dart*: edge `e` has the darts `2 e` and `2 e + 1`. Loops and parallel edges are possible.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RotationSystem {
    ways: Vec<Vec<usize>>,
    /// The vertex of each dart and its position among the ways there.
    place: Vec<(usize, usize)>,
}

/// The other dart of an edge.
pub const fn partner(dart: usize) -> usize {
    dart ^ 1
}

impl RotationSystem {
    /// A rotation system from the darts of each vertex in counter-clockwise order.
    ///
    /// # Panics
    /// When the ways do not hold each dart `0..n` of an even number `n` once.
    pub fn new(ways: Vec<Vec<usize>>) -> Self {
        let count = ways.iter().map(Vec::len).sum();
        let mut place = vec![None; count];
        for (vertex, ways) in ways.iter().enumerate() {
            for (position, &dart) in ways.iter().enumerate() {
                assert!(place[dart].replace((vertex, position)).is_none(), "dart {dart} is one way of one vertex");
            }
        }
        assert!(count.is_multiple_of(2), "an edge has two darts");
        Self { ways, place: place.into_iter().flatten().collect() }
    }

    /// The number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.ways.len()
    }

    /// The number of darts, two for each edge.
    pub fn dart_count(&self) -> usize {
        self.place.len()
    }

    /// The ways of a vertex, counter-clockwise.
    ///
    /// # Panics
    /// When there is no such vertex.
    pub fn ways(&self, vertex: usize) -> &[usize] {
        &self.ways[vertex]
    }

    /// The vertex of a dart.
    ///
    /// # Panics
    /// When there is no such dart.
    pub fn vertex(&self, dart: usize) -> usize {
        self.place[dart].0
    }

    /// The next way of the same vertex, counter-clockwise.
    ///
    /// # Panics
    /// When there is no such dart.
    pub fn next_way(&self, dart: usize) -> usize {
        let (vertex, position) = self.place[dart];
        let ways = &self.ways[vertex];
        ways[(position + 1) % ways.len()]
    }

    /// The genus of a connected system after Euler: 0 if it can be drawn in the plane.
    pub fn genus(&self) -> usize {
        let mut passed = vec![false; self.dart_count()];
        let mut faces = self.ways.iter().filter(|ways| ways.is_empty()).count();
        for start in 0..self.dart_count() {
            faces += usize::from(!passed[start]);
            let mut dart = start;
            while !std::mem::replace(&mut passed[dart], true) {
                dart = self.next_way(partner(dart));
            }
        }
        (2 + self.dart_count() / 2).saturating_sub(self.vertex_count() + faces) / 2
    }

    /// The part with the edges for which `keep` holds, and the vertices in `vertices`, which are numbered in this order. The
    /// kept edges are numbered in ascending order.
    ///
    /// # Panics
    /// When a kept edge ends at a vertex that is not in `vertices`.
    pub fn part(&self, vertices: &[usize], keep: impl Fn(usize) -> bool) -> Self {
        let kept = (0..self.dart_count() / 2).filter(|&edge| keep(edge));
        let number: BTreeMap<usize, usize> = kept.enumerate().map(|(number, edge)| (edge, number)).collect();
        let renumbered = |&dart: &usize| number.get(&(dart / 2)).map(|edge| 2 * edge + dart % 2);
        Self::new(vertices.iter().map(|&vertex| self.ways[vertex].iter().filter_map(renumbered).collect()).collect())
    }

    /// Whether a connected system equals another one up to the numbers of vertices and darts: the same edges, and the same cyclic
    /// order of the ways at every vertex.
    pub fn is_isomorphic_to(&self, other: &Self) -> bool {
        self.vertex_count() == other.vertex_count()
            && self.dart_count() == other.dart_count()
            && (self.dart_count() == 0 || (0..other.dart_count()).any(|way| self.follows(other, None, 0, way)))
    }

    /// Whether a connected system equals another one up to the numbers of the darts, when vertex `v` of this one is vertex
    /// `image[v]` of the other: the same edges, and the same cyclic order of the ways at every vertex.
    pub fn equals(&self, other: &Self, image: &[usize]) -> bool {
        if self.vertex_count() != other.vertex_count() || self.dart_count() != other.dart_count() {
            return false;
        }
        // One pair of darts determines all others.
        let Some(root) = (self.dart_count() > 0).then_some(0) else { return true };
        let candidates = image.get(self.vertex(root)).and_then(|&vertex| other.ways.get(vertex));
        candidates.is_some_and(|ways| ways.iter().any(|&way| self.follows(other, Some(image), root, way)))
    }

    /// Whether the systems are equal with dart `root` of this one as dart `way` of the other, and with the images of the vertices
    /// if they are given.
    fn follows(&self, other: &Self, image: Option<&[usize]>, root: usize, way: usize) -> bool {
        let mut dart_of = vec![None; self.dart_count()];
        let mut is_taken = vec![false; other.dart_count()];
        let mut open = VecDeque::from([(root, way)]);
        while let Some((dart, way)) = open.pop_front() {
            match dart_of[dart] {
                Some(known) if known == way => continue,
                Some(_) => return false,
                None => {}
            }
            let (here, there) = (self.vertex(dart), other.vertex(way));
            let is_image = image.is_none_or(|image| image[here] == there);
            if is_taken[way] || !is_image || self.ways[here].len() != other.ways[there].len() {
                return false;
            }
            dart_of[dart] = Some(way);
            is_taken[way] = true;
            open.extend([(partner(dart), partner(way)), (self.next_way(dart), other.next_way(way))]);
        }
        dart_of.iter().all(Option::is_some)
    }
}

/// The true map of a building. Edge `e` has the darts `2 e` at its first node and `2 e + 1` at its second.
impl From<&TrueMap> for RotationSystem {
    fn from(map: &TrueMap) -> Self {
        let darts = |node| map.ways(node).iter().map(|way| 2 * way.edge + usize::from(way.is_reversed)).collect();
        Self::new((0..map.nodes.len()).map(darts).collect())
    }
}

/// The edges of a map in the order of its ways. Frontiers are left out.
impl From<Darts<'_>> for RotationSystem {
    fn from(map: Darts<'_>) -> Self {
        let mut number = BTreeMap::new();
        for (edge, (first, second)) in map.edges().enumerate() {
            number.extend([(first, 2 * edge), (second, 2 * edge + 1)]);
        }
        let ways = |vertex| map.ways(vertex).filter_map(|dart| number.get(&dart).copied()).collect();
        Self::new(map.vertices().map(ways).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::seq::SliceRandom;
    use toposlam_sim::world::{Limits, Plan};

    #[test]
    fn isomorphic_systems_differ_in_their_numbers_only() {
        let system = |ways: &[&[usize]]| RotationSystem::new(ways.iter().map(|ways| ways.to_vec()).collect());
        // A junction with a loop and two corridors of different ends: the loop is beside itself, or around one of the ends.
        let beside = system(&[&[0, 1, 2, 4], &[3, 6], &[7], &[5]]);
        let around = system(&[&[0, 2, 1, 4], &[3, 6], &[7], &[5]]);
        assert!(!beside.is_isomorphic_to(&around));
        assert!(beside.is_isomorphic_to(&system(&[&[4], &[5, 2], &[3, 0, 6, 7], &[1]])));
    }

    #[test]
    fn a_building_is_isomorphic_to_itself_only() {
        let system = |name| RotationSystem::from(&*Plan::built_in(name).unwrap().true_map(&Limits::default()).unwrap());
        let (office, ring) = (system("office"), system("ring"));
        assert!(office.is_isomorphic_to(&office) && !office.is_isomorphic_to(&ring));
        assert_eq!((office.genus(), ring.genus()), (0, 0));
    }

    /// Two vertices, two parallel edges, a loop at vertex 0 and a dead end at vertex 1.
    fn small() -> RotationSystem {
        RotationSystem::new(vec![vec![0, 4, 5, 2], vec![3, 6, 1], vec![7]])
    }

    #[test]
    fn the_genus_counts_faces() {
        assert_eq!(small().genus(), 0);
        // The ends of the loop alternate with the other ways: a torus.
        assert_eq!(RotationSystem::new(vec![vec![0, 4, 2, 5], vec![3, 6, 1], vec![7]]).genus(), 1);
        assert_eq!(RotationSystem::new(vec![vec![]]).genus(), 0);
    }

    #[test]
    fn renumbered_darts_and_vertices_are_equal() {
        // The edges in another order, the vertices reversed, and the lists of ways rotated.
        let other = RotationSystem::new(vec![vec![0], vec![2, 5, 1], vec![4, 3, 7, 6]]);
        assert!(small().equals(&other, &[2, 1, 0]));
        assert!(!small().equals(&other, &[0, 1, 2]));
    }

    #[test]
    fn a_multigraph_equals_itself_under_any_numbering_but_not_with_an_edge_less() {
        let family: crate::family::Family = "4,20,8,24,2-3,3-6,0.03,multigraph".parse().unwrap();
        let mut rng = crate::walk::path_rng(4, 0);
        for index in 0..family.count {
            let environment = family.environment(index).unwrap();
            let system = environment.rotation().unwrap();
            let mut shuffled = |count: usize| {
                let mut numbers: Vec<usize> = (0..count).collect();
                numbers.shuffle(&mut rng);
                numbers
            };
            let (image, edges) = (shuffled(system.vertex_count()), shuffled(system.dart_count() / 2));
            let mut ways = vec![Vec::new(); system.vertex_count()];
            for (vertex, &renumbered) in image.iter().enumerate() {
                // Every second edge has its darts exchanged.
                let dart = |&dart: &usize| 2 * edges[dart / 2] + (dart + edges[dart / 2]) % 2;
                ways[renumbered] = system.ways(vertex).iter().map(dart).collect();
                ways[renumbered].rotate_left(edges[0] % system.ways(vertex).len());
            }
            let renumbered = RotationSystem::new(ways);
            assert!(system.equals(&renumbered, &image));
            let all: Vec<usize> = (0..system.vertex_count()).collect();
            assert!(!system.equals(&renumbered.part(&all, |edge| edge > 0), &image));
            let mut other = image.clone();
            other.swap(0, 1);
            assert!(!system.equals(&renumbered, &other) || environment.neighbours()[0] == environment.neighbours()[1]);
        }
    }

    #[test]
    fn another_order_of_the_ways_or_another_edge_is_not_equal() {
        let same = [0, 1, 2];
        // The dead end lies on the other side of the parallel edges, and the loop between them.
        assert!(!small().equals(&RotationSystem::new(vec![vec![0, 2, 4, 5], vec![3, 6, 1], vec![7]]), &same));
        // The loop is at vertex 1.
        assert!(!small().equals(&RotationSystem::new(vec![vec![0, 2], vec![3, 4, 5, 6, 1], vec![7]]), &same));
        // An edge is missing.
        assert!(!small().equals(&RotationSystem::new(vec![vec![0, 2], vec![3, 4, 1], vec![5]]), &same));
    }

    #[test]
    fn a_map_has_the_edges_but_not_the_frontiers() {
        let mut map = toposlam::DartMap::<4, 16>::EMPTY;
        let vertices = [0; 3].map(|_| map.add_vertex().unwrap());
        let [a, b, frontier, c, d] =
            [0, 10_000, 20_000, 30_000, 40_000].map(|bearing| map.add_way(0, bearing).unwrap());
        let [e, f, g] = [0, 20_000, 40_000].map(|bearing| map.add_way(1, bearing).unwrap());
        let h = map.add_way(vertices[2], 0).unwrap();
        [(a, g), (b, c), (d, e), (f, h)].into_iter().for_each(|(one, other)| map.join(one, other));
        assert_eq!(map.partner(frontier), None);
        assert!(small().equals(&RotationSystem::from(map.view()), &[0, 1, 2]));
    }

    #[test]
    fn a_part_keeps_the_order_of_its_ways() {
        let part = small().part(&[1, 0], |edge| edge < 3);
        assert_eq!(part, RotationSystem::new(vec![vec![3, 1], vec![0, 4, 5, 2]]));
    }
}
