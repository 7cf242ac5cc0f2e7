//! What one scan shows of a meet point: spread, radius and openings.

use super::obstacles::Obstacles;
use super::openings::Openings;
use super::scan::RingScan;

/// How well one scan shows a meet point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MeetPoint {
    /// The spread of the obstacles, `u16::MAX` with fewer than three.
    pub(super) spread_mm: u16,
    /// Mean range of the equidistant obstacles.
    pub(super) radius_mm: u16,
    /// The openings between the equidistant obstacles.
    pub(super) openings: Openings,
}

impl<const SONARS: usize> RingScan<'_, SONARS> {
    /// Measures how well the scan shows a meet point.
    pub(super) fn meet_point(&self, obstacles: &Obstacles) -> MeetPoint {
        let openings = self.openings(obstacles);
        let spread_mm = obstacles.spread_mm().unwrap_or(u16::MAX);
        MeetPoint { spread_mm, radius_mm: obstacles.radius_mm(), openings }
    }
}
