//! Calls of the place detector.

use core::hint::black_box;

use static_cell::ConstStaticCell;
use toposlam::{
    ConfigError,
    place::{PlaceConfig, PlaceDetector},
    ring::RingGeometry,
};

use super::any::{Opaque, any_frame, show};

pub(crate) fn place() {
    static DETECTOR: ConstStaticCell<PlaceDetector<16>> = ConstStaticCell::new(PlaceDetector::new());
    let Some(detector) = DETECTOR.try_take() else { return };
    if let Err(error) = detector.start(PlaceConfig::default().opaque(), RingGeometry::even().opaque()) {
        show::<ConfigError>(error);
    }
    for _ in 0..black_box(9) {
        black_box(detector.observe(&any_frame()));
    }
    detector.hold_place();
    black_box((detector.faults(), detector.is_blind(), detector.is_at_place()));
    black_box(detector.set_config(PlaceConfig::default().opaque()).is_ok());
    let scan = detector.scan();
    let obstacles = scan.obstacles();
    black_box((obstacles.iter().count(), obstacles.equidistant().last(), obstacles.spread_mm(), obstacles.radius_mm()));
    let openings = scan.openings(&obstacles);
    black_box((openings.bearings_mrad(), openings.nearest(black_box(3), black_box(4))));
    black_box((scan.echoes().last(), scan.equidistance_mm(), scan.nearest(|bearing_mrad| bearing_mrad > black_box(5))));
}
