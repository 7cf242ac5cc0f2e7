//! Inputs that the optimiser cannot see through, and sinks for results.

use core::{
    fmt::{self, Write},
    hint::black_box,
};

use toposlam::{
    Fingerprint, FingerprintError, NgramError, NgramLength, VertexId,
    ring::{Echo, RingFrame},
    wire::{Message, QueueFull},
};

/// Hides a value from the optimiser.
pub(crate) trait Opaque: Sized {
    fn opaque(self) -> Self {
        black_box(self)
    }
}

impl<T> Opaque for T {}

/// Discards text.
struct Nowhere;

impl Write for Nowhere {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        black_box(text);
        if black_box(true) { Ok(()) } else { Err(fmt::Error) }
    }
}

/// Formats an error.
pub(crate) fn show<ERROR: fmt::Display>(error: ERROR) {
    let _ = black_box(write!(Nowhere, "{error}"));
}

/// Discards a result.
pub(crate) fn discard<T, ERROR>(outcome: Result<T, ERROR>) {
    black_box(outcome.is_ok());
}

pub(crate) fn any_fingerprint() -> Fingerprint {
    match Fingerprint::from_radius_mm(black_box(1200)) {
        Ok(fingerprint) => fingerprint,
        Err(error) => {
            show::<FingerprintError>(error);
            Fingerprint::MAX
        }
    }
}

pub(crate) fn any_length() -> NgramLength {
    match NgramLength::new(black_box(5)) {
        Ok(length) => length,
        Err(error) => {
            show::<NgramError>(error);
            NgramLength::MIN
        }
    }
}

pub(crate) fn any_vertex() -> VertexId {
    VertexId::new(black_box(1)).unwrap_or(VertexId::FIRST)
}

pub(crate) fn any_frame() -> RingFrame<16> {
    RingFrame { echoes: black_box([Echo::Range { range_mm: 1000 }; 16]) }
}

pub(crate) fn any_answer(message: &Message) -> Result<(), QueueFull> {
    black_box(message);
    if black_box(true) { Ok(()) } else { Err(QueueFull) }
}
