//! The names of the vertices of a map.

use crate::wire::messages::bit;
use crate::wire::{Name, NameError, Refusal};

/// The names of the vertices of a map with at most `V` vertices. A vertex has one name at most, and no two have the same.
///
/// A name follows the id of its vertex. When vertices are merged, the name of the one that keeps its id stays, otherwise the first
/// one. The name of a vertex that is removed is lost. Memory: 16 bytes per vertex.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names<const V: usize> {
    names: [Name; V],
}

impl<const V: usize> Names<V> {
    /// No vertex has a name.
    pub const fn new() -> Self {
        Self { names: [Name::NONE; V] }
    }

    /// The name of a vertex; [`Name::NONE`] without one.
    pub fn get(&self, vertex: u8) -> Name {
        self.names.get(usize::from(vertex)).copied().unwrap_or(Name::NONE)
    }

    /// The vertices with a name, as a set of bits.
    pub fn vertices(&self) -> u64 {
        self.iter().fold(0, |named, (vertex, _)| named | bit(vertex))
    }

    /// Every vertex with a name, in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = (u8, Name)> + '_ {
        (0..).zip(self.names).filter(|(_, name)| !name.is_none())
    }

    /// The vertex with a name.
    pub fn find(&self, name: &str) -> Option<u8> {
        self.iter().find(|(_, known)| known.as_bytes() == name.as_bytes()).map(|(vertex, _)| vertex)
    }

    /// Names a vertex, or clears its name with [`Name::NONE`].
    ///
    /// # Errors
    /// [`Refusal::BadName`], or [`Refusal::NameTaken`] if another vertex has the name; nothing changes then.
    pub fn set(&mut self, vertex: u8, name: Name) -> Result<(), Refusal> {
        if name.check().is_err_and(|error| error != NameError::Empty) {
            return Err(Refusal::BadName);
        }
        if self.iter().any(|(other, known)| other != vertex && known == name) {
            return Err(Refusal::NameTaken);
        }
        self.put(vertex, name);
        Ok(())
    }

    /// Replaces the name of a vertex. Another vertex with this name loses it.
    pub(in crate::wire) fn put(&mut self, vertex: u8, name: Name) {
        self.names.iter_mut().filter(|known| **known == name).for_each(|known| *known = Name::NONE);
        if let Some(slot) = self.names.get_mut(usize::from(vertex)) {
            *slot = name;
        }
    }

    /// Clears the names of all vertices but these.
    pub(in crate::wire) fn keep(&mut self, vertices: u64) {
        for (slot, vertex) in self.names.iter_mut().zip(0..) {
            if vertices & bit(vertex) == 0 {
                *slot = Name::NONE;
            }
        }
    }

    /// Clears the names of the vertices from `vertices` on.
    pub fn truncate(&mut self, vertices: usize) {
        self.names.iter_mut().skip(vertices).for_each(|name| *name = Name::NONE);
    }

    /// Clears all names.
    pub fn clear(&mut self) {
        self.truncate(0);
    }

    /// Applies new ids: `now` is the id of a vertex by its id before, `None` if it was removed.
    pub fn remap(&mut self, now: impl Fn(u8) -> Option<u8>) {
        let before = core::mem::replace(&mut self.names, [Name::NONE; V]);
        let named = || (0..).zip(before.iter().copied()).filter(|(_, name)| !name.is_none());
        for (vertex, name) in named().filter(|&(vertex, _)| now(vertex) == Some(vertex)) {
            self.put(vertex, name);
        }
        for (vertex, name) in named() {
            if let Some(vertex) = now(vertex).filter(|&vertex| self.get(vertex).is_none()) {
                self.put(vertex, name);
            }
        }
    }
}

impl<const V: usize> Default for Names<V> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[(u8, &str)]) -> Names<8> {
        let mut table = Names::new();
        for &(vertex, name) in names {
            table.set(vertex, Name::new(name).unwrap()).unwrap();
        }
        table
    }

    #[test]
    fn a_name_is_found_and_belongs_to_one_vertex() {
        let mut names = named(&[(3, "kitchen"), (5, "hall")]);
        assert_eq!((names.find("kitchen"), names.find("hall"), names.find("")), (Some(3), Some(5), None));
        assert_eq!(names.set(4, Name::new("hall").unwrap()), Err(Refusal::NameTaken));
        assert_eq!(names.set(5, Name::new("hall").unwrap()), Ok(()), "its own name");
        assert_eq!(names.set(5, Name::NONE), Ok(()));
        assert_eq!((names.find("hall"), names.vertices()), (None, 1 << 3));
        assert_eq!(names.set(4, Name::new("hall").unwrap()), Ok(()));
    }

    #[test]
    fn names_follow_the_ids_of_their_vertices() {
        let mut names = named(&[(0, "a"), (1, "b"), (2, "c"), (3, "d")]);
        // 0 and 1 change places, 2 is removed, 3 moves up.
        names.remap(|vertex| [Some(1), Some(0), None, Some(2)].get(usize::from(vertex)).copied().flatten());
        assert_eq!(names, named(&[(1, "a"), (0, "b"), (2, "d")]));
    }

    #[test]
    fn of_merged_vertices_the_one_that_keeps_its_id_keeps_its_name() {
        let merged = |names: &[(u8, &str)], into: u8| {
            let mut names = named(names);
            names.remap(|vertex| Some(if vertex <= 2 { into } else { vertex }));
            names
        };
        assert_eq!(merged(&[(0, "a"), (1, "b"), (3, "d")], 1), named(&[(1, "b"), (3, "d")]));
        assert_eq!(merged(&[(0, "a"), (2, "c")], 1), named(&[(1, "a")]));
        assert_eq!(merged(&[(2, "c")], 0), named(&[(0, "c")]));
    }
}
