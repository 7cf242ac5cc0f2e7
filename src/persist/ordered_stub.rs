//! STUB
use super::Persist;
use super::snapshot::{Reader, SnapshotError, Writer};
use crate::filter::OrderedFilter;
impl<const N: usize, const V: usize, const D: usize, const T: usize> Persist for OrderedFilter<N, V, D, T> {
    const SECTION: u8 = 1;
    fn save(&mut self, _: &mut Writer<'_>) -> Result<(), SnapshotError> { Err(SnapshotError::Full) }
    fn check(&mut self, _: Reader<'_>) -> Result<(), SnapshotError> { Err(SnapshotError::Contents) }
    fn restore(&mut self, _: Reader<'_>) -> Result<(), SnapshotError> { Err(SnapshotError::Contents) }
}
