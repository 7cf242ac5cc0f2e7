//! The proof that no panic path is left in the library: this image links only when there is none.
//!
//! It calls every public function of the library with inputs that the optimiser cannot see through. Its panic handler
//! calls a function that does not exist, so a panic path that survives the optimiser is an undefined symbol. Build it with
//! `cargo firmware --profile proof --bin no_panic`; it is never run. `--cfg teeth` adds one function that can panic, to show
//! that the proof can fail.

use core::{hint::black_box, panic::PanicInfo};

use stm32f4xx_hal as _;

mod proof;

/// The linker script of `defmt` wants a logger.
#[defmt::global_logger]
struct Mute;

// SAFETY: nothing is done, so nothing can be done at the wrong time.
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
    // SAFETY: never executed; the image does not link when this is reachable.
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
    proof::fault();
    proof::ring();
    proof::sonar();
    proof::fingerprint_and_ngram();
    proof::map_and_history();
    proof::filter();
    proof::robust_filter();
    proof::place();
    proof::mapper();
    proof::wire();
    proof::commands();
    proof::drive();
    proof::robot();
    #[cfg(teeth)]
    black_box(can_panic(black_box(&[1, 2, 3])));
    loop {
        black_box(0);
    }
}
