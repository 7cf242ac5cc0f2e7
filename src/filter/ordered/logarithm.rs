//! Natural logarithms in some twenty instructions, and tables of logarithms.

use crate::filter::uniform;

/// ln 2.
const LN_2: f32 = core::f32::consts::LN_2;

/// The number of entries of [`LN`].
const COUNTS: usize = 256;

/// ln k, and 0 for k = 0.
static LN: [f32; COUNTS] = {
    let mut table = [0.0; COUNTS];
    let mut count = 1;
    while count < COUNTS {
        table[count] = ln(count as f32);
        count += 1;
    }
    table
};

/// ln Γ(2 + (n − 1)/2) by n, from 1: what the evidence of n labels needs.
static LN_GAMMA: [f32; LABELS] = {
    let mut table = [0.0; LABELS];
    // Γ(2) = 1, Γ(5/2) = ¾ √π, Γ(x + 1) = x Γ(x).
    table[2] = 0.284_682_87;
    let mut visits = 3;
    while visits < LABELS {
        table[visits] = table[visits - 2] + ln(0.5 * (visits + 1) as f32);
        visits += 1;
    }
    table
};
const LABELS: usize = 256;

/// ln x for positive x, to 2 · 10⁻⁷ of it or of 1, whichever is larger: the series of artanh.
pub(super) const fn ln(x: f32) -> f32 {
    let bits = x.to_bits();
    // x = 2ᵉ · m with m from √½ to √2.
    let shifted = bits.wrapping_sub(0x3F35_04F3);
    let exponent = (shifted as i32) >> 23;
    let m = f32::from_bits(bits.wrapping_sub((exponent as u32) << 23));
    let s = (m - 1.0) / (m + 1.0);
    let square = s * s;
    let series = 1.0 + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0)));
    exponent as f32 * LN_2 + 2.0 * s * series
}

/// eˣ for x from −80 to 80, to 2 · 10⁻⁴ of it.
pub(super) fn exp(x: f32) -> f32 {
    let scaled = x * core::f32::consts::LOG2_E;
    // 2ⁿ · 2^part with part from 0 to 1.
    let whole = if scaled < 0.0 { scaled as i32 - 1 } else { scaled as i32 };
    let part = scaled - whole as f32;
    let power = 1.0 + part * (0.695_976 + part * (0.224_94 + part * 0.079_1));
    f32::from_bits(power.to_bits().wrapping_add_signed(whole << 23))
}

/// Noise that makes the largest of perturbed logarithms a draw, from 24 random bits.
pub(super) fn gumbel(bits: u32) -> f32 {
    -ln(-ln(uniform(bits)))
}

/// ln k; 0 for k = 0.
pub(super) fn ln_of(count: usize) -> f32 {
    LN.get(count).copied().unwrap_or(5.55)
}

/// ln Γ(2 + (n − 1)/2) for n labels, 1 or more.
pub(super) fn ln_gamma_of_labels(visits: u16) -> f32 {
    LN_GAMMA.get(usize::from(visits)).copied().unwrap_or_else(|| {
        // Stirling's series.
        let x = 1.5 + 0.5 * f32::from(visits);
        (x - 0.5) * ln(x) - x + 0.918_938_5 + 1.0 / (12.0 * x)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_meet_their_stated_accuracy() {
        let mut worst = 0.0_f64;
        for step in 1..200_000_u32 {
            let x = (f64::from(step) / 200_000.0 * 60.0 - 30.0).exp() as f32;
            let expected = f64::from(x).ln();
            worst = worst.max((f64::from(ln(x)) - expected).abs() / expected.abs().max(1.0));
        }
        assert!(worst < 2e-7, "{worst}");
        assert!((0..256).all(|count| (f64::from(ln_of(count)) - f64::from(count.max(1) as u32).ln()).abs() < 1e-6));
    }

    #[test]
    fn the_exponential_function_meets_its_stated_accuracy() {
        for step in -8000..=8000_i16 {
            let x = f32::from(step) / 100.0;
            let expected = f64::from(x).exp();
            assert!((f64::from(exp(x)) / expected - 1.0).abs() < 2e-4, "{x}");
        }
    }

    #[test]
    fn the_gamma_function_is_that_of_the_robust_filter() {
        for visits in 1..2000_u16 {
            let expected = crate::filter::robust::special_functions::ln_gamma(1.5 + 0.5 * f32::from(visits));
            assert!((ln_gamma_of_labels(visits) - expected).abs() < 1e-5 * expected.abs().max(1.0), "{visits}");
        }
    }
}
