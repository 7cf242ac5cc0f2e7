//! Hints of an observation: the exit by which the robot left the last place, its ways, and the travel time.

use pyo3::prelude::*;
use toposlam::{Fingerprint, Observation, Passage, Ways};

use crate::number::{integer, invalid, millimetres};

/// The exit by which the robot left a place, relative to the way by which it came there: `Exit.BACK`, `Exit.ON` (another way, of unknown
/// bearing), or `Exit.from_bearing_mrad`.
#[pyclass(frozen, eq, hash, from_py_object, module = "toposlam")]
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Exit(toposlam::Exit);

#[pymethods]
impl Exit {
    #[classattr]
    const BACK: Self = Self(toposlam::Exit::Back);
    #[classattr]
    const ON: Self = Self(toposlam::Exit::On);

    /// The exit at a bearing, 0 to 6282 mrad counter-clockwise from the way by which the robot came.
    #[staticmethod]
    fn from_bearing_mrad(bearing_mrad: &Bound<'_, PyAny>) -> PyResult<Self> {
        toposlam::Exit::from_bearing_mrad(integer(bearing_mrad, "bearing_mrad")?).map(Self).map_err(invalid)
    }

    fn __repr__(&self) -> String {
        match self.0 {
            toposlam::Exit::Back => "Exit.BACK".to_owned(),
            toposlam::Exit::On => "Exit.ON".to_owned(),
            // The middle of the bearings that are this exit.
            toposlam::Exit::Bearing(bearing) => {
                format!("Exit.from_bearing_mrad({})", (u32::from(bearing) * 6283 + 128) / 256)
            }
        }
    }
}

/// The passage of a mapper.
pub(crate) fn passage(
    exit: Option<Exit>,
    travel_frames: Option<&Bound<'_, PyAny>>,
    entry_mrad: Option<&Bound<'_, PyAny>>,
    returns: bool,
) -> PyResult<Passage> {
    Ok(Passage {
        exit: exit.map(|exit| exit.0),
        travel_frames: travel_frames.map(travel_time).transpose()?,
        entry_mrad: entry_mrad.map(|bearing| integer(bearing, "entry_mrad")).transpose()?,
        returns,
    })
}

/// The observation of a filter.
pub(crate) fn observation(
    radius_mm: &Bound<'_, PyAny>,
    ways: Option<&Bound<'_, PyAny>>,
    exit: Option<Exit>,
    travel_frames: Option<&Bound<'_, PyAny>>,
    starts_sequence: bool,
) -> PyResult<Observation> {
    let fingerprint = Fingerprint::from_radius_mm(millimetres(radius_mm, "radius_mm")?).map_err(invalid)?;
    Ok(Observation {
        ways: ways.map(ways_of).transpose()?,
        exit: exit.map(|exit| exit.0),
        travel_frames: travel_frames.map(travel_time).transpose()?,
        starts_sequence,
        ..Observation::new(fingerprint)
    })
}

fn travel_time(frames: &Bound<'_, PyAny>) -> PyResult<u16> {
    match integer(frames, "travel_frames")? {
        0 => Err(invalid("travel_frames is 0, but must be from 1 to 65535")),
        frames => Ok(frames),
    }
}

/// A number of ways, or the bearings of all but the way by which the robot came.
fn ways_of(ways: &Bound<'_, PyAny>) -> PyResult<Ways> {
    let Ok(bearings) = ways.try_iter() else { return Ways::from_count(integer(ways, "ways")?).map_err(invalid) };
    let bearings = bearings.map(|bearing| integer(&bearing?, "a bearing of ways"));
    Ways::from_bearings_mrad(&bearings.collect::<PyResult<Vec<u16>>>()?).map_err(invalid)
}
