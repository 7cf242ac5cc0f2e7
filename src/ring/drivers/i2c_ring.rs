//! A ring of rangers on one I2C bus: what all of them have in common, whatever their messages.

use embedded_hal::{
    delay::DelayNs,
    i2c::{Error as _, ErrorKind, I2c},
};

use super::{FiringPlan, Reading, SonarError, SonarFault, SonarRing, round::Round};
use crate::{FaultCounters, ring::RingFrame};

/// A kind of ranger on an I2C bus: started with one message, asked with another until it is done.
///
/// [`Srf08Config`](super::Srf08Config) and [`MaxBotixConfig`](super::MaxBotixConfig) are such kinds. A ring of another
/// kind needs no more than this.
pub trait I2cRanger<const SONARS: usize> {
    /// Says which setting cannot be.
    type ConfigError;

    /// Looks at the settings once, before the first frame.
    ///
    /// # Errors
    /// Names the setting that cannot be.
    fn check(&self) -> Result<(), Self::ConfigError>;

    /// The 7-bit address of sensor 0; sensor *i* is at this plus *i*.
    fn first_address(&self) -> u8;

    /// Which sensors fire together.
    fn plan(&self) -> FiringPlan<SONARS>;

    /// How long the ring waits.
    fn timing(&self) -> RangingTiming;

    /// An address at which every ranger on the bus listens as well, if there is one.
    fn address_of_all(&self) -> Option<u8> {
        None
    }

    /// Starts a ranging.
    ///
    /// # Errors
    /// Those of the bus. A ranger that does not acknowledge counts as [`SonarFault::Silent`].
    fn start<BUS: I2c>(&self, bus: &mut BUS, address: u8) -> Result<(), BUS::Error>;

    /// Asks a ranger that was started. Not to acknowledge means to be still ranging.
    ///
    /// # Errors
    /// Those of the bus.
    fn ask<BUS: I2c>(&self, bus: &mut BUS, address: u8) -> Result<Reading, BUS::Error>;
}

/// How long an [`I2cRing`] waits, in microseconds from the start of a firing group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RangingTiming {
    /// Until the sensors are asked for the first time.
    pub first_ask_us: u32,
    /// Between two rounds of asking; 0 counts as 1.
    pub poll_interval_us: u32,
    /// Until no more is asked. Asked is once at least.
    pub timeout_us: u32,
    /// Until the next group may start, even when all sensors have answered.
    pub cycle_us: u32,
}

/// A ring of `SONARS` rangers at consecutive addresses of one I2C bus.
///
/// A frame waits for each firing group until its sensors have answered, at most the time-out of its kind; to that comes
/// the time on the bus, one start and, for each round of asking, one question for each sensor that has not answered yet.
/// Every wait is bounded, so a frame ends whatever the sensors do, as long as each message on the bus ends.
#[derive(Debug)]
pub struct I2cRing<BUS, DELAY, RANGER, const SONARS: usize> {
    bus: BUS,
    delay: DELAY,
    ranger: RANGER,
    last_error: Option<SonarError>,
}

impl<BUS: I2c, DELAY: DelayNs, RANGER: I2cRanger<SONARS>, const SONARS: usize> I2cRing<BUS, DELAY, RANGER, SONARS> {
    /// A ring on a bus. Nothing is sent before the first frame.
    ///
    /// # Errors
    /// Names the field of the configuration that cannot be.
    pub fn new(bus: BUS, delay: DELAY, config: RANGER) -> Result<Self, RANGER::ConfigError> {
        config.check()?;
        Ok(Self { bus, delay, ranger: config, last_error: None })
    }

    /// Gives the bus and the delay back.
    pub fn release(self) -> (BUS, DELAY) {
        (self.bus, self.delay)
    }

    /// Starts the sensors of a group; what failed is settled at once, the others are ranging afterwards.
    fn fire(&mut self, group: u8, round: &mut Round<SONARS>) {
        match self.ranger.address_of_all() {
            Some(address) if self.ranger.plan().is_together() => {
                if let Err(fault) = self.start(address) {
                    round.settle(group, Err(fault));
                }
            }
            _ => {
                for (sensor, reading) in round.ranging(group) {
                    if let Err(fault) = self.start(self.address(sensor)) {
                        *reading = Reading::Settled(Err(fault));
                    }
                }
            }
        }
    }

    fn start(&mut self, address: u8) -> Result<(), SonarFault> {
        self.ranger.start(&mut self.bus, address).map_err(|error| match error.kind() {
            ErrorKind::NoAcknowledge(_) => SonarFault::Silent,
            _ => SonarFault::Bus,
        })
    }

    fn ask(&mut self, address: u8) -> Reading {
        self.ranger.ask(&mut self.bus, address).unwrap_or_else(|error| match error.kind() {
            ErrorKind::NoAcknowledge(_) => Reading::Ranging,
            _ => Reading::Settled(Err(SonarFault::Bus)),
        })
    }

    /// Asks a group until it is done or its time is up, and waits until the next one may start.
    fn collect(&mut self, group: u8, round: &mut Round<SONARS>) {
        let timing = self.ranger.timing();
        let poll_interval_us = timing.poll_interval_us.max(1);
        let (mut waited_us, mut pause_us) = (0_u32, timing.first_ask_us);
        while round.is_ranging(group) {
            self.delay.delay_us(pause_us);
            waited_us = waited_us.saturating_add(pause_us);
            for (sensor, reading) in round.ranging(group) {
                *reading = self.ask(self.address(sensor));
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

    fn address(&self, sensor: usize) -> u8 {
        // The configuration was checked: every sensor has an address.
        self.ranger.first_address().wrapping_add(sensor as u8)
    }
}

impl<BUS: I2c, DELAY: DelayNs, RANGER: I2cRanger<SONARS>, const SONARS: usize> SonarRing<SONARS>
    for I2cRing<BUS, DELAY, RANGER, SONARS>
{
    fn read(&mut self, faults: &mut FaultCounters) -> RingFrame<SONARS> {
        let plan = self.ranger.plan();
        let mut round = Round::new(&plan);
        for group in plan.groups() {
            self.fire(group, &mut round);
            self.collect(group, &mut round);
        }
        let (frame, last_error) = round.frame(faults);
        self.last_error = last_error;
        frame
    }

    fn last_error(&self) -> Option<SonarError> {
        self.last_error
    }
}

/// Whether `SONARS` addresses from the first one on lie within a range.
pub(super) fn addresses_fit(first: u8, sonars: usize, within: core::ops::RangeInclusive<u8>) -> bool {
    within.contains(&first) && usize::from(first) + sonars <= usize::from(*within.end()) + 1
}
