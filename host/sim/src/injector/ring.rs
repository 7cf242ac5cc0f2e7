//! Faults of the ring of sonars, as its driver reports them.

use std::fmt;

use toposlam::reference;
use toposlam::ring::{Echo, RingFrame};
use toposlam::{FaultCounters, FaultKind};

use super::{Chance, FaultRates};

/// Largest corrupted range, in millimetres.
const RANGE_MAX_MM: u32 = 6000;

/// Counts of the injected faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RingCounts {
    /// Lost answers.
    pub lost_answers: u64,
    /// Replaced ranges.
    pub corrupted_ranges: u64,
    /// Frames that were replaced by the previous one.
    pub delayed_frames: u64,
    /// Number of times that the bus got stuck.
    pub stuck_times: u64,
    /// Frames without any sonar on the stuck bus.
    pub stuck_frames: u64,
}

impl fmt::Display for RingCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} answers lost, {} ranges corrupted, {} frames delayed, bus stuck {} times for {} frames",
            self.lost_answers, self.corrupted_ranges, self.delayed_frames, self.stuck_times, self.stuck_frames
        )
    }
}

/// Injects faults into the frames between a world and a robot.
#[derive(Clone, Debug)]
pub struct RingInjector<const SONARS: usize = { reference::SONARS }> {
    rates: FaultRates,
    chance: Chance,
    /// The last frame that the sonars measured and the robot received.
    before: Option<RingFrame<SONARS>>,
    stuck_frames_left: u32,
    counts: RingCounts,
}

impl<const SONARS: usize> RingInjector<SONARS> {
    /// An injector for one world.
    pub fn new(rates: FaultRates, seed: u64) -> Self {
        Self { rates, chance: Chance::new(seed, 0), before: None, stuck_frames_left: 0, counts: RingCounts::default() }
    }

    /// Returns the frame that the robot receives. `driver` counts the faults that the ring's driver counts: a lost
    /// answer as `SonarSilent`, each sonar on a stuck bus as `BusError`.
    pub fn disturb(&mut self, frame: RingFrame<SONARS>, driver: &mut FaultCounters) -> RingFrame<SONARS> {
        if self.stuck_frames_left == 0 && self.chance.happens(self.rates.bus_stuck) {
            self.stuck_frames_left = self.chance.within(1, FaultRates::STUCK_FRAMES);
            self.counts.stuck_times += 1;
        }
        if self.stuck_frames_left > 0 {
            self.stuck_frames_left -= 1;
            self.counts.stuck_frames += 1;
            (0..SONARS).for_each(|_| driver.record(FaultKind::BusError));
            return RingFrame { echoes: [Echo::Dead; SONARS] };
        }
        let mut frame = match self.before {
            Some(before) if self.chance.happens(self.rates.frame_delayed) => {
                self.counts.delayed_frames += 1;
                before
            }
            _ => frame,
        };
        self.before = Some(frame);
        for echo in &mut frame.echoes {
            if self.chance.happens(self.rates.answer_lost) {
                self.counts.lost_answers += 1;
                driver.record(FaultKind::SonarSilent);
                *echo = Echo::Dead;
            } else if self.chance.happens(self.rates.range_corrupted) {
                self.counts.corrupted_ranges += 1;
                *echo = Echo::Range { range_mm: self.chance.within(0, RANGE_MAX_MM) as u16 };
            }
        }
        frame
    }

    /// Counts of the faults so far.
    pub const fn counts(&self) -> RingCounts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toposlam::reference::SONARS;

    fn frames(rates: FaultRates, seed: u64) -> (Vec<RingFrame<SONARS>>, RingCounts, FaultCounters) {
        let mut injector = RingInjector::new(rates, seed);
        let mut driver = FaultCounters::new();
        let world = (0..1000).map(|number| RingFrame { echoes: [Echo::Range { range_mm: 500 + number }; SONARS] });
        let got = world.map(|frame| injector.disturb(frame, &mut driver)).collect();
        (got, injector.counts(), driver)
    }

    #[test]
    fn faults_are_reproducible_from_the_seed() {
        let rates = FaultRates::scaled(0.1);
        assert_eq!(frames(rates, 1).0, frames(rates, 1).0);
        assert_ne!(frames(rates, 1).0, frames(rates, 2).0);
    }

    #[test]
    fn the_counts_match_the_faults_in_the_frames() {
        let (got, counts, driver) = frames(FaultRates::scaled(0.05), 3);
        let blind = got.iter().filter(|frame| frame.dead_sensors().count() == SONARS).count() as u64;
        let dead: usize = got.iter().map(|frame| frame.dead_sensors().count()).sum();
        assert!(counts.stuck_frames > 0 && counts.delayed_frames > 0 && counts.corrupted_ranges > 0);
        assert_eq!(blind, counts.stuck_frames);
        assert_eq!(dead as u64, counts.lost_answers + SONARS as u64 * counts.stuck_frames);
        assert_eq!(u64::from(driver.count(FaultKind::SonarSilent)), counts.lost_answers);
        assert_eq!(u64::from(driver.count(FaultKind::BusError)), SONARS as u64 * counts.stuck_frames);
    }
}
