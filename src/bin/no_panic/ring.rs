//! Calls of the fault counters, the ring and its drivers.

use core::hint::black_box;

use embedded_hal::{
    delay::DelayNs,
    digital,
    i2c::{Error as _, I2c},
};
use embedded_hal_nb::{nb, serial};
use static_cell::ConstStaticCell;
use toposlam::{
    FaultCounters, FaultKind,
    ring::drivers::{
        AddressError, BridgeError, FiringPlan, HcSr04Config, HcSr04Ring, MaxBotixConfig, MaxBotixRing,
        MicrosecondClock, Sc18im700, SonarError, SonarRing, Srf08Config, Srf08Ring, Vl53l1xConfig, Vl53l1xRing,
        change_maxbotix_address, change_srf08_address,
    },
    ring::{Echo, RingFrame, RingGeometry, ScanPoint},
};

use super::any::{Opaque, show};

struct AnyLine;

#[derive(Debug, Clone, Copy)]
struct LineError;

impl serial::Error for LineError {
    fn kind(&self) -> serial::ErrorKind {
        serial::ErrorKind::Other
    }
}

impl serial::ErrorType for AnyLine {
    type Error = LineError;
}

fn any_outcome<T>(value: T) -> nb::Result<T, LineError> {
    match black_box(0_u8) {
        0 => Ok(value),
        1 => Err(nb::Error::WouldBlock),
        _ => Err(nb::Error::Other(LineError)),
    }
}

impl serial::Read<u8> for AnyLine {
    fn read(&mut self) -> nb::Result<u8, LineError> {
        any_outcome(black_box(0))
    }
}

impl serial::Write<u8> for AnyLine {
    fn write(&mut self, byte: u8) -> nb::Result<(), LineError> {
        black_box(byte);
        any_outcome(())
    }

    fn flush(&mut self) -> nb::Result<(), LineError> {
        any_outcome(())
    }
}

struct AnyDelay;

impl DelayNs for AnyDelay {
    fn delay_ns(&mut self, nanoseconds: u32) {
        black_box(nanoseconds);
    }
}

struct AnyPin;

impl digital::ErrorType for AnyPin {
    type Error = digital::ErrorKind;
}

impl digital::InputPin for AnyPin {
    fn is_high(&mut self) -> Result<bool, digital::ErrorKind> {
        if black_box(true) { Ok(black_box(true)) } else { Err(digital::ErrorKind::Other) }
    }

    fn is_low(&mut self) -> Result<bool, digital::ErrorKind> {
        self.is_high()
    }
}

impl digital::OutputPin for AnyPin {
    fn set_low(&mut self) -> Result<(), digital::ErrorKind> {
        if black_box(true) { Ok(()) } else { Err(digital::ErrorKind::Other) }
    }

    fn set_high(&mut self) -> Result<(), digital::ErrorKind> {
        self.set_low()
    }
}

struct AnyClock;

impl MicrosecondClock for AnyClock {
    fn now_us(&mut self) -> u32 {
        black_box(5)
    }
}

pub(crate) fn sonar() {
    let mut bridge = Sc18im700::new(AnyLine, black_box(100));
    let report = |outcome: Result<(), BridgeError>| {
        if let Err(error) = outcome {
            black_box(error.kind());
            show(error);
        }
    };
    report(bridge.start());
    report(bridge.set_baud_rate(black_box(9600)));
    static READ: ConstStaticCell<[u8; 40]> = ConstStaticCell::new([0; 40]);
    if let Some(read) = READ.try_take().and_then(|read| read.get_mut(..black_box(3))) {
        report(bridge.read(black_box(1), read));
        report(bridge.write_read(black_box(1), black_box(&[1, 2, 3]), read));
        let written = black_box([5; 20]);
        report(bridge.write(black_box(1), &written));
        use embedded_hal::i2c::Operation::{Read, Write};
        let mut operations = [Write(&written), Read(read), Write(&written)];
        if let Some(operations) = operations.get_mut(..black_box(2)) {
            report(bridge.transaction(black_box(1), operations));
        }
    }
    i2c_rings(Sc18im700::new(bridge.release(), black_box(7)));
    pin_ring();
}

/// One of the firing plans, hidden from the optimiser.
fn any_plan() -> FiringPlan<16> {
    let own = FiringPlan { group_of: [3; 16].opaque() };
    black_box(own.group_count());
    match black_box(0_u8) {
        0 => own,
        1 => FiringPlan::together(),
        2 => FiringPlan::default(),
        _ => FiringPlan::interleaved(black_box(4)),
    }
}

fn read(ring: &mut impl SonarRing<16>) {
    let mut faults = FaultCounters::new();
    let frame: RingFrame<16> = ring.read(&mut faults);
    black_box((frame, faults));
    if let Some(error) = ring.last_error() {
        show::<SonarError>(error);
        black_box(error.fault.kind());
    }
}

fn i2c_rings(mut bus: impl I2c) {
    for outcome in [
        change_srf08_address(&mut bus, &mut AnyDelay, black_box(0x70), black_box(0x71)),
        change_maxbotix_address(&mut bus, &mut AnyDelay, black_box(0x70), black_box(0x71)),
    ] {
        if let Err(error) = outcome {
            show::<AddressError>(error);
        }
    }
    let config = if black_box(true) { Srf08Config::default() } else { Srf08Config::SRF10 };
    match Srf08Ring::<_, _, 16>::new(&mut bus, AnyDelay, config.with_plan(any_plan()).opaque()) {
        Ok(mut ring) => {
            read(&mut ring);
            ring.release().1.delay_ms(1);
        }
        Err(error) => show::<toposlam::ConfigError>(error),
    }
    let config = MaxBotixConfig::default().with_plan(any_plan());
    match MaxBotixRing::<_, _, 16>::new(&mut bus, AnyDelay, config.opaque()) {
        Ok(mut ring) => read(&mut ring),
        Err(error) => show::<toposlam::ConfigError>(error),
    }
    tof_ring(bus);
}

fn tof_ring(bus: impl I2c) {
    let config = Vl53l1xConfig::default().with_plan(any_plan());
    match Vl53l1xRing::<_, _, 16>::new(bus, AnyDelay, config.opaque()) {
        Ok(mut ring) => {
            let _ = black_box(ring.start(&mut core::array::from_fn(|_| AnyPin)));
            read(&mut ring);
        }
        Err(error) => show::<toposlam::ConfigError>(error),
    }
}

fn pin_ring() {
    let pins = core::array::from_fn(|_| (AnyPin, AnyPin));
    let config = HcSr04Config::default().with_plan(any_plan());
    black_box(config.opaque().echo(black_box(5)).is_ok());
    match HcSr04Ring::<_, _, _, _, 16>::new(pins, AnyClock, AnyDelay, config.opaque()) {
        Ok(mut ring) => {
            read(&mut ring);
            ring.release().2.delay_ms(1);
        }
        Err(error) => show::<toposlam::ConfigError>(error),
    }
}

pub(crate) fn fault() {
    let mut counters = FaultCounters::new().opaque();
    let other = FaultCounters::default().opaque();
    for kind in FaultKind::ALL.opaque() {
        counters.record(kind);
        black_box(counters.count(kind));
    }
    counters.add(&other);
    black_box(counters);
}

pub(crate) fn ring() {
    black_box(Echo::Silence.opaque().range_mm());
    black_box(RingFrame { echoes: [Echo::Dead.opaque(); 16] }.dead_sensors().last());
    black_box(RingFrame::from_ranges([Some(5), None].opaque()));
    let points = [ScanPoint { bearing_mrad: 5, range_mm: 5 }; 20].opaque();
    black_box(RingFrame::<16>::from_points(points, &RingGeometry::even().opaque()));
}
