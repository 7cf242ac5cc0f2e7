//! The ways of one vertex of an edge-ordered map, and how far the map is explored.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::{List, Remapped};
use crate::WAYS_MAX;
use crate::map::{DartId, Darts, VertexId};

/// The ways of one vertex in counter-clockwise order.
///
/// A way is known by its vertex and its position among the ways of that vertex. Decoding refuses ways that no map has, so that
/// the decoder counts them as an unknown message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct VertexWays {
    /// The vertex.
    pub vertex: u8,
    /// Its ways, by ascending bearing.
    pub ways: List<Way, WAYS_MAX>,
}

/// One way of a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Way {
    /// The mean bearing in milliradians, counter-clockwise, 0 to 6282. Zero is an arbitrary direction of the vertex:
    /// differences between the ways of one vertex have a meaning.
    pub bearing_mrad: u16,
    /// The other end of the edge; `None` for a frontier, a way that nobody has driven.
    pub leads_to: Option<WayId>,
    /// The mean travel time of the edge in ring frames, 1 or more; `None` if no passage has one.
    pub travel_frames: Option<u16>,
}

/// A way by its vertex and its position among the ways of that vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct WayId {
    /// The vertex, 0 to 63.
    pub vertex: u8,
    /// The position among its ways, from 0.
    pub way: u8,
}

impl VertexWays {
    /// The ways of a vertex of a map.
    pub fn of(darts: Darts<'_>, vertex: VertexId) -> Self {
        let way_id =
            |dart: DartId| Some(WayId { vertex: darts.vertex(dart)?.into(), way: darts.position(dart)? as u8 });
        let way = |dart| Way {
            bearing_mrad: ((u32::from(darts.bearing(dart).unwrap_or(0)) * 6283) >> 16) as u16,
            leads_to: darts.partner(dart).and_then(way_id),
            travel_frames: darts.travel_frames(dart),
        };
        Self { vertex: vertex.into(), ways: List::new(darts.ways(vertex).map(way)) }
    }

    fn is_possible(&self) -> bool {
        let ways = self.ways.as_slice();
        let is_way = |way: &Way| {
            way.bearing_mrad < 6283
                && way.travel_frames != Some(0)
                && (way.leads_to.is_some() || way.travel_frames.is_none())
        };
        let is_end = |(here, way): (u8, &Way)| {
            way.leads_to.is_none_or(|end| {
                let here = WayId { vertex: self.vertex, way: here };
                // A loop joins two ways of this vertex, each to the other.
                let is_loop = || ways.get(usize::from(end.way)).is_some_and(|back| back.leads_to == Some(here));
                usize::from(end.vertex) < VertexId::LIMIT
                    && usize::from(end.way) < WAYS_MAX
                    && end != here
                    && (end.vertex != self.vertex || is_loop())
            })
        };
        usize::from(self.vertex) < VertexId::LIMIT
            && ways.iter().all(is_way)
            && (0..).zip(ways).all(is_end)
            && ways.is_sorted_by_key(|way| way.bearing_mrad)
    }
}

impl Way {
    pub(in crate::wire) const NONE: Self = Self { bearing_mrad: 0, leads_to: None, travel_frames: None };

    /// The canonical bytes of a way, for the digest of a map.
    pub(in crate::wire) fn to_bytes(self) -> [u8; 6] {
        let [a, b] = self.bearing_mrad.to_le_bytes();
        let [c, d] = self.leads_to.map_or([u8::MAX; 2], |end| [end.vertex, end.way]);
        let [e, f] = self.travel_frames.unwrap_or(0).to_le_bytes();
        [a, b, c, d, e, f]
    }

    /// The same way without the other end of its edge.
    pub(in crate::wire) const fn frontier(self) -> Self {
        Self { leads_to: None, travel_frames: None, ..self }
    }

    /// The same way under the new vertex ids; a frontier if the vertex it leads to was removed.
    pub(in crate::wire) fn remapped(self, remapped: &Remapped) -> Self {
        let Some(end) = self.leads_to else { return self };
        match remapped.now(end.vertex) {
            Some(vertex) => Self { leads_to: Some(WayId { vertex, ..end }), ..self },
            None => self.frontier(),
        }
    }
}

/// The ways as received.
#[derive(Deserialize)]
struct Unchecked {
    vertex: u8,
    ways: List<Way, WAYS_MAX>,
}

impl TryFrom<Unchecked> for VertexWays {
    type Error = Impossible;

    fn try_from(Unchecked { vertex, ways }: Unchecked) -> Result<Self, Impossible> {
        let ways = Self { vertex, ways };
        if ways.is_possible() { Ok(ways) } else { Err(Impossible) }
    }
}

/// No map has these ways.
struct Impossible;

impl fmt::Display for Impossible {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("no map has these ways")
    }
}

/// How far the map is explored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Exploration {
    /// The number of frontiers of the map, ways that nobody has driven.
    pub frontiers: u8,
    /// Whether the drive reaches no frontier any more.
    pub complete: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::DartMap;

    fn way(bearing_mrad: u16, leads_to: Option<(u8, u8)>) -> Way {
        let leads_to = leads_to.map(|(vertex, way)| WayId { vertex, way });
        Way { bearing_mrad, leads_to, travel_frames: None }
    }

    fn possible(vertex: u8, ways: &[Way]) -> bool {
        VertexWays { vertex, ways: List::new(ways.iter().copied()) }.is_possible()
    }

    #[test]
    fn loops_parallel_edges_and_frontiers_are_possible() {
        assert!(possible(0, &[]));
        assert!(possible(63, &[way(0, Some((63, 1))), way(0, Some((63, 0))), way(6282, None)]));
        assert!(possible(1, &[way(3, Some((0, 6))), way(4, Some((0, 5))), way(5, None)]));
    }

    #[test]
    fn ways_that_no_map_has_are_not_possible() {
        assert!(!possible(64, &[]));
        assert!(!possible(0, &[way(6283, None)]));
        assert!(!possible(0, &[way(5, None), way(4, None)]));
        assert!(!possible(0, &[way(5, Some((64, 0)))]));
        assert!(!possible(0, &[way(5, Some((1, 7)))]));
        assert!(!possible(0, &[way(5, Some((0, 0)))]), "a way that leads to itself");
        assert!(!possible(0, &[way(5, Some((0, 1)))]), "a loop with one end");
        assert!(!possible(0, &[way(5, Some((0, 1))), way(6, None)]), "a loop with one end");
        assert!(!possible(0, &[Way { travel_frames: Some(9), ..way(5, None) }]), "a travel time to nowhere");
        assert!(!possible(0, &[Way { travel_frames: Some(0), ..way(5, Some((1, 0))) }]));
    }

    #[test]
    fn the_ways_of_a_map_are_possible_and_know_each_other() {
        let mut map = DartMap::<4, 12>::EMPTY;
        let [a, b] = [(); 2].map(|()| map.add_vertex().unwrap());
        let [.., loop_end] = [0, 16_384, 65_535].map(|bearing| map.add_way(a, bearing).unwrap());
        let stub = map.add_way(b, 32_768).unwrap();
        map.join(0, loop_end);
        map.join(1, stub);
        map.time(1, 4096);
        let ways = [a, b].map(|vertex| VertexWays::of(map.view(), VertexId::new(vertex).unwrap()));
        assert_eq!(ways[0].ways.as_slice()[0], way(0, Some((0, 2))));
        assert_eq!(ways[0].ways.as_slice()[1], Way { travel_frames: Some(2), ..way(1570, Some((1, 0))) });
        assert_eq!(ways[0].ways.as_slice()[2], way(6282, Some((0, 0))));
        assert_eq!(ways[1].ways.as_slice(), [Way { travel_frames: Some(2), ..way(3141, Some((0, 1))) }]);
        assert!(ways.iter().all(VertexWays::is_possible));
    }
}
