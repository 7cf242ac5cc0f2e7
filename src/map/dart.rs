//! Darts, by record and by number, and the read access to an edge-ordered map.

use super::VertexId;
use core::fmt;

/// The largest number of ways of a place.
pub const WAYS_MAX: usize = 7;

/// No dart, or no vertex.
pub(crate) const NONE: u8 = u8::MAX;

/// A bearing as a binary angle, counter-clockwise: 2¹⁶ is a full turn, so that differences wrap around by themselves.
pub type Bearing = u16;

/// Units of ln(travel time): 2⁻¹² nats.
pub(crate) const LN_TRAVEL_UNIT: f32 = 4096.0;

/// One way of one vertex: 8 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dart {
    pub(super) vertex: u8,
    pub(super) partner: u8,
    /// In the frame of its vertex.
    pub(super) bearing: Bearing,
    /// At how many visits the way was seen or driven.
    pub(super) seen: u8,
    /// How many passages of the edge have a travel time. Held by the end with the smaller number.
    pub(super) timed: u8,
    /// Mean of ln(travel time in ring frames) in units of 2⁻¹². Held as `timed`.
    pub(super) ln_travel: u16,
}

impl Dart {
    /// What a slot holds that was never used: all zero, so that an empty map needs no initial values.
    pub(super) const ZERO: Self = Self { vertex: 0, partner: 0, bearing: 0, seen: 0, timed: 0, ln_travel: 0 };

    pub(super) const NONE: Self = Self { vertex: NONE, partner: NONE, bearing: 0, seen: 0, timed: 0, ln_travel: 0 };
}

/// The darts of a vertex in counter-clockwise order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct VertexWays {
    pub(super) count: u8,
    pub(super) darts: [u8; WAYS_MAX],
}

impl VertexWays {
    pub(super) const NONE: Self = Self { count: 0, darts: [0; WAYS_MAX] };

    pub(super) fn as_slice(&self) -> &[u8] {
        self.darts.get(..usize::from(self.count)).unwrap_or(&[])
    }
}

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
        Some(libm::expf(f32::from(holder.ln_travel) / LN_TRAVEL_UNIT) as u16)
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
