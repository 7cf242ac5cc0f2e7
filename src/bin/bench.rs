//! The robot image: wires a board to the stages.
#![no_std]
#![no_main]
use cortex_m as _;
use cortex_m_semihosting as _;
use defmt_rtt as _;
use static_cell as _;
use stm32f4xx_hal as _;
use toposlam as _;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}

#[cortex_m_rt::entry]
fn main() -> ! {
    loop {}
}
