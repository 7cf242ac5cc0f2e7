//! A ring of any number of sensors, and its frames. The library has the number in the type; here it is a value.

use pyo3::prelude::*;
use pyo3::types::PyString;
use toposlam::place::PlaceConfig;
use toposlam::ring::{Echo, RingFrame, RingGeometry, ScanPoint};

use crate::number::{integer, invalid, real};

/// The least number of sensors.
const SONARS_MIN: usize = 4;
/// The largest number of sensors.
const SONARS_MAX: usize = 32;
/// The largest bearing in milliradians.
const BEARING_MAX_MRAD: f64 = 3142.0;

/// Evaluates an expression with the constant `$sonars`, the number of sensors in `$count`, which [`Ring`] has checked.
macro_rules! with_sonars {
    ($count:expr, $sonars:ident => $body:expr) => {
        $crate::ring::with_sonars!(@ $count, $sonars => $body,
            4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31)
    };
    (@ $count:expr, $sonars:ident => $body:expr, $($number:literal)*) => {
        match $count {
            $($number => { const $sonars: usize = $number; $body })*
            _ => { const $sonars: usize = 32; $body }
        }
    };
}

pub(crate) use with_sonars;

/// The bearings of the sensors in milliradians, 4 to 32. In Python it is a number of sensors, which are then evenly spaced, or a
/// sequence of bearings.
pub(crate) struct Ring(Vec<i16>);

impl<'py> FromPyObject<'_, 'py> for Ring {
    type Error = PyErr;

    fn extract(ring: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let is_size = |sonars: usize| (SONARS_MIN..=SONARS_MAX).contains(&sonars);
        if let Ok(bearings) = ring.try_iter() {
            let bearings: Vec<i16> = bearings.map(|bearing| bearing_mrad(&bearing?)).collect::<PyResult<_>>()?;
            if !is_size(bearings.len()) {
                return Err(wrong_size(bearings.len()));
            }
            return Ok(Self(bearings));
        }
        let sonars = usize::from(integer::<u16>(&ring, "ring")?);
        if !is_size(sonars) {
            return Err(wrong_size(sonars));
        }
        Ok(Self(with_sonars!(sonars, SONARS => RingGeometry::<SONARS>::even().bearings_mrad.to_vec())))
    }
}

impl Ring {
    /// The number of sensors.
    pub(crate) fn sonars(&self) -> usize {
        self.0.len()
    }

    /// The geometry in the library. `SONARS` is that of [`with_sonars`].
    pub(crate) fn geometry<const SONARS: usize>(&self) -> RingGeometry<SONARS> {
        let mut bearings_mrad = [0; SONARS];
        bearings_mrad.iter_mut().zip(&self.0).for_each(|(slot, bearing_mrad)| *slot = *bearing_mrad);
        RingGeometry { bearings_mrad }
    }

    /// The settings of the place detector for this ring.
    pub(crate) fn place_config(&self) -> PlaceConfig {
        with_sonars!(self.sonars(), SONARS => PlaceConfig::for_ring(&self.geometry::<SONARS>()))
    }
}

fn wrong_size(sonars: usize) -> PyErr {
    invalid(format!("a ring has {SONARS_MIN} to {SONARS_MAX} sensors, not {sonars}"))
}

fn bearing_mrad(bearing: &Bound<'_, PyAny>) -> PyResult<i16> {
    let rounded = real(bearing, "a bearing")?.round();
    if rounded.abs() <= BEARING_MAX_MRAD {
        return Ok(rounded as i16);
    }
    Err(invalid(format!("a bearing is {bearing} mrad, but must be from -3142 to 3142")))
}

/// The echoes of one frame.
///
/// A range in millimetres is rounded. `None`, infinity and "silence" are silence, NaN and "dead" a dead sensor.
pub(crate) fn frame<const SONARS: usize>(ranges_mm: &Bound<'_, PyAny>) -> PyResult<RingFrame<SONARS>> {
    let mut echoes = [Echo::Dead; SONARS];
    let mut count = 0;
    for range in ranges_mm.try_iter()? {
        if let Some(slot) = echoes.get_mut(count) {
            *slot = echo(&range?)?;
        }
        count += 1;
    }
    if count != SONARS {
        return Err(invalid(format!("a frame of this ring has {SONARS} ranges, not {count}")));
    }
    Ok(RingFrame { echoes })
}

fn echo(range: &Bound<'_, PyAny>) -> PyResult<Echo> {
    if range.is_none() {
        return Ok(Echo::Silence);
    }
    if let Ok(word) = range.cast::<PyString>() {
        return match &*word.to_cow()? {
            "silence" => Ok(Echo::Silence),
            "dead" => Ok(Echo::Dead),
            word => Err(invalid(format!("a range is {word:?}, but must be a number, None, \"silence\" or \"dead\""))),
        };
    }
    let range_mm = real(range, "a range")?;
    if range_mm.is_nan() {
        return Ok(Echo::Dead);
    }
    if range_mm < 0.0 {
        return Err(invalid(format!("a range is {range} mm, but must not be negative")));
    }
    if range_mm.is_infinite() {
        return Ok(Echo::Silence);
    }
    // A range above the largest one of the configuration is silence, too.
    Ok(Echo::Range { range_mm: range_mm.round().min(f64::from(u16::MAX)) as u16 })
}

/// The frame of a scan with many points, such as that of a lidar: for each sensor of a ring the nearest range among the points whose
/// bearing is nearest to its own, or None without such a point.
///
/// bearings_mrad: bearing of each point, counter-clockwise from straight ahead.
/// ranges_mm: range of each point. A lidar that reports "no return" as 0 needs None or infinity there.
/// ring: number of sensors, 4 to 32, or the bearing of each in milliradians.
#[pyfunction]
pub(crate) fn ring_frame(
    bearings_mrad: &Bound<'_, PyAny>,
    ranges_mm: &Bound<'_, PyAny>,
    ring: Ring,
) -> PyResult<Vec<Option<u16>>> {
    let mut points = Vec::new();
    let mut ranges = ranges_mm.try_iter()?;
    for bearing in bearings_mrad.try_iter()? {
        let bearing_mrad = real(&bearing?, "a bearing")?.round();
        if bearing_mrad.abs() > f64::from(i32::MAX) || bearing_mrad.is_nan() {
            return Err(invalid(format!("a bearing is {bearing_mrad} mrad, but must be a number of turns")));
        }
        let range = ranges.next().ok_or_else(|| invalid("there are fewer ranges than bearings"))??;
        if let Echo::Range { range_mm } = echo(&range)? {
            points.push(ScanPoint { bearing_mrad: bearing_mrad as i32, range_mm });
        }
    }
    if ranges.next().is_some() {
        return Err(invalid("there are more ranges than bearings"));
    }
    Ok(with_sonars!(ring.sonars(), SONARS => {
        let frame = RingFrame::from_points(points, &ring.geometry::<SONARS>());
        frame.echoes.iter().map(|echo| echo.range_mm()).collect()
    }))
}
