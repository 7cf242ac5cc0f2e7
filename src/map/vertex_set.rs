//! Sets of vertices, one bit a vertex.

use super::VertexId;
use core::fmt;
use core::ops::{BitAnd, BitAndAssign, BitOr, BitOrAssign, BitXor, Not, Shl, Shr, Sub, SubAssign};

/// A set of vertices: bit `v` says whether vertex `v` is in the set.
///
/// The sets of the public interface are 64 bits wide, so that they hold every [`VertexId`].
///
/// ```
/// use toposlam::{VertexId, VertexSet};
///
/// let [a, b, c] = [0, 1, 5].map(|number| VertexId::new(number).unwrap());
/// let mut set = VertexSet::from_iter([a, c]);
/// set.insert(b);
/// set.remove(a);
/// assert!(set.contains(b) && !set.contains(a));
/// assert!((set | VertexSet::from(a)).iter().eq([a, b, c]));
/// assert_eq!((set.len(), set.bits()), (2, 0b10_0010));
/// ```
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct VertexSet<W = u64>(W);

/// The word that a set of vertices lies in.
pub trait Word:
    Copy
    + Eq
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + Not<Output = Self>
    + Shl<u32, Output = Self>
    + Shr<u32, Output = Self>
{
    /// No bit.
    const ZERO: Self;
    /// Bit 0.
    const ONE: Self;
    /// How many bits the word has.
    const BITS: u32;

    /// How many bits are set.
    fn count_ones(self) -> u32;
    /// The number of the lowest bit that is set; `BITS` when there is none.
    fn trailing_zeros(self) -> u32;
    /// The word without its lowest bit.
    fn without_lowest(self) -> Self;
    /// The `count` lowest bits.
    fn lowest(count: u32) -> Self;
}

macro_rules! word {
    ($word:ident) => {
        impl Word for $word {
            const ZERO: Self = 0;
            const ONE: Self = 1;
            const BITS: u32 = Self::BITS;

            fn count_ones(self) -> u32 {
                self.count_ones()
            }

            fn trailing_zeros(self) -> u32 {
                self.trailing_zeros()
            }

            fn without_lowest(self) -> Self {
                self & self.wrapping_sub(1)
            }

            fn lowest(count: u32) -> Self {
                Self::ONE.checked_shl(count).unwrap_or(0).wrapping_sub(1)
            }
        }
    };
}

word!(u32);
word!(u64);

impl<W: Word> VertexSet<W> {
    /// The set without any vertex.
    pub const EMPTY: Self = Self(W::ZERO);

    /// The set with these bits.
    pub const fn from_bits(bits: W) -> Self {
        Self(bits)
    }

    /// Bit `v` for each vertex `v` of the set.
    pub const fn bits(self) -> W {
        self.0
    }

    /// The vertices with numbers below `count`.
    pub fn first(count: usize) -> Self {
        Self(W::lowest(count as u32))
    }

    /// How many vertices the set has.
    pub fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Whether the set has no vertex.
    pub fn is_empty(self) -> bool {
        self.0 == W::ZERO
    }

    /// Whether the set has a vertex.
    pub fn contains(self, vertex: VertexId) -> bool {
        self.0 >> bit_number::<W>(vertex) & W::ONE != W::ZERO
    }

    /// Adds a vertex.
    pub fn insert(&mut self, vertex: VertexId) {
        *self |= Self::from(vertex);
    }

    /// Takes a vertex out.
    pub fn remove(&mut self, vertex: VertexId) {
        *self -= Self::from(vertex);
    }

    /// Takes out the vertex with the smallest number.
    pub fn pop_first(&mut self) -> Option<VertexId> {
        let first = self.first_vertex();
        self.0 = self.0.without_lowest();
        first
    }

    /// The vertices in the order of their numbers.
    pub fn iter(self) -> impl Iterator<Item = VertexId> + Clone {
        let mut left = self;
        core::iter::from_fn(move || left.pop_first())
    }

    fn first_vertex(self) -> Option<VertexId> {
        if self.is_empty() { None } else { Some(VertexId::of_bit(self.0.trailing_zeros())) }
    }
}

/// The bit of a vertex. A set that is narrower than 64 bits belongs to maps that have no vertex beyond its last bit.
fn bit_number<W: Word>(vertex: VertexId) -> u32 {
    u32::from(u8::from(vertex)) & (W::BITS - 1)
}

impl<W: Word> From<VertexId> for VertexSet<W> {
    fn from(vertex: VertexId) -> Self {
        Self(W::ONE << bit_number::<W>(vertex))
    }
}

impl<W: Word> FromIterator<VertexId> for VertexSet<W> {
    fn from_iter<I: IntoIterator<Item = VertexId>>(vertices: I) -> Self {
        vertices.into_iter().fold(Self::EMPTY, |set, vertex| set | Self::from(vertex))
    }
}

impl<W: Word> BitOr for VertexSet<W> {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl<W: Word> BitAnd for VertexSet<W> {
    type Output = Self;

    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

/// The vertices of the first set that are not in the second.
impl<W: Word> Sub for VertexSet<W> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

impl<W: Word> BitOrAssign for VertexSet<W> {
    fn bitor_assign(&mut self, other: Self) {
        *self = *self | other;
    }
}

impl<W: Word> BitAndAssign for VertexSet<W> {
    fn bitand_assign(&mut self, other: Self) {
        *self = *self & other;
    }
}

impl<W: Word> SubAssign for VertexSet<W> {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<W: Word> fmt::Debug for VertexSet<W> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.iter().map(VertexId::index)).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn check<W: Word>() {
        let ids: Vec<VertexId> = VertexId::first(W::BITS as usize).collect();
        let mut set = VertexSet::<W>::EMPTY;
        let mut expected = BTreeSet::new();
        for round in 0..1000_usize {
            let vertex = ids[round * 31 % ids.len()];
            if round % 3 == 1 {
                set.remove(vertex);
                expected.remove(&vertex);
            } else {
                set.insert(vertex);
                expected.insert(vertex);
            }
            let other = VertexSet::<W>::first(round % (ids.len() + 1));
            assert!(set.iter().eq(expected.iter().copied()));
            assert_eq!((set.len(), set.is_empty()), (expected.len(), expected.is_empty()));
            for &vertex in &ids {
                let (here, there) = (expected.contains(&vertex), vertex.index() < round % (ids.len() + 1));
                assert_eq!((set.contains(vertex), other.contains(vertex)), (here, there));
                assert_eq!((set | other).contains(vertex), here || there);
                assert_eq!((set & other).contains(vertex), here && there);
                assert_eq!((set - other).contains(vertex), here && !there);
            }
        }
    }

    #[test]
    fn sets_behave_as_sets_of_numbers() {
        check::<u32>();
        check::<u64>();
    }
}
