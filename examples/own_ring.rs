//! A ring of sensors that the library does not know: eight of them, read in any way.
//!
//! A ring implements [`SonarRing`]. Everything behind it follows from its geometry.
//!
//! ```sh
//! cargo run --example own_ring
//! ```

use toposlam::ring::drivers::{SonarError, SonarFault, SonarRing};
use toposlam::ring::{Echo, RingFrame, RingGeometry};
use toposlam::{ConfigError, FaultCounters, Mapper, MapperConfig, RobustFilter};

const SONARS: usize = 8;

/// Eight range sensors behind a multiplexer. Here they are simulated in a corridor, 1.6 m wide at one end and 2.4 m at the other.
struct OwnRing {
    step: u32,
    last_error: Option<SonarError>,
}

impl OwnRing {
    /// Reads one sensor: `None` without an answer, 0 without an echo, otherwise the range in millimetres.
    fn range_mm(&self, sensor: usize) -> Option<u16> {
        let sweep = self.step / 101;
        let ahead_mm = 30 * (self.step % 101).abs_diff(50) as u16;
        let half_width_mm = if sweep.is_multiple_of(2) { 800 } else { 1200 };
        match sensor {
            0 => Some(half_width_mm + ahead_mm),
            2 | 6 => Some(half_width_mm),
            5 => None,
            _ => Some(0),
        }
    }
}

impl SonarRing<SONARS> for OwnRing {
    fn read(&mut self, faults: &mut FaultCounters) -> RingFrame<SONARS> {
        let mut echoes = [Echo::Dead; SONARS];
        self.last_error = None;
        for (sensor, echo) in (0..).zip(&mut echoes) {
            *echo = match self.range_mm(sensor.into()) {
                Some(0) => Echo::Silence,
                Some(range_mm) => Echo::Range { range_mm },
                // A sensor that fails stays dead, and the others are read all the same.
                None => {
                    let error = SonarError { sensor, fault: SonarFault::Silent };
                    faults.record(error.fault.kind());
                    self.last_error = Some(error);
                    continue;
                }
            };
        }
        self.step += 1;
        RingFrame { echoes }
    }

    fn last_error(&self) -> Option<SonarError> {
        self.last_error
    }
}

fn main() -> Result<(), ConfigError> {
    let mut ring = OwnRing { step: 0, last_error: None };
    let mut faults = FaultCounters::new();
    let mut mapper = Box::new(Mapper::<SONARS, 16, RobustFilter<10, 16, 400>>::new());
    mapper.start(&MapperConfig::for_ring(RingGeometry::even()))?;

    // The robot drives between the ends of the corridor; at each of them three obstacles are equally far.
    for _ in 0..5 * 101 {
        if let Some((place, update)) = mapper.observe(&ring.read(&mut faults), None) {
            println!("radius {} mm: vertex {}", place.fingerprint.radius_mm(), update.vertex);
        }
    }
    println!("faults of the ring: {faults:?}");
    assert_eq!(mapper.map().vertices().len(), 2);
    Ok(())
}

#[test]
fn the_example_finds_both_ends() {
    main().unwrap();
}
