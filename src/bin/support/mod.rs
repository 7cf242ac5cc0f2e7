//! What the images share: telling the emulator from the chip, ending on a fault, and measuring the stack.

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, STACK_PAINT_VALUE, exception};
use cortex_m_semihosting::debug;
use stm32f4xx_hal::pac;

/// Whether this is QEMU: its reset and clock controller reads as 0, whereas on a chip the bit of the running internal
/// oscillator is set from the first instruction on (RM0090, RCC_CR).
pub(crate) fn is_emulated() -> bool {
    // SAFETY: the register is there in every STM32F4, and reading it has no effect.
    #[allow(unsafe_code)]
    let control = unsafe { &*pac::RCC::ptr() }.cr().read().bits();
    control == 0
}

/// In the emulator: ends it with a failure. On a chip: starts anew.
fn give_up() -> ! {
    if is_emulated() {
        debug::exit(debug::EXIT_FAILURE);
    }
    SCB::sys_reset()
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    give_up()
}

// SAFETY: the handler touches no state that the fault may have left half written.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    give_up()
}

/// How many bytes of stack were ever in use, from the paint that `cortex-m-rt` puts there before `main`.
#[allow(unsafe_code, dead_code)]
pub(crate) fn stack_high_water_bytes() -> usize {
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
    start.addr() - word.addr()
}
