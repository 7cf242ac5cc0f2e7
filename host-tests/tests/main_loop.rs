//! The main loop of the robot, on a board in memory.

use toposlam::reference::{ROBOT, ReferenceRobot, SNAPSHOT_BYTES, SONARS};
use toposlam::ring::{Echo, RingFrame};
use toposlam::{FaultCounters, FaultKind};
use toposlam_sim::exploration::MemoryBoard;

#[test]
fn a_late_turn_is_counted_and_a_wrapping_clock_is_not_late() {
    let mut buffer = [0; SNAPSHOT_BYTES];
    let mut robot = Box::new(ReferenceRobot::new());
    robot.start(&ROBOT, &mut buffer).unwrap();
    let silence = RingFrame { echoes: [Echo::Silence; SONARS] };
    let bound_ms = u32::from(ROBOT.turn_bound_ms);
    // The clock wraps between the second turn and the third.
    let first_ms = u32::MAX - bound_ms - 10;
    let turns = [
        (first_ms, 0),
        (first_ms + bound_ms, 0),
        (first_ms.wrapping_add(2 * bound_ms), 0),
        (first_ms.wrapping_add(3 * bound_ms + 1), 1),
        (first_ms.wrapping_add(4 * bound_ms + 1), 1),
    ];
    let mut board = MemoryBoard::default();
    for (now_ms, late) in turns {
        board.now_ms = now_ms;
        robot.turn(&silence, &FaultCounters::new(), &mut board);
        assert_eq!(robot.faults(&FaultCounters::new()).count(FaultKind::LoopLate), late, "at {now_ms} ms");
    }
}
