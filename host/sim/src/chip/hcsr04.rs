//! A model of a bank of HC-SR04 rangers: their pins in simulated time, in a world of ring frames.

use std::{cell::RefCell, fmt, rc::Rc};

use embedded_hal::digital::{Error, ErrorKind, ErrorType, InputPin, OutputPin};
use toposlam::ring::{Echo, RingFrame};

use super::{
    SimulatedTime,
    surroundings::{Surroundings, flight_us},
};

const SHORTEST_TRIGGER_NS: u64 = 10_000;
/// Delay from the end of the trigger to the rising edge of the echo line.
const RISE_NS: u64 = 450_000;
const NO_ECHO_NS: u64 = 38_000_000;
/// Shorter than an echo from 20 mm.
const SPIKE_NS: u64 = 50_000;

/// A fault that a test injects into a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HcSr04Fault {
    /// Its echo line never rises.
    NeverRises,
    /// Its echo line rises and then stays high.
    NeverFalls,
    /// Its echo line is always high.
    HeldHigh,
    /// It answers with a pulse of 50 µs.
    Spike,
    /// It receives no echo and times out after 200 ms, as some clones do.
    GivesUpLate,
    /// Its echo pin cannot be read.
    EchoPinBroken,
    /// Its trigger pin cannot be set.
    TriggerPinBroken,
}

/// The error of a failed pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PinBroken;

impl fmt::Display for PinBroken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the pin is broken")
    }
}

impl std::error::Error for PinBroken {}

impl Error for PinBroken {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// The rangers. [`pins`](Self::pins) returns the pins for a driver.
#[derive(Debug)]
pub struct HcSr04Bank<WORLD, const SONARS: usize> {
    state: Rc<RefCell<State<WORLD, SONARS>>>,
}

#[derive(Debug)]
struct State<WORLD, const SONARS: usize> {
    surroundings: Surroundings<WORLD, SONARS>,
    time: SimulatedTime,
    sensors: [Sensor; SONARS],
    ignored_triggers: u32,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sensor {
    fault: Option<HcSr04Fault>,
    trigger_rose_ns: Option<u64>,
    echo_rises_ns: Option<u64>,
}

impl<WORLD: FnMut() -> Option<RingFrame<SONARS>>, const SONARS: usize> HcSr04Bank<WORLD, SONARS> {
    /// A bank of rangers in a world.
    pub fn new(world: WORLD, time: SimulatedTime) -> Self {
        let sensors = [Sensor::default(); SONARS];
        let state = State { surroundings: Surroundings::new(world), time, sensors, ignored_triggers: 0 };
        Self { state: Rc::new(RefCell::new(state)) }
    }

    /// Trigger and echo pin of each sensor.
    pub fn pins(&self) -> [(TriggerPin<WORLD, SONARS>, EchoPin<WORLD, SONARS>); SONARS] {
        std::array::from_fn(|sensor| {
            (TriggerPin { state: self.state.clone(), sensor }, EchoPin { state: self.state.clone(), sensor })
        })
    }

    /// Injects a fault into a sensor, or clears it.
    pub fn set_fault(&self, sensor: usize, fault: Option<HcSr04Fault>) {
        self.state.borrow_mut().sensors[sensor].fault = fault;
    }

    /// Enables cross-talk: neighbours that listen at the same time both report the shorter range.
    pub fn set_cross_talk(&self, cross_talk: bool) {
        self.state.borrow_mut().surroundings.cross_talk = cross_talk;
    }

    /// Number of trigger pulses that were too short, or came while the echo line was high.
    pub fn ignored_triggers(&self) -> u32 {
        self.state.borrow().ignored_triggers
    }
}

impl<WORLD: FnMut() -> Option<RingFrame<SONARS>>, const SONARS: usize> State<WORLD, SONARS> {
    fn trigger_falls(&mut self, sensor: usize) {
        let now_ns = self.time.now_ns();
        let Some(rose_ns) = self.sensors[sensor].trigger_rose_ns.take() else { return };
        if now_ns - rose_ns < SHORTEST_TRIGGER_NS || self.is_listening(sensor) {
            self.ignored_triggers += 1;
            return;
        }
        let listening = std::array::from_fn(|other| self.is_listening(other));
        self.surroundings.fire(std::array::from_fn(|other| other == sensor), listening);
        self.sensors[sensor].echo_rises_ns = Some(now_ns + RISE_NS);
    }

    /// Start and end of a sensor's echo pulse.
    fn pulse_ns(&self, sensor: usize) -> Option<(u64, u64)> {
        let rises_ns = self.sensors[sensor].echo_rises_ns?;
        let length_ns = match (self.sensors[sensor].fault, self.surroundings.heard(sensor)) {
            (Some(HcSr04Fault::NeverRises), _) => return None,
            (Some(HcSr04Fault::NeverFalls), _) => return Some((rises_ns, u64::MAX)),
            (Some(HcSr04Fault::Spike), _) => SPIKE_NS,
            (Some(HcSr04Fault::GivesUpLate), _) => 200_000_000,
            (_, Echo::Range { range_mm }) => u64::from(flight_us(range_mm)) * 1000,
            (_, Echo::Silence | Echo::Dead) => NO_ECHO_NS,
        };
        (!self.surroundings.is_dead(sensor)).then_some((rises_ns, rises_ns + length_ns))
    }

    fn is_listening(&self, sensor: usize) -> bool {
        self.pulse_ns(sensor).is_some_and(|(_, falls_ns)| self.time.now_ns() < falls_ns)
    }

    fn echo_is_high(&self, sensor: usize) -> bool {
        let now_ns = self.time.now_ns();
        self.sensors[sensor].fault == Some(HcSr04Fault::HeldHigh)
            || self.pulse_ns(sensor).is_some_and(|(rises_ns, falls_ns)| (rises_ns..falls_ns).contains(&now_ns))
    }
}

/// The trigger input of a sensor.
#[derive(Debug)]
pub struct TriggerPin<WORLD, const SONARS: usize> {
    state: Rc<RefCell<State<WORLD, SONARS>>>,
    sensor: usize,
}

impl<WORLD, const SONARS: usize> ErrorType for TriggerPin<WORLD, SONARS> {
    type Error = PinBroken;
}

impl<WORLD: FnMut() -> Option<RingFrame<SONARS>>, const SONARS: usize> TriggerPin<WORLD, SONARS> {
    fn is_broken(&self) -> bool {
        self.state.borrow().sensors[self.sensor].fault == Some(HcSr04Fault::TriggerPinBroken)
    }
}

impl<WORLD: FnMut() -> Option<RingFrame<SONARS>>, const SONARS: usize> OutputPin for TriggerPin<WORLD, SONARS> {
    fn set_low(&mut self) -> Result<(), PinBroken> {
        if self.is_broken() {
            return Err(PinBroken);
        }
        self.state.borrow_mut().trigger_falls(self.sensor);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), PinBroken> {
        if self.is_broken() {
            return Err(PinBroken);
        }
        let mut state = self.state.borrow_mut();
        let now_ns = state.time.now_ns();
        state.sensors[self.sensor].trigger_rose_ns.get_or_insert(now_ns);
        Ok(())
    }
}

/// The echo output of a sensor.
#[derive(Debug)]
pub struct EchoPin<WORLD, const SONARS: usize> {
    state: Rc<RefCell<State<WORLD, SONARS>>>,
    sensor: usize,
}

impl<WORLD, const SONARS: usize> ErrorType for EchoPin<WORLD, SONARS> {
    type Error = PinBroken;
}

impl<WORLD: FnMut() -> Option<RingFrame<SONARS>>, const SONARS: usize> InputPin for EchoPin<WORLD, SONARS> {
    fn is_high(&mut self) -> Result<bool, PinBroken> {
        let state = self.state.borrow();
        if state.sensors[self.sensor].fault == Some(HcSr04Fault::EchoPinBroken) {
            return Err(PinBroken);
        }
        Ok(state.echo_is_high(self.sensor))
    }

    fn is_low(&mut self) -> Result<bool, PinBroken> {
        self.is_high().map(|is_high| !is_high)
    }
}
