//! Runs a robot in a simulated building for hours, with faults of every kind and a permanently active operator.

use toposlam::FaultKind;
use toposlam::drive::VelocityCommand;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam::ring::{Echo, RingFrame};
use toposlam_eval::soak::{Soak, SoakReport, TURNS_PER_HOUR};
use toposlam_sim::exploration::Exploration;
use toposlam_sim::injector::FaultRates;
use toposlam_sim::world::{Plan, RobotModel};

/// 24 hours take half a minute in release; `.ci/run` runs them with `toposlam soak`.
const HOURS: u64 = 2;

fn run(rates: FaultRates, hours: u64) -> SoakReport {
    let plan = Plan::built_in("office").unwrap();
    let report =
        Soak { model: RobotModel::default(), rates, seed: 1, turns: hours * TURNS_PER_HOUR }.run(&plan).unwrap();
    report.lines().iter().for_each(|line| println!("{line}"));
    report
}

#[test]
fn faults_lose_no_turn_and_no_place_and_every_fault_is_counted() {
    let report = run(FaultRates::scaled(0.01), HOURS);
    assert_eq!(report.mistakes(), [""; 0]);
    assert!(report.places > 80 * HOURS, "{} places", report.places);
    let [to_robot, from_robot] = report.lines;
    assert!(report.ring.lost_answers > 0 && report.ring.corrupted_ranges > 0 && report.ring.delayed_frames > 0);
    assert!(report.ring.stuck_times > 0 && to_robot.bursts > 0 && to_robot.floods > 0);
    assert!(to_robot.dropped_bytes > 0 && to_robot.flipped_bits > 0 && from_robot.dropped_bytes > 0);
    assert!(report.operator.restored >= HOURS && report.operator.repeated > 0 && report.kept > 0);
    let counted = [FaultKind::RingBlind, FaultKind::WireCorrupt, FaultKind::CommandFlood, FaultKind::CommandRefused];
    assert!(counted.into_iter().all(|kind| report.faults.count(kind) > 0), "{:?}", report.faults);
}

#[test]
fn an_operator_without_faults_does_not_degrade_the_map() {
    let report = run(FaultRates::NONE, 1);
    assert_eq!(report.mistakes(), [""; 0]);
    assert!(report.score.exact && report.phantoms == 0 && report.bumps == 0);
    assert_eq!(report.operator.repeated, 0);
}

#[test]
fn extreme_fault_rates_lose_no_turn_and_every_fault_is_counted() {
    let report = run(FaultRates::scaled(0.5), 1);
    assert_eq!(report.mistakes(), [""; 0]);
}

#[test]
fn a_run_is_reproducible() {
    let [once, again] = [0, 1].map(|_| {
        let report = run(FaultRates::scaled(0.02), 1);
        (report.lines(), report.faults)
    });
    assert_eq!(once, again);
}

#[test]
fn a_robot_stops_while_all_sonars_are_dead_and_then_resumes() {
    let plan = Plan::built_in("office").unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
    while exploration.board().velocity.speed_permille < 900 {
        exploration.advance();
    }
    for _ in 0..100 {
        exploration.map(&RingFrame { echoes: [Echo::Dead; 16] });
        assert_eq!(exploration.board().velocity, VelocityCommand::STOP);
    }
    exploration.advance();
    assert!(exploration.board().velocity.speed_permille > 0);
}
