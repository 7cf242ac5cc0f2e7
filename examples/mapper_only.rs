//! A map from a list of places: only the filter, for a robot that detects places in its own way.
//!
//! Each line of `places.csv` is one visit to a place: the radius of the largest free disc around it, the number of ways
//! that lead away (may be empty), and whether the robot left the previous place by the way it had come (`back`), by another
//! one (`on`), or does not know (empty).
//!
//! ```sh
//! cargo run --example mapper_only
//! ```

use toposlam::{Fingerprint, Observation, RobustConfig, RobustFilter, Turn};

const PLACES: &str = include_str!("places.csv");

/// At most 10 hypotheses, maps of at most 16 vertices, and a history of 400 places.
type Filter = RobustFilter<10, 16, 400>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut filter = Box::new(Filter::new());
    filter.start(RobustConfig::DEFAULT, 1)?;

    for line in PLACES.lines().skip(1) {
        let update = filter.observe(observation(line)?);
        // A robot refines the map while it drives to the next place, one step for each ring frame.
        for _ in 0..20 {
            filter.polish();
        }
        println!("place {:2}: {line:12} is vertex {}", update.place_index, update.vertex);
    }

    let map = filter.map();
    for vertex in map.vertices() {
        let radius_mm = map.label(vertex).map_or(0, Fingerprint::radius_mm);
        println!("vertex {vertex}: radius {radius_mm} mm, {} visits", map.visits(vertex));
    }
    let edges: Vec<String> = map.edges().map(|(a, b)| format!("{a}-{b}")).collect();
    println!("edges: {}", edges.join(" "));
    assert_eq!((map.vertices().len(), edges.len()), (9, 12));
    Ok(())
}

/// Parses one line of the file.
fn observation(line: &str) -> Result<Observation, Box<dyn std::error::Error>> {
    let mut columns = line.split(',');
    let mut column = || columns.next().ok_or("a column is missing");
    let mut observation = Observation::new(Fingerprint::from_radius_mm(column()?.parse()?)?);
    observation.degree = column()?.parse().ok();
    observation.turn = match column()? {
        "back" => Some(Turn::Back),
        "on" => Some(Turn::On),
        _ => None,
    };
    Ok(observation)
}

#[test]
fn the_example_finds_the_map() {
    main().unwrap();
}
