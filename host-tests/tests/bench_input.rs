//! The input that the bench image carries is what the simulation gives.

use toposlam::reference::{self, Detector};
use toposlam_host::world::{Plan, RobotModel, Simulation};

const RECORDED_MM: [u16; 200] = include!("../../src/bin/support/bench_input.rs");

/// The first places are enough to notice that the recording is of another drive, and take a fraction of the time.
const COMPARED: usize = 20;

#[test]
fn the_recorded_bench_input_is_the_drive_through_the_office() {
    let plan = Plan::built_in("office").unwrap();
    let simulation = Simulation::new(&plan, RobotModel::default(), 1).unwrap();
    let mut detector = Detector::new();
    detector.start(reference::PLACE, reference::RING).unwrap();
    let places = simulation.filter_map(|(frame, _)| detector.observe(&frame));
    let radii_mm: Vec<_> = places.map(|place| place.fingerprint.radius_mm()).take(COMPARED).collect();
    assert_eq!(radii_mm, RECORDED_MM[..COMPARED]);
}
