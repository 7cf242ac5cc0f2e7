//! Angles in milliradians, counter-clockwise positive, 0 straight ahead, without floating point.

/// Half a turn.
pub(crate) const HALF_TURN_MRAD: i16 = 3142;
const HALF: i32 = HALF_TURN_MRAD as i32;

/// The length of the vectors of [`unit`].
pub(crate) const UNIT: i32 = 1 << 12;

/// The turn from one bearing to another the short way round, counter-clockwise positive.
pub(crate) fn turn_mrad(from_mrad: i16, to_mrad: i16) -> i32 {
    let turn_mrad = i32::from(to_mrad) - i32::from(from_mrad);
    if turn_mrad > HALF {
        turn_mrad - 2 * HALF
    } else if turn_mrad < -HALF {
        turn_mrad + 2 * HALF
    } else {
        turn_mrad
    }
}

/// A bearing turned by an angle of at most two turns, −3142 to 3142.
pub(crate) fn turned(bearing_mrad: i16, by_mrad: i32) -> i16 {
    (i32::from(bearing_mrad).saturating_add(by_mrad).saturating_add(5 * HALF) % (2 * HALF) - HALF) as i16
}

/// A vector in units of its own: x ahead, y to the left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Vector {
    pub(crate) x: i32,
    pub(crate) y: i32,
}

impl Vector {
    pub(crate) fn length(self) -> i32 {
        let square = |side: i32| u64::from(side.unsigned_abs()).pow(2);
        square(self.x).saturating_add(square(self.y)).isqrt().min(i32::MAX as u64) as i32
    }

    /// Where the vector points; straight ahead if it has no length. Right to 5 mrad: the arcus tangent is
    /// z · (π/4 + 0.273 · (1 − z)) in the first octant.
    pub(crate) fn bearing_mrad(self) -> i16 {
        let (x, y) = (i64::from(self.x.unsigned_abs()), i64::from(self.y.unsigned_abs()));
        let (short, long) = (x.min(y), x.max(y));
        let slope = (short << 12).checked_div(long).unwrap_or(0);
        let octant_mrad = ((slope * (785 + ((273 * (4096 - slope)) >> 12))) >> 12) as i32;
        let quadrant_mrad = if y > x { HALF / 2 - octant_mrad } else { octant_mrad };
        let half_mrad = if self.x < 0 { HALF - quadrant_mrad } else { quadrant_mrad };
        (if self.y < 0 { -half_mrad } else { half_mrad }) as i16
    }
}

/// The vector of length [`UNIT`] that points somewhere. Right to 0.2 %: the sine is Bhaskara's,
/// 16 x (π − x) / (5 π² − 4 x (π − x)) from 0 to π.
pub(crate) fn unit(bearing_mrad: i16) -> Vector {
    Vector { x: sine(turned(bearing_mrad, HALF / 2)), y: sine(bearing_mrad) }
}

fn sine(bearing_mrad: i16) -> i32 {
    let angle = i64::from(bearing_mrad.unsigned_abs().min(HALF_TURN_MRAD as u16));
    let product = 4 * angle * (i64::from(HALF) - angle);
    let sine = (product * 4 * i64::from(UNIT)).checked_div(5 * i64::from(HALF * HALF) - product).unwrap_or(0) as i32;
    if bearing_mrad < 0 { -sine } else { sine }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_turn_between_bearings_goes_the_short_way_round() {
        assert_eq!(turn_mrad(3142, -3142), 0);
        assert_eq!(turn_mrad(3000, -3000), 284);
        assert_eq!(turn_mrad(-3000, 3000), -284);
        assert_eq!(turn_mrad(-785, 785), 1570);
    }

    #[test]
    fn a_turned_bearing_stays_within_half_a_turn() {
        assert_eq!(turned(3000, 284), -3000);
        assert_eq!(turned(-3000, -284), 3000);
        assert_eq!(turned(100, -300), -200);
        assert_eq!(turned(-3142, -3142), 0);
    }

    #[test]
    fn vectors_and_bearings_agree_to_a_third_of_a_degree() {
        for bearing_mrad in (-3142..=3142).step_by(7) {
            let vector = unit(bearing_mrad);
            let (sine, cosine) = (f64::from(bearing_mrad) / 1000.0).sin_cos();
            assert!((f64::from(vector.x) - 4096.0 * cosine).abs() < 12.0, "{bearing_mrad}: {vector:?}");
            assert!((f64::from(vector.y) - 4096.0 * sine).abs() < 12.0, "{bearing_mrad}: {vector:?}");
            let exact = Vector { x: (cosine * 1e5) as i32, y: (sine * 1e5) as i32 };
            assert!(turn_mrad(exact.bearing_mrad(), bearing_mrad).abs() <= 6, "{bearing_mrad}");
            assert!((exact.length() - 100_000).abs() <= 2);
        }
        assert_eq!(Vector { x: 0, y: 0 }.bearing_mrad(), 0);
    }
}
