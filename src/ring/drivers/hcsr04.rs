//! HC-SR04 ultrasonic rangers: a trigger line and an echo line for each, timed with a microsecond clock.
//!
//! Source: *HC-SR04 user's manual*. A pulse of at least 10 µs on the trigger line starts a measurement. The echo line rises
//! soon after, and falls when the echo arrives: the width of the pulse is the time of flight of the round trip. Without an
//! echo it falls after about 38 ms; some clones take longer, and some hold the line high permanently. Two measurements are
//! at least 60 ms apart, so that the sound decays.

use crate::setters::setters;
use embedded_hal::{
    delay::DelayNs,
    digital::{InputPin, OutputPin},
};

use super::{
    FiringPlan, Reading, SonarError, SonarFault, SonarRing,
    reading::Readings,
    sound::{check_speed_of_sound, flight_us, range_mm},
};
use crate::config_error::ConfigError;
use crate::fault::FaultCounters;
use crate::ring::{Echo, RingFrame};

/// A clock that counts microseconds and wraps after `u32::MAX`, such as a free-running timer.
pub trait MicrosecondClock {
    /// Returns the time. A resolution of 6 µs is one of 1 mm of range.
    fn now_us(&mut self) -> u32;
}

/// Firing plan, times and range limits of a ring of HC-SR04.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct HcSr04Config<const SONARS: usize> {
    /// Which sensors fire together. Default: four groups, so that in a ring of 16 those that fire together are 90° apart.
    pub plan: FiringPlan<SONARS>,
    /// Width of the trigger pulse, in microseconds, at least 10. Default 12.
    pub trigger_us: u8,
    /// Timeout for the rise of the echo line, in microseconds, at least 1. Default 5000; reported delays are 0.4 to 2.3 ms.
    pub rise_timeout_us: u16,
    /// Timeout for the fall of the echo line, in microseconds, at least the time of flight for `max_range_mm`. Default
    /// 40,000. A longer pulse is silence, not a fault.
    pub echo_timeout_us: u16,
    /// Minimum time from the start of one group to the start of the next, in milliseconds, also between frames. Default 60.
    pub cycle_ms: u8,
    /// Number of consecutive reads of the clock without an advance after which it counts as stopped, at least 1. Default
    /// 10,000.
    pub stopped_clock_polls: u16,
    /// Speed of sound in metres per second, 300 to 400. Default 343: dry air at 20 °C.
    pub speed_of_sound_m_per_s: u16,
    /// Minimum valid range, in millimetres. Default 20, from the data sheet. A shorter one is a fault.
    pub min_range_mm: u16,
    /// Maximum valid range, in millimetres. Default 4000, from the data sheet. A longer one is silence, because the width of
    /// the pulse without an echo differs between clones.
    pub max_range_mm: u16,
}

impl<const SONARS: usize> HcSr04Config<SONARS> {
    setters! {
        with_plan, plan: FiringPlan<SONARS>;
        with_trigger_us, trigger_us: u8;
        with_rise_timeout_us, rise_timeout_us: u16;
        with_echo_timeout_us, echo_timeout_us: u16;
        with_cycle_ms, cycle_ms: u8;
        with_stopped_clock_polls, stopped_clock_polls: u16;
        with_speed_of_sound_m_per_s, speed_of_sound_m_per_s: u16;
        with_min_range_mm, min_range_mm: u16;
        with_max_range_mm, max_range_mm: u16;
    }

    /// The values of the data sheet, four firing groups.
    pub const DEFAULT: Self = Self {
        plan: FiringPlan::interleaved(4),
        trigger_us: 12,
        rise_timeout_us: 5000,
        echo_timeout_us: 40_000,
        cycle_ms: 60,
        stopped_clock_polls: 10_000,
        speed_of_sound_m_per_s: 343,
        min_range_mm: 20,
        max_range_mm: 4000,
    };

    fn check(&self) -> Result<(), ConfigError> {
        let most = u16::MAX.into();
        ConfigError::check("trigger_us", self.trigger_us.into(), 10, u8::MAX.into())?;
        ConfigError::check("stopped_clock_polls", self.stopped_clock_polls.into(), 1, most)?;
        check_speed_of_sound(self.speed_of_sound_m_per_s)?;
        ConfigError::check("min_range_mm", self.min_range_mm.into(), 0, self.max_range_mm.into())?;
        ConfigError::check("rise_timeout_us", self.rise_timeout_us.into(), 1, most)?;
        let flight_us = flight_us(self.max_range_mm, self.speed_of_sound_m_per_s);
        ConfigError::check("echo_timeout_us", self.echo_timeout_us.into(), flight_us, most)
    }

    /// Converts the width of a pulse on the echo line to an echo; also for a ring that times the pulses with interrupts.
    ///
    /// # Errors
    /// [`SonarFault::OutOfRange`] below the minimum range.
    pub fn echo(&self, pulse_us: u32) -> Result<Echo, SonarFault> {
        match u16::try_from(range_mm(pulse_us, self.speed_of_sound_m_per_s)) {
            Ok(range_mm) if range_mm < self.min_range_mm => Err(SonarFault::OutOfRange),
            Ok(range_mm) if range_mm <= self.max_range_mm => Ok(Echo::Range { range_mm }),
            _ => Ok(Echo::Silence),
        }
    }

    /// The reading of a sensor `elapsed_us` after the trigger. `rise_us` stores when the echo line rose.
    fn reading(&self, echo: &mut impl InputPin, rise_us: &mut Option<u32>, elapsed_us: u32) -> Reading {
        let since_rise_us = rise_us.map(|rise_us| elapsed_us.saturating_sub(rise_us));
        Reading::Done(match (echo.is_high(), since_rise_us) {
            (Err(_), _) => Err(SonarFault::Bus),
            (Ok(false), Some(pulse_us)) => self.echo(pulse_us),
            (Ok(true), Some(pulse_us)) if pulse_us > self.echo_timeout_us.into() => Ok(Echo::Silence),
            (Ok(false), None) if elapsed_us > self.rise_timeout_us.into() => Err(SonarFault::Silent),
            (Ok(true), None) => {
                *rise_us = Some(elapsed_us);
                return Reading::Pending;
            }
            _ => return Reading::Pending,
        })
    }
}

impl<const SONARS: usize> Default for HcSr04Config<SONARS> {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A ring of `SONARS` HC-SR04. The sensors of a group may share a trigger line; each then has a handle to the same pin.
///
/// The sensors of a group are triggered together and timed in one polling loop, so a frame takes `cycle_ms` for each firing
/// group. The resolution of a range is the duration of one iteration of that loop, which reads the clock and each pending
/// echo line of the group: 6 µs are 1 mm. An interrupt lengthens an iteration.
///
/// Every wait is bounded: each line has a timeout, and a stopped clock is detected.
///
/// - A line that does not rise is [`SonarFault::Silent`].
/// - A line that is high before the trigger is [`SonarFault::Stuck`], and that sensor is not triggered. A clone that holds its
///   line high is silence in the first frame and stuck in the following ones, until its supply is switched off.
/// - A pin that returns an error is [`SonarFault::Bus`].
#[derive(Debug)]
pub struct HcSr04Ring<TRIGGER, ECHO, CLOCK, DELAY, const SONARS: usize> {
    pins: [(TRIGGER, ECHO); SONARS],
    clock: CLOCK,
    delay: DELAY,
    config: HcSr04Config<SONARS>,
    /// Time of the newest trigger.
    fired_us: Option<u32>,
    last_error: Option<SonarError>,
}

impl<TRIGGER: OutputPin, ECHO: InputPin, CLOCK: MicrosecondClock, DELAY: DelayNs, const SONARS: usize>
    HcSr04Ring<TRIGGER, ECHO, CLOCK, DELAY, SONARS>
{
    /// Creates a ring on the trigger and the echo pin of each sensor. The trigger lines must be low. Touches no pin before
    /// the first frame.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn new(
        pins: [(TRIGGER, ECHO); SONARS],
        clock: CLOCK,
        delay: DELAY,
        config: HcSr04Config<SONARS>,
    ) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self { pins, clock, delay, config, fired_us: None, last_error: None })
    }

    /// Returns the pins, the clock and the delay.
    pub fn release(self) -> ([(TRIGGER, ECHO); SONARS], CLOCK, DELAY) {
        (self.pins, self.clock, self.delay)
    }

    /// Waits until the cycle of the group before is over.
    fn wait_for_cycle(&mut self) {
        let Some(fired_us) = self.fired_us else { return };
        let since_us = self.clock.now_us().wrapping_sub(fired_us);
        let rest_us = u32::from(self.config.cycle_ms).saturating_mul(1000).saturating_sub(since_us);
        if rest_us > 0 {
            self.delay.delay_us(rest_us);
        }
    }

    /// Triggers the sensors of a group whose echo line is low; the others are done.
    fn fire(&mut self, group: u8, readings: &mut Readings<SONARS>) {
        self.for_pending(group, readings, |_, echo| match echo.is_low() {
            Ok(true) => Ok(()),
            Ok(false) => Err(SonarFault::Stuck),
            Err(_) => Err(SonarFault::Bus),
        });
        self.for_pending(group, readings, |trigger, _| trigger.set_high().map_err(|_| SonarFault::Bus));
        self.delay.delay_us(self.config.trigger_us.into());
        self.for_pending(group, readings, |trigger, _| trigger.set_low().map_err(|_| SonarFault::Bus));
    }

    fn for_pending(
        &mut self,
        group: u8,
        readings: &mut Readings<SONARS>,
        mut act: impl FnMut(&mut TRIGGER, &mut ECHO) -> Result<(), SonarFault>,
    ) {
        for (sensor, reading) in readings.pending(group) {
            let Some((trigger, echo)) = self.pins.get_mut(sensor) else { continue };
            if let Err(fault) = act(trigger, echo) {
                *reading = Reading::Done(Err(fault));
            }
        }
    }

    /// Measures the pulses of a group until each has ended or timed out.
    fn time_pulses(&mut self, group: u8, readings: &mut Readings<SONARS>) {
        let fired_us = self.clock.now_us();
        self.fired_us = Some(fired_us);
        let mut rises_us = [None; SONARS];
        let mut elapsed_us = 0;
        let mut stopped_polls = 0;
        while readings.is_pending(group) {
            let now_us = self.clock.now_us().wrapping_sub(fired_us);
            if now_us > elapsed_us {
                elapsed_us = now_us;
                stopped_polls = 0;
            } else if stopped_polls < self.config.stopped_clock_polls {
                stopped_polls += 1;
            } else {
                readings.complete(group, Err(SonarFault::Clock));
            }
            for (sensor, reading) in readings.pending(group) {
                if let (Some((_, echo)), Some(rise_us)) = (self.pins.get_mut(sensor), rises_us.get_mut(sensor)) {
                    *reading = self.config.reading(echo, rise_us, elapsed_us);
                }
            }
        }
    }
}

impl<TRIGGER: OutputPin, ECHO: InputPin, CLOCK: MicrosecondClock, DELAY: DelayNs, const SONARS: usize> SonarRing<SONARS>
    for HcSr04Ring<TRIGGER, ECHO, CLOCK, DELAY, SONARS>
{
    fn read(&mut self, faults: &mut FaultCounters) -> RingFrame<SONARS> {
        let mut readings = Readings::new(&self.config.plan);
        for group in self.config.plan.groups() {
            self.wait_for_cycle();
            self.fire(group, &mut readings);
            self.time_pulses(group, &mut readings);
        }
        let (frame, last_error) = readings.into_frame(faults);
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
    fn every_valid_range_is_exact_in_the_unit_of_the_pulse() {
        let config = HcSr04Config::<1>::DEFAULT;
        for range_mm in config.min_range_mm..=config.max_range_mm {
            let pulse_us = (u32::from(range_mm) * 2000 + 171) / 343;
            assert_eq!(config.echo(pulse_us), Ok(Echo::Range { range_mm }));
        }
    }

    #[test]
    fn a_pulse_below_the_data_sheet_is_out_of_range_and_one_above_is_silence() {
        let config = HcSr04Config::<1>::DEFAULT;
        for pulse_us in [0, 1, 113] {
            assert_eq!(config.echo(pulse_us), Err(SonarFault::OutOfRange));
        }
        for pulse_us in [23_400, 38_000, 200_000, u32::MAX] {
            assert_eq!(config.echo(pulse_us), Ok(Echo::Silence));
        }
    }

    #[test]
    fn each_field_out_of_its_range_is_named() {
        let good = HcSr04Config::<16>::DEFAULT;
        assert_eq!(good.check(), Ok(()));
        let wrong = [
            (HcSr04Config { trigger_us: 9, ..good }, "trigger_us"),
            (HcSr04Config { rise_timeout_us: 0, ..good }, "rise_timeout_us"),
            (HcSr04Config { echo_timeout_us: 23_000, ..good }, "echo_timeout_us"),
            (HcSr04Config { stopped_clock_polls: 0, ..good }, "stopped_clock_polls"),
            (HcSr04Config { speed_of_sound_m_per_s: 401, ..good }, "speed_of_sound_m_per_s"),
            (HcSr04Config { min_range_mm: 4001, ..good }, "min_range_mm"),
        ];
        for (config, field) in wrong {
            assert_eq!(config.check().unwrap_err().field(), field);
        }
    }
}
