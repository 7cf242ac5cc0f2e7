//! Integer arithmetic on bearings and plane vectors, shared by `place` and `drive`.
//!
//! A bearing is an angle in milliradians, −3142 to 3142: 0 is straight ahead, positive is counter-clockwise (left).

/// Half a turn, π in milliradians.
pub(crate) const HALF_TURN_MRAD: i16 = 3142;
const HALF: i32 = HALF_TURN_MRAD as i32;

/// Length of the vectors that [`unit`] returns.
pub(crate) const UNIT: i32 = 1 << 12;

/// Signed angle from one bearing to another, −3142 to 3142.
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

/// Angle from one bearing to another counter-clockwise, 0 to 6284.
pub(crate) fn counter_clockwise_mrad(from_mrad: i16, to_mrad: i16) -> i32 {
    let turn_mrad = turn_mrad(from_mrad, to_mrad);
    if turn_mrad < 0 { turn_mrad + 2 * i32::from(HALF_TURN_MRAD) } else { turn_mrad }
}

/// Rotates a bearing by an angle of at most two turns. The result is −3142 to 3142.
pub(crate) fn rotated(bearing_mrad: i16, by_mrad: i32) -> i16 {
    (i32::from(bearing_mrad).saturating_add(by_mrad).saturating_add(5 * HALF) % (2 * HALF) - HALF) as i16
}

/// A vector in the robot's frame: x ahead, y to the left. The unit is the caller's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Vector {
    pub(crate) x: i32,
    pub(crate) y: i32,
}

impl Vector {
    /// Euclidean length, rounded down and saturated.
    pub(crate) fn length(self) -> i32 {
        let square = |side: i32| u64::from(side.unsigned_abs()).pow(2);
        square(self.x).saturating_add(square(self.y)).isqrt().min(i32::MAX as u64) as i32
    }

    /// Rotates the vector counter-clockwise.
    pub(crate) fn rotated(self, by_mrad: i32) -> Self {
        let axis = unit(rotated(0, by_mrad));
        let part = |x: i32, y: i32| {
            let sum = i64::from(self.x) * i64::from(x) + i64::from(self.y) * i64::from(y);
            (sum / i64::from(UNIT)).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
        };
        Self { x: part(axis.x, -axis.y), y: part(axis.y, axis.x) }
    }

    /// Bearing of the vector, 0 for the null vector. The error is at most 5 mrad: in the first octant the arctangent is
    /// approximated by z · (π/4 + 0.273 · (1 − z)).
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

/// Vector of length [`UNIT`] with the given bearing. The error is at most 0.2 %: the sine is Bhaskara's approximation,
/// 16 x (π − x) / (5 π² − 4 x (π − x)) for x from 0 to π.
pub(crate) fn unit(bearing_mrad: i16) -> Vector {
    Vector { x: sine(rotated(bearing_mrad, HALF / 2)), y: sine(bearing_mrad) }
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
    fn the_angle_between_two_bearings_is_at_most_half_a_turn() {
        assert_eq!(turn_mrad(3142, -3142), 0);
        assert_eq!(turn_mrad(3000, -3000), 284);
        assert_eq!(turn_mrad(-3000, 3000), -284);
        assert_eq!(turn_mrad(-785, 785), 1570);
    }

    #[test]
    fn a_rotated_bearing_is_within_half_a_turn() {
        assert_eq!(rotated(3000, 284), -3000);
        assert_eq!(rotated(-3000, -284), 3000);
        assert_eq!(rotated(100, -300), -200);
        assert_eq!(rotated(-3142, -3142), 0);
    }

    #[test]
    fn a_rotated_vector_keeps_its_length() {
        let vector = Vector { x: 3000, y: -4000 };
        for by_mrad in (-3142..=3142).step_by(100) {
            let rotated_vector = vector.rotated(by_mrad);
            assert!((rotated_vector.length() - 5000).abs() <= 12, "{by_mrad}: {rotated_vector:?}");
            let turned_mrad = turn_mrad(vector.bearing_mrad(), rotated_vector.bearing_mrad());
            assert!(turn_mrad(turned_mrad as i16, by_mrad as i16).abs() <= 12, "{by_mrad}: {turned_mrad}");
        }
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
