//! The Python module `toposlam._core`: ring frames and places in, maps out, as in the library `toposlam`.
//!
//! Each class has the name of its type in the library. Errors are Python exceptions; `toposlam/_core.pyi` documents all of it.

mod config;
mod filter;
mod hints;
mod map;
mod mapper;
mod number;
mod place;
mod ring;

use pyo3::prelude::*;

/// Adds every class.
#[pymodule]
mod _core {
    #[pymodule_export]
    use crate::config::{OrderedConfig, PaperConfig, PlaceConfig, RobustConfig};
    #[pymodule_export]
    use crate::filter::{Filter, OrderedFilter, PaperFilter, RobustFilter, Update};
    #[pymodule_export]
    use crate::hints::Exit;
    #[pymodule_export]
    use crate::map::{Map, Vertex, Way};
    #[pymodule_export]
    use crate::mapper::Mapper;
    #[pymodule_export]
    use crate::place::{Place, PlaceDetector};
    #[pymodule_export]
    use crate::ring::ring_frame;
}
