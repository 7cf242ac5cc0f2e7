//! One measurement of the whole ring.

use super::RingGeometry;

const FULL_TURN_MRAD: i32 = 6283;

/// Measurement of one sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Echo {
    /// An echo from an obstacle.
    Range {
        /// Distance to the nearest obstacle, in millimetres.
        range_mm: u16,
    },
    /// No echo, from a sensor that works: no obstacle in range, or one that reflects the sound away.
    Silence,
    /// No valid measurement: the sensor did not answer, or its answer was out of range.
    Dead,
}

impl Echo {
    /// Range in millimetres; `None` without an echo.
    pub const fn range_mm(self) -> Option<u16> {
        match self {
            Self::Range { range_mm } => Some(range_mm),
            Self::Silence | Self::Dead => None,
        }
    }
}

/// The angle between two bearings, 0 to 3142.
fn angle_between_mrad(bearing_mrad: i16, other_mrad: i32) -> i32 {
    let ahead_mrad = (other_mrad % FULL_TURN_MRAD - i32::from(bearing_mrad)).rem_euclid(FULL_TURN_MRAD);
    ahead_mrad.min(FULL_TURN_MRAD - ahead_mrad)
}

/// One measurement by each of the `SONARS` sensors of a ring, in the order of its [`RingGeometry`](super::RingGeometry).
///
/// ```
/// use toposlam::ring::{Echo, RingFrame};
///
/// let mut frame = RingFrame { echoes: [Echo::Silence; 16] };
/// frame.echoes[0] = Echo::Range { range_mm: 1200 };
/// frame.echoes[5] = Echo::Dead;
/// let nearest_mm = frame.echoes.iter().filter_map(|echo| echo.range_mm()).min();
/// assert_eq!(nearest_mm, Some(1200));
/// assert!(frame.dead_sensors().eq([5]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RingFrame<const SONARS: usize> {
    /// The echo of each sensor.
    pub echoes: [Echo; SONARS],
}

/// A point of a scan, as a lidar measures it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanPoint {
    /// Bearing in milliradians: 0 is straight ahead, positive is counter-clockwise. Any number of turns is valid.
    pub bearing_mrad: i32,
    /// Distance in millimetres.
    pub range_mm: u16,
}

impl<const SONARS: usize> RingFrame<SONARS> {
    /// The frame of a ring whose sensors all work: a range in millimetres for each, `None` without an echo.
    ///
    /// ```
    /// use toposlam::ring::{Echo, RingFrame};
    ///
    /// let frame = RingFrame::from_ranges([Some(800), None, Some(1200)]);
    /// assert_eq!(frame.echoes, [Echo::Range { range_mm: 800 }, Echo::Silence, Echo::Range { range_mm: 1200 }]);
    /// ```
    pub fn from_ranges(ranges_mm: [Option<u16>; SONARS]) -> Self {
        Self { echoes: ranges_mm.map(|range_mm| range_mm.map_or(Echo::Silence, |range_mm| Echo::Range { range_mm })) }
    }

    /// The frame of a scan with many points, such as that of a lidar.
    ///
    /// A point belongs to the bearing of the ring that is nearest to its own, the first of two at the same distance. The echo
    /// of a bearing is its nearest point, [`Echo::Silence`] without any. A lidar reports "no return" as a range of 0 or as the
    /// largest one: leave those points out. Cost: O(points × SONARS).
    ///
    /// ```
    /// use toposlam::ring::{Echo, RingFrame, RingGeometry, ScanPoint};
    ///
    /// // A scan with a point for each degree, in a round room of 2 m with a post behind.
    /// let scan = (0..360).map(|degree| ScanPoint {
    ///     bearing_mrad: degree * 6283 / 360,
    ///     range_mm: if degree == 178 { 700 } else { 2000 },
    /// });
    /// let frame = RingFrame::<8>::from_points(scan, &RingGeometry::even());
    /// assert_eq!(frame.echoes[0], Echo::Range { range_mm: 2000 });
    /// assert_eq!(frame.echoes[4], Echo::Range { range_mm: 700 });
    /// ```
    pub fn from_points(points: impl IntoIterator<Item = ScanPoint>, geometry: &RingGeometry<SONARS>) -> Self {
        let mut ranges_mm = [None; SONARS];
        for ScanPoint { bearing_mrad, range_mm } in points {
            let cells = geometry.bearings_mrad.iter().zip(&mut ranges_mm);
            let nearest = cells.min_by_key(|(bearing, _)| angle_between_mrad(**bearing, bearing_mrad));
            if let Some((_, cell_mm)) = nearest {
                *cell_mm = Some(cell_mm.map_or(range_mm, |nearest_mm: u16| nearest_mm.min(range_mm)));
            }
        }
        Self::from_ranges(ranges_mm)
    }

    /// Iterates over the indices of the sensors that are [`Echo::Dead`] in this frame, in ascending order.
    pub fn dead_sensors(&self) -> impl Iterator<Item = usize> {
        self.echoes.iter().enumerate().filter_map(|(sensor, echo)| (*echo == Echo::Dead).then_some(sensor))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(points: &[(i32, u16)]) -> impl Iterator<Item = ScanPoint> {
        points.iter().map(|&(bearing_mrad, range_mm)| ScanPoint { bearing_mrad, range_mm })
    }

    #[test]
    fn a_point_belongs_to_the_nearest_bearing_across_the_turn() {
        let echoes =
            |bearing_mrad| RingFrame::<4>::from_points(scan(&[(bearing_mrad, 900)]), &RingGeometry::even()).echoes;
        for (bearing_mrad, sensor) in [
            (0, 0),
            (785, 0),
            (787, 1),
            (-700, 0),
            (3141, 2),
            (-3100, 2),
            (5600, 0),
            (-5600, 0),
            (i32::MAX, 3),
            (i32::MIN, 1),
        ] {
            let mut expected = [Echo::Silence; 4];
            expected[sensor] = Echo::Range { range_mm: 900 };
            assert_eq!(echoes(bearing_mrad), expected, "{bearing_mrad} mrad");
        }
    }

    #[test]
    fn the_nearest_point_of_a_bearing_is_its_echo_and_a_bearing_without_points_is_silent() {
        let points = scan(&[(100, 1500), (-100, 1400), (50, 1450), (1571, 3000)]);
        let frame = RingFrame::<4>::from_points(points, &RingGeometry::even());
        assert_eq!(frame, RingFrame::from_ranges([Some(1400), Some(3000), None, None]));
    }

    #[test]
    fn uneven_bearings_divide_the_turn_between_them() {
        let geometry = RingGeometry { bearings_mrad: [0, 300, -1000] };
        let points = scan(&[(149, 1000), (151, 2000), (-490, 3000), (-510, 4000), (3000, 5000)]);
        assert_eq!(
            RingFrame::from_points(points, &geometry),
            RingFrame::from_ranges([Some(1000), Some(2000), Some(4000)])
        );
    }
}
