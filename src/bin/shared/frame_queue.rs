//! The transmit queue of a serial line.

use heapless::Deque;
use toposlam::wire::QueueFull;

const TRANSMIT_BYTES: usize = 2048;

/// Bytes to send, in frames.
pub(crate) type TransmitQueue = Deque<u8, TRANSMIT_BYTES>;

/// Appends a frame to the queue, whole or not at all.
pub(crate) fn push_frame(queue: &mut TransmitQueue, frame: &[u8]) -> Result<(), QueueFull> {
    if queue.capacity() - queue.len() < frame.len() {
        return Err(QueueFull);
    }
    for &byte in frame {
        // Does not fail: the capacity was checked.
        let _ = queue.push_back(byte);
    }
    Ok(())
}
