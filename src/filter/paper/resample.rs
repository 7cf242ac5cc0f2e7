//! Drawing the next particles from the predictions, by rejection.
//!
//! A prediction is proposed in proportion to Eq. 7 · Eq. 9, which cost little, and accepted in proportion to Eq. 8, which is
//! expensive. So accepted predictions are draws in proportion to the weight of Eq. 6, and Eq. 8 is computed only for
//! predictions that are proposed.

use crate::filter::paper::likelihood::NAT;

/// A prediction whose Eq. 7 · Eq. 9 is this many nats below the best one is never proposed: e⁻¹⁵ · 2²⁰ rounds to 0. That
/// is a label that is 3.9 σ_l off, however well the map fits the evidence.
pub(super) const PROPOSAL_REACH: i32 = 15 * NAT;

/// A proposal that fits the evidence this many nats worse than the best is never accepted: e⁻²³ · 2³² rounds to 0.
pub(super) const ACCEPTANCE_REACH: i32 = 23 * NAT;

/// A prediction that fits the evidence this much worse than the best has a weight that rounds to 0, for any Eq. 7
/// and 9, so its distance does not matter.
pub(super) const DISTANCE_REACH: i32 = PROPOSAL_REACH + ACCEPTANCE_REACH;

/// After this many proposals a step computes Eq. 8 of all predictions and draws the rest without rejection. This bounds the
/// time of a step whose proposals seldom fit the evidence.
pub(super) const PROPOSALS: u16 = 128;

/// How often a prediction is drawn, relative to the best one, in units of 2⁻²⁰ and rounded. Only ratios count, so the
/// division of Eq. 4 is not needed.
pub(super) fn draw_weight(ln_weight: i32, ln_best: i32) -> u32 {
    let behind = ln_best.saturating_sub(ln_weight);
    if behind >= PROPOSAL_REACH {
        return 0;
    }
    (relative(behind) * (1 << 20) as f32 + 0.5) as u32
}

/// Whether a draw accepts a proposal whose Eq. 8 is this far behind the best one.
pub(super) fn accepts(draw: u32, behind: i32) -> bool {
    behind < ACCEPTANCE_REACH && u64::from(draw) < (relative(behind) * (1_u64 << 32) as f32) as u64
}

fn relative(behind: i32) -> f32 {
    libm::expf(-(behind as f32) / NAT as f32)
}

/// The position of a draw in the sum of all weights.
pub(super) fn target(draw: u32, total: u64) -> u64 {
    // A total has at most 20 bits of weight, 8 of multiplicity and 14 of candidates.
    let (high, low) = (total >> 16, total & 0xFFFF);
    let draw = u64::from(draw);
    (high * draw + ((low * draw) >> 16)) >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_relative_to_the_best() {
        assert_eq!(draw_weight(-5 * NAT, -5 * NAT), 1 << 20);
        assert_eq!(draw_weight(-6 * NAT, -5 * NAT), (2_f64.powi(20) * (-1_f64).exp()).round() as u32);
        assert_eq!(draw_weight(-20 * NAT, -5 * NAT), 0);
        assert_eq!(draw_weight(i32::MIN, i32::MAX), 0);
    }

    #[test]
    fn the_best_fit_is_always_accepted_and_the_worst_never() {
        assert!(accepts(u32::MAX, 0));
        assert!(!accepts(0, ACCEPTANCE_REACH) && !accepts(0, i32::MAX));
        let half = (core::f32::consts::LN_2 * NAT as f32) as i32;
        assert!(accepts((1 << 31) - (1 << 20), half) && !accepts((1 << 31) + (1 << 20), half));
    }

    #[test]
    fn targets_cover_the_total() {
        for total in [1 << 20, 12_345_678, (1 << 42) - 1] {
            assert_eq!(target(0, total), 0);
            assert_eq!(target(u32::MAX, total), ((u128::from(total) * u128::from(u32::MAX)) >> 32) as u64);
        }
    }
}
