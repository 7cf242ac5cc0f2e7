//! Parts of the reference board that are more than wiring.

pub(crate) mod line;
pub(crate) mod sleeping_uart;
pub(crate) mod time;
