//! Proof that the library has no panic path: this image links only if there is none.
//!
//! It calls every public function of the library with inputs that the optimiser cannot see through, one file for each room.
//! Its panic handler calls a function that does not exist, so a panic path that the optimiser does not remove is an undefined
//! symbol. Build it with `cargo firmware --profile proof --bin no_panic`; it is never run. `--cfg teeth` adds a function that
//! can panic, to show that the proof can fail.

use core::{hint::black_box, panic::PanicInfo};

use stm32f4xx_hal as _;

mod any;
mod map;
mod mapper;
mod ordered;
mod paper;
mod place;
mod ring;
mod robot;
mod robust;
mod wire;

/// The linker script of `defmt` needs a logger.
#[defmt::global_logger]
struct Mute;

// SAFETY: the functions do nothing.
#[allow(unsafe_code)]
unsafe impl defmt::Logger for Mute {
    fn acquire() {}
    unsafe fn flush() {}
    unsafe fn release() {}
    unsafe fn write(_: &[u8]) {}
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    #[allow(unsafe_code)]
    unsafe extern "C" {
        fn a_panic_path_survived() -> !;
    }
    // SAFETY: never executed: the image does not link if this is reachable.
    #[allow(unsafe_code)]
    unsafe {
        a_panic_path_survived()
    }
}

#[cfg(teeth)]
fn can_panic(numbers: &[u32]) -> u32 {
    numbers[black_box(7)]
}

#[cortex_m_rt::entry]
fn main() -> ! {
    ring::fault();
    ring::ring();
    ring::sonar();
    place::place();
    map::map();
    paper::ngram();
    paper::history();
    paper::filter();
    ordered::ordered_filter();
    robust::robust_filter();
    robot::drive();
    mapper::mapper();
    wire::wire();
    wire::names();
    wire::commands();
    robot::robot();
    #[cfg(teeth)]
    black_box(can_panic(black_box(&[1, 2, 3])));
    loop {
        black_box(0);
    }
}
