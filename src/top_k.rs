//! The best few of many items, and a sort of a few.

/// The best `K` items of those inserted, the best first.
///
/// The caller says which of two items goes first; of equal items the one inserted first stays ahead. Time for an insertion:
/// O(K).
#[derive(Clone, Copy, Debug)]
pub(crate) struct TopK<T, const K: usize> {
    items: [T; K],
    len: usize,
}

impl<T: Copy, const K: usize> TopK<T, K> {
    /// No items. `filler` takes the places that are still free.
    pub(crate) const fn new(filler: T) -> Self {
        Self { items: [filler; K], len: 0 }
    }

    /// Removes all items.
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    /// Drops the items behind the first `len`.
    pub(crate) fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
    }

    /// The items, the best first.
    pub(crate) fn as_slice(&self) -> &[T] {
        self.items.get(..self.len).unwrap_or(&self.items)
    }

    /// The items, for changes that do not alter their order unless no item is inserted any more.
    pub(crate) fn as_mut_slice(&mut self) -> &mut [T] {
        self.items.get_mut(..self.len).unwrap_or(&mut [])
    }

    /// Inserts an item unless there are `K` others that `goes_first(other, item)` puts ahead of it.
    pub(crate) fn insert(&mut self, item: T, goes_first: impl Fn(&T, &T) -> bool) {
        self.insert_within(K, item, goes_first);
    }

    /// As [`TopK::insert`], with room for `limit` items, `K` at most.
    pub(crate) fn insert_within(&mut self, limit: usize, item: T, goes_first: impl Fn(&T, &T) -> bool) {
        let limit = limit.min(K);
        if self.len < limit {
            self.len += 1;
        } else if self.as_slice().last().is_none_or(|last| goes_first(last, &item)) {
            return;
        }
        self.replace(self.len - 1, item, goes_first);
    }

    /// Replaces the item at a position by one that belongs there or further ahead.
    pub(crate) fn replace(&mut self, position: usize, item: T, goes_first: impl Fn(&T, &T) -> bool) {
        if let Some(items) = self.items.get_mut(..=position) {
            rise(items, item, goes_first);
        }
    }
}

impl<T: PartialEq + Copy, const K: usize> PartialEq for TopK<T, K> {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl<T: Eq + Copy, const K: usize> Eq for TopK<T, K> {}

/// Puts an item in place of the last one, and then ahead of those that do not go first.
fn rise<T: Copy>(items: &mut [T], item: T, goes_first: impl Fn(&T, &T) -> bool) {
    let Some((mut slot, ahead)) = items.split_last_mut() else { return };
    for other in ahead.iter_mut().rev() {
        if goes_first(other, &item) {
            break;
        }
        *slot = *other;
        slot = other;
    }
    *slot = item;
}

/// Sorts a few items; equal ones keep their order. Unlike the sort of the standard library, it has no path that panics.
pub(crate) fn insertion_sort<T: Copy>(items: &mut [T], goes_first: impl Fn(&T, &T) -> bool) {
    for end in 1..items.len() {
        if let Some(sorted) = items.get_mut(..=end)
            && let Some(&item) = sorted.last()
        {
            rise(sorted, item, &goes_first);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_items_are_kept_in_order_and_equal_ones_in_the_order_of_their_insertion() {
        let items: Vec<(u8, usize)> = (0..60).map(|index| ((index * 37 % 11) as u8, index)).collect();
        for limit in 1..=8 {
            let mut top = TopK::<_, 8>::new((0, 0));
            for (count, &item) in (1..).zip(&items) {
                top.insert_within(limit, item, |one, other| one.0 >= other.0);
                let mut sorted = items[..count].to_vec();
                sorted.sort_by_key(|item| core::cmp::Reverse(item.0));
                sorted.truncate(limit);
                assert_eq!(top.as_slice(), sorted);
            }
        }
    }
}
