//! The input that the bench image carries is what the simulation gives.

use toposlam::reference::paper;
use toposlam::ring::Echo;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel, SONARS};

const PLACES_MM: [u16; 400] = include!("../../src/bin/bench/places.rs");
/// The bearings of the other ways and of the exit in milliradians, and the travel time in ring frames; see `src/bin/bench/hints.rs`.
type Hint = (Option<&'static [u16]>, Option<u16>, u16);

const HINTS: [Hint; 400] = include!("../../src/bin/bench/hints.rs");
const FRAMES_MM: [[u16; SONARS]; 200] = include!("../../src/bin/bench/frames.rs");

/// The first places are enough to notice that the recording is of another drive, and take a fraction of the time.
const COMPARED_PLACES: usize = 20;

#[test]
fn the_recorded_bench_input_is_the_drive_through_the_office() {
    let plan = Plan::built_in("office").unwrap();
    let model = RobotModel::default();
    let mut exploration =
        Exploration::<{ paper::VERTICES }, paper::Filter>::with_robot(&plan, model, 1, &paper::ROBOT, &mut []).unwrap();
    let mut frames = 0;
    while exploration.places() < COMPARED_PLACES {
        let frame = exploration.frame();
        exploration.map(&frame);
        let velocity = exploration.board().velocity;
        exploration.drive(velocity);
        if let Some(recorded_mm) = FRAMES_MM.get(frames) {
            let recorded = recorded_mm.map(|mm| if mm == 0 { Echo::Silence } else { Echo::Range { range_mm: mm } });
            assert_eq!(frame.echoes, recorded, "frame {frames}");
        }
        frames += 1;
    }
    for (index, step) in exploration.steps().iter().enumerate() {
        assert_eq!(step.place.fingerprint.radius_mm(), PLACES_MM[index], "place {index}");
        assert_eq!(format!("{:?}", step.reported.recorded()), format!("{:?}", HINTS[index]), "place {index}");
    }
    assert!(frames > FRAMES_MM.len(), "{frames} frames");
}
