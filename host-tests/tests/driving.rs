//! Exploration of the simulated world: completeness, and with faulty sonars collisions, places found and hints.

use toposlam::FaultKind;
use toposlam::reference::{SNAPSHOT_BYTES, robust};
use toposlam::ring::Echo;
use toposlam::wire::Command;
use toposlam_eval::mapping::score_exploration;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::injector::FaultRates;
use toposlam_sim::world::{HintReport, Plan, Report, ReportedHints, RobotModel, SonarModel};

/// The result of an exploration.
struct Outcome {
    report: Report,
    /// Frames in which the robot touched a wall.
    touched: u32,
    hints: HintReport,
    /// Share of the places that the final map assigns to the right vertex.
    located: f64,
}

/// Explores until `places` places are found.
fn explore(plan: &str, sonar: SonarModel, seed: u64, places: usize) -> Outcome {
    let plan = Plan::built_in(plan).unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let model = RobotModel { sonar, ..RobotModel::default() };
    let mut exploration = Exploration::start(&plan, model, seed, &mut buffer).unwrap();
    while exploration.places() < places {
        assert!(exploration.frames() < 1000 * places as u64, "after {} places", exploration.places());
        exploration.advance();
    }
    let report = exploration.ground_truth().report();
    let reported: Vec<ReportedHints> = exploration.steps().iter().map(|step| step.reported).collect();
    let hints = exploration.ground_truth().hint_report(&reported);
    Outcome { report, touched: exploration.rover().bumps(), hints, located: score_exploration(&exploration).location }
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
    let Outcome { report, hints, .. } = explore("ring", sonar, 0, 100);
    assert!(report.phantom + report.doubled <= 1, "{report}");
    let (reported, wrong, _) = hints.exits;
    assert!(reported > 80 && wrong <= 3, "{reported} exits reported, {wrong} wrong");
}

#[test]
fn with_a_tenth_of_the_echoes_missed_the_exits_are_right() {
    let sonar = SonarModel { missed_share: 0.1, ..SonarModel::default() };
    let Outcome { report, hints, located, .. } = explore("office", sonar, 0, 100);
    let (reported, wrong, _) = hints.exits;
    assert!(reported > 80 && wrong <= 3, "{reported} exits reported, {wrong} wrong");
    assert!(report.missed + report.phantom + report.doubled <= 3, "{report}");
    assert!(located > 0.9, "{located}");
}

#[test]
fn walls_detected_at_a_flat_angle_are_not_places() {
    let sonar = SonarModel { specular_limit_rad: 35_f64.to_radians(), ..SonarModel::default() };
    let reports = [1, 2, 3].map(|seed| explore("office", sonar, seed, 100).report);
    let wrong: usize = reports.iter().map(|report| report.phantom + report.doubled).sum();
    assert!(wrong <= 3, "{reports:?}");
}

/// Two rooms beside a corridor of 1.6 m, joined by gaps of `gap_mm` in a wall of `thickness_mm`; cells of 50 mm.
fn rooms_with_gaps(gap_mm: usize, thickness_mm: usize, aside_mm: usize) -> Plan {
    let mut rows = vec![vec![b'#'; 160]; 100];
    let mut clear = |x: std::ops::Range<usize>, y: std::ops::Range<usize>| {
        y.for_each(|row| rows[row][x.clone()].fill(b'.'));
    };
    let (gap, thickness, aside) = (gap_mm / 50, thickness_mm / 50, aside_mm / 50);
    clear(2..70, 10..42);
    clear(70..70 + thickness, 10 + aside..10 + aside + gap);
    clear(70 + thickness..150, 6..40);
    clear(14..44, 42..98);
    rows[26][20] = b'S';
    let rows: Vec<String> = rows.into_iter().map(|row| String::from_utf8(row).unwrap()).collect();
    Plan::parse(&format!("cell_mm 50\n{}\n", rows.join("\n"))).unwrap()
}

#[test]
fn a_robot_does_not_touch_the_walls_of_gaps_and_does_not_enter_those_narrower_than_its_body() {
    let (mut frames, mut touched) = (0, 0);
    for (seed, gap_mm) in (0..12).map(|seed| (seed, [250, 300, 400, 550][seed as usize % 4])) {
        let plan = rooms_with_gaps(gap_mm, [100, 350][seed as usize / 4 % 2], [0, 300, 550][seed as usize / 4 % 3]);
        let mut buffer = [0; SNAPSHOT_BYTES];
        let mut exploration = Exploration::start(&plan, RobotModel::default(), seed, &mut buffer).unwrap();
        let mut farthest_mm = 0.0_f64;
        while exploration.places() < 30 {
            assert!(exploration.frames() < 15_000, "after {} places, {gap_mm} mm", exploration.places());
            exploration.advance();
            farthest_mm = farthest_mm.max(exploration.rover().position().x_mm);
        }
        frames += exploration.frames();
        touched += exploration.rover().bumps();
        assert!(gap_mm > 300 || farthest_mm < 3500.0, "a gap of {gap_mm} mm: at {farthest_mm}");
    }
    assert!(u64::from(touched) * 1000 <= frames, "{touched} of {frames} frames at a wall");
}

/// A hall of this size in cells of 100 mm, with corridors of `width` cells to the west and to the east at these rows.
fn hall([columns, rows]: [usize; 2], west: usize, east: usize, width: usize) -> Plan {
    const CORRIDOR: usize = 40;
    let mut cells = vec![vec![b'#'; columns + 2 * CORRIDOR + 2]; rows + 2];
    cells[1..=rows].iter_mut().for_each(|row| row[CORRIDOR + 1..=CORRIDOR + columns].fill(b'.'));
    cells[west..west + width].iter_mut().for_each(|row| row[1..=CORRIDOR].fill(b'.'));
    cells[east..east + width]
        .iter_mut()
        .for_each(|row| row[CORRIDOR + columns + 1..=2 * CORRIDOR + columns].fill(b'.'));
    cells[west + width / 2][CORRIDOR / 2] = b'S';
    let cells: Vec<String> = cells.into_iter().map(|row| String::from_utf8(row).unwrap()).collect();
    Plan::parse(&format!("cell_mm 100\n{}\n", cells.join("\n"))).unwrap()
}

#[test]
fn a_hall_wider_than_the_sonars_reach_is_crossed_from_corridor_to_corridor() {
    for (seed, size, west, east, width) in
        [(1, [140, 140], 60, 60, 20), (2, [150, 130], 25, 90, 18), (3, [160, 150], 110, 40, 22)]
    {
        let plan = hall(size, west, east, width);
        let mut buffer = [0; SNAPSHOT_BYTES];
        let mut exploration = Exploration::start(&plan, RobotModel::default(), seed, &mut buffer).unwrap();
        let mut crossings = 0;
        let mut is_east = false;
        while crossings < 4 {
            assert!(exploration.frames() < 20_000, "{size:?}: {crossings} crossings");
            exploration.advance();
            let x_mm = exploration.rover().position().x_mm;
            let is_far = if is_east { x_mm < 3500.0 } else { x_mm > 100.0 * (size[0] + 46) as f64 };
            (is_east, crossings) = (is_east != is_far, crossings + u32::from(is_far));
        }
        assert!(exploration.times_lost() <= 2 * crossings, "{size:?}: lost {} times", exploration.times_lost());
        assert_eq!(exploration.rover().bumps(), 0, "{size:?}");
    }
}

#[test]
fn with_a_tenth_of_the_answers_lost_and_false_ranges_the_exits_are_right() {
    let plan = Plan::built_in("office").unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
    exploration.set_faults(FaultRates { answer_lost: 0.1, range_corrupted: 0.025, ..FaultRates::NONE }, 1);
    while exploration.places() < 100 {
        assert!(exploration.frames() < 100_000, "after {} places", exploration.places());
        exploration.advance();
    }
    let reported: Vec<ReportedHints> = exploration.steps().iter().map(|step| step.reported).collect();
    let (reported, wrong, _) = exploration.ground_truth().hint_report(&reported).exits;
    assert!(reported > 80 && wrong <= 2, "{reported} exits reported, {wrong} wrong");
    let report = exploration.ground_truth().report();
    assert!(report.missed + report.phantom + report.doubled <= 2, "{report}");
}

#[test]
fn a_sonar_stuck_at_one_range_is_left_out_and_the_robot_finds_its_places() {
    for (sonar, range_mm) in [(3, 350), (12, 1400)] {
        let plan = Plan::built_in("office").unwrap();
        let mut buffer = [0; SNAPSHOT_BYTES];
        let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
        while exploration.places() < 60 {
            assert!(exploration.frames() < 60_000, "after {} places", exploration.places());
            let mut frame = exploration.frame();
            frame.echoes[sonar] = Echo::Range { range_mm };
            exploration.map(&frame);
            let velocity = exploration.board().velocity;
            exploration.drive(velocity);
        }
        assert!(exploration.faults().count(FaultKind::SonarImplausible) >= 1, "sonar {sonar} at {range_mm} mm");
        let report = exploration.ground_truth().report();
        assert!(report.found >= 50 && report.missed + report.phantom <= 8, "{report}");
    }
}

#[test]
fn exits_ways_and_travel_times_are_right() {
    let Outcome { hints, .. } = explore("ladder", SonarModel::default(), 2, 60);
    let (reported, wrong, unknown) = hints.exits;
    assert!(reported > 50 && wrong <= 1 && unknown <= 1, "{:?}", hints.exits);
    let (ways, missed, not_there) = hints.ways;
    assert!(ways > 50 && missed <= 1 && not_there <= 1, "{:?}", hints.ways);
    assert!(hints.bearing_errors_rad.iter().all(|error_rad| error_rad.abs() < 0.4));
    assert!(hints.travel_errors.iter().all(|error| error.abs() < 0.15), "{:?}", hints.travel_errors);
}

#[test]
fn a_robot_without_ways_explores_at_random_and_has_no_path_to_a_vertex() {
    let plan = Plan::built_in("office").unwrap();
    let mut buffer = [0; robust::SNAPSHOT_BYTES];
    let model = RobotModel::default();
    let mut exploration =
        Exploration::<{ robust::VERTICES }, robust::Filter>::with_robot(&plan, model, 1, &robust::ROBOT, &mut buffer)
            .unwrap();
    while exploration.places() < 30 {
        exploration.advance();
    }
    let robot = exploration.robot();
    let map = robot.mapper().map();
    assert!(map.edges().count() > 2);
    assert!(map.vertices().all(|vertex| !robot.drive().leads_to(robot.mapper().filter(), vertex)));
    assert!(!robot.drive().is_complete());
}

#[test]
fn a_map_is_complete_when_every_way_was_driven_and_the_robot_goes_on() {
    let plan = Plan::built_in("office").unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
    let edges = exploration.rover().true_map().edges.len();
    while !exploration.robot().drive().is_complete() {
        exploration.advance();
        assert!(exploration.places() < 4 * edges, "{} places", exploration.places());
    }
    assert!(score_exploration(&exploration).exact);
    assert_eq!(exploration.robot().mapper().map().edges().count(), edges);
    let places = exploration.places();
    while exploration.places() < places + 30 {
        exploration.advance();
        assert!(exploration.robot().drive().is_complete());
    }
    assert!(score_exploration(&exploration).exact);
}

#[test]
fn one_of_two_parallel_corridors_is_the_shorter_way_to_a_vertex() {
    // Two junctions of the ladder are joined by a rail and, around the other rail, by the rungs. No path has more than five edges,
    // from a dead end to the farthest.
    let plan = Plan::built_in("ladder").unwrap();
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), 1, &mut buffer).unwrap();
    while !exploration.robot().drive().is_complete() {
        exploration.advance();
    }
    for vertex in exploration.robot().mapper().map().vertices().map(u8::from).collect::<Vec<_>>() {
        let places = exploration.places();
        exploration.command(Command::GoTo { vertex });
        exploration.advance();
        while exploration.is_underway() {
            exploration.advance();
        }
        let steps = exploration.places() - places;
        assert!(steps <= 5, "{steps} places to vertex {vertex}");
    }
}

/// A corridor 2 m wide with a room of 4.3 m by 3.4 m on each side, each behind a door of this width in a wall of 0.2 m.
fn rooms_at_a_corridor(door_mm: f64) -> Plan {
    const CELL_MM: f64 = 50.0;
    let free = [
        (0.0, 4000.0, 12_000.0, 6000.0),
        (2000.0, 6200.0, 6300.0, 9600.0),
        (6000.0, 400.0, 10_300.0, 3800.0),
        (3200.0, 6000.0, 3200.0 + door_mm, 6200.0),
        (8300.0, 3800.0, 8300.0 + door_mm, 4000.0),
    ];
    let cell = |row: u32, column: u32| {
        let (x, y) = ((f64::from(column) + 0.5) * CELL_MM, (f64::from(row) + 0.5) * CELL_MM);
        let is_free = free.iter().any(|(left, low, right, high)| x > *left && x < *right && y > *low && y < *high);
        if (row, column) == (100, 110) {
            'S'
        } else if is_free {
            '.'
        } else {
            '#'
        }
    };
    let rows = (0..200).rev().map(|row| (0..240).map(|column| cell(row, column)).collect::<String>());
    let rows: Vec<String> = rows.collect();
    Plan::parse(&format!("cell_mm {CELL_MM}\n{}", rows.join("\n"))).unwrap()
}

/// The result of 60 places among the rooms at a corridor.
struct Rooms {
    /// How often the robot went into each room or out of it.
    changes: [usize; 2],
    lost: u32,
    /// Frames in which the robot touched a wall.
    touched: u32,
}

fn explore_rooms(door_mm: f64, seed: u64) -> Rooms {
    let plan = rooms_at_a_corridor(door_mm);
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut exploration = Exploration::start(&plan, RobotModel::default(), seed, &mut buffer).unwrap();
    let mut changes = [0; 2];
    let mut is_inside = [false; 2];
    while exploration.places() < 60 {
        exploration.advance();
        assert!(exploration.frames() < 15_000, "door of {door_mm} mm: {} places", exploration.places());
        let y_mm = exploration.rover().position().y_mm;
        for (room, is_in) in [y_mm > 6500.0, y_mm < 3500.0].into_iter().enumerate() {
            changes[room] += usize::from(is_in != is_inside[room]);
            is_inside[room] = is_in;
        }
    }
    Rooms { changes, lost: exploration.times_lost(), touched: exploration.rover().bumps() }
}

#[test]
fn rooms_behind_doors_of_1300_mm_and_more_are_entered_and_left() {
    for (door_mm, seed) in [(1300.0, 1), (1300.0, 2), (1400.0, 3), (1400.0, 4), (1500.0, 5), (1600.0, 6)] {
        let Rooms { changes, lost, touched } = explore_rooms(door_mm, seed);
        assert!(changes.iter().all(|changes| *changes >= 2), "door of {door_mm} mm: {changes:?}");
        assert!(lost <= 3, "door of {door_mm} mm: lost {lost} times");
        assert_eq!(touched, 0, "door of {door_mm} mm");
    }
}

#[test]
fn a_room_behind_a_narrower_door_is_entered_and_no_wall_is_touched() {
    for (door_mm, seed) in [(800.0, 1), (900.0, 2), (1000.0, 3), (1200.0, 4)] {
        let Rooms { changes, touched, .. } = explore_rooms(door_mm, seed);
        assert!(changes.iter().any(|changes| *changes >= 1), "door of {door_mm} mm: {changes:?}");
        assert_eq!(touched, 0, "door of {door_mm} mm");
    }
}

#[test]
#[ignore = "prints the table of doors in docs/driving.md"]
fn table_of_doors() {
    const SEEDS: u64 = 12;
    for door_mm in [800.0, 900.0, 1000.0, 1100.0, 1200.0, 1300.0, 1400.0, 1500.0, 1600.0] {
        let runs: Vec<Rooms> = (1..=SEEDS).map(|seed| explore_rooms(door_mm, seed)).collect();
        let both = runs.iter().filter(|run| run.changes.iter().all(|changes| *changes >= 2)).count();
        let lost: u32 = runs.iter().map(|run| run.lost).sum();
        let touched: u32 = runs.iter().map(|run| run.touched).sum();
        println!("| {door_mm} mm | {both} of {SEEDS} | {lost} | {touched} |");
    }
}
