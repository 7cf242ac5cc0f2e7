//! The place detector.

use std::collections::BTreeMap;

use pyo3::prelude::*;
use toposlam::{FaultCounters, FaultKind};

use crate::config::PlaceConfig;
use crate::number::invalid;
use crate::ring::{Ring, frame, with_sonars};

/// A place: a point with three or more equidistant obstacles.
///
/// radius_mm: radius of the largest free disc around it.
/// frame_index: index of the frame in which the robot was closest to it.
/// degree: number of ways, 1 to 6, or None if the frames do not agree.
/// ways_mrad: bearings of the ways in the frame in which the place is reported.
/// behind_mrad: direction from which the robot came.
/// spread_mm: smallest difference of range between the equidistant obstacles.
#[pyclass(frozen, eq, get_all, module = "toposlam")]
#[derive(Clone, PartialEq)]
pub(crate) struct Place {
    radius_mm: u16,
    frame_index: u32,
    degree: Option<u8>,
    ways_mrad: Vec<i16>,
    behind_mrad: i16,
    spread_mm: u16,
}

#[pymethods]
impl Place {
    fn __repr__(&self) -> String {
        format!("<Place of radius {} mm at frame {}>", self.radius_mm, self.frame_index)
    }
}

impl From<toposlam::place::Place> for Place {
    fn from(place: toposlam::place::Place) -> Self {
        Self {
            radius_mm: place.fingerprint.radius_mm(),
            frame_index: place.frame_index,
            degree: place.degree,
            ways_mrad: place.ways.bearings_mrad().to_vec(),
            behind_mrad: place.behind_mrad,
            spread_mm: place.spread_mm,
        }
    }
}

/// A detector of the library for one number of sensors.
trait Detector: Send + Sync {
    fn observe(&mut self, ranges_mm: &Bound<'_, PyAny>) -> PyResult<Option<Place>>;
    fn state(&self) -> State<'_>;
}

/// The state of a detector after a frame.
struct State<'a> {
    is_blind: bool,
    is_at_place: bool,
    rotation_mrad: i32,
    faults: &'a FaultCounters,
}

impl<const SONARS: usize> Detector for toposlam::place::PlaceDetector<SONARS> {
    fn observe(&mut self, ranges_mm: &Bound<'_, PyAny>) -> PyResult<Option<Place>> {
        Ok(self.observe(&frame(ranges_mm)?).map(Place::from))
    }

    fn state(&self) -> State<'_> {
        State {
            is_blind: self.is_blind(),
            is_at_place: self.is_at_place(),
            rotation_mrad: self.rotation_mrad(),
            faults: self.faults(),
        }
    }
}

/// Detects places in ring frames.
///
/// ring: number of evenly spaced sensors, 4 to 32, counter-clockwise from straight ahead, or the bearing of each in milliradians.
/// config: the settings, by default those for the ring.
#[pyclass(module = "toposlam")]
pub(crate) struct PlaceDetector(Box<dyn Detector>);

#[pymethods]
impl PlaceDetector {
    #[new]
    #[pyo3(signature = (ring, config = None))]
    fn new(ring: Ring, config: Option<PlaceConfig>) -> PyResult<Self> {
        let config = config.map_or_else(|| ring.place_config(), |config| config.0);
        Ok(Self(with_sonars!(ring.sonars(), SONARS => {
            let mut detector = Box::new(toposlam::place::PlaceDetector::<SONARS>::new());
            detector.start(config, ring.geometry()).map_err(invalid)?;
            detector
        })))
    }

    /// Processes a frame. Returns the place if the frame completes a visit to one.
    ///
    /// ranges_mm: a range for each sensor. None, infinity or "silence" mean no echo; NaN or "dead" mean that the sensor did not answer.
    fn observe(&mut self, ranges_mm: &Bound<'_, PyAny>) -> PyResult<Option<Place>> {
        self.0.observe(ranges_mm)
    }

    /// Whether the newest frame has too few live sensors.
    #[getter]
    fn is_blind(&self) -> bool {
        self.0.state().is_blind
    }

    /// Whether the robot is still at the place that was reported last.
    #[getter]
    fn is_at_place(&self) -> bool {
        self.0.state().is_at_place
    }

    /// Estimated change of all bearings between the two newest frames: the negative of the robot's rotation.
    #[getter]
    fn rotation_mrad(&self) -> i32 {
        self.0.state().rotation_mrad
    }

    /// Number of faults of each kind that occurred.
    #[getter]
    fn faults(&self) -> BTreeMap<String, u32> {
        faults(self.0.state().faults)
    }
}

/// The faults that have occurred, by the names of their kinds.
pub(crate) fn faults(counters: &FaultCounters) -> BTreeMap<String, u32> {
    let counts = FaultKind::ALL.into_iter().map(|kind| (format!("{kind:?}"), counters.count(kind)));
    counts.filter(|(_, count)| *count > 0).collect()
}
