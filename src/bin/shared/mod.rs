//! Code that the images of the reference board share: emulator detection, and the handlers of panics and faults.

mod stack;

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::debug;
use stm32f4xx_hal::pac;

pub(crate) use stack::stack_high_water_bytes;

/// Whether the image runs in QEMU. There the clock control register reads as 0; on a chip the ready bit of the internal
/// oscillator is set from the first instruction (RM0090, RCC_CR).
pub(crate) fn is_emulated() -> bool {
    // SAFETY: every STM32F4 has the register, and reading it has no side effect.
    #[allow(unsafe_code)]
    let control = unsafe { &*pac::RCC::ptr() }.cr().read().bits();
    control == 0
}

/// Ends the emulator with a failure, or resets the chip.
fn abort() -> ! {
    if is_emulated() {
        debug::exit(debug::EXIT_FAILURE);
    }
    SCB::sys_reset()
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    abort()
}

// SAFETY: the handler uses no state that the fault may have left inconsistent.
#[allow(unsafe_code)]
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    abort()
}
