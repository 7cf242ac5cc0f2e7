//! Prints the recorded input of the bench image: a drive of the simulated robot through the office plan with seed 1.
//!
//! ```sh
//! cargo run --release -p toposlam-host-tests --example bench_input -- places > src/bin/bench/places.rs
//! cargo run --release -p toposlam-host-tests --example bench_input -- hints > src/bin/bench/hints.rs
//! cargo run --release -p toposlam-host-tests --example bench_input -- frames > src/bin/bench/frames.rs
//! ```
//!
//! The robot has the paper's filter, which knows no ways. So it leaves every place by a random exit, and the recording does not
//! depend on any inference.

use toposlam::reference::paper;
use toposlam::ring::RingFrame;
use toposlam_sim::exploration::Exploration;
use toposlam_sim::world::{Plan, RobotModel, SONARS};

const PLACES: usize = 400;
const FRAMES: usize = 200;

fn main() {
    let plan = Plan::built_in("office").expect("it is built in");
    let mut exploration = Exploration::<{ paper::VERTICES }, paper::Filter>::with_robot(
        &plan,
        RobotModel::default(),
        1,
        &paper::ROBOT,
        &mut [],
    )
    .expect("the plan has a Voronoi graph");
    match std::env::args().nth(1).as_deref() {
        Some("places") => {
            while exploration.places() < PLACES {
                exploration.advance();
            }
            println!(
                "// The radii of {PLACES} places in millimetres, as the place detector found them on a drive of the simulated robot"
            );
            println!("// through the office plan with seed 1. `host-tests/examples/bench_input.rs` made this file.");
            println!("[");
            for row in exploration.steps().chunks(16) {
                let radii: Vec<_> = row.iter().map(|step| step.place.fingerprint.radius_mm().to_string()).collect();
                println!("    {},", radii.join(", "));
            }
            println!("]");
        }
        Some("hints") => {
            while exploration.places() < PLACES {
                exploration.advance();
            }
            println!(
                "// The hints of these places: the bearings of the ways other than the one by which the robot came, the exit from"
            );
            println!(
                "// the place before, and the travel time in ring frames. `host-tests/examples/bench_input.rs` made this file."
            );
            println!("[");
            for step in exploration.steps() {
                println!("    {},", format!("{:?}", step.reported.recorded()).replace("Some([", "Some(&["));
            }
            println!("]");
        }
        Some("frames") => {
            println!(
                "// The first {FRAMES} ring frames of a drive of the simulated robot through the office plan with seed 1, ranges"
            );
            println!("// in millimetres, 0 for silence. `host-tests/examples/bench_input.rs` made this file.");
            println!("[");
            for _ in 0..FRAMES {
                let frame: RingFrame<SONARS> = exploration.frame();
                exploration.map(&frame);
                let velocity = exploration.board().velocity;
                exploration.drive(velocity);
                let ranges_mm = frame.echoes.map(|echo| echo.range_mm().unwrap_or(0).to_string());
                println!("    [{}],", ranges_mm.join(", "));
            }
            println!("]");
        }
        _ => {
            eprintln!("usage: bench_input places|hints|frames");
            std::process::exit(2);
        }
    }
}
