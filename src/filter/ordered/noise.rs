//! The scale of the noise, taken from what was observed.

use super::record::Record;
use crate::filter::Exit;

/// Differences from this many steps on are counted as one.
const DIFFERENCES: usize = 128;

/// The least number of returns for an estimate.
const RETURNS: u16 = 5;

/// The median of the differences between two visits of one place, in standard deviations of a label.
const DEVIATIONS: f32 = 0.954;

/// The standard deviation of the labels in steps by the differences between a place and the place before the last where the robot
/// turned back; `None` when it seldom did. It does not depend on a map. Cost: O(T).
pub(super) fn returning_deviation<const T: usize>(record: &Record<T>) -> Option<f32> {
    let mut counts = [0_u16; DIFFERENCES];
    let mut returns = 0_u16;
    for last in 2..record.len() {
        if record.get(last).starts()
            || record.get(last - 1).starts()
            || !record.get(last).exit().is_some_and(Exit::is_back)
        {
            continue;
        }
        let difference = record.get(last).steps.abs_diff(record.get(last - 2).steps);
        if let Some(count) = counts.get_mut(usize::from(difference).min(DIFFERENCES - 1)) {
            *count += 1;
            returns += 1;
        }
    }
    let mut below = 0;
    let median = counts.iter().position(|&count| {
        below += count;
        2 * below >= returns
    })?;
    (returns >= RETURNS).then_some((median as f32 + 0.5) / DEVIATIONS)
}
