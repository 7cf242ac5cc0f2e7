//! A ring of 16 sonars for the tests of the drive.

use crate::place::{PlaceConfig, PlaceDetector};
use crate::ring::{Echo, RingFrame, RingGeometry};

/// A detector whose scan has these ranges, by sensor of an even ring; the other sensors receive no echo.
pub(super) fn detector(ranges_mm: &[(usize, u16)]) -> PlaceDetector<16> {
    let mut frame = RingFrame { echoes: [Echo::Silence; 16] };
    for &(sensor, range_mm) in ranges_mm {
        frame.echoes[sensor] = Echo::Range { range_mm };
    }
    let mut detector = PlaceDetector::new();
    detector.start(PlaceConfig::DEFAULT, RingGeometry::even()).unwrap();
    detector.observe(&frame);
    detector
}
