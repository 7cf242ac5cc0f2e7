//! The settings of the place detector and of the filters, as classes with the fields of the library.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toposlam::{ConfigError, Direction, reference};

use crate::number::{integer, invalid};
use crate::ring::Ring;

/// A class of the integer fields of a configuration. `$signature` is that of its constructor, with the defaults. `$set` sets another
/// field and returns whether there is one of this name; `$check` checks all fields, and the rest are more methods.
macro_rules! config_class {
    (
        $(#[$attribute:meta])* $name:ident, $core:ty, $signature:literal, { $($field:ident),* $(,)? },
        $set:expr, $check:expr,
        { $($rest:tt)* }
    ) => {
        $(#[$attribute])*
        #[pyclass(frozen, eq, from_py_object, module = "toposlam")]
        #[derive(Clone, Copy, PartialEq)]
        pub(crate) struct $name(pub(crate) $core);

        #[pymethods]
        impl $name {
            #[new]
            #[pyo3(signature = (**fields), text_signature = $signature)]
            fn new(fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
                Self::with(<$core>::DEFAULT, fields)
            }

            $(#[getter]
            fn $field(&self) -> i64 {
                self.0.$field.into()
            })*

            fn __repr__(&self) -> String {
                let fields = [$(format!("{}={}", stringify!($field), self.0.$field)),*];
                format!("{}({})", stringify!($name), fields.join(", "))
            }

            $($rest)*
        }

        impl $name {
            /// The settings with other values of some fields.
            fn with(mut config: $core, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
                let set: fn(&mut $core, &str, &Bound<'_, PyAny>) -> PyResult<bool> = $set;
                for (field, value) in fields.into_iter().flatten() {
                    let field: String = field.extract()?;
                    match field.as_str() {
                        $(stringify!($field) => config.$field = integer(&value, &field)?,)*
                        field if set(&mut config, field, &value)? => {}
                        _ => {
                            let error = format!("{} has no field {field:?}", stringify!($name));
                            return Err(PyTypeError::new_err(error));
                        }
                    }
                }
                let check: fn(&$core) -> Result<(), ConfigError> = $check;
                check(&config).map_err(invalid)?;
                Ok(Self(config))
            }
        }
    };
}

config_class! {
    /// Settings of the place detector.
    ///
    /// equidistance_mm: largest difference of range between equidistant obstacles.
    /// leave_mm: spread above which the robot has left the place.
    /// separation_mrad: minimum angle between two obstacles.
    /// confirm_frames: number of frames that confirm a place.
    /// leave_frames: number of frames without the place after which it is over.
    /// settle_frames: number of frames after which a place is reported although the robot is still at it.
    /// range_min_mm, range_max_mm: limits of a valid range. A shorter one is a fault, a longer one is silence.
    /// live_sensors_min: minimum number of live sensors, 3 to the size of the ring.
    PlaceConfig, toposlam::place::PlaceConfig,
    "(*, equidistance_mm=150, leave_mm=300, separation_mrad=1047, confirm_frames=3, leave_frames=3, settle_frames=25, \
     range_min_mm=30, range_max_mm=6000, live_sensors_min=6)",
    {
        equidistance_mm, leave_mm, separation_mrad, confirm_frames, leave_frames, settle_frames, range_min_mm, range_max_mm,
        live_sensors_min,
    },
    |_, _, _| Ok(false),
    // The limits depend on the ring; the detector checks them when it starts.
    |_| Ok(()),
    {
        /// The settings for a ring, the default of a detector and of a mapper: with other limits of `separation_mrad` and
        /// `live_sensors_min` for a small or uneven ring.
        #[staticmethod]
        #[pyo3(signature = (ring, **fields))]
        fn for_ring(ring: Ring, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
            Self::with(ring.place_config(), fields)
        }
    }
}

config_class! {
    /// Settings of the ordered filter.
    ///
    /// noise_mm: first guess of the standard deviation of a radius.
    /// wrong_exit_permille: how often an exit is wrong.
    /// missed_way_permille: how often a way is not seen.
    /// false_way_permille: how often something is seen that is no way.
    /// bearing_noise_mrad: standard deviation of a bearing.
    /// travel_noise_permille: standard deviation of a travel time, in thousandths of it.
    OrderedConfig, toposlam::OrderedConfig,
    "(*, noise_mm=30, wrong_exit_permille=40, missed_way_permille=50, false_way_permille=20, bearing_noise_mrad=100, \
     travel_noise_permille=100)",
    {
        noise_mm, wrong_exit_permille, missed_way_permille, false_way_permille, bearing_noise_mrad, travel_noise_permille,
    },
    |_, _, _| Ok(false),
    toposlam::OrderedConfig::check,
    {}
}

config_class! {
    /// Settings of the robust filter.
    ///
    /// hypotheses: how many hypotheses are kept, 1 to 10.
    /// noise_mm: first guess of the standard deviation of a radius.
    /// resolution_mm: resolution of the radii.
    /// moves: number of refinement proposals at each place.
    /// wrong_turn_permille: how often the hint that the robot turned back is wrong.
    /// wrong_degree_permille: how often a number of ways is wrong.
    RobustConfig, toposlam::RobustConfig,
    "(*, hypotheses=10, noise_mm=30, resolution_mm=2, moves=1, wrong_turn_permille=20, wrong_degree_permille=100)",
    { hypotheses, noise_mm, resolution_mm, moves, wrong_turn_permille, wrong_degree_permille },
    |_, _, _| Ok(false),
    |config| config.check(reference::robust::HYPOTHESES),
    {}
}

config_class! {
    /// Settings of the paper's filter.
    ///
    /// ngram_length: how many labels an n-gram has, 2 to 7.
    /// particles: number of particles, 1 to 10.
    /// penalty_permille: φ of Eq. 9, the penalty for similar vertices.
    /// sigma_label_mm, sigma_consistency_mm: σ_l of Eq. 7 and 9, σ_c of Eq. 8.
    /// direction: which half of Eq. 2 counts, "two-sided", "map-to-history" or "history-to-map".
    PaperConfig, toposlam::PaperConfig,
    "(*, ngram_length=5, particles=10, penalty_permille=100, sigma_label_mm=50, sigma_consistency_mm=30, \
     direction='two-sided')",
    { ngram_length, particles, penalty_permille, sigma_label_mm, sigma_consistency_mm },
    set_direction,
    |config| config.check(reference::paper::PARTICLES).map(|_| ()),
    {
        #[getter]
        fn direction(&self) -> &'static str {
            let named = DIRECTIONS.iter().find(|(_, direction)| *direction == self.0.direction);
            named.map_or("", |(name, _)| name)
        }
    }
}

const DIRECTIONS: [(&str, Direction); 3] = [
    ("two-sided", Direction::TwoSided),
    ("map-to-history", Direction::MapToHistory),
    ("history-to-map", Direction::HistoryToMap),
];

fn set_direction(config: &mut toposlam::PaperConfig, field: &str, value: &Bound<'_, PyAny>) -> PyResult<bool> {
    if field != "direction" {
        return Ok(false);
    }
    let name: String = value.extract()?;
    let named = DIRECTIONS.iter().find(|(known, _)| *known == name);
    let (_, direction) = named.ok_or_else(|| {
        let names = DIRECTIONS.map(|(name, _)| name).join(", ");
        invalid(format!("direction is {name:?}, but must be one of {names}"))
    })?;
    config.direction = *direction;
    Ok(true)
}
