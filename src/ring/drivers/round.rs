//! One frame in the making: what each sensor of a ring has said so far, whatever the kind of sensor.

use super::{FiringPlan, SonarError, SonarFault};
use crate::{
    FaultCounters,
    ring::{Echo, RingFrame},
};

/// What a sensor has said since it was started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Nothing yet: it is still ranging.
    Ranging,
    /// It is done, or nothing more is to be expected from it.
    Settled(Result<Echo, SonarFault>),
}

/// The readings of a ring between its first group's start and its last group's end.
pub(super) struct Round<const SONARS: usize> {
    plan: FiringPlan<SONARS>,
    readings: [Reading; SONARS],
}

impl<const SONARS: usize> Round<SONARS> {
    pub(super) fn new(plan: &FiringPlan<SONARS>) -> Self {
        Self { plan: *plan, readings: [Reading::Ranging; SONARS] }
    }

    /// The sensors of a group that are still ranging, by their index.
    pub(super) fn ranging(&mut self, group: u8) -> impl Iterator<Item = (usize, &mut Reading)> {
        let readings = self.readings.iter_mut().enumerate().zip(self.plan.group_of);
        let of_group = readings.filter_map(move |(reading, of)| (of == group).then_some(reading));
        of_group.filter(|(_, reading)| **reading == Reading::Ranging)
    }

    /// Whether a group has a sensor that is still ranging.
    pub(super) fn is_ranging(&mut self, group: u8) -> bool {
        self.ranging(group).next().is_some()
    }

    /// Settles all that is still ranging in a group.
    pub(super) fn settle(&mut self, group: u8, as_what: Result<Echo, SonarFault>) {
        for (_, reading) in self.ranging(group) {
            *reading = Reading::Settled(as_what);
        }
    }

    /// The frame, with every fault counted, and the last sensor in trouble. Who is still ranging is silent.
    pub(super) fn frame(self, faults: &mut FaultCounters) -> (RingFrame<SONARS>, Option<SonarError>) {
        let mut frame = RingFrame { echoes: [Echo::Dead; SONARS] };
        let mut last_error = None;
        for ((echo, reading), sensor) in frame.echoes.iter_mut().zip(self.readings).zip(0_u8..) {
            let outcome = match reading {
                Reading::Settled(outcome) => outcome,
                Reading::Ranging => Err(SonarFault::Silent),
            };
            match outcome {
                Ok(heard) => *echo = heard,
                Err(fault) => {
                    faults.record(fault.kind());
                    last_error = Some(SonarError { sensor, fault });
                }
            }
        }
        (frame, last_error)
    }
}
