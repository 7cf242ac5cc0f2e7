//! The place detector on synthetic frames: a corridor 2 m wide and its end.

use super::*;
use crate::config_error::ConfigError;
use crate::fault::{FaultCounters, FaultKind};
use crate::ring::{Echo, RingFrame, RingGeometry};

/// An even ring and its frame in a corridor 2 m wide, with the end wall `end_mm` straight ahead. Each sensor measures along
/// its axis.
fn corridor<const SONARS: usize>(end_mm: u16) -> (RingGeometry<SONARS>, RingFrame<SONARS>) {
    let mut geometry = RingGeometry { bearings_mrad: [0; SONARS] };
    let mut frame = RingFrame { echoes: [Echo::Silence; SONARS] };
    for (sensor, (bearing_mrad, echo)) in geometry.bearings_mrad.iter_mut().zip(&mut frame.echoes).enumerate() {
        let bearing = core::f64::consts::TAU * sensor as f64 / SONARS as f64;
        let bearing = if bearing > core::f64::consts::PI { bearing - core::f64::consts::TAU } else { bearing };
        *bearing_mrad = (bearing * 1000.0) as i16;
        let side_mm = 1000.0 / bearing.sin().abs();
        let front_mm = if bearing.cos() > 0.0 { f64::from(end_mm) / bearing.cos() } else { f64::INFINITY };
        let range_mm = side_mm.min(front_mm);
        if range_mm <= 6000.0 {
            *echo = Echo::Range { range_mm: range_mm as u16 };
        }
    }
    (geometry, frame)
}

fn started<const SONARS: usize>() -> PlaceDetector<SONARS> {
    let mut detector = PlaceDetector::new();
    detector.start(PlaceConfig::DEFAULT, corridor(6000).0).unwrap();
    detector
}

/// The distance to the end wall while the robot drives to the dead end's meet point, stops there and drives back.
fn in_and_out() -> impl Iterator<Item = u16> {
    let way_in = (1000..3000).rev().step_by(30);
    let way_out = (1000..3000).step_by(30);
    way_in.chain([1000; 10]).chain(way_out)
}

fn places<const SONARS: usize>(detector: &mut PlaceDetector<SONARS>, frames: &[RingFrame<SONARS>]) -> Vec<Place> {
    frames.iter().filter_map(|frame| detector.observe(frame)).collect()
}

fn a_dead_end_is_one_place<const SONARS: usize>() {
    let frames: Vec<_> = in_and_out().map(|end_mm| corridor::<SONARS>(end_mm).1).collect();
    let found = places(&mut started::<SONARS>(), &frames);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].fingerprint.radius_mm().abs_diff(1000) <= 10, "{found:?}");
    assert_eq!(found[0].degree, Some(1));
    assert!((66..80).contains(&found[0].frame_index), "{found:?}");
}

#[test]
fn a_dead_end_is_one_place_for_rings_of_8_16_and_24() {
    a_dead_end_is_one_place::<8>();
    a_dead_end_is_one_place::<16>();
    a_dead_end_is_one_place::<24>();
}

#[test]
fn a_corridor_is_not_a_place() {
    let frames = [corridor::<16>(6000).1; 200];
    assert_eq!(places(&mut started::<16>(), &frames), []);
}

#[test]
fn a_robot_that_stops_at_a_meet_point_reports_it_once() {
    let frames = [corridor::<16>(1000).1; 300];
    assert_eq!(places(&mut started::<16>(), &frames).len(), 1);
}

#[test]
fn a_meet_point_that_flickers_is_reported_once() {
    let mut frames: Vec<_> = in_and_out().map(|end_mm| corridor::<16>(end_mm).1).collect();
    for (number, frame) in frames.iter_mut().enumerate() {
        match number % 5 {
            1 => frame.echoes[0] = Echo::Silence,
            3 => frame.echoes[4] = Echo::Dead,
            _ => {}
        }
    }
    assert_eq!(places(&mut started::<16>(), &frames).len(), 1);
}

#[test]
fn a_single_frame_does_not_confirm_a_place() {
    let mut frames = [corridor::<16>(6000).1; 50];
    frames[20] = corridor(1000).1;
    assert_eq!(places(&mut started::<16>(), &frames), []);
}

#[test]
fn a_place_is_detected_with_any_one_sensor_dead() {
    for dead in 0..16 {
        let mut frames: Vec<_> = in_and_out().map(|end_mm| corridor::<16>(end_mm).1).collect();
        frames.iter_mut().for_each(|frame| frame.echoes[dead] = Echo::Dead);
        let found = places(&mut started::<16>(), &frames);
        assert_eq!(found.len(), 1, "sensor {dead}");
        assert!(found[0].fingerprint.radius_mm().abs_diff(1000) <= 50, "sensor {dead}: {found:?}");
    }
}

#[test]
fn frames_without_live_sensors_count_as_blind() {
    let mut detector = started::<16>();
    assert_eq!(places(&mut detector, &[RingFrame { echoes: [Echo::Dead; 16] }; 40]), []);
    assert_eq!(detector.faults().count(FaultKind::RingBlind), 40);
}

#[test]
fn blind_frames_do_not_split_a_place() {
    let mut frames: Vec<_> = in_and_out().map(|end_mm| corridor::<16>(end_mm).1).collect();
    frames[70..74].fill(RingFrame { echoes: [Echo::Dead; 16] });
    assert_eq!(places(&mut started::<16>(), &frames).len(), 1);
}

#[test]
fn a_ring_without_echoes_detects_no_place_and_counts_no_fault() {
    let mut detector = started::<16>();
    assert_eq!(places(&mut detector, &[RingFrame { echoes: [Echo::Silence; 16] }; 40]), []);
    assert_eq!(*detector.faults(), FaultCounters::new());
}

#[test]
fn zero_ranges_count_as_out_of_range_and_detect_no_place() {
    let mut detector = started::<16>();
    assert_eq!(places(&mut detector, &[RingFrame { echoes: [Echo::Range { range_mm: 0 }; 16] }; 40]), []);
    assert_eq!(detector.faults().count(FaultKind::SonarOutOfRange), 640);
    assert_eq!(detector.faults().count(FaultKind::RingBlind), 40);
}

#[test]
fn a_radius_above_the_largest_fingerprint_is_counted() {
    let config = PlaceConfig { range_max_mm: 20_000, ..PlaceConfig::DEFAULT };
    let mut detector = PlaceDetector::<16>::new();
    detector.start(config, corridor(6000).0).unwrap();
    assert_eq!(places(&mut detector, &[RingFrame { echoes: [Echo::Range { range_mm: 9000 }; 16] }; 100]), []);
    assert_eq!(detector.faults().count(FaultKind::RadiusOutOfRange), 1);
}

#[test]
fn the_longest_ranges_do_not_overflow() {
    let config = PlaceConfig { range_max_mm: 65_534, leave_mm: u16::MAX, ..PlaceConfig::DEFAULT };
    let mut detector = PlaceDetector::<16>::new();
    detector.start(config, corridor(6000).0).unwrap();
    assert_eq!(places(&mut detector, &[RingFrame { echoes: [Echo::Range { range_mm: 65_534 }; 16] }; 300]), []);
    assert_eq!(detector.faults().count(FaultKind::RadiusOutOfRange), 1);
}

#[test]
fn a_detector_before_its_start_reports_nothing() {
    let mut detector = PlaceDetector::<16>::new();
    assert_eq!(places(&mut detector, &[corridor::<16>(1000).1; 100]), []);
}

#[test]
fn a_bearing_beyond_half_a_turn_is_rejected() {
    let mut geometry = corridor::<16>(1000).0;
    geometry.bearings_mrad[3] = 3143;
    let refused = PlaceDetector::<16>::new().start(PlaceConfig::DEFAULT, geometry);
    let error = ConfigError::OutOfRange { field: "bearings_mrad", value: 3143, min: -3142, max: 3142 };
    assert_eq!(refused, Err(error));
}

/// A frame in a corridor 1.6 m wide with the robot's heading `heading_deg` off its axis. A sensor with a cone of 30° detects
/// a wall up to 25° off its normal, with an error of up to 40 mm.
fn askew(heading_deg: i32, random: &mut u32) -> RingFrame<16> {
    let mut frame = RingFrame { echoes: [Echo::Silence; 16] };
    for (echo, axis_deg) in frame.echoes.iter_mut().zip((0..).map(|sonar| f64::from(sonar) * 22.5)) {
        for normal_deg in [90.0, -90.0] {
            let off_deg = (axis_deg + f64::from(heading_deg) - normal_deg + 540.0).rem_euclid(360.0) - 180.0;
            let incidence_deg = (off_deg.abs() - 15.0).max(0.0);
            if incidence_deg <= 25.0 {
                *random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let error_mm = (*random >> 16) as u16 % 81;
                *echo = Echo::Range { range_mm: (760.0 / incidence_deg.to_radians().cos()) as u16 + error_mm };
            }
        }
    }
    frame
}

#[test]
fn a_corridor_is_not_a_place_with_a_dead_sensor_in_any_order_of_the_sensors() {
    for (dead, step) in (0..16).flat_map(|dead| [(dead, 1), (dead, 5)]) {
        let shuffled = |sensor: usize| sensor * step % 16;
        let in_order = corridor::<16>(6000).0.bearings_mrad;
        let geometry = RingGeometry { bearings_mrad: core::array::from_fn(|sensor| in_order[shuffled(sensor)]) };
        let mut detector = PlaceDetector::<16>::new();
        detector.start(PlaceConfig::DEFAULT, geometry).unwrap();
        let mut random = 1;
        for frame in 0..2000 {
            let mut in_order = askew((frame / 8) % 23 - 11, &mut random).echoes;
            in_order[dead] = Echo::Dead;
            let echoes = core::array::from_fn(|sensor| in_order[shuffled(sensor)]);
            let place = detector.observe(&RingFrame { echoes });
            assert_eq!(place, None, "with sensor {dead} dead, in steps of {step}, at frame {frame}");
        }
    }
}
