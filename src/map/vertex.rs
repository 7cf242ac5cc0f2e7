//! The number of a vertex.

use core::fmt;

/// A vertex of a map by its number, 0 to 63. Vertices are numbered in the order in which they were added.
///
/// An id is independent of the size of a map. [`Map::contains`](crate::Map::contains) checks whether a map has the vertex.
///
/// ```
/// use toposlam::VertexId;
///
/// const HALL: VertexId = VertexId::new(3).unwrap();
/// assert_eq!((HALL.index(), u8::from(HALL), HALL.to_string().as_str()), (3, 3, "3"));
/// assert_eq!(VertexId::new(64), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId(u8);

impl VertexId {
    /// The largest number of vertices of a map.
    pub const LIMIT: usize = 64;

    /// Vertex 0.
    pub const FIRST: Self = Self(0);

    /// The vertex with a number; `None` from [`VertexId::LIMIT`] on.
    pub const fn new(number: u8) -> Option<Self> {
        if (number as usize) < Self::LIMIT { Some(Self(number)) } else { None }
    }

    /// The number of the vertex, for indexing an array by vertex.
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// The first `count` vertices in the order of their numbers.
    pub fn first(count: usize) -> impl ExactSizeIterator<Item = Self> + DoubleEndedIterator + Clone {
        (0..count.min(Self::LIMIT) as u8).map(Self)
    }

    /// The vertex with the number of a bit.
    pub(super) const fn of_bit(number: u32) -> Self {
        Self(number as u8)
    }
}

impl From<VertexId> for u8 {
    fn from(vertex: VertexId) -> Self {
        vertex.0
    }
}

impl From<VertexId> for usize {
    fn from(vertex: VertexId) -> Self {
        vertex.index()
    }
}

impl fmt::Display for VertexId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
