//! What the robot needs of a board, besides its ring of sonars.

use core::fmt;

use crate::drive::VelocityCommand;
use crate::wire::QueueFull;

/// A board: its serial line, wheels, clock, watchdog and flash. Nothing here may wait for the other end of anything.
pub trait Board {
    /// A byte that the serial line has received; `None` when there is none (yet).
    fn receive(&mut self) -> Option<u8>;

    /// Queues a whole frame for the serial line.
    ///
    /// # Errors
    /// [`QueueFull`] when it does not fit whole; nothing is queued then.
    fn send(&mut self, frame: &[u8]) -> Result<(), QueueFull>;

    /// Sets the wheels.
    fn follow(&mut self, velocity: VelocityCommand);

    /// Tells the watchdog that the main loop has come round.
    fn feed_watchdog(&mut self);

    /// The time since the start in milliseconds; it wraps.
    fn now_ms(&mut self) -> u32;

    /// The most stack that was ever in use, in bytes; 0 when nobody measures it.
    fn stack_high_water_bytes(&mut self) -> u32;

    /// Keeps a snapshot so that it outlasts a loss of power. The robot stands still meanwhile.
    ///
    /// # Errors
    /// [`SaveError`]; the snapshots before must still be there.
    fn save(&mut self, snapshot: &[u8]) -> Result<(), SaveError>;
}

/// Why a snapshot was not kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveError {
    /// The board has nowhere to keep one.
    NoStore,
    /// The flash could not be written or erased.
    Failed,
}

impl fmt::Display for SaveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoStore => "the board has nowhere to keep a snapshot",
            Self::Failed => "the flash could not be written or erased",
        })
    }
}

impl core::error::Error for SaveError {}
