//! The input that the bench image carries is what the simulation gives.

use toposlam::Exit;
use toposlam::reference::{self, Detector};
use toposlam::ring::Echo;
use toposlam_sim::world::{Plan, RobotModel, SONARS, Simulation};

const PLACES_MM: [u16; 400] = include!("../../src/bin/bench/places.rs");
const HINTS: [[u8; 2]; 400] = include!("../../src/bin/bench/hints.rs");
const FRAMES_MM: [[u16; SONARS]; 200] = include!("../../src/bin/bench/frames.rs");

/// The first places are enough to notice that the recording is of another drive, and take a fraction of the time.
const COMPARED_PLACES: usize = 20;

#[test]
fn the_recorded_bench_input_is_the_drive_through_the_office() {
    let plan = Plan::built_in("office").unwrap();
    let simulation = Simulation::new(&plan, RobotModel::default(), 1).unwrap();
    let mut detector = Detector::new();
    detector.start(reference::PLACE, reference::RING).unwrap();
    let (mut frames, mut places) = (0, 0);
    for (frame, truth) in simulation {
        if let Some(recorded_mm) = FRAMES_MM.get(frames) {
            let recorded = recorded_mm.map(|mm| if mm == 0 { Echo::Silence } else { Echo::Range { range_mm: mm } });
            assert_eq!(frame.echoes, recorded, "frame {frames}");
        }
        frames += 1;
        if let Some(place) = detector.observe(&frame) {
            assert_eq!(place.fingerprint.radius_mm(), PLACES_MM[places], "place {places}");
            let turn = match truth.turn {
                None => b'-',
                Some(Exit::Back) => b'b',
                Some(_) => b'o',
            };
            assert_eq!([turn, b'0' + place.degree.unwrap_or(0)], HINTS[places], "place {places}");
            places += 1;
            if places == COMPARED_PLACES {
                break;
            }
        }
    }
    assert!(frames > FRAMES_MM.len(), "{frames} frames");
}
