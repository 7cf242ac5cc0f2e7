//! Prints the recorded input of the bench image: the simulated drive through the office plan with seed 1.
//!
//! ```sh
//! cargo run --release -p toposlam-host-tests --example bench_input -- places > src/bin/bench/places.rs
//! cargo run --release -p toposlam-host-tests --example bench_input -- hints > src/bin/bench/hints.rs
//! cargo run --release -p toposlam-host-tests --example bench_input -- frames > src/bin/bench/frames.rs
//! ```

use toposlam::Exit;
use toposlam::place::Place;
use toposlam::reference::{self, Detector};
use toposlam_sim::world::{Plan, RobotModel, Simulation};

/// As many as the history of the reference robot holds.
const PLACES: usize = 400;
const FRAMES: usize = 200;

fn main() {
    let plan = Plan::built_in("office").expect("it is built in");
    let simulation = Simulation::new(&plan, RobotModel::default(), 1).expect("the plan has a Voronoi graph");
    match std::env::args().nth(1).as_deref() {
        Some("places") => {
            let radii_mm: Vec<_> = places(simulation).iter().map(|(place, _)| place.fingerprint.radius_mm()).collect();
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
        Some("hints") => {
            println!("// The hints of these places: the bearings of the ways other than the one by which the robot came, the exit from");
            println!("// the place before, and the travel time in ring frames. `host-tests/examples/bench_input.rs` made this file.");
            println!("[");
            for hints in places(simulation).iter().map(|(place, exit)| hints(place, *exit)) {
                println!("    {hints},");
            }
            println!("]");
        }
        Some("frames") => {
            println!(
                "// The first {FRAMES} ring frames of the simulated drive through the office plan with seed 1, ranges"
            );
            println!("// in millimetres, 0 for silence. `host-tests/examples/bench_input.rs` made this file.");
            println!("[");
            for (frame, _) in simulation.take(FRAMES) {
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

/// The places of a drive, and what the drive knows of how the robot left the place before each.
fn places(simulation: Simulation) -> Vec<(Place, Option<Exit>)> {
    let mut detector = Detector::new();
    detector.start(reference::PLACE, reference::RING).expect("the reference settings are valid");
    let places = simulation.filter_map(|(frame, truth)| Some((detector.observe(&frame)?, truth.turn)));
    places.take(PLACES).collect()
}
