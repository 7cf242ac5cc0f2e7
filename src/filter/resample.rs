//! Drawing the next particles from the weighted candidates.

use crate::likelihood::NAT;

/// A candidate whose weight is this many nats below the best one is never drawn: e⁻¹⁵ · 2²⁰ rounds to 0.
pub(super) const REACH: i32 = 15 * NAT;

/// A weight relative to the best one, in units of 2⁻²⁰ and rounded: Eq. 4 without the division, since only ratios are
/// drawn from.
pub(super) fn relative_weight(ln_weight: i32, ln_best: i32) -> u32 {
    let behind = ln_best.saturating_sub(ln_weight);
    if behind >= REACH {
        return 0;
    }
    (libm::expf(-(behind as f32) / NAT as f32) * (1 << 20) as f32 + 0.5) as u32
}

/// Where a draw points to in the sum of all weights.
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
        assert_eq!(relative_weight(-5 * NAT, -5 * NAT), 1 << 20);
        assert_eq!(relative_weight(-6 * NAT, -5 * NAT), (2_f64.powi(20) * (-1_f64).exp()).round() as u32);
        assert_eq!(relative_weight(-20 * NAT, -5 * NAT), 0);
        assert_eq!(relative_weight(i32::MIN, i32::MAX), 0);
    }

    #[test]
    fn targets_cover_the_total() {
        for total in [1 << 20, 12_345_678, (1 << 42) - 1] {
            assert_eq!(target(0, total), 0);
            assert_eq!(target(u32::MAX, total), ((u128::from(total) * u128::from(u32::MAX)) >> 32) as u64);
        }
    }
}
