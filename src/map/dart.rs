//! Darts by their number, and the read access to an edge-ordered map.

use super::VertexId;
use super::darts::{Dart, VertexWays};
use core::fmt;

/// One way of one vertex of an edge-ordered map, by its number, 0 to 253.
///
/// Darts are numbered in the order in which they were added. The numbers are those of one map; they change when another map
/// becomes the best one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DartId(u8);

impl DartId {
    /// The dart with a number; `None` from 254 on.
    pub const fn new(number: u8) -> Option<Self> {
        if number < 254 { Some(Self(number)) } else { None }
    }

    /// The number of the dart, for indexing an array by dart.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl From<DartId> for u8 {
    fn from(dart: DartId) -> Self {
        dart.0
    }
}

impl fmt::Display for DartId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Read access to an edge-ordered map of any capacity: at each vertex the ways in counter-clockwise order, and which two of them
/// an edge joins.
#[derive(Clone, Copy, Debug)]
pub struct Darts<'a> {
    vertices: &'a [VertexWays],
    darts: &'a [Dart],
}

impl<'a> Darts<'a> {
    pub(super) const fn new(vertices: &'a [VertexWays], darts: &'a [Dart]) -> Self {
        Self { vertices, darts }
    }

    fn dart(self, dart: DartId) -> Option<&'a Dart> {
        self.darts.get(dart.index())
    }

    /// All vertices in the order of their numbers.
    pub fn vertices(self) -> impl ExactSizeIterator<Item = VertexId> + DoubleEndedIterator + Clone {
        VertexId::first(self.vertices.len())
    }

    /// All darts in the order of their numbers.
    pub fn darts(self) -> impl ExactSizeIterator<Item = DartId> + DoubleEndedIterator + Clone {
        (0..self.darts.len().min(254) as u8).map(DartId)
    }

    /// The ways of a vertex in counter-clockwise order; none for a vertex the map does not have.
    pub fn ways(
        self,
        vertex: VertexId,
    ) -> impl ExactSizeIterator<Item = DartId> + DoubleEndedIterator + Clone + use<'a> {
        self.vertices.get(vertex.index()).map_or(&[][..], VertexWays::as_slice).iter().map(|&dart| DartId(dart))
    }

    /// The vertex of a dart; `None` for a dart the map does not have.
    pub fn vertex(self, dart: DartId) -> Option<VertexId> {
        self.dart(dart).and_then(|dart| VertexId::new(dart.vertex))
    }

    /// The other end of the edge of a dart; `None` for a frontier, a way that was not driven.
    pub fn partner(self, dart: DartId) -> Option<DartId> {
        self.dart(dart).and_then(|dart| DartId::new(dart.partner))
    }

    /// The position of a dart among the ways of its vertex, from 0.
    pub fn position(self, dart: DartId) -> Option<usize> {
        self.ways(self.vertex(dart)?).position(|way| way == dart)
    }

    /// The mean bearing of a dart in the frame of its vertex: counter-clockwise, 2¹⁶ is a full turn. The frame is arbitrary;
    /// differences between the ways of one vertex have a meaning.
    pub fn bearing(self, dart: DartId) -> Option<u16> {
        self.dart(dart).map(|dart| dart.bearing)
    }

    /// The number of visits at which a way was seen or driven; saturates at 255.
    pub fn sightings(self, dart: DartId) -> u8 {
        self.dart(dart).map_or(0, |dart| dart.seen)
    }

    /// The mean travel time of the edge of a dart in ring frames (the geometric mean); `None` if no passage has one.
    pub fn travel_frames(self, dart: DartId) -> Option<u16> {
        let partner = self.partner(dart)?;
        let holder = self.dart(dart.min(partner)).filter(|holder| holder.timed > 0)?;
        Some(libm::expf(f32::from(holder.ln_travel) / 4096.0) as u16)
    }

    /// The number of passages of the edge of a dart that have a travel time; 0 for a frontier. Saturates at 255.
    pub fn passages(self, dart: DartId) -> u8 {
        let holder = self.partner(dart).and_then(|partner| self.dart(dart.min(partner)));
        holder.map_or(0, |holder| holder.timed)
    }

    /// Every frontier, in the order of their numbers.
    pub fn frontiers(self) -> impl Iterator<Item = DartId> + Clone + use<'a> {
        self.darts().filter(move |&dart| self.partner(dart).is_none())
    }

    /// Every edge once, as its two darts with the smaller number first.
    pub fn edges(self) -> impl Iterator<Item = (DartId, DartId)> + Clone + use<'a> {
        self.darts().filter_map(move |dart| self.partner(dart).filter(|&other| dart < other).map(|other| (dart, other)))
    }
}
