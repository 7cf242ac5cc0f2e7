//! The sonar drivers against models of the sensors: the traffic of the data sheets, and every fault of a ring.

mod addresses;
mod any_answers;
mod bridge;
mod firing;
mod hcsr04;
mod link;
mod maxbotix;
mod srf08;
mod srf10;
mod vl53l1x;

use embedded_hal::delay::DelayNs;
use toposlam::{
    FaultCounters, FaultKind,
    ring::drivers::SonarFault,
    ring::{Echo, RingFrame},
};

/// Sums the delays of a driver.
#[derive(Default)]
pub(crate) struct Waited {
    pub(crate) nanoseconds: u64,
}

impl DelayNs for &mut Waited {
    fn delay_ns(&mut self, nanoseconds: u32) {
        self.nanoseconds += u64::from(nanoseconds);
    }
}

/// A frame with a different range for each sensor, and silence at two of them.
pub(crate) fn world_frame(number: u16) -> RingFrame<16> {
    let mut frame = RingFrame { echoes: [Echo::Silence; 16] };
    for (sensor, echo) in (0_u16..).zip(&mut frame.echoes).filter(|(sensor, _)| sensor % 8 != 5) {
        *echo = Echo::Range { range_mm: 30 + number * 7 + sensor * 371 };
    }
    frame
}

pub(crate) fn world() -> impl FnMut() -> Option<RingFrame<16>> {
    let mut numbers = 0..50;
    move || numbers.next().map(world_frame)
}

/// A source of frames.
pub(crate) type World = Box<dyn FnMut() -> Option<RingFrame<16>>>;

/// Asserts the count of one kind of fault, and that no other was counted.
pub(crate) fn assert_counted(faults: &FaultCounters, fault: Option<SonarFault>, count: u32) {
    for kind in FaultKind::ALL {
        let expected = if fault.map(SonarFault::kind) == Some(kind) { count } else { 0 };
        assert_eq!(faults.count(kind), expected, "{fault:?} counted as {kind:?}");
    }
}

/// A frame with some sensors dead.
pub(crate) fn without(mut frame: RingFrame<16>, dead: impl Fn(usize) -> bool) -> RingFrame<16> {
    for sensor in (0..16).filter(|&sensor| dead(sensor)) {
        frame.echoes[sensor] = Echo::Dead;
    }
    frame
}
