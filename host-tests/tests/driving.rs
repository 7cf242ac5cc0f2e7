//! Exploration of the simulated world with faulty sonars: collisions, places found, and turn hints.

use toposlam::Exit;
use toposlam::reference::SNAPSHOT_BYTES;
use toposlam_eval::mapping::score_exploration;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, Report, RobotModel, SonarModel};

/// The result of an exploration.
struct Outcome {
    report: Report,
    /// Frames in which the robot touched a wall.
    touched: u32,
    /// Number of right and of wrong turn hints.
    turns: (usize, usize),
    /// Share of the places that the final map assigns to the right vertex.
    located: f64,
}

/// Explores until `places` places are found.
fn explore(plan: &str, sonar: SonarModel, seed: u64, places: usize) -> Outcome {
    let plan = Plan::built_in(plan).unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let model = RobotModel { sonar, ..RobotModel::default() };
    let mut exploration = Exploration::start(&plan, model, seed, &mut buffer).unwrap();
    let (mut told, mut turns) = (None, (0, 0));
    while exploration.places() < places {
        assert!(exploration.frames() < 1000 * places as u64, "after {} places", exploration.places());
        let found = exploration.advance().is_some();
        if let ([.., Some(before), Some(_), Some(now)], true, Some(turn)) = (exploration.nodes(), found, told) {
            let is_right = (turn == Exit::Back) == (before == now);
            turns = (turns.0 + usize::from(is_right), turns.1 + usize::from(!is_right));
        }
        told = exploration.robot().drive().passage().exit;
    }
    let report = exploration.ground_truth().report();
    Outcome { report, touched: exploration.rover().bumps(), turns, located: score_exploration(&exploration).location }
}

#[test]
fn with_the_sonar_ahead_dead_the_robot_touches_no_wall_and_finds_its_places() {
    for (plan, seed) in [("ring", 0), ("office", 1)] {
        let sonar = SonarModel { dead_sonars: 1, ..SonarModel::default() };
        let Outcome { report, touched, located, .. } = explore(plan, sonar, seed, 100);
        assert_eq!(touched, 0, "{plan}");
        assert!(report.missed + report.phantom + report.doubled <= 5, "{plan}: {report}");
        assert!(located > 0.9, "{plan}: {located}");
    }
}

#[test]
fn with_a_sonar_at_the_side_dead_no_corridor_is_a_place() {
    let sonar = SonarModel { dead_sonars: 1 << 4, ..SonarModel::default() };
    let Outcome { report, turns: (right, wrong), .. } = explore("ring", sonar, 0, 100);
    assert!(report.phantom + report.doubled <= 1, "{report}");
    assert!(right > 80 && wrong <= 3, "{right} right, {wrong} wrong");
}

#[test]
fn with_a_tenth_of_the_echoes_missed_the_turn_hints_are_right() {
    let sonar = SonarModel { missed_share: 0.1, ..SonarModel::default() };
    let Outcome { report, turns: (right, wrong), located, .. } = explore("office", sonar, 0, 100);
    assert!(right > 80 && wrong <= 3, "{right} right, {wrong} wrong");
    assert!(report.missed + report.phantom + report.doubled <= 3, "{report}");
    assert!(located > 0.9, "{located}");
}

#[test]
fn walls_detected_at_a_flat_angle_are_not_places() {
    let sonar = SonarModel { specular_limit_rad: 35_f64.to_radians(), ..SonarModel::default() };
    let Outcome { report, .. } = explore("office", sonar, 0, 100);
    assert!(report.phantom + report.doubled <= 1, "{report}");
}
