//! The board of a robot: everything but its ring of sensors.

use core::fmt;

use crate::drive::VelocityCommand;
use crate::wire::QueueFull;

/// The serial line, wheels, clock, watchdog and flash of a board. No method may wait for the other end of a line.
///
/// The methods with a default are for what a board may lack: a watchdog, a painted stack, a store.
pub trait Board {
    /// Returns the next byte that the serial line has received; `None` if there is none.
    fn receive(&mut self) -> Option<u8>;

    /// Queues a whole frame for the serial line.
    ///
    /// # Errors
    /// [`QueueFull`] if the whole frame does not fit; nothing is queued then.
    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull>;

    /// Sets the wheels to follow a velocity.
    fn follow(&mut self, velocity: VelocityCommand);

    /// Feeds the watchdog, once in each turn of the main loop. The default does nothing.
    fn feed_watchdog(&mut self) {}

    /// The time since the start in milliseconds; it wraps.
    fn now_ms(&mut self) -> u32;

    /// The largest stack use since the start in bytes; 0, the default, if it is not measured.
    fn stack_high_water_bytes(&mut self) -> u32 {
        0
    }

    /// Stores a snapshot so that it survives a power cut. The robot stands still during the call. The default stores nothing.
    ///
    /// # Errors
    /// [`SaveError`]; earlier snapshots must then still be stored. The default is [`SaveError::NoStore`].
    fn save(&mut self, snapshot: &[u8]) -> Result<(), SaveError> {
        let _ = snapshot;
        Err(SaveError::NoStore)
    }
}

/// Why a snapshot was not stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveError {
    /// The board cannot store snapshots.
    NoStore,
    /// The flash could not be written or erased.
    Failed,
}

impl fmt::Display for SaveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoStore => "the board cannot store snapshots",
            Self::Failed => "the flash could not be written or erased",
        })
    }
}

impl core::error::Error for SaveError {}
