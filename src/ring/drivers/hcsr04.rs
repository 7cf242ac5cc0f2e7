//! A ring of HC-SR04 rangers: a trigger line and an echo line each, timed with a clock of microseconds.
//!
//! Source: *HC-SR04 user's manual*. A pulse of 10 µs or more on the trigger line starts a ranging; soon after, the echo line
//! rises, and it falls when the echo is heard: the pulse is the time of flight, there and back. Without an echo it falls
//! after about 38 ms; some clones take longer, and some hold the line for ever. 60 ms from one ranging to the next let the
//! sound die away.

use core::fmt;

use embedded_hal::{
    delay::DelayNs,
    digital::{InputPin, OutputPin},
};

use super::{
    FiringPlan, Reading, SonarError, SonarFault, SonarRing,
    round::Round,
    sound::{is_speed_of_sound, range_mm},
};
use crate::{
    FaultCounters,
    ring::{Echo, RingFrame},
};

/// A clock that counts microseconds and starts again at 0 after `u32::MAX`, such as a free-running timer.
pub trait Microseconds {
    /// The time. It need not change between two calls, but it must go on; a step of 6 µs is 1 mm of range.
    fn now_us(&mut self) -> u32;
}

/// How a ring of HC-SR04 is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HcSr04Config<const SONARS: usize> {
    /// Which sensors fire together. Default: four groups, so that those that fire together are 90° apart.
    pub plan: FiringPlan<SONARS>,
    /// Length of the trigger pulse in microseconds, at least 10. Default 12.
    pub trigger_us: u8,
    /// How long the echo line may take to rise, in microseconds, at least 1. Default 5000; from 0.4 to 2.3 ms were seen.
    pub rise_timeout_us: u16,
    /// How long to wait for the echo line to fall, in microseconds, at least as long as an echo from `max_range_mm` takes.
    /// Default 40,000. A line that is high for longer counts as silence, not as a fault: nothing was heard.
    pub echo_timeout_us: u16,
    /// From the start of one group to that of the next, in milliseconds, also between frames. Default 60.
    pub cycle_ms: u8,
    /// How often the clock may be read without going on before it counts as standing still, at least 1. Default 10,000.
    pub standstill_polls: u16,
    /// Speed of sound in metres per second, 300 to 400. Default 343, dry air of 20 °C.
    pub speed_of_sound_m_per_s: u16,
    /// The shortest range to believe, in millimetres. Default 20, from the data sheet. What is shorter is a fault.
    pub min_range_mm: u16,
    /// The longest range to believe, in millimetres. Default 4000, from the data sheet. What is longer is silence, for the
    /// pulse of a sensor that hears nothing is as long as it likes.
    pub max_range_mm: u16,
}

impl<const SONARS: usize> HcSr04Config<SONARS> {
    /// The data sheet's values, four firing groups.
    pub const DEFAULT: Self = Self {
        plan: FiringPlan::interleaved(4),
        trigger_us: 12,
        rise_timeout_us: 5000,
        echo_timeout_us: 40_000,
        cycle_ms: 60,
        standstill_polls: 10_000,
        speed_of_sound_m_per_s: 343,
        min_range_mm: 20,
        max_range_mm: 4000,
    };

    fn check(&self) -> Result<(), HcSr04ConfigError> {
        if self.trigger_us < 10 {
            return Err(HcSr04ConfigError::Trigger);
        }
        if self.standstill_polls == 0 {
            return Err(HcSr04ConfigError::StandstillPolls);
        }
        if !is_speed_of_sound(self.speed_of_sound_m_per_s) {
            return Err(HcSr04ConfigError::SpeedOfSound);
        }
        if self.min_range_mm > self.max_range_mm {
            return Err(HcSr04ConfigError::Range);
        }
        let longest_mm = range_mm(self.echo_timeout_us.into(), self.speed_of_sound_m_per_s);
        if self.rise_timeout_us == 0 || longest_mm < self.max_range_mm.into() {
            return Err(HcSr04ConfigError::Timeout);
        }
        Ok(())
    }

    /// What the length of a pulse means.
    fn echo(&self, pulse_us: u32) -> Result<Echo, SonarFault> {
        match u16::try_from(range_mm(pulse_us, self.speed_of_sound_m_per_s)) {
            Ok(range_mm) if range_mm < self.min_range_mm => Err(SonarFault::OutOfRange),
            Ok(range_mm) if range_mm <= self.max_range_mm => Ok(Echo::Range { range_mm }),
            _ => Ok(Echo::Silence),
        }
    }

    /// What the echo line says so many microseconds after the trigger. `rise_us` remembers when it rose.
    fn look(&self, echo: &mut impl InputPin, rise_us: &mut Option<u32>, elapsed_us: u32) -> Reading {
        let since_rise_us = rise_us.map(|rise_us| elapsed_us.saturating_sub(rise_us));
        Reading::Settled(match (echo.is_high(), since_rise_us) {
            (Err(_), _) => Err(SonarFault::Bus),
            (Ok(false), Some(pulse_us)) => self.echo(pulse_us),
            (Ok(true), Some(pulse_us)) if pulse_us > self.echo_timeout_us.into() => Ok(Echo::Silence),
            (Ok(false), None) if elapsed_us > self.rise_timeout_us.into() => Err(SonarFault::Silent),
            (Ok(true), None) => {
                *rise_us = Some(elapsed_us);
                return Reading::Ranging;
            }
            _ => return Reading::Ranging,
        })
    }
}

impl<const SONARS: usize> Default for HcSr04Config<SONARS> {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Which field of an [`HcSr04Config`] cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum HcSr04ConfigError {
    /// `trigger_us`: less than 10.
    Trigger,
    /// `rise_timeout_us` is 0, or `echo_timeout_us` is shorter than an echo from `max_range_mm`.
    Timeout,
    /// `standstill_polls`: 0.
    StandstillPolls,
    /// `speed_of_sound_m_per_s`: outside 300 to 400.
    SpeedOfSound,
    /// `min_range_mm` is above `max_range_mm`.
    Range,
}

impl fmt::Display for HcSr04ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Trigger => "trigger_us: must be 10 or more",
            Self::Timeout => "rise_timeout_us: must not be 0; echo_timeout_us: must leave time for max_range_mm",
            Self::StandstillPolls => "standstill_polls: must not be 0",
            Self::SpeedOfSound => "speed_of_sound_m_per_s: must be from 300 to 400",
            Self::Range => "min_range_mm: must not be above max_range_mm",
        })
    }
}

impl core::error::Error for HcSr04ConfigError {}

/// A ring of `SONARS` HC-SR04 on pins of their own. The sensors of a group may share a trigger line; each then has a handle
/// to the same pin.
///
/// The sensors of a group are triggered together and timed side by side in one loop, so a frame takes `cycle_ms` for each
/// firing group, whatever the sensors do. A range is as exact as a turn of that loop is short: a look at the clock and at
/// each echo line of the group that is still awaited; 6 µs are 1 mm. An interrupt in between lengthens a turn.
///
/// Nothing is waited for without a bound: each line has its time-outs, and a clock that stands still is noticed.
///
/// - A line that does not rise is [`SonarFault::Silent`].
/// - A line that is high already before the trigger is [`SonarFault::Stuck`], and that sensor is not triggered; a clone that
///   hangs is silence once and stuck from then on, until its power is cut.
/// - A pin that cannot be read or set is [`SonarFault::Bus`].
#[derive(Debug)]
pub struct HcSr04Ring<TRIGGER, ECHO, CLOCK, DELAY, const SONARS: usize> {
    pins: [(TRIGGER, ECHO); SONARS],
    clock: CLOCK,
    delay: DELAY,
    config: HcSr04Config<SONARS>,
    /// When the latest group was triggered.
    fired_us: Option<u32>,
    last_error: Option<SonarError>,
}

impl<TRIGGER: OutputPin, ECHO: InputPin, CLOCK: Microseconds, DELAY: DelayNs, const SONARS: usize>
    HcSr04Ring<TRIGGER, ECHO, CLOCK, DELAY, SONARS>
{
    /// A ring on its pins, trigger and echo of each sensor; the trigger lines are to be low. No pin is touched before the
    /// first frame.
    ///
    /// # Errors
    /// Names the field of the configuration that cannot be.
    pub fn new(
        pins: [(TRIGGER, ECHO); SONARS],
        clock: CLOCK,
        delay: DELAY,
        config: HcSr04Config<SONARS>,
    ) -> Result<Self, HcSr04ConfigError> {
        config.check()?;
        Ok(Self { pins, clock, delay, config, fired_us: None, last_error: None })
    }

    /// Gives the pins, the clock and the delay back.
    pub fn release(self) -> ([(TRIGGER, ECHO); SONARS], CLOCK, DELAY) {
        (self.pins, self.clock, self.delay)
    }

    /// Waits until the sound of the group before has died away.
    fn rest(&mut self) {
        let Some(fired_us) = self.fired_us else { return };
        let since_us = self.clock.now_us().wrapping_sub(fired_us);
        let rest_us = u32::from(self.config.cycle_ms).saturating_mul(1000).saturating_sub(since_us);
        if rest_us > 0 {
            self.delay.delay_us(rest_us);
        }
    }

    /// Triggers the sensors of a group whose lines are at rest; the others are settled.
    fn fire(&mut self, group: u8, round: &mut Round<SONARS>) {
        self.for_ranging(group, round, |_, echo| match echo.is_low() {
            Ok(true) => Ok(()),
            Ok(false) => Err(SonarFault::Stuck),
            Err(_) => Err(SonarFault::Bus),
        });
        self.for_ranging(group, round, |trigger, _| trigger.set_high().map_err(|_| SonarFault::Bus));
        self.delay.delay_us(self.config.trigger_us.into());
        self.for_ranging(group, round, |trigger, _| trigger.set_low().map_err(|_| SonarFault::Bus));
    }

    fn for_ranging(
        &mut self,
        group: u8,
        round: &mut Round<SONARS>,
        mut act: impl FnMut(&mut TRIGGER, &mut ECHO) -> Result<(), SonarFault>,
    ) {
        for (sensor, reading) in round.ranging(group) {
            let Some((trigger, echo)) = self.pins.get_mut(sensor) else { continue };
            if let Err(fault) = act(trigger, echo) {
                *reading = Reading::Settled(Err(fault));
            }
        }
    }

    /// Times the pulses of a group until each has ended or its time is up.
    fn listen(&mut self, group: u8, round: &mut Round<SONARS>) {
        let fired_us = self.clock.now_us();
        self.fired_us = Some(fired_us);
        let mut rises_us = [None; SONARS];
        let mut elapsed_us = 0;
        let mut standstill = 0;
        while round.is_ranging(group) {
            let now_us = self.clock.now_us().wrapping_sub(fired_us);
            if now_us > elapsed_us {
                elapsed_us = now_us;
                standstill = 0;
            } else if standstill < self.config.standstill_polls {
                standstill += 1;
            } else {
                round.settle(group, Err(SonarFault::Clock));
            }
            for (sensor, reading) in round.ranging(group) {
                if let (Some((_, echo)), Some(rise_us)) = (self.pins.get_mut(sensor), rises_us.get_mut(sensor)) {
                    *reading = self.config.look(echo, rise_us, elapsed_us);
                }
            }
        }
    }
}

impl<TRIGGER: OutputPin, ECHO: InputPin, CLOCK: Microseconds, DELAY: DelayNs, const SONARS: usize> SonarRing<SONARS>
    for HcSr04Ring<TRIGGER, ECHO, CLOCK, DELAY, SONARS>
{
    fn read(&mut self, faults: &mut FaultCounters) -> RingFrame<SONARS> {
        let mut round = Round::new(&self.config.plan);
        for group in self.config.plan.groups() {
            self.rest();
            self.fire(group, &mut round);
            self.listen(group, &mut round);
        }
        let (frame, last_error) = round.frame(faults);
        self.last_error = last_error;
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
    fn every_believable_range_survives_the_pulse() {
        let config = HcSr04Config::<1>::DEFAULT;
        for range_mm in config.min_range_mm..=config.max_range_mm {
            let pulse_us = (u32::from(range_mm) * 2000 + 171) / 343;
            assert_eq!(config.echo(pulse_us), Ok(Echo::Range { range_mm }));
        }
    }

    #[test]
    fn a_pulse_too_short_for_the_data_sheet_is_nonsense_and_one_too_long_is_silence() {
        let config = HcSr04Config::<1>::DEFAULT;
        for pulse_us in [0, 1, 113] {
            assert_eq!(config.echo(pulse_us), Err(SonarFault::OutOfRange));
        }
        for pulse_us in [23_400, 38_000, 200_000, u32::MAX] {
            assert_eq!(config.echo(pulse_us), Ok(Echo::Silence));
        }
    }

    #[test]
    fn the_configuration_names_the_field_that_cannot_be() {
        let good = HcSr04Config::<16>::DEFAULT;
        assert_eq!(good.check(), Ok(()));
        let wrong = [
            (HcSr04Config { trigger_us: 9, ..good }, HcSr04ConfigError::Trigger),
            (HcSr04Config { rise_timeout_us: 0, ..good }, HcSr04ConfigError::Timeout),
            (HcSr04Config { echo_timeout_us: 23_000, ..good }, HcSr04ConfigError::Timeout),
            (HcSr04Config { standstill_polls: 0, ..good }, HcSr04ConfigError::StandstillPolls),
            (HcSr04Config { speed_of_sound_m_per_s: 401, ..good }, HcSr04ConfigError::SpeedOfSound),
            (HcSr04Config { min_range_mm: 4001, ..good }, HcSr04ConfigError::Range),
        ];
        for (config, error) in wrong {
            assert_eq!(config.check(), Err(error));
        }
    }
}
