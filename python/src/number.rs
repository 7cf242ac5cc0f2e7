//! Numbers from Python, with errors that name the argument.

use std::fmt::Display;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// An invalid value.
pub(crate) fn invalid(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// An integer of a type; `name` is that of the argument.
pub(crate) fn integer<T: TryFrom<i64> + Bounded>(value: &Bound<'_, PyAny>, name: &str) -> PyResult<T> {
    let out_of_range = || invalid(format!("{name} is {value}, but must be from {} to {}", T::MIN, T::MAX));
    match value.extract::<i64>() {
        Ok(number) => T::try_from(number).map_err(|_| out_of_range()),
        Err(error) if error.is_instance_of::<PyTypeError>(value.py()) => {
            Err(PyTypeError::new_err(format!("{name} must be an integer, not {}", type_name(value))))
        }
        Err(_) => Err(out_of_range()),
    }
}

/// A real number.
pub(crate) fn real(value: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    value
        .extract::<f64>()
        .map_err(|_| PyTypeError::new_err(format!("{name} must be a number, not {}", type_name(value))))
}

/// A length in millimetres, rounded.
pub(crate) fn millimetres(value: &Bound<'_, PyAny>, name: &str) -> PyResult<u16> {
    let rounded = real(value, name)?.round();
    if (0.0..=f64::from(u16::MAX)).contains(&rounded) {
        return Ok(rounded as u16);
    }
    Err(invalid(format!("{name} is {value}, but must be from 0 to {}", u16::MAX)))
}

/// The name of the type of a value.
pub(crate) fn type_name(value: &Bound<'_, PyAny>) -> String {
    value.get_type().name().map_or_else(|_| "this".to_owned(), |name| name.to_string())
}

/// The range of an integer type.
pub(crate) trait Bounded {
    /// The least value.
    const MIN: i64;
    /// The largest value.
    const MAX: i64;
}

macro_rules! bounded {
    ($($integer:ty),*) => {
        $(impl Bounded for $integer {
            const MIN: i64 = <$integer>::MIN as i64;
            const MAX: i64 = <$integer>::MAX as i64;
        })*
    };
}

bounded!(u8, u16, u32, i16);

/// A seed: 64 bits without a sign.
pub(crate) fn seed(value: &Bound<'_, PyAny>) -> PyResult<u64> {
    value.extract().map_err(|_| invalid(format!("seed is {value}, but must be an integer from 0 to {}", u64::MAX)))
}
