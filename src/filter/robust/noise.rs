//! The scale of the noise, taken from what was observed, so that the configured one is only a first guess.

use super::hypothesis::Hypothesis;
use super::record::Record;

/// Differences from this many steps on are counted as one.
const DIFFERENCES: usize = 128;

/// The share of differences over two places that the estimate reads off. A robot that chooses its way at random turns
/// back at two places of five, so this is near the middle of the differences between two visits of one place.
const QUANTILE: f32 = 0.2;

/// That quantile of the differences, in standard deviations of a label, when two of five are visits of one place.
const DEVIATIONS: f32 = 0.82;

/// By how much the scatter of the map may exceed what the differences show.
const TOLERANCE: f32 = 1.5;

/// The smallest estimate in steps of coarse fingerprints: labels that all fall into one step show no scatter at all.
const RESOLUTIONS: f32 = 0.7;

/// The range of the estimate, in steps.
const SMALLEST_STEPS: f32 = 2.0;
const LARGEST_STEPS: f32 = 150.0;

/// The standard deviation of the labels in steps, when there is enough to tell it from.
///
/// It is that of the labels about the means of their vertices, pooled over a map. A map that takes several places for one
/// shows too much; so it is limited by the differences between a place and the place before the last, which are small
/// whenever the robot turned back, whatever the map. A robot that never turns back has no such limit. Cost: O(T).
pub(super) fn deviation_steps<const V: usize, const T: usize>(
    record: &Record<T>,
    best: &Hypothesis<V, T>,
    resolution_steps: f32,
) -> Option<f32> {
    let mut scatter = 0.0;
    let mut freedom = 0.0;
    for tally in best.tallies.iter().take(usize::from(best.vertices)).filter(|tally| tally.visits >= 2) {
        scatter += tally.scatter();
        freedom += f32::from(tally.visits - 1);
    }
    if freedom == 0.0 {
        return None;
    }
    let pooled = libm::sqrtf(scatter / freedom);
    let smallest = SMALLEST_STEPS.max(RESOLUTIONS * resolution_steps);
    Some(pooled.min(TOLERANCE * returning_deviation(record)).min(LARGEST_STEPS).max(smallest))
}

fn returning_deviation<const T: usize>(record: &Record<T>) -> f32 {
    let mut counts = [0_u16; DIFFERENCES];
    let mut pairs = 0_u16;
    let triples = record.iter().zip(record.iter().skip(1)).zip(record.iter().skip(2));
    for ((first, middle), last) in triples {
        if middle.begins() || last.begins() {
            continue;
        }
        let difference = usize::from(first.steps.abs_diff(last.steps)).min(DIFFERENCES - 1);
        if let Some(count) = counts.get_mut(difference) {
            *count += 1;
            pairs += 1;
        }
    }
    let wanted = f32::from(pairs) * QUANTILE;
    let mut below = 0;
    let quantile = counts.iter().position(|&count| {
        below += count;
        f32::from(below) >= wanted
    });
    match quantile {
        Some(steps) if steps + 1 < DIFFERENCES => (steps as f32 + 0.5) / DEVIATIONS,
        _ => LARGEST_STEPS,
    }
}
