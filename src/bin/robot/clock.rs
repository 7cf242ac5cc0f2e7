//! The millisecond clock of the board: SysTick interrupts.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_rt::exception;

static TICKS: AtomicU32 = AtomicU32::new(0);

/// Counts a tick. The interrupt also wakes the UART of the bridge.
#[exception]
fn SysTick() {
    TICKS.fetch_add(1, Ordering::Relaxed);
}

/// A clock of milliseconds.
pub(crate) struct Clock {
    ticks_per_s: u32,
}

impl Clock {
    /// Starts SysTick: 4000 ticks per second, or ten in the emulator, where the peer on the line may be slow.
    pub(crate) fn start(timer: &mut SYST, clock_hz: u32, is_emulated: bool) -> Self {
        let ticks_per_s = if is_emulated { 10 } else { 4000 };
        timer.set_clock_source(SystClkSource::Core);
        // The emulated core always runs at 168 MHz, where the largest reload value is a tenth of a second.
        timer.set_reload(if is_emulated { 16_777_215 } else { clock_hz / ticks_per_s - 1 });
        timer.clear_current();
        timer.enable_interrupt();
        timer.enable_counter();
        Self { ticks_per_s }
    }

    /// Milliseconds since the start, wrapping.
    pub(crate) fn now_ms(&self) -> u32 {
        let ticks = u64::from(TICKS.load(Ordering::Relaxed));
        (ticks * 1000).checked_div(u64::from(self.ticks_per_s)).unwrap_or(0) as u32
    }
}
