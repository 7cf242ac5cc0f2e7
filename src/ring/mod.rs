//! One reading of the whole sonar ring, and where the sensors of the ring look.

pub mod drivers;

/// What one sonar said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Echo {
    /// The nearest echo came from this far, in millimetres.
    Range {
        /// Distance to the obstacle, in millimetres.
        range_mm: u16,
    },
    /// The sensor works and heard nothing: nothing in range, or the sound was reflected away.
    Silence,
    /// The sensor did not answer, or answered nonsense: it says nothing about the world.
    Dead,
}

impl Echo {
    /// The range in millimetres, when there was an echo.
    pub const fn range_mm(self) -> Option<u16> {
        match self {
            Self::Range { range_mm } => Some(range_mm),
            Self::Silence | Self::Dead => None,
        }
    }
}

/// One reading of a ring of `SONARS` sensors, in the order of the ring's [`RingGeometry`].
///
/// ```
/// use toposlam::ring::{Echo, RingFrame};
///
/// let mut frame = RingFrame { echoes: [Echo::Silence; 16] };
/// frame.echoes[0] = Echo::Range { range_mm: 1200 };
/// frame.echoes[5] = Echo::Dead;
/// let nearest_mm = frame.echoes.iter().filter_map(|echo| echo.range_mm()).min();
/// assert_eq!(nearest_mm, Some(1200));
/// assert!(frame.dead_sensors().eq([5]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RingFrame<const SONARS: usize> {
    /// One echo for each sensor.
    pub echoes: [Echo; SONARS],
}

impl<const SONARS: usize> RingFrame<SONARS> {
    /// The indices of the sensors that say nothing about the world in this frame, in ascending order.
    pub fn dead_sensors(&self) -> impl Iterator<Item = usize> {
        self.echoes.iter().enumerate().filter_map(|(sensor, echo)| (*echo == Echo::Dead).then_some(sensor))
    }
}

/// Where the sensors of a ring look, counter-clockwise from straight ahead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RingGeometry<const SONARS: usize> {
    /// The bearing of each sensor in milliradians, −3142 to 3142, counter-clockwise positive, 0 straight ahead.
    pub bearings_mrad: [i16; SONARS],
}

impl<const SONARS: usize> RingGeometry<SONARS> {
    /// Sensors at even spacing, the first one straight ahead, counter-clockwise.
    ///
    /// ```
    /// use toposlam::ring::RingGeometry;
    /// assert_eq!(RingGeometry::<4>::even().bearings_mrad, [0, 1571, -3141, -1571]);
    /// ```
    pub const fn even() -> Self {
        const { assert!(SONARS > 0 && SONARS <= 128, "a ring has 1 to 128 sensors") };
        const FULL_TURN_MRAD: usize = 6283;
        let mut bearings_mrad = [0; SONARS];
        let mut sensor = 0;
        while sensor < SONARS {
            let bearing_mrad = ((2 * sensor * FULL_TURN_MRAD + SONARS) / (2 * SONARS)) as i16;
            bearings_mrad[sensor] =
                if 2 * sensor < SONARS { bearing_mrad } else { bearing_mrad - FULL_TURN_MRAD as i16 };
            sensor += 1;
        }
        Self { bearings_mrad }
    }
}
