//! High-water mark of the stack.

use cortex_m_rt::STACK_PAINT_VALUE;

/// Largest number of stack bytes ever in use, from the paint that `cortex-m-rt` writes before `main`.
#[allow(unsafe_code)]
pub(crate) fn stack_high_water_bytes() -> u32 {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    let (end, start) = (&raw const _stack_end, &raw const _stack_start);
    let mut word = end;
    // SAFETY: the words between the two symbols are painted RAM that only the stack uses. Words below its deepest use keep
    // the paint.
    while word < start && unsafe { word.read_volatile() } == STACK_PAINT_VALUE {
        word = word.wrapping_add(1);
    }
    u32::try_from(start.addr() - word.addr()).unwrap_or(u32::MAX)
}
