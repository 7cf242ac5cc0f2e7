//! The edge-ordered map: at each vertex the ways in counter-clockwise order, and which two of them an edge joins.
//!
//! One way of one vertex is a *dart*. The partner of a dart is the other end of its edge; a dart without partner is a
//! *frontier*, a way that was not driven.

use super::dart::{Bearing, Dart, Darts, NONE, VertexWays, WAYS_MAX};

/// An edge-ordered map of at most `V` vertices (`V` ≤ 64) and `D` darts (`D` ≤ 254); vertices and darts are numbered from 0
/// in the order in which they were added. Loops and parallel edges are ordinary edges.
///
/// Memory: 8 bytes a vertex and 8 bytes a dart.
#[derive(Debug, PartialEq, Eq)]
pub struct DartMap<const V: usize, const D: usize> {
    vertices: u8,
    darts: u8,
    ways: [VertexWays; V],
    dart: [Dart; D],
}

impl<const V: usize, const D: usize> Clone for DartMap<V, D> {
    fn clone(&self) -> Self {
        Self { ..*self }
    }

    /// In place: a map is too large for a temporary on the stack of a microcontroller.
    fn clone_from(&mut self, source: &Self) {
        self.vertices = source.vertices;
        self.darts = source.darts;
        self.ways = source.ways;
        self.dart = source.dart;
    }
}

impl<const V: usize, const D: usize> DartMap<V, D> {
    /// The map without any vertex.
    pub const EMPTY: Self = {
        assert!(V >= 1 && V <= 64, "a map holds 1 to 64 vertices");
        assert!(D >= 2 && D <= 254, "a map holds 2 to 254 darts");
        Self { vertices: 0, darts: 0, ways: [VertexWays::NONE; V], dart: [Dart::ZERO; D] }
    };

    /// Removes all vertices and darts. Cost: O(V).
    pub fn clear(&mut self) {
        self.vertices = 0;
        self.darts = 0;
        self.ways.fill(VertexWays::NONE);
    }

    /// Takes over a map with other vertex numbers: `number` gives the new number of each vertex. Darts keep their numbers.
    pub(crate) fn renumber_from(&mut self, other: &Self, number: impl Fn(u8) -> u8) {
        self.clone_from(other);
        for (vertex, ways) in (0..other.vertices).zip(&other.ways) {
            if let Some(slot) = self.ways.get_mut(usize::from(number(vertex))) {
                *slot = *ways;
            }
        }
        self.dart.iter_mut().take(self.darts.into()).for_each(|dart| dart.vertex = number(dart.vertex));
    }

    /// The fields of a way as they are in a snapshot: its partner, bearing, visits, timed passages and travel time.
    #[cfg(feature = "snapshot")]
    pub(crate) fn fields(&self, dart: u8) -> (u8, Bearing, u8, u8, u16) {
        let Dart { partner, bearing, seen, timed, ln_travel, .. } = self.get(dart);
        (partner, bearing, seen, timed, ln_travel)
    }

    /// Starts a map of `darts` ways from the fields of a snapshot: [`DartMap::append_way`] follows for each of them.
    #[cfg(feature = "snapshot")]
    pub(crate) fn start_with(&mut self, darts: u8) {
        self.clear();
        self.darts = darts;
        self.dart.fill(Dart::NONE);
    }

    /// Appends a way with its number and fields to the ways of a vertex; `None` when the number is taken or there is no room.
    #[cfg(feature = "snapshot")]
    pub(crate) fn append_way(
        &mut self,
        vertex: u8,
        dart: u8,
        (partner, bearing, seen, timed, ln_travel): (u8, Bearing, u8, u8, u16),
    ) -> Option<()> {
        let ways = self.ways.get_mut(usize::from(vertex))?;
        let way = ways.darts.get_mut(usize::from(ways.count))?;
        let slot = self.dart.get_mut(usize::from(dart)).filter(|slot| dart < self.darts && slot.vertex == NONE)?;
        *slot = Dart { vertex, partner, bearing, seen, timed, ln_travel };
        *way = dart;
        ways.count += 1;
        Some(())
    }

    /// Whether every way has a vertex, the ways of every vertex are in order, and two ways that an edge joins name each other.
    #[cfg(feature = "snapshot")]
    pub(crate) fn is_consistent(&self) -> bool {
        let is_joined = |dart: u8| match self.get(dart) {
            Dart { vertex: NONE, .. } => false,
            Dart { partner: NONE, .. } => true,
            Dart { partner, .. } => partner != dart && self.get(partner).partner == dart,
        };
        let in_order = |vertex| self.ways(vertex).is_sorted_by_key(|&way| self.bearing(way));
        (0..self.darts).all(is_joined) && (0..self.vertices).all(in_order)
    }

    /// Read access with typed numbers.
    pub fn view(&self) -> Darts<'_> {
        Darts::new(
            self.ways.get(..usize::from(self.vertices)).unwrap_or(&[]),
            self.dart.get(..usize::from(self.darts)).unwrap_or(&[]),
        )
    }

    /// How many vertices the map has.
    pub const fn vertices(&self) -> u8 {
        self.vertices
    }

    /// How many darts the map has.
    pub const fn darts(&self) -> u8 {
        self.darts
    }

    fn get(&self, dart: u8) -> Dart {
        self.dart.get(usize::from(dart)).copied().unwrap_or(Dart::NONE)
    }

    /// The ways of a vertex in counter-clockwise order; empty for a vertex the map does not have.
    pub fn ways(&self, vertex: u8) -> &[u8] {
        self.ways.get(usize::from(vertex)).and_then(|ways| ways.darts.get(..usize::from(ways.count))).unwrap_or(&[])
    }

    /// The vertex of a dart; 255 for a dart the map does not have.
    pub fn vertex(&self, dart: u8) -> u8 {
        self.get(dart).vertex
    }

    /// The other end of the edge of a dart; `None` for a frontier.
    pub fn partner(&self, dart: u8) -> Option<u8> {
        Some(self.get(dart).partner).filter(|&partner| partner != NONE)
    }

    /// The mean bearing of a dart in the frame of its vertex.
    pub fn bearing(&self, dart: u8) -> Bearing {
        self.get(dart).bearing
    }

    /// At how many visits a way was seen or driven; saturates.
    pub(crate) fn seen(&self, dart: u8) -> u8 {
        self.get(dart).seen
    }

    /// How many passages of an edge have a travel time, and the mean of the logarithms in units of 2⁻¹².
    pub(crate) fn travel(&self, dart: u8) -> (u8, u16) {
        let holder = self.get(self.holder(dart));
        (holder.timed, holder.ln_travel)
    }

    fn holder(&self, dart: u8) -> u8 {
        dart.min(self.get(dart).partner)
    }

    /// Every frontier, in the order of their numbers.
    pub fn frontiers(&self) -> impl Iterator<Item = u8> + '_ {
        (0..self.darts).filter(|&dart| self.get(dart).partner == NONE)
    }

    /// Every edge once, as the numbers of its two darts with the smaller first.
    pub fn edges(&self) -> impl Iterator<Item = (u8, u8)> + '_ {
        (0..self.darts).filter_map(|dart| self.partner(dart).filter(|&other| dart < other).map(|other| (dart, other)))
    }

    /// Adds a vertex without ways; `None` when there is no room.
    pub fn add_vertex(&mut self) -> Option<u8> {
        let vertex = self.vertices;
        *self.ways.get_mut(usize::from(vertex))? = VertexWays::NONE;
        self.vertices += 1;
        Some(vertex)
    }

    /// Adds a way with a bearing to a vertex, at its place in the counter-clockwise order; `None` when there is no room.
    pub fn add_way(&mut self, vertex: u8, bearing: Bearing) -> Option<u8> {
        let dart = self.darts;
        let before = self.ways(vertex).iter().take_while(|&&way| self.bearing(way) <= bearing).count();
        let slot = self.dart.get_mut(usize::from(dart))?;
        let ways = self.ways.get_mut(usize::from(vertex)).filter(|ways| usize::from(ways.count) < WAYS_MAX)?;
        *slot = Dart { vertex, bearing, ..Dart::NONE };
        let mut moved = dart;
        for way in ways.darts.iter_mut().skip(before) {
            core::mem::swap(way, &mut moved);
        }
        ways.count += 1;
        self.darts += 1;
        Some(dart)
    }

    /// Joins two frontiers by an edge. Nothing happens unless both are frontiers and different.
    pub fn join(&mut self, a: u8, b: u8) {
        if a == b || a >= self.darts || b >= self.darts || self.partner(a).is_some() || self.partner(b).is_some() {
            return;
        }
        for (from, to) in [(a, b), (b, a)] {
            if let Some(dart) = self.dart.get_mut(usize::from(from)) {
                dart.partner = to;
                dart.timed = 0;
            }
        }
    }

    /// Takes the edge of a dart away; both its ends become frontiers.
    pub fn part(&mut self, dart: u8) {
        if let Some(partner) = self.partner(dart) {
            for end in [dart, partner] {
                if let Some(dart) = self.dart.get_mut(usize::from(end)) {
                    dart.partner = NONE;
                }
            }
        }
    }

    /// The way whose bearing is closest to one, and by how much it is off; `None` for a vertex without ways.
    pub fn nearest_way(&self, vertex: u8, bearing: Bearing) -> Option<(u8, i16)> {
        let off = |way: u8| bearing.wrapping_sub(self.bearing(way)) as i16;
        let ways = self.ways(vertex).iter().map(|&way| (way, off(way)));
        ways.min_by_key(|(_, off)| off.unsigned_abs())
    }

    /// The next way of the same vertex, counter-clockwise.
    pub fn next_way(&self, dart: u8) -> u8 {
        let ways = self.ways(self.vertex(dart));
        let position = ways.iter().position(|&way| way == dart).unwrap_or(0);
        ways.get(position + 1).or(ways.first()).copied().unwrap_or(dart)
    }

    /// Moves a way to another vertex, with its bearing there, and leaves it in the list of the first; `false` when the other has
    /// no room.
    pub(crate) fn move_way(&mut self, way: u8, vertex: u8, bearing: Bearing) -> bool {
        let Some(ways) = self.ways.get_mut(usize::from(vertex)) else { return false };
        let Some(slot) = ways.darts.get_mut(usize::from(ways.count)) else { return false };
        *slot = way;
        ways.count += 1;
        if let Some(dart) = self.dart.get_mut(usize::from(way)) {
            dart.vertex = vertex;
            dart.bearing = bearing;
        }
        self.sort_ways(vertex);
        true
    }

    /// Says which dart is the other end of one, and that one the other end of it.
    pub(crate) fn set_partner(&mut self, dart: u8, partner: u8) {
        for (from, to) in [(dart, partner), (partner, dart)] {
            if let Some(dart) = self.dart.get_mut(usize::from(from)) {
                dart.partner = to;
            }
        }
    }

    /// Counts a visit at which a way was `off` from its mean bearing; the order of the ways follows the bearings.
    pub(crate) fn see(&mut self, dart: u8, off: i16) {
        let Some(slot) = self.dart.get_mut(usize::from(dart)) else { return };
        slot.seen = slot.seen.saturating_add(1);
        let step = off / i16::from(slot.seen.min(100));
        slot.bearing = slot.bearing.wrapping_add_signed(step);
        let vertex = slot.vertex;
        if step != 0 {
            self.sort_ways(vertex);
        }
    }

    /// Takes the ways of a vertex that were never seen for seen at this many visits.
    pub(crate) fn assume_seen(&mut self, vertex: u8, visits: u8) {
        for dart in self.dart.iter_mut().take(self.darts.into()).filter(|dart| dart.vertex == vertex && dart.seen == 0)
        {
            dart.seen = visits;
        }
    }

    /// Removes the darts that `is_removed` names, which must be frontiers. Darts keep their order. Returns the new number of each,
    /// [`NONE`] for those that are gone.
    pub(crate) fn remove_frontiers(&mut self, is_removed: impl Fn(u8) -> bool) -> [u8; D] {
        let mut numbers = [NONE; D];
        let mut kept = 0;
        for (dart, number) in (0..self.darts).zip(&mut numbers) {
            if self.get(dart).partner != NONE || !is_removed(dart) {
                *number = kept;
                kept += 1;
            }
        }
        let renumbered = |dart: u8| numbers.get(usize::from(dart)).copied().unwrap_or(NONE);
        for dart in 0..self.darts {
            let mut moved = self.get(dart);
            moved.partner = renumbered(moved.partner);
            if let Some(slot) = self.dart.get_mut(usize::from(renumbered(dart))) {
                *slot = moved;
            }
        }
        for ways in self.ways.iter_mut().take(self.vertices.into()) {
            let old = core::mem::replace(ways, VertexWays::NONE);
            let left = old.as_slice().iter().map(|&dart| renumbered(dart)).filter(|&dart| dart != NONE);
            for (slot, dart) in ways.darts.iter_mut().zip(left) {
                *slot = dart;
                ways.count += 1;
            }
        }
        self.darts = kept;
        numbers
    }

    /// Corrects the mean bearing of a way.
    pub(crate) fn turn(&mut self, dart: u8, by: i16) {
        if let Some(slot) = self.dart.get_mut(usize::from(dart)) {
            slot.bearing = slot.bearing.wrapping_add_signed(by);
            let vertex = slot.vertex;
            self.sort_ways(vertex);
        }
    }

    /// Turns the frame of a vertex.
    pub(crate) fn turn_vertex(&mut self, vertex: u8, by: Bearing) {
        let Some(ways) = self.ways.get(usize::from(vertex)) else { return };
        for &way in ways.darts.iter().take(usize::from(ways.count)) {
            if let Some(dart) = self.dart.get_mut(usize::from(way)) {
                dart.bearing = dart.bearing.wrapping_add(by);
            }
        }
        self.sort_ways(vertex);
    }

    /// Counts a passage of the edge of a dart with a travel time, as a natural logarithm of ring frames in
    /// units of 2⁻¹².
    pub fn time(&mut self, dart: u8, ln_travel: u16) {
        let holder = self.holder(dart);
        let Some(slot) = self.dart.get_mut(usize::from(holder)) else { return };
        slot.timed = slot.timed.saturating_add(1);
        let off = i32::from(ln_travel) - i32::from(slot.ln_travel);
        slot.ln_travel = (i32::from(slot.ln_travel) + off / i32::from(slot.timed)) as u16;
    }

    fn sort_ways(&mut self, vertex: u8) {
        let Some(ways) = self.ways.get_mut(usize::from(vertex)) else { return };
        let bearing = |dart: u8| self.dart.get(usize::from(dart)).map_or(0, |dart| dart.bearing);
        let count = usize::from(ways.count).min(WAYS_MAX);
        for end in 1..count {
            for slot in (1..=end).rev() {
                let (Some(&before), Some(&here)) = (ways.darts.get(slot - 1), ways.darts.get(slot)) else { break };
                if bearing(before) <= bearing(here) {
                    break;
                }
                ways.darts.swap(slot - 1, slot);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Small = DartMap<8, 24>;

    #[test]
    fn ways_stay_in_order_and_full_tables_refuse() {
        let mut map = Small::EMPTY;
        let vertex = map.add_vertex().unwrap();
        for bearing in [50_000, 1_000, 30_000, 65_000, 2_000, 40_000, 3_000] {
            map.add_way(vertex, bearing).unwrap();
        }
        let bearings: Vec<u16> = map.ways(vertex).iter().map(|&way| map.bearing(way)).collect();
        assert_eq!(bearings, [1_000, 2_000, 3_000, 30_000, 40_000, 50_000, 65_000]);
        assert_eq!(map.add_way(vertex, 7), None);
        assert_eq!(map.nearest_way(vertex, 65_500), Some((3, 500)));
        assert_eq!(map.nearest_way(vertex, 200), Some((3, 736)));
        assert_eq!((map.next_way(3), map.next_way(1)), (1, 4));
        map.join(2, 5);
        let numbers = map.remove_frontiers(|dart| [0, 2, 3].contains(&dart));
        assert_eq!(&numbers[..7], [NONE, 0, 1, NONE, 2, 3, 4]);
        let bearings: Vec<u16> = map.ways(vertex).iter().map(|&way| map.bearing(way)).collect();
        assert_eq!(bearings, [1_000, 2_000, 3_000, 30_000, 40_000]);
        assert_eq!((map.partner(1), map.partner(3), map.partner(0)), (Some(3), Some(1), None));
        (1..8).for_each(|_| assert!(map.add_vertex().is_some()));
        assert_eq!(map.add_vertex(), None);
    }
}
