//! Counts instructions: in the emulator SysTick advances with the instructions executed.

use core::{
    arch::asm,
    sync::atomic::{AtomicU32, Ordering},
};

use cortex_m::peripheral::{SCB, SYST, syst::SystClkSource};
use cortex_m_rt::exception;

const TICKS_PER_WRAP: u32 = 1 << 24;
static WRAPS: AtomicU32 = AtomicU32::new(0);

/// Counts a wrap.
#[exception]
fn SysTick() {
    WRAPS.store(WRAPS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// SysTick, extended to 56 bits by counting its wraps, and the number of ticks of a known number of instructions.
pub(crate) struct Clock {
    _timer: SYST,
    ticks_of_two_million: u64,
}

impl Clock {
    /// Starts SysTick and calibrates it with two loops of known length.
    pub(crate) fn start(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TICKS_PER_WRAP - 1);
        timer.clear_current();
        timer.enable_interrupt();
        timer.enable_counter();
        let uncalibrated = Self { _timer: timer, ticks_of_two_million: 0 };
        // The difference of two loops cancels the cost of the measurement itself.
        let (short, ()) = uncalibrated.ticks_for(|| loop_of_known_length(100_000));
        let (long, ()) = uncalibrated.ticks_for(|| loop_of_known_length(1_100_000));
        Self { ticks_of_two_million: long - short, ..uncalibrated }
    }

    /// Number of SysTick ticks in a million instructions.
    pub(crate) const fn ticks_per_million_instructions(&self) -> u64 {
        self.ticks_of_two_million / 2
    }

    fn ticks(&self) -> u64 {
        loop {
            let wraps = WRAPS.load(Ordering::Relaxed);
            let left = SYST::get_current();
            if wraps == WRAPS.load(Ordering::Relaxed) && !SCB::is_pendst_pending() {
                // A wrap begins at 0 and counts down from the reload value.
                let elapsed = (TICKS_PER_WRAP - left) % TICKS_PER_WRAP;
                return u64::from(wraps) * u64::from(TICKS_PER_WRAP) + u64::from(elapsed);
            }
        }
    }

    fn ticks_for<T>(&self, work: impl FnOnce() -> T) -> (u64, T) {
        let before = self.ticks();
        let result = work();
        (self.ticks() - before, result)
    }

    /// Runs `work` and returns the number of instructions it took, and its result.
    pub(crate) fn measure<T>(&self, work: impl FnOnce() -> T) -> (u64, T) {
        let (ticks, result) = self.ticks_for(work);
        (ticks * 2_000_000 / self.ticks_of_two_million, result)
    }
}

/// Executes two instructions per iteration.
fn loop_of_known_length(iterations: u32) {
    // SAFETY: the code modifies its own register and the flags only.
    #[allow(unsafe_code)]
    unsafe {
        asm!("2: subs {iterations}, #1", "bne 2b", iterations = inout(reg) iterations => _, options(nomem, nostack));
    }
}
