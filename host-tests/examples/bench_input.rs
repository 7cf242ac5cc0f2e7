//! Prints the recorded input of the bench image: the simulated drive through the office plan with seed 1.
//!
//! ```sh
//! cargo run --release -p toposlam-host-tests --example bench_input -- places > src/bin/support/bench_places.rs
//! cargo run --release -p toposlam-host-tests --example bench_input -- frames > src/bin/support/bench_frames.rs
//! ```

use toposlam::reference::{self, Detector};
use toposlam_host::world::{Plan, RobotModel, Simulation};

/// More than the history of the reference robot holds, so that its ring wraps.
const PLACES: usize = 400;
const FRAMES: usize = 200;

fn main() {
    let plan = Plan::built_in("office").expect("it is built in");
    let simulation = Simulation::new(&plan, RobotModel::default(), 1).expect("the plan has a Voronoi graph");
    let frames = simulation.map(|(frame, _)| frame);
    match std::env::args().nth(1).as_deref() {
        Some("places") => {
            let mut detector = Detector::new();
            detector.start(reference::PLACE, reference::RING).expect("the reference settings are valid");
            let places = frames.filter_map(|frame| detector.observe(&frame));
            let radii_mm: Vec<_> = places.map(|place| place.fingerprint.radius_mm()).take(PLACES).collect();
            println!(
                "// The radii of {PLACES} places in millimetres, as the place detector found them on the simulated"
            );
            println!(
                "// drive through the office plan with seed 1. `host-tests/examples/bench_input.rs` made this file."
            );
            println!("[");
            for row in radii_mm.chunks(16) {
                println!("    {},", row.iter().map(u16::to_string).collect::<Vec<_>>().join(", "));
            }
            println!("]");
        }
        Some("frames") => {
            println!(
                "// The first {FRAMES} ring frames of the simulated drive through the office plan with seed 1, ranges"
            );
            println!("// in millimetres, 0 for silence. `host-tests/examples/bench_input.rs` made this file.");
            println!("[");
            for frame in frames.take(FRAMES) {
                let ranges_mm = frame.echoes.map(|echo| echo.range_mm().unwrap_or(0).to_string());
                println!("    [{}],", ranges_mm.join(", "));
            }
            println!("]");
        }
        _ => {
            eprintln!("usage: bench_input places|frames");
            std::process::exit(2);
        }
    }
}
