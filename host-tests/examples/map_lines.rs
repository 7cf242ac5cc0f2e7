//! Maps the lines of the standard input with the library: what the tests of the Python module compare it with.
//!
//! ```sh
//! map_lines FILTER places SEED STEPS < LINES     # refinement steps between two places
//! map_lines FILTER frames SONARS SEED < LINES    # an even ring
//! ```
//!
//! FILTER is `ordered`, `robust` or `paper`, with its default settings and the capacities of the reference robot. A line of places has
//! the fields radius_mm, ways, exit, travel_frames, starts_sequence; one of frames has the ranges, separated by spaces, then exit,
//! travel_frames, entry_mrad. Fields are separated by commas; an empty one is unknown. Ways are a number, or the bearings of the others,
//! each after a space. For each place the program prints its radius and its vertex, at the end the digest and the probability of the map.

use std::env::args;
use std::error::Error;
use std::io::{BufRead, stdin};

use toposlam::reference::{ordered, paper, robust};
use toposlam::ring::{Echo, RingFrame, RingGeometry};
use toposlam::wire::map_digest;
use toposlam::{
    Exit, Filter, Fingerprint, Mapper, MapperConfig, Observation, OrderedConfig, PaperConfig, Passage, RobustConfig,
    Ways,
};

type Failure = Box<dyn Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = args().skip(1).collect();
    let [filter, what, numbers @ ..] = &arguments[..] else { return Err("see the first lines of this file".into()) };
    let numbers: Vec<u64> = numbers.iter().map(|number| number.parse()).collect::<Result<_, _>>()?;
    match filter.as_str() {
        "ordered" => run::<{ ordered::VERTICES }, ordered::Filter>(what, OrderedConfig::DEFAULT, &numbers),
        "robust" => run::<{ robust::VERTICES }, robust::Filter>(what, RobustConfig::DEFAULT, &numbers),
        "paper" => run::<{ paper::VERTICES }, paper::Filter>(what, PaperConfig::DEFAULT, &numbers),
        _ => Err(format!("no filter {filter}").into()),
    }
}

fn run<const V: usize, F: Filter<V>>(what: &str, config: F::Config, numbers: &[u64]) -> Result<(), Failure> {
    match (what, numbers) {
        ("places", &[seed, steps]) => places::<V, F>(config, seed, steps),
        ("frames", &[5, seed]) => frames::<5, V, F>(config, seed),
        ("frames", &[16, seed]) => frames::<16, V, F>(config, seed),
        _ => Err("see the first lines of this file".into()),
    }
}

fn places<const V: usize, F: Filter<V>>(config: F::Config, seed: u64, steps: u64) -> Result<(), Failure> {
    let mut filter = Box::new(F::UNSTARTED);
    filter.start(config, seed)?;
    for line in stdin().lock().lines() {
        let line = line?;
        let fields: Vec<&str> = line.split(',').collect();
        let [radius_mm, ways, exit, travel_frames, starts_sequence] = fields[..] else {
            return Err("five fields".into());
        };
        let observation = Observation {
            ways: parse_ways(ways)?,
            exit: parse_exit(exit)?,
            travel_frames: travel_frames.parse().ok(),
            starts_sequence: !starts_sequence.is_empty(),
            ..Observation::new(Fingerprint::from_radius_mm(radius_mm.parse()?)?)
        };
        let update = filter.observe(observation);
        println!("{radius_mm} {}", update.vertex);
        (0..steps).for_each(|_| filter.refine());
    }
    print_map(&*filter);
    Ok(())
}

fn frames<const SONARS: usize, const V: usize, F: Filter<V>>(config: F::Config, seed: u64) -> Result<(), Failure> {
    let mut mapper = Box::new(Mapper::<SONARS, V, F>::new());
    mapper.start(&MapperConfig::new(RingGeometry::even(), config).with_seed(seed))?;
    for line in stdin().lock().lines() {
        let line = line?;
        let fields: Vec<&str> = line.split(',').collect();
        let [ranges, exit, travel_frames, entry_mrad] = fields[..] else { return Err("four fields".into()) };
        let mut frame = RingFrame { echoes: [Echo::Dead; SONARS] };
        for (echo, range) in frame.echoes.iter_mut().zip(ranges.split(' ')) {
            *echo = match range {
                "silence" => Echo::Silence,
                "dead" => Echo::Dead,
                range_mm => Echo::Range { range_mm: range_mm.parse()? },
            };
        }
        let passage = Passage {
            exit: parse_exit(exit)?,
            travel_frames: travel_frames.parse().ok(),
            entry_mrad: entry_mrad.parse().ok(),
            returns: false,
        };
        if let Some((place, update)) = mapper.observe(&frame, passage) {
            println!("{} {}", place.fingerprint.radius_mm(), update.vertex);
        }
    }
    print_map(mapper.filter());
    Ok(())
}

fn parse_ways(text: &str) -> Result<Option<Ways>, Failure> {
    let ways = match text.parse() {
        Ok(count) => Ways::from_count(count)?,
        Err(_) if text.is_empty() => return Ok(None),
        Err(_) => {
            let bearings: Vec<u16> = text.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
            Ways::from_bearings_mrad(&bearings)?
        }
    };
    Ok(Some(ways))
}

fn parse_exit(text: &str) -> Result<Option<Exit>, Failure> {
    Ok(match text {
        "" => None,
        "back" => Some(Exit::Back),
        "on" => Some(Exit::On),
        bearing_mrad => Some(Exit::from_bearing_mrad(bearing_mrad.parse()?)?),
    })
}

fn print_map<const V: usize>(filter: &impl Filter<V>) {
    println!("{} {}", map_digest(filter.map(), filter.darts()), filter.map_probability_q16());
}
