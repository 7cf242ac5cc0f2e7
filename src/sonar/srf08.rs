//! A ring of up to 16 SRF08 ultrasonic rangers on one I2C bus.
//!
//! Source: Devantech, *SRF08 Ultra sonic range finder, Technical Specification*. Register 0 is the command when written
//! and the software revision when read; while the ranger listens for its echo it does not answer, and the released bus
//! reads as 255. Register 1 is the light sensor, registers 2 and 3 the first echo, high byte first, 0 for no echo. A
//! command written to address 0 starts every ranger on the bus.

use core::fmt;

use embedded_hal::{
    delay::DelayNs,
    i2c::{Error as _, ErrorKind, I2c},
};

use super::{SonarError, SonarFault, SonarRing};
use crate::{
    FaultCounters,
    ring::{Echo, RingFrame},
};

/// Every ranger on the bus listens to this address as well.
const GENERAL_CALL: u8 = 0;
const COMMAND_REGISTER: u8 = 0;
const REVISION_WHILE_RANGING: u8 = 255;
/// Start a ranging and report the time of flight in microseconds: the finest of the three units.
const RANGE_IN_MICROSECONDS: u8 = 0x52;
const LAST_ADDRESS: u8 = 0x7F;
const MOST_SENSORS: usize = 16;

/// How a ring of SRF08 is wired and read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Srf08Config {
    /// The 7-bit address of sensor 0; sensor *i* is at this plus *i*. 0x70 to 0x7F, default 0x70.
    pub first_address: u8,
    /// Into how many groups the ring is divided; sensor *i* fires with the others of group *i* modulo this number, so
    /// with two or more groups no neighbours hear each other's sound. 1 fires all at once by general call, which is
    /// faster. 1 to the number of sensors, default 2.
    pub firing_groups: u8,
    /// How long a group may take from its start, in milliseconds, at least 1. Default 100: a ranging lasts 65.
    pub timeout_ms: u16,
    /// How long to wait between two rounds of asking, in microseconds, at least 1. Default 2000.
    pub poll_interval_us: u16,
    /// Speed of sound in metres per second, 300 to 400. Default 343, dry air of 20 °C.
    pub speed_of_sound_m_per_s: u16,
    /// The shortest range to believe, in millimetres. Default 30, from the data sheet.
    pub min_range_mm: u16,
    /// The longest range to believe, in millimetres. Default 6000, from the data sheet.
    pub max_range_mm: u16,
}

impl Srf08Config {
    /// The data sheet's values, two firing groups.
    pub const DEFAULT: Self = Self {
        first_address: 0x70,
        firing_groups: 2,
        timeout_ms: 100,
        poll_interval_us: 2000,
        speed_of_sound_m_per_s: 343,
        min_range_mm: 30,
        max_range_mm: 6000,
    };

    fn check(&self, sonars: usize) -> Result<(), Srf08ConfigError> {
        let first_address = usize::from(self.first_address);
        if !(0x70..=LAST_ADDRESS).contains(&self.first_address)
            || sonars > MOST_SENSORS
            || first_address + sonars > usize::from(LAST_ADDRESS) + 1
        {
            return Err(Srf08ConfigError::FirstAddress);
        }
        if self.firing_groups == 0 || usize::from(self.firing_groups) > sonars {
            return Err(Srf08ConfigError::FiringGroups);
        }
        if self.timeout_ms == 0 {
            return Err(Srf08ConfigError::Timeout);
        }
        if self.poll_interval_us == 0 {
            return Err(Srf08ConfigError::PollInterval);
        }
        if !(300..=400).contains(&self.speed_of_sound_m_per_s) {
            return Err(Srf08ConfigError::SpeedOfSound);
        }
        if self.min_range_mm > self.max_range_mm {
            return Err(Srf08ConfigError::Range);
        }
        Ok(())
    }

    /// How often a group is asked before its time is up; at least once.
    fn polls(&self) -> u32 {
        let timeout_us = u32::from(self.timeout_ms) * 1000;
        timeout_us.checked_div(u32::from(self.poll_interval_us)).unwrap_or(1).max(1)
    }

    /// What the microseconds of the first echo mean.
    fn echo(&self, flight_us: u16) -> Result<Echo, SonarFault> {
        if flight_us == 0 {
            return Ok(Echo::Silence);
        }
        // There and back: half of time times speed; 1 m/s is 1 mm/ms. At most 65,535 · 400, well within 32 bits.
        let range_mm = (u32::from(flight_us) * u32::from(self.speed_of_sound_m_per_s) + 1000) / 2000;
        match u16::try_from(range_mm) {
            Ok(range_mm) if (self.min_range_mm..=self.max_range_mm).contains(&range_mm) => Ok(Echo::Range { range_mm }),
            _ => Err(SonarFault::Nonsense),
        }
    }
}

impl Default for Srf08Config {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Which field of a [`Srf08Config`] cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Srf08ConfigError {
    /// `first_address`: not every sensor of the ring gets an address from 0x70 to 0x7F.
    FirstAddress,
    /// `firing_groups`: 0, or more than there are sensors.
    FiringGroups,
    /// `timeout_ms`: 0.
    Timeout,
    /// `poll_interval_us`: 0.
    PollInterval,
    /// `speed_of_sound_m_per_s`: outside 300 to 400.
    SpeedOfSound,
    /// `min_range_mm` is above `max_range_mm`.
    Range,
}

impl fmt::Display for Srf08ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::FirstAddress => "first_address: sensors need addresses from 0x70 to 0x7F",
            Self::FiringGroups => "firing_groups: must be from 1 to the number of sensors",
            Self::Timeout => "timeout_ms: must not be 0",
            Self::PollInterval => "poll_interval_us: must not be 0",
            Self::SpeedOfSound => "speed_of_sound_m_per_s: must be from 300 to 400",
            Self::Range => "min_range_mm: must not be above max_range_mm",
        })
    }
}

impl core::error::Error for Srf08ConfigError {}

/// A ring of `SONARS` SRF08 at consecutive addresses of one I2C bus, at most 16.
///
/// A frame takes one ranging (65 ms on the real sensors) for each firing group, and at most `timeout_ms` of waiting for
/// each plus the time on the bus: one write and, for each round of asking, one read of four bytes for each sensor that
/// has not answered yet.
#[derive(Debug)]
pub struct Srf08Ring<BUS, DELAY, const SONARS: usize> {
    bus: BUS,
    delay: DELAY,
    config: Srf08Config,
    last_error: Option<SonarError>,
}

impl<BUS: I2c, DELAY: DelayNs, const SONARS: usize> Srf08Ring<BUS, DELAY, SONARS> {
    /// A ring on a bus. Nothing is sent before the first frame.
    ///
    /// # Errors
    /// Names the field of the configuration that cannot be.
    pub fn new(bus: BUS, delay: DELAY, config: Srf08Config) -> Result<Self, Srf08ConfigError> {
        config.check(SONARS)?;
        Ok(Self { bus, delay, config, last_error: None })
    }

    /// Gives the bus and the delay back.
    pub fn release(self) -> (BUS, DELAY) {
        (self.bus, self.delay)
    }

    /// Starts the sensors of a group; what failed is settled at once, the others are ranging afterwards.
    fn fire(&mut self, group: u8, states: &mut [SensorState; SONARS]) {
        if self.config.firing_groups == 1 {
            let started = self.start(GENERAL_CALL);
            for state in states {
                *state = started;
            }
        } else {
            for (state, address) in self.group(group, states) {
                *state = self.start(address);
            }
        }
    }

    fn start(&mut self, address: u8) -> SensorState {
        match self.bus.write(address, &[COMMAND_REGISTER, RANGE_IN_MICROSECONDS]) {
            Ok(()) => SensorState::Ranging,
            Err(error) => match error.kind() {
                ErrorKind::NoAcknowledge(_) => SensorState::Settled(Err(SonarFault::Silent)),
                _ => SensorState::Settled(Err(SonarFault::Bus)),
            },
        }
    }

    /// Asks one ranging sensor; one read tells both whether it is done and what it heard.
    fn ask(&mut self, address: u8) -> SensorState {
        let mut registers = [REVISION_WHILE_RANGING; 4];
        match self.bus.write_read(address, &[COMMAND_REGISTER], &mut registers) {
            Ok(()) => {
                let [revision, _light, high, low] = registers;
                if revision == REVISION_WHILE_RANGING {
                    SensorState::Ranging
                } else {
                    SensorState::Settled(self.config.echo(u16::from_be_bytes([high, low])))
                }
            }
            // Some of the family keep silent while they range, so this alone is no fault.
            Err(error) => match error.kind() {
                ErrorKind::NoAcknowledge(_) => SensorState::Ranging,
                _ => SensorState::Settled(Err(SonarFault::Bus)),
            },
        }
    }

    /// The sensors of a firing group with their addresses.
    fn group<'a>(
        &self,
        group: u8,
        states: &'a mut [SensorState; SONARS],
    ) -> impl Iterator<Item = (&'a mut SensorState, u8)> + use<'a, BUS, DELAY, SONARS> {
        let (first_address, groups) = (self.config.first_address, self.config.firing_groups);
        let mut group_of_next = 0;
        states.iter_mut().zip(0_u8..).filter_map(move |(state, sensor)| {
            let group_of_this = group_of_next;
            group_of_next = if group_of_this + 1 >= groups { 0 } else { group_of_this + 1 };
            (group_of_this == group).then_some((state, first_address.wrapping_add(sensor)))
        })
    }
}

#[derive(Clone, Copy)]
enum SensorState {
    Ranging,
    Settled(Result<Echo, SonarFault>),
}

impl<BUS: I2c, DELAY: DelayNs, const SONARS: usize> SonarRing<SONARS> for Srf08Ring<BUS, DELAY, SONARS> {
    fn read(&mut self, faults: &mut FaultCounters) -> RingFrame<SONARS> {
        let mut states = [SensorState::Ranging; SONARS];
        for group in 0..self.config.firing_groups {
            self.fire(group, &mut states);
            for _ in 0..self.config.polls() {
                if !self.group(group, &mut states).any(|(state, _)| matches!(state, SensorState::Ranging)) {
                    break;
                }
                self.delay.delay_us(u32::from(self.config.poll_interval_us));
                for (state, address) in self.group(group, &mut states) {
                    if matches!(state, SensorState::Ranging) {
                        *state = self.ask(address);
                    }
                }
            }
        }
        self.last_error = None;
        let mut frame = RingFrame { echoes: [Echo::Dead; SONARS] };
        for ((echo, state), sensor) in frame.echoes.iter_mut().zip(states).zip(0_u8..) {
            match state {
                SensorState::Settled(Ok(heard)) => *echo = heard,
                SensorState::Settled(Err(_)) | SensorState::Ranging => {
                    let fault = if let SensorState::Settled(Err(fault)) = state { fault } else { SonarFault::Silent };
                    faults.count(fault.kind());
                    self.last_error = Some(SonarError { sensor, fault });
                }
            }
        }
        frame
    }

    fn last_error(&self) -> Option<SonarError> {
        self.last_error
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_believable_range_survives_the_sensors_unit() {
        let config = Srf08Config::DEFAULT;
        for range_mm in config.min_range_mm..=config.max_range_mm {
            let flight_us = (u32::from(range_mm) * 2000 + 171) / 343;
            assert_eq!(config.echo(flight_us as u16), Ok(Echo::Range { range_mm }));
        }
    }

    #[test]
    fn what_the_data_sheet_does_not_allow_is_nonsense_and_zero_is_silence() {
        let config = Srf08Config::DEFAULT;
        assert_eq!(config.echo(0), Ok(Echo::Silence));
        for flight_us in [1, 160, 35_000, u16::MAX] {
            assert_eq!(config.echo(flight_us), Err(SonarFault::Nonsense));
        }
    }

    #[test]
    fn the_configuration_names_the_field_that_cannot_be() {
        let good = Srf08Config::DEFAULT;
        assert_eq!(good.check(16), Ok(()));
        let wrong = [
            (Srf08Config { first_address: 0x6F, ..good }, Srf08ConfigError::FirstAddress),
            (Srf08Config { first_address: 0x71, ..good }, Srf08ConfigError::FirstAddress),
            (Srf08Config { firing_groups: 0, ..good }, Srf08ConfigError::FiringGroups),
            (Srf08Config { firing_groups: 17, ..good }, Srf08ConfigError::FiringGroups),
            (Srf08Config { timeout_ms: 0, ..good }, Srf08ConfigError::Timeout),
            (Srf08Config { poll_interval_us: 0, ..good }, Srf08ConfigError::PollInterval),
            (Srf08Config { speed_of_sound_m_per_s: 299, ..good }, Srf08ConfigError::SpeedOfSound),
            (Srf08Config { min_range_mm: 6001, ..good }, Srf08ConfigError::Range),
        ];
        for (config, error) in wrong {
            assert_eq!(config.check(16), Err(error));
        }
    }
}
