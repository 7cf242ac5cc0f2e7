//! ln Γ and its derivative in single precision, and Gumbel noise.

use crate::filter::uniform;

/// ½ ln 2π.
pub(crate) const HALF_LN_2_PI: f32 = 0.918_938_5;

/// ln Γ(x) for x ≥ 0.25, to 10⁻⁵: Stirling's series, after a shift by 4 for small arguments.
pub(crate) fn ln_gamma(x: f32) -> f32 {
    let (shifted, shift) =
        if x < 4.0 { (x + 4.0, libm::logf(x * (x + 1.0) * (x + 2.0) * (x + 3.0))) } else { (x, 0.0) };
    let inverse = 1.0 / shifted;
    (shifted - 0.5) * libm::logf(shifted) - shifted + HALF_LN_2_PI + inverse * (1.0 / 12.0 - inverse * inverse / 360.0)
        - shift
}

/// ψ(x), the derivative of ln Γ, for x ≥ 0.25, to 10⁻⁴.
pub(super) fn digamma(x: f32) -> f32 {
    let mut shifted = x;
    let mut shift = 0.0;
    while shifted < 4.0 {
        shift += 1.0 / shifted;
        shifted += 1.0;
    }
    let inverse = 1.0 / shifted;
    libm::logf(shifted) - 0.5 * inverse - inverse * inverse / 12.0 - shift
}

/// Noise that makes the largest of perturbed logarithms a draw, from 24 random bits.
pub(super) fn gumbel(bits: u32) -> f32 {
    -libm::logf(-libm::logf(uniform(bits)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ln Γ and its derivative in f64, by Stirling's series after a shift to 20.
    fn in_f64(x: f64) -> (f64, f64) {
        let (mut x, mut ln_product, mut sum) = (x, 0.0, 0.0);
        while x < 20.0 {
            ln_product += x.ln();
            sum += 1.0 / x;
            x += 1.0;
        }
        let stirling = (x - 0.5) * x.ln() - x + 0.5 * (2.0 * core::f64::consts::PI).ln();
        let series = 1.0 / (12.0 * x) - 1.0 / (360.0 * x.powi(3));
        let derivative = x.ln() - 1.0 / (2.0 * x) - 1.0 / (12.0 * x.powi(2)) + 1.0 / (120.0 * x.powi(4));
        (stirling + series - ln_product, derivative - sum)
    }

    #[test]
    fn the_gamma_function_meets_its_stated_accuracy() {
        let (mut worst, mut worst_relative, mut worst_derivative) = (0.0_f64, 0.0_f64, 0.0_f64);
        // From 0.25 to 16 by 1/64, then the halves that visits give, as far as they are counted.
        let grid = (16..1024).map(|step| step as f32 / 64.0).chain((32..131_072).map(|half| half as f32 / 2.0));
        for x in grid {
            let (expected, derivative) = in_f64(x.into());
            let off = (f64::from(ln_gamma(x)) - expected).abs();
            if x <= 16.0 {
                worst = worst.max(off)
            } else {
                worst_relative = worst_relative.max(off / expected)
            }
            worst_derivative = worst_derivative.max((f64::from(digamma(x)) - derivative).abs());
        }
        println!(
            "ln Γ off by {worst:e} up to 16, by {worst_relative:e} of it beyond; derivative by {worst_derivative:e}"
        );
        assert!(worst < 1e-5 && worst_relative < 3e-7 && worst_derivative < 1e-4);
    }
}
