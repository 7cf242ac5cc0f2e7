//! Maps places that something else has detected: radii and degrees from a CSV file in, a graph of places out.
//!
//! ```sh
//! cargo run --release --example mapper_only                  # examples/places.csv
//! cargo run --release --example mapper_only -- FILE.csv      # columns radius_mm,degree; an empty degree is unknown
//! ```

use std::error::Error;

use toposlam::{Filter, Fingerprint, Observation, RobustConfig, RobustFilter, Ways};

/// Refinement steps between two places. More steps find better maps; a robot runs one in each ring frame.
const REFINEMENT_STEPS: usize = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let text = match std::env::args().nth(1).filter(|argument| argument.ends_with(".csv")) {
        Some(file) => std::fs::read_to_string(file)?,
        None => include_str!("places.csv").to_owned(),
    };
    // Ten hypotheses, maps of up to 16 vertices, a history of 400 places. On a microcontroller this is a `static`.
    let mut filter = Box::new(RobustFilter::<10, 16, 400>::new());
    filter.start(RobustConfig::DEFAULT, 1)?;
    for line in text.lines().skip(1) {
        let (radius_mm, degree) = line.split_once(',').ok_or("a row has two columns, radius_mm and degree")?;
        let fingerprint = Fingerprint::from_radius_mm(radius_mm.parse()?)?;
        let ways = degree.parse().ok().and_then(|degree| Ways::from_count(degree).ok());
        filter.observe(Observation { ways, ..Observation::new(fingerprint) });
        (0..REFINEMENT_STEPS).for_each(|_| filter.refine());
    }
    let update = filter.refresh();
    println!(
        "{} places, {} vertices, now at vertex {}",
        filter.observed(),
        filter.map().vertices().len(),
        update.vertex
    );
    println!("probability of the map among its rivals: {:.2}", f64::from(filter.map_probability_q16()) / 65536.0);
    for (a, b) in filter.map().edges() {
        println!("{a} -- {b}");
    }
    Ok(())
}

#[test]
fn the_example_maps_its_file() {
    main().unwrap();
}
