//! The readings of a frame while its groups fire one after the other, for any kind of sensor.

use super::{FiringPlan, SonarError, SonarFault};
use crate::fault::FaultCounters;
use crate::ring::{Echo, RingFrame};

/// The state of one sensor's measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// The sensor is still measuring.
    Pending,
    /// The measurement is complete, or has failed.
    Done(Result<Echo, SonarFault>),
}

/// The readings of all sensors of a ring, from the start of its first group to the end of its last.
pub(super) struct Readings<const SONARS: usize> {
    plan: FiringPlan<SONARS>,
    readings: [Reading; SONARS],
}

impl<const SONARS: usize> Readings<SONARS> {
    /// All pending.
    pub(super) fn new(plan: &FiringPlan<SONARS>) -> Self {
        Self { plan: *plan, readings: [Reading::Pending; SONARS] }
    }

    /// The pending sensors of a group, by their index.
    pub(super) fn pending(&mut self, group: u8) -> impl Iterator<Item = (usize, &mut Reading)> {
        let readings = self.readings.iter_mut().enumerate().zip(self.plan.group_of);
        let of_group = readings.filter_map(move |(reading, of)| (of == group).then_some(reading));
        of_group.filter(|(_, reading)| **reading == Reading::Pending)
    }

    /// Whether a group has a pending sensor.
    pub(super) fn is_pending(&mut self, group: u8) -> bool {
        self.pending(group).next().is_some()
    }

    /// Completes all pending sensors of a group with one outcome.
    pub(super) fn complete(&mut self, group: u8, outcome: Result<Echo, SonarFault>) {
        for (_, reading) in self.pending(group) {
            *reading = Reading::Done(outcome);
        }
    }

    /// Returns the frame and the fault of the last sensor that failed, and records every fault. A pending sensor has timed
    /// out: [`SonarFault::Silent`].
    pub(super) fn into_frame(self, faults: &mut FaultCounters) -> (RingFrame<SONARS>, Option<SonarError>) {
        let mut frame = RingFrame { echoes: [Echo::Dead; SONARS] };
        let mut last_error = None;
        for ((echo, reading), sensor) in frame.echoes.iter_mut().zip(self.readings).zip(0_u8..) {
            let outcome = match reading {
                Reading::Done(outcome) => outcome,
                Reading::Pending => Err(SonarFault::Silent),
            };
            match outcome {
                Ok(measured) => *echo = measured,
                Err(fault) => {
                    faults.record(fault.kind());
                    last_error = Some(SonarError { sensor, fault });
                }
            }
        }
        (frame, last_error)
    }
}
