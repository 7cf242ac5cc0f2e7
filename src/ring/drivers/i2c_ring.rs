//! A ring of rangers on one I2C bus: firing groups, polling, timeouts and fault counting for any kind of ranger.

use embedded_hal::{
    delay::DelayNs,
    i2c::{Error, ErrorKind, I2c},
};

use super::{FiringPlan, Reading, SonarError, SonarFault, SonarRing, reading::Readings};
use crate::config_error::ConfigError;
use crate::fault::FaultCounters;
use crate::ring::RingFrame;

/// A kind of ranger on an I2C bus: one message starts a measurement, another polls for its result.
///
/// [`Srf08Config`](super::Srf08Config), [`MaxBotixConfig`](super::MaxBotixConfig) and
/// [`Vl53l1xConfig`](super::Vl53l1xConfig) implement it. A new kind of ranger implements it and uses [`I2cRing`].
pub trait I2cRanger<const SONARS: usize> {
    /// Checks the settings, once, before the first frame.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    fn check(&self) -> Result<(), ConfigError>;

    /// 7-bit address of sensor 0. Sensor *i* has this address plus *i*.
    fn first_address(&self) -> u8;

    /// Which sensors fire together.
    fn plan(&self) -> FiringPlan<SONARS>;

    /// The times between the messages.
    fn timing(&self) -> RangingTiming;

    /// An address to which all rangers on the bus listen, if there is one.
    fn broadcast_address(&self) -> Option<u8> {
        None
    }

    /// Starts a measurement.
    ///
    /// # Errors
    /// Errors of the bus. A missing acknowledge is recorded as [`SonarFault::Silent`].
    fn start<BUS: I2c>(&self, bus: &mut BUS, address: u8) -> Result<(), BUS::Error>;

    /// Polls a ranger for its result.
    ///
    /// # Errors
    /// Errors of the bus. A missing acknowledge means that the ranger is still measuring.
    fn poll<BUS: I2c>(&self, bus: &mut BUS, address: u8) -> Result<Reading, BUS::Error>;
}

/// The times of an [`I2cRing`], in microseconds from the start of a firing group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RangingTiming {
    /// Delay before the first poll.
    pub first_poll_us: u32,
    /// Time between two polls of a sensor; 0 counts as 1.
    pub poll_interval_us: u32,
    /// Polling timeout; each sensor is polled at least once.
    pub timeout_us: u32,
    /// Minimum time before the next group starts, even when all sensors are done.
    pub cycle_us: u32,
}

/// A ring of `SONARS` rangers at consecutive addresses of one I2C bus.
///
/// A frame waits for each firing group until its sensors are done, at most for the timeout of their kind. The time on the
/// bus adds to it: one start message for each sensor, and one poll message for each pending sensor and poll interval. Every
/// wait is bounded, so a frame ends whatever the sensors answer, provided that each message on the bus ends.
#[derive(Debug)]
pub struct I2cRing<BUS, DELAY, RANGER, const SONARS: usize> {
    pub(super) bus: BUS,
    pub(super) delay: DELAY,
    pub(super) ranger: RANGER,
    last_error: Option<SonarError>,
}

impl<BUS: I2c, DELAY: DelayNs, RANGER: I2cRanger<SONARS>, const SONARS: usize> I2cRing<BUS, DELAY, RANGER, SONARS> {
    /// Creates a ring. Sends nothing before the first frame.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn new(bus: BUS, delay: DELAY, config: RANGER) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self { bus, delay, ranger: config, last_error: None })
    }

    /// Returns the bus and the delay.
    pub fn release(self) -> (BUS, DELAY) {
        (self.bus, self.delay)
    }

    /// Starts the measurements of a group. A sensor that does not start is done at once; the others are pending.
    fn fire(&mut self, group: u8, readings: &mut Readings<SONARS>) {
        match self.ranger.broadcast_address() {
            Some(address) if self.ranger.plan().is_together() => {
                if let Err(fault) = self.start_at(address) {
                    readings.complete(group, Err(fault));
                }
            }
            _ => {
                for (sensor, reading) in readings.pending(group) {
                    if let Err(fault) = self.start_at(self.address(sensor)) {
                        *reading = Reading::Done(Err(fault));
                    }
                }
            }
        }
    }

    fn start_at(&mut self, address: u8) -> Result<(), SonarFault> {
        self.ranger.start(&mut self.bus, address).map_err(|error| fault(&error))
    }

    fn poll(&mut self, address: u8) -> Reading {
        self.ranger.poll(&mut self.bus, address).unwrap_or_else(|error| match error.kind() {
            ErrorKind::NoAcknowledge(_) => Reading::Pending,
            _ => Reading::Done(Err(SonarFault::Bus)),
        })
    }

    /// Polls a group until it is done or timed out, and waits until the next group may start.
    fn collect(&mut self, group: u8, readings: &mut Readings<SONARS>) {
        let timing = self.ranger.timing();
        let poll_interval_us = timing.poll_interval_us.max(1);
        let (mut waited_us, mut pause_us) = (0_u32, timing.first_poll_us);
        while readings.is_pending(group) {
            self.delay.delay_us(pause_us);
            waited_us = waited_us.saturating_add(pause_us);
            for (sensor, reading) in readings.pending(group) {
                *reading = self.poll(self.address(sensor));
            }
            pause_us = poll_interval_us;
            if waited_us.saturating_add(pause_us) > timing.timeout_us {
                break;
            }
        }
        if let Some(rest_us) = timing.cycle_us.checked_sub(waited_us).filter(|&rest_us| rest_us > 0) {
            self.delay.delay_us(rest_us);
        }
    }

    pub(super) fn address(&self, sensor: usize) -> u8 {
        // Does not wrap: the configuration was checked.
        self.ranger.first_address().wrapping_add(sensor as u8)
    }
}

impl<BUS: I2c, DELAY: DelayNs, RANGER: I2cRanger<SONARS>, const SONARS: usize> SonarRing<SONARS>
    for I2cRing<BUS, DELAY, RANGER, SONARS>
{
    fn read(&mut self, faults: &mut FaultCounters) -> RingFrame<SONARS> {
        let plan = self.ranger.plan();
        let mut readings = Readings::new(&plan);
        for group in plan.groups() {
            self.fire(group, &mut readings);
            self.collect(group, &mut readings);
        }
        let (frame, last_error) = readings.into_frame(faults);
        self.last_error = last_error;
        frame
    }

    fn last_error(&self) -> Option<SonarError> {
        self.last_error
    }
}

/// The fault of a message that failed.
pub(super) fn fault(error: &impl Error) -> SonarFault {
    match error.kind() {
        ErrorKind::NoAcknowledge(_) => SonarFault::Silent,
        _ => SonarFault::Bus,
    }
}

/// Whether `sonars` consecutive addresses from `first` are within a range.
pub(super) fn check_addresses(
    first: u8,
    sonars: usize,
    within: core::ops::RangeInclusive<u8>,
) -> Result<(), ConfigError> {
    let last_first = i32::from(*within.end()) + 1 - sonars as i32;
    ConfigError::check("first_address", first.into(), (*within.start()).into(), last_first)
}
