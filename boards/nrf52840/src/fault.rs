//! What happens when something fails that cannot, and how deep the stack was.

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, STACK_PAINT_VALUE, exception};

/// Starts anew.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset()
}

// SAFETY: the handler touches no state that the fault may have left half written.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    SCB::sys_reset()
}

/// How many bytes of stack were ever in use, from the paint that `cortex-m-rt` puts there before `main`.
#[allow(unsafe_code)]
pub(crate) fn stack_high_water_bytes() -> u32 {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    let (end, start) = (&raw const _stack_end, &raw const _stack_start);
    let mut word = end;
    // SAFETY: the words between the two symbols are RAM that was painted and belongs to the stack only; below the
    // deepest use they are never written again.
    while word < start && unsafe { word.read_volatile() } == STACK_PAINT_VALUE {
        word = word.wrapping_add(1);
    }
    u32::try_from(start.addr() - word.addr()).unwrap_or(u32::MAX)
}
