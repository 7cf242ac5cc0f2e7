//! Sets of vertices, one bit a vertex.

use super::VertexId;
use core::fmt;
use core::ops::{BitAnd, BitAndAssign, BitOr, BitOrAssign, Sub, SubAssign};

/// Defines a set of vertices that lies in one word.
macro_rules! vertex_set {
    ($(#[$meta:meta])* $visibility:vis struct $set:ident($word:ident);) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
        $visibility struct $set($word);

        #[allow(dead_code, unreachable_pub, reason = "the narrower set is internal and uses less")]
        impl $set {
            /// The set without any vertex.
            pub const EMPTY: Self = Self(0);

            /// Every vertex that a set can hold.
            pub const ALL: Self = Self(<$word>::MAX);

            /// The set whose vertices are the numbers of the bits that are set.
            pub const fn from_bits(bits: $word) -> Self {
                Self(bits)
            }

            /// Bit `v` for each vertex `v` of the set.
            pub const fn bits(self) -> $word {
                self.0
            }

            /// The vertices with numbers below `count`.
            pub const fn first(count: usize) -> Self {
                let end: $word = if count < $word::BITS as usize { 1 << count } else { 0 };
                Self(end.wrapping_sub(1))
            }

            /// How many vertices the set has.
            pub const fn len(self) -> usize {
                self.0.count_ones() as usize
            }

            /// How many vertices of the set have a smaller number than a vertex.
            pub const fn rank(self, vertex: VertexId) -> usize {
                let below = (1 << (vertex.index() as u32 & ($word::BITS - 1))) - 1;
                (self.0 & below).count_ones() as usize
            }

            /// The vertex with the smallest number that is not in the set; `None` when all are.
            pub fn first_missing(self) -> Option<VertexId> {
                let number = self.0.trailing_ones();
                if number < $word::BITS { Some(VertexId::of_bit(number)) } else { None }
            }

            /// Whether the set has no vertex.
            pub const fn is_empty(self) -> bool {
                self.0 == 0
            }

            /// Whether the set has a vertex.
            pub const fn contains(self, vertex: VertexId) -> bool {
                self.0 >> (vertex.index() as u32 & ($word::BITS - 1)) & 1 == 1
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
                if self.is_empty() {
                    return None;
                }
                let first = VertexId::of_bit(self.0.trailing_zeros());
                self.0 &= self.0 - 1;
                Some(first)
            }

            /// The vertices in the order of their numbers.
            pub fn iter(self) -> impl Iterator<Item = VertexId> + Clone {
                let mut left = self;
                core::iter::from_fn(move || left.pop_first())
            }
        }

        impl From<VertexId> for $set {
            fn from(vertex: VertexId) -> Self {
                Self(1 << (vertex.index() as u32 & ($word::BITS - 1)))
            }
        }

        impl FromIterator<VertexId> for $set {
            fn from_iter<I: IntoIterator<Item = VertexId>>(vertices: I) -> Self {
                vertices.into_iter().fold(Self::EMPTY, |set, vertex| set | Self::from(vertex))
            }
        }

        impl BitOr for $set {
            type Output = Self;

            fn bitor(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }
        }

        impl BitAnd for $set {
            type Output = Self;

            fn bitand(self, other: Self) -> Self {
                Self(self.0 & other.0)
            }
        }

        /// The vertices of the first set that are not in the second.
        impl Sub for $set {
            type Output = Self;

            fn sub(self, other: Self) -> Self {
                Self(self.0 & !other.0)
            }
        }

        impl BitOrAssign for $set {
            fn bitor_assign(&mut self, other: Self) {
                *self = *self | other;
            }
        }

        impl BitAndAssign for $set {
            fn bitand_assign(&mut self, other: Self) {
                *self = *self & other;
            }
        }

        impl SubAssign for $set {
            fn sub_assign(&mut self, other: Self) {
                *self = *self - other;
            }
        }

        impl fmt::Debug for $set {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.debug_set().entries(self.iter().map(VertexId::index)).finish()
            }
        }
    };
}

vertex_set! {
    /// A set of vertices.
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
    pub struct VertexSet(u64);
}

vertex_set! {
    /// A set of the first 32 vertices, in half the memory of a [`VertexSet`] and one register.
    pub(crate) struct VertexSet32(u32);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    macro_rules! behaves_as_a_set {
        ($set:ident, $limit:literal) => {
            let ids: Vec<VertexId> = VertexId::first($limit).collect();
            let mut set = $set::EMPTY;
            let mut expected = BTreeSet::new();
            for round in 0..1000_usize {
                let vertex = ids[round * 31 % $limit];
                if round % 3 == 1 {
                    set.remove(vertex);
                    expected.remove(&vertex);
                } else {
                    set.insert(vertex);
                    expected.insert(vertex);
                }
                let below = round % ($limit + 1);
                let other = $set::first(below);
                assert!(set.iter().eq(expected.iter().copied()));
                assert_eq!((set.len(), set.is_empty()), (expected.len(), expected.is_empty()));
                for &vertex in &ids {
                    let (here, there) = (expected.contains(&vertex), vertex.index() < below);
                    assert_eq!((set.contains(vertex), other.contains(vertex)), (here, there));
                    assert_eq!((set | other).contains(vertex), here || there);
                    assert_eq!((set & other).contains(vertex), here && there);
                    assert_eq!((set - other).contains(vertex), here && !there);
                }
            }
        };
    }

    #[test]
    fn sets_behave_as_sets_of_numbers() {
        behaves_as_a_set!(VertexSet, 64);
        behaves_as_a_set!(VertexSet32, 32);
    }
}
