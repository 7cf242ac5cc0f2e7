//! The serial line: two tasks between UART0 and the queues of the main loop.

use embassy_rp::uart::{BufferedUartRx, BufferedUartTx};
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, pipe::Pipe};
use embedded_io_async::{Read, Write};
use toposlam::wire::QueueFull;

static RECEIVED: Pipe<CriticalSectionRawMutex, 512> = Pipe::new();
static TO_SEND: Pipe<CriticalSectionRawMutex, 2048> = Pipe::new();

/// The next received byte.
pub(crate) fn receive() -> Option<u8> {
    let mut byte = [0];
    RECEIVED.try_read(&mut byte).ok().filter(|&count| count == 1)?;
    let [byte] = byte;
    Some(byte)
}

/// Queues a frame whole or not at all.
pub(crate) fn send(frame: &[u8]) -> Result<(), QueueFull> {
    if TO_SEND.free_capacity() < frame.len() {
        return Err(QueueFull);
    }
    // The queue is a ring: a frame across its end takes two writes.
    let mut rest = frame;
    while !rest.is_empty() {
        let count = TO_SEND.try_write(rest).map_err(|_| QueueFull)?;
        rest = rest.get(count..).unwrap_or(&[]);
    }
    Ok(())
}

/// Moves queued bytes to the UART.
#[embassy_executor::task]
pub(crate) async fn transmit(mut uart: BufferedUartTx) {
    let mut buffer = [0; 32];
    loop {
        let count = TO_SEND.read(&mut buffer).await;
        // A UART without flow control has no errors.
        let _ = uart.write_all(buffer.get(..count).unwrap_or(&[])).await;
    }
}

/// Moves received bytes to the queue. Bytes that do not fit are lost, and their sender repeats them.
#[embassy_executor::task]
pub(crate) async fn receive_bytes(mut uart: BufferedUartRx) {
    let mut buffer = [0; 32];
    loop {
        if let Ok(count) = uart.read(&mut buffer).await {
            let _ = RECEIVED.try_write(buffer.get(..count).unwrap_or(&[]));
        }
    }
}
