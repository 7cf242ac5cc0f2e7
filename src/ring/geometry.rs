//! The bearings of the sensors of a ring.

/// Largest number of sensors in a ring.
pub(crate) const MAX_SONARS: usize = 128;

/// The bearing of each of the `SONARS` sensors of a ring, 3 to 128.
///
/// [`even`](Self::even) is for evenly spaced sensors. Any other ring lists its bearings, in any order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RingGeometry<const SONARS: usize> {
    /// Bearing of each sensor in milliradians, −3142 to 3142: 0 is straight ahead, positive is counter-clockwise.
    pub bearings_mrad: [i16; SONARS],
}

impl<const SONARS: usize> RingGeometry<SONARS> {
    /// Evenly spaced sensors, counter-clockwise from straight ahead.
    ///
    /// ```
    /// use toposlam::ring::RingGeometry;
    /// assert_eq!(RingGeometry::<4>::even().bearings_mrad, [0, 1571, -3141, -1571]);
    /// ```
    pub const fn even() -> Self {
        const { assert!(SONARS > 0 && SONARS <= MAX_SONARS, "a ring has 1 to 128 sensors") };
        const FULL_TURN_MRAD: usize = 6283;
        let mut bearings_mrad = [0; SONARS];
        let mut sensor = 0;
        while sensor < SONARS {
            let bearing_mrad = ((2 * sensor * FULL_TURN_MRAD + SONARS) / (2 * SONARS)) as i16;
            bearings_mrad[sensor] =
                if 2 * sensor < SONARS { bearing_mrad } else { bearing_mrad - FULL_TURN_MRAD as i16 };
            sensor += 1;
        }
        Self { bearings_mrad }
    }

    /// The largest gap between two neighbouring bearings, in milliradians. Cost: O(SONARS²).
    pub(crate) const fn largest_gap_mrad(&self) -> i32 {
        let bearings = self.bearings_mrad.as_slice();
        let (mut largest, mut rest) = (0, bearings);
        while let [bearing, tail @ ..] = rest {
            let (mut gap, mut others) = (6283, bearings);
            while let [other, next @ ..] = others {
                let ahead = (*other as i32 - *bearing as i32).rem_euclid(6283);
                if ahead > 0 && ahead < gap {
                    gap = ahead;
                }
                others = next;
            }
            if gap > largest {
                largest = gap;
            }
            rest = tail;
        }
        largest
    }
}
