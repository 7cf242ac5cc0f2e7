//! Maps with a ring of one's own: a type that implements `SonarRing`, a place detector and a filter.
//!
//! ```sh
//! cargo run --release --example own_ring
//! ```

use std::error::Error;

use toposlam::ring::drivers::{SonarError, SonarRing};
use toposlam::ring::{Echo, RingFrame, RingGeometry};
use toposlam::{FaultCounters, Mapper, MapperConfig, Passage, RobustFilter};

/// Sensors of the ring, 45° apart, counter-clockwise, the first one straight ahead.
const SENSORS: usize = 8;

/// Ring frames from the entrance of the corridor to its end and back.
const FRAMES_PER_LAP: u16 = 202;

/// A cart that drives to and fro in a corridor. The corridor is 1.6 m wide at one end and 2.4 m at the other.
#[derive(Default)]
struct Cart {
    frame: u16,
}

impl SonarRing<SENSORS> for Cart {
    fn read(&mut self, _faults: &mut FaultCounters) -> RingFrame<SENSORS> {
        let lap = self.frame / FRAMES_PER_LAP % 2;
        let half_width_mm = if lap == 0 { 800 } else { 1200 };
        let to_end = (self.frame % FRAMES_PER_LAP).abs_diff(FRAMES_PER_LAP / 2);
        self.frame = self.frame.wrapping_add(1);
        // The end wall is ahead. A sensor 45° aside hears the wall beside it from √2 times as far. Behind there is nothing.
        let range = |range_mm: u16| Echo::Range { range_mm };
        let slant_mm = (f32::from(half_width_mm) * std::f32::consts::SQRT_2) as u16;
        let mut echoes = [Echo::Silence; SENSORS];
        echoes[0] = range(half_width_mm + 30 * to_end);
        for (sensor, range_mm) in [(1, slant_mm), (2, half_width_mm), (3, slant_mm)] {
            echoes[sensor] = range(range_mm);
            echoes[SENSORS - sensor] = range(range_mm);
        }
        RingFrame { echoes }
    }

    fn last_error(&self) -> Option<SonarError> {
        None
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut mapper = Box::new(Mapper::<SENSORS, 16, RobustFilter<10, 16, 400>>::new());
    mapper.start(&MapperConfig::for_ring(RingGeometry::even()))?;
    let (mut cart, mut faults) = (Cart::default(), FaultCounters::new());
    for _ in 0..6 * FRAMES_PER_LAP {
        let frame = cart.read(&mut faults);
        if let Some((place, update)) = mapper.observe(&frame, Passage::UNKNOWN) {
            println!("radius {} mm: vertex {}", place.fingerprint.radius_mm(), update.vertex);
        }
    }
    if mapper.filter().observed() < 6 {
        return Err("the corridor has an end in each lap".into());
    }
    for (a, b) in mapper.map().edges() {
        println!("{a} -- {b}");
    }
    Ok(())
}

#[test]
fn the_example_finds_both_ends_of_the_corridor() {
    main().unwrap();
}
