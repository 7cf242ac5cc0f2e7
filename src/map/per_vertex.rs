//! One value for each vertex.

use super::VertexId;
use core::ops::{Index, IndexMut};

/// A value for each of `V` vertices, indexed by [`VertexId`].
///
/// Indexing never panics in a release build: an id that is no vertex of a map of `V` vertices gives the value of another
/// vertex. Ids from outside are looked up by [`PerVertex::get`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PerVertex<T, const V: usize>([T; V]);

impl<T: Copy, const V: usize> PerVertex<T, V> {
    /// The same value for each vertex.
    pub const fn filled(value: T) -> Self {
        Self::new([value; V])
    }

    /// Sets the value of each vertex.
    pub fn fill(&mut self, value: T) {
        self.0.fill(value);
    }
}

impl<T, const V: usize> PerVertex<T, V> {
    /// For a power of two the bits of an index, which take one instruction to keep in bounds.
    const MASK: usize = if V.is_power_of_two() { V - 1 } else { usize::MAX };

    /// The value of each vertex in the order of their numbers.
    pub const fn new(values: [T; V]) -> Self {
        const { assert!(V >= 1 && V <= VertexId::LIMIT, "there are 1 to 64 vertices") };
        Self(values)
    }

    /// The values in the order of the vertices.
    pub const fn values(&self) -> &[T; V] {
        &self.0
    }

    /// The values in the order of the vertices.
    pub const fn values_mut(&mut self) -> &mut [T; V] {
        &mut self.0
    }

    /// The value of a vertex; `None` for the vertices from `V` on.
    pub fn get(&self, vertex: VertexId) -> Option<&T> {
        self.0.get(vertex.index())
    }

    /// Each vertex with its value.
    pub fn iter(&self) -> impl Iterator<Item = (VertexId, &T)> {
        VertexId::first(V).zip(&self.0)
    }

    /// Each vertex with its value.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (VertexId, &mut T)> {
        VertexId::first(V).zip(&mut self.0)
    }

    fn slot(vertex: VertexId) -> usize {
        debug_assert!(vertex.index() < V, "vertex {vertex} of {V}");
        (vertex.index() & Self::MASK).min(V - 1)
    }
}

impl<T, const V: usize> Index<VertexId> for PerVertex<T, V> {
    type Output = T;

    fn index(&self, vertex: VertexId) -> &T {
        &self.0[Self::slot(vertex)]
    }
}

impl<T, const V: usize> IndexMut<VertexId> for PerVertex<T, V> {
    fn index_mut(&mut self, vertex: VertexId) -> &mut T {
        &mut self.0[Self::slot(vertex)]
    }
}
