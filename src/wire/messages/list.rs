//! A list of bounded length; on the wire it takes only the bytes of its elements.

use core::fmt;
use core::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeSeq, Serializer};

/// Up to `MAX` elements. On the wire: their number, then the elements.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct List<T, const MAX: usize> {
    length: u8,
    /// Unused ones have the default value.
    elements: [T; MAX],
}

impl<T: Copy + Default, const MAX: usize> List<T, MAX> {
    /// A list of the first `MAX` elements of an iterator.
    pub fn new(elements: impl IntoIterator<Item = T>) -> Self {
        let mut list = Self::default();
        for (slot, element) in list.elements.iter_mut().zip(elements) {
            *slot = element;
            list.length = list.length.saturating_add(1);
        }
        list
    }
}

impl<T: Copy, const MAX: usize> List<T, MAX> {
    /// The empty list. `default` is the default value of an element.
    pub(in crate::wire) const fn empty(default: T) -> Self {
        Self { length: 0, elements: [default; MAX] }
    }
}

impl<T, const MAX: usize> List<T, MAX> {
    pub(in crate::wire) fn as_mut_slice(&mut self) -> &mut [T] {
        self.elements.get_mut(..usize::from(self.length)).unwrap_or(&mut [])
    }

    /// All elements.
    pub fn as_slice(&self) -> &[T] {
        self.elements.get(..usize::from(self.length)).unwrap_or(&[])
    }
}

impl<T: Copy + Default, const MAX: usize> Default for List<T, MAX> {
    fn default() -> Self {
        const { assert!(MAX <= 255, "a list holds up to 255 elements") };
        Self { length: 0, elements: [T::default(); MAX] }
    }
}

impl<T: fmt::Debug, const MAX: usize> fmt::Debug for List<T, MAX> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.as_slice()).finish()
    }
}

impl<T: Serialize, const MAX: usize> Serialize for List<T, MAX> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut sequence = serializer.serialize_seq(Some(usize::from(self.length)))?;
        for element in self.as_slice() {
            sequence.serialize_element(element)?;
        }
        sequence.end()
    }
}

impl<'de, T: Deserialize<'de> + Copy + Default, const MAX: usize> Deserialize<'de> for List<T, MAX> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(ListVisitor(PhantomData))
    }
}

struct ListVisitor<T, const MAX: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de> + Copy + Default, const MAX: usize> Visitor<'de> for ListVisitor<T, MAX> {
    type Value = List<T, MAX>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("at most as many elements as the list has room for")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Self::Value, A::Error> {
        let mut list = List::default();
        for slot in &mut list.elements {
            let Some(element) = sequence.next_element()? else {
                return Ok(list);
            };
            *slot = element;
            list.length = list.length.saturating_add(1);
        }
        match sequence.next_element::<T>()? {
            None => Ok(list),
            Some(_) => Err(A::Error::invalid_length(MAX.saturating_add(1), &self)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_beyond_the_capacity_are_dropped() {
        assert_eq!(List::<u8, 3>::new([1, 2]).as_slice(), [1, 2]);
        assert_eq!(List::<u8, 3>::new(1..=9).as_slice(), [1, 2, 3]);
    }

    #[test]
    fn a_longer_list_is_rejected() {
        assert_eq!(postcard::from_bytes::<List<u8, 3>>(&[3, 1, 2, 3]), Ok(List::new([1, 2, 3])));
        assert!(postcard::from_bytes::<List<u8, 3>>(&[4, 1, 2, 3, 4]).is_err());
    }
}
