//! A ring returns a valid frame for arbitrary answers of its sensors.

use embedded_hal::{
    digital,
    i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation},
};
use proptest::prelude::*;
use toposlam::{
    FaultCounters, FaultKind,
    ring::drivers::{
        HcSr04Config, HcSr04Ring, MaxBotixConfig, MaxBotixRing, MicrosecondClock, SonarRing, Srf08Config, Srf08Ring,
        Vl53l1xConfig, Vl53l1xRing,
    },
    ring::{Echo, RingFrame},
};
use toposlam_sim::chip::{HcSr04Bank, HcSr04Fault, I2cBus, MaxBotixBank, SensorFault, SimulatedTime, Srf08Bank};

use crate::{Waited, without, world, world_frame};

/// A bus, pins and a clock whose answers follow from a cyclic sequence of bytes.
#[derive(Clone)]
struct Noise {
    bytes: Vec<u8>,
    next: usize,
    transfers: u32,
}

impl Noise {
    fn of(bytes: Vec<u8>) -> Self {
        Self { bytes, next: 0, transfers: 0 }
    }

    fn byte(&mut self) -> u8 {
        self.next += 1;
        self.bytes[self.next % self.bytes.len()]
    }
}

impl ErrorType for Noise {
    type Error = ErrorKind;
}

impl I2c for Noise {
    fn transaction(&mut self, _: u8, operations: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        self.transfers += 1;
        match self.byte() {
            0..16 => return Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address)),
            16..24 => return Err(ErrorKind::ArbitrationLoss),
            _ => {}
        }
        for operation in operations {
            if let Operation::Read(bytes) = operation {
                bytes.fill_with(|| self.byte());
            }
        }
        Ok(())
    }
}

impl digital::ErrorType for Noise {
    type Error = digital::ErrorKind;
}

impl digital::InputPin for Noise {
    fn is_high(&mut self) -> Result<bool, digital::ErrorKind> {
        match self.byte() {
            0..4 => Err(digital::ErrorKind::Other),
            byte => Ok(byte % 2 == 0),
        }
    }

    fn is_low(&mut self) -> Result<bool, digital::ErrorKind> {
        self.is_high().map(|is_high| !is_high)
    }
}

impl digital::OutputPin for Noise {
    fn set_low(&mut self) -> Result<(), digital::ErrorKind> {
        if self.byte() < 4 { Err(digital::ErrorKind::Other) } else { Ok(()) }
    }

    fn set_high(&mut self) -> Result<(), digital::ErrorKind> {
        self.set_low()
    }
}

impl MicrosecondClock for Noise {
    /// Advances, goes back, or stops.
    fn now_us(&mut self) -> u32 {
        u32::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }
}

/// Every echo is in range, and there is one fault for each dead sensor.
fn assert_sound(frame: RingFrame<16>, faults: &FaultCounters, nearest_mm: u16, farthest_mm: u16) {
    for range_mm in frame.echoes.into_iter().filter_map(Echo::range_mm) {
        assert!((nearest_mm..=farthest_mm).contains(&range_mm), "{range_mm} mm");
    }
    let counted: u32 = FaultKind::ALL.into_iter().map(|kind| faults.count(kind)).sum();
    assert_eq!(counted as usize, frame.dead_sensors().count());
}

proptest! {
    #[test]
    fn any_bytes_from_the_bus_give_a_frame_with_ranges_of_the_data_sheet(bytes in prop::collection::vec(any::<u8>(), 1..64)) {
        for config in [Srf08Config::DEFAULT, Srf08Config::SRF10] {
            let mut waited = Waited::default();
            let mut ring = Srf08Ring::new(Noise::of(bytes.clone()), &mut waited, config).unwrap();
            let mut faults = FaultCounters::new();
            assert_sound(ring.read(&mut faults), &faults, 30, 6000);
            // At most 50 polls of each sensor, in two groups.
            prop_assert!(ring.release().0.transfers <= 16 * 51);
            prop_assert!(waited.nanoseconds <= 2 * 100_000_000);
        }
        let mut waited = Waited::default();
        let mut ring = MaxBotixRing::new(Noise::of(bytes.clone()), &mut waited, MaxBotixConfig::DEFAULT).unwrap();
        let mut faults = FaultCounters::new();
        assert_sound(ring.read(&mut faults), &faults, 200, 7640);
        prop_assert!(ring.release().0.transfers <= 16 * 12);
        prop_assert_eq!(waited.nanoseconds, 2 * 100_000_000);
        let mut waited = Waited::default();
        let mut ring = Vl53l1xRing::new(Noise::of(bytes.clone()), &mut waited, Vl53l1xConfig::DEFAULT).unwrap();
        let mut xshut: [_; 16] = std::array::from_fn(|sensor| Noise { next: sensor, ..Noise::of(bytes.clone()) });
        let _ = ring.start(&mut xshut);
        let mut faults = FaultCounters::new();
        assert_sound(ring.read(&mut faults), &faults, 40, 4000);
        // At most 110 polls and 22 messages of the start, and 60 polls of two messages.
        prop_assert!(ring.release().0.transfers <= 16 * (132 + 1 + 120));
        prop_assert!(waited.nanoseconds <= 1_000_000 + 16 * 550_000_000 + 300_000_000);
    }

    #[test]
    fn any_levels_of_the_pins_and_any_clock_give_a_frame_with_ranges_of_the_data_sheet(
        bytes in prop::collection::vec(any::<u8>(), 1..64),
        clock in prop::collection::vec(any::<u8>(), 1..64),
    ) {
        let pins = std::array::from_fn(|sensor| {
            let pin = Noise { next: sensor, ..Noise::of(bytes.clone()) };
            (pin.clone(), pin)
        });
        let mut waited = Waited::default();
        let config = HcSr04Config::DEFAULT.with_stopped_clock_polls(100);
        let mut ring = HcSr04Ring::new(pins, Noise::of(clock), &mut waited, config).unwrap();
        let mut faults = FaultCounters::new();
        assert_sound(ring.read(&mut faults), &faults, 20, 4000);
        prop_assert!(waited.nanoseconds <= 4 * 60_100_000);
    }

    #[test]
    fn any_subset_of_dead_sensors_leaves_the_others_unharmed_and_is_named(dead in any::<u16>()) {
        let is_dead = |sensor: usize| dead >> sensor & 1 == 1;
        let names = || (0..16).filter(move |&sensor| is_dead(sensor));
        let last = names().next_back().map(|sensor| sensor as u8);

        let mut devices = Srf08Bank::new(world(), 3);
        names().for_each(|sensor| devices.set_fault(sensor, Some(SensorFault::Absent)));
        let mut waited = Waited::default();
        let mut ring = Srf08Ring::new(I2cBus { devices }, &mut waited, Srf08Config::DEFAULT).unwrap();
        for number in 0..2 {
            let frame = ring.read(&mut FaultCounters::new());
            prop_assert_eq!(frame, without(world_frame(number), is_dead));
            prop_assert!(frame.dead_sensors().eq(names()));
            prop_assert_eq!(ring.last_error().map(|error| error.sensor), last);
        }

        let time = SimulatedTime::new(0, 2000);
        let mut devices = MaxBotixBank::new(world(), time.clone());
        names().for_each(|sensor| devices.set_fault(sensor, Some(SensorFault::NeverDone)));
        let mut ring = MaxBotixRing::<_, _, 16>::new(I2cBus { devices }, time.clone(), MaxBotixConfig::DEFAULT).unwrap();
        prop_assert!(ring.read(&mut FaultCounters::new()).dead_sensors().eq(names()));
        prop_assert_eq!(ring.last_error().map(|error| error.sensor), last);

        let bank = HcSr04Bank::new(world(), time.clone());
        names().for_each(|sensor| bank.set_fault(sensor, Some(HcSr04Fault::NeverRises)));
        let mut ring = HcSr04Ring::<_, _, _, _, 16>::new(bank.pins(), time.clone(), time, HcSr04Config::DEFAULT).unwrap();
        prop_assert!(ring.read(&mut FaultCounters::new()).dead_sensors().eq(names()));
        prop_assert_eq!(ring.last_error().map(|error| error.sensor), last);
    }
}
