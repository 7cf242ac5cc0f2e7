//! One measurement of the whole ring.

/// Measurement of one sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Echo {
    /// An echo from an obstacle.
    Range {
        /// Distance to the nearest obstacle, in millimetres.
        range_mm: u16,
    },
    /// No echo, from a sensor that works: no obstacle in range, or one that reflects the sound away.
    Silence,
    /// No valid measurement: the sensor did not answer, or its answer was out of range.
    Dead,
}

impl Echo {
    /// Range in millimetres; `None` without an echo.
    pub const fn range_mm(self) -> Option<u16> {
        match self {
            Self::Range { range_mm } => Some(range_mm),
            Self::Silence | Self::Dead => None,
        }
    }
}

/// One measurement by each of the `SONARS` sensors of a ring, in the order of its [`RingGeometry`](super::RingGeometry).
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
    /// The echo of each sensor.
    pub echoes: [Echo; SONARS],
}

impl<const SONARS: usize> RingFrame<SONARS> {
    /// Iterates over the indices of the sensors that are [`Echo::Dead`] in this frame, in ascending order.
    pub fn dead_sensors(&self) -> impl Iterator<Item = usize> {
        self.echoes.iter().enumerate().filter_map(|(sensor, echo)| (*echo == Echo::Dead).then_some(sensor))
    }
}
