//! A clock that only advances when it is read or waited for.

use std::{cell::Cell, rc::Rc};

use embedded_hal::delay::DelayNs;
use toposlam::ring::drivers::MicrosecondClock;

/// Simulated time, shared by its clones. Drivers wait for it and read it, and the models act on it.
#[derive(Clone, Debug)]
pub struct SimulatedTime {
    now_ns: Rc<Cell<u64>>,
    look_ns: u64,
}

impl SimulatedTime {
    /// A clock that starts at `start_us`. Each read takes `look_ns`, which stands for the work between two reads; with
    /// 0, reads do not advance the clock.
    pub fn new(start_us: u64, look_ns: u64) -> Self {
        Self { now_ns: Rc::new(Cell::new(start_us * 1000)), look_ns }
    }

    /// The time in nanoseconds; this read takes no time.
    pub fn now_ns(&self) -> u64 {
        self.now_ns.get()
    }
}

impl DelayNs for SimulatedTime {
    fn delay_ns(&mut self, nanoseconds: u32) {
        self.now_ns.set(self.now_ns.get() + u64::from(nanoseconds));
    }
}

impl MicrosecondClock for SimulatedTime {
    fn now_us(&mut self) -> u32 {
        self.now_ns.set(self.now_ns.get() + self.look_ns);
        // It wraps to 0, as the driver expects.
        (self.now_ns.get() / 1000) as u32
    }
}
