//! The standard deviation of the labels, estimated from the observations. The configured one is a first guess.

use super::history::ObservationHistory;
use super::hypothesis::Hypothesis;

/// Differences from this many steps on are counted together.
const DIFFERENCES: usize = 128;

/// The quantile of the differences over two places that the estimate uses.
///
/// A robot that chooses its exits at random turns back at about two places of five: two of five differences are between
/// visits of one place, and most others are larger. So this quantile is about the median of those two fifths.
const QUANTILE: f32 = 0.2;

/// That quantile in standard deviations s of a label. The difference between two labels of one place is normal with standard
/// deviation √2 s, so it is below 0.82 s with probability erf(0.82 / 2) = 0.44. Two fifths of that are 0.175 of all
/// differences; the remaining 0.025 allow for 4 % of the differences between other places.
const QUANTILE_DEVIATIONS: f32 = 0.82;

/// How many times the estimate from the differences the estimate from the map may be.
const TOLERANCE: f32 = 1.5;

/// The smallest estimate in steps of the fingerprints: labels that all fall into one step show no scatter.
const RESOLUTIONS: f32 = 0.7;

/// The range of the estimate, in steps.
const SMALLEST_STEPS: f32 = 2.0;
const LARGEST_STEPS: f32 = 150.0;

/// The standard deviation of the labels in steps; `None` if no vertex has two visits.
///
/// ```text
/// s = min(√(Σ Q / Σ (n − 1)), 1.5 q / 0.82)
/// ```
///
/// The first term is the scatter about the vertices, pooled over the map. A map that merges distinct places has too much
/// scatter and would justify itself, so the second term limits it: q is the 0.2 quantile of the differences between each
/// label and the second last one before it, which are small wherever the robot turned back, on any map. A robot that
/// never turns back has no such limit. The result is limited to the resolution of the fingerprints, and to 4 to 300 mm.
/// Cost: O(T).
pub(super) fn deviation_steps<const V: usize, const T: usize>(
    history: &ObservationHistory<T>,
    best: &Hypothesis<V, T>,
    resolution_steps: f32,
) -> Option<f32> {
    let mut scatter = 0.0;
    let mut freedom = 0.0;
    for statistics in best.vertices().map(|vertex| &best.statistics[vertex]).filter(|vertex| vertex.visits >= 2) {
        scatter += statistics.scatter;
        freedom += f32::from(statistics.visits - 1);
    }
    if freedom == 0.0 {
        return None;
    }
    let pooled = libm::sqrtf(scatter / freedom);
    let smallest = SMALLEST_STEPS.max(RESOLUTIONS * resolution_steps);
    Some(pooled.min(TOLERANCE * deviation_of_returns(history)).min(LARGEST_STEPS).max(smallest))
}

/// q / 0.82 of [`deviation_steps`]; the largest estimate if the robot does not turn back.
fn deviation_of_returns<const T: usize>(history: &ObservationHistory<T>) -> f32 {
    let mut counts = [0_u16; DIFFERENCES];
    let mut pairs = 0_u16;
    let triples = history.iter().zip(history.iter().skip(1)).zip(history.iter().skip(2));
    for ((first, middle), last) in triples {
        if middle.starts_sequence() || last.starts_sequence() {
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
        Some(steps) if steps + 1 < DIFFERENCES => (steps as f32 + 0.5) / QUANTILE_DEVIATIONS,
        _ => LARGEST_STEPS,
    }
}
