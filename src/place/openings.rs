//! The openings between equidistant obstacles: the directions in which edges leave a meet point.

use super::scan::{Obstacles, RingScan};
use super::smoothing::DEAD_MM;
use crate::bearing::{HALF_TURN_MRAD, counter_clockwise_mrad, rotated, turn_mrad};
use crate::top_k::TopK;

/// A sensor looks into an opening when its range is above this percentage of the radius. The corner of a square room is at
/// 1.41 times the radius of the inscribed disc.
const OPEN_PERCENT: u32 = 160;

/// Openings of two scans within this angle are the same, in milliradians.
const SAME_OPENING_MRAD: i32 = 500;
/// The most different openings of the merged scans.
const MERGED_MAX: usize = 8;

/// Bearings of the openings between the equidistant obstacles of a scan, at most [`Obstacles::MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Openings {
    bearings_mrad: TopK<i16, { Obstacles::MAX }>,
}

impl Openings {
    /// No openings.
    pub const NONE: Self = Self { bearings_mrad: TopK::new(0) };

    /// The number of openings.
    pub fn count(&self) -> u8 {
        self.bearings_mrad().len() as u8
    }

    /// Bearings in milliradians in ascending order: counter-clockwise from straight behind.
    pub fn bearings_mrad(&self) -> &[i16] {
        self.bearings_mrad.as_slice()
    }

    /// Index and bearing of the opening closest to `bearing_mrad`; `None` when none is within `within_mrad` of it.
    pub fn nearest(&self, bearing_mrad: i16, within_mrad: u16) -> Option<(usize, i16)> {
        let off_mrad = |opening_mrad: i16| turn_mrad(bearing_mrad, opening_mrad).abs();
        let openings = self.bearings_mrad().iter().copied().enumerate();
        let nearest = openings.min_by_key(|&(_, opening_mrad)| off_mrad(opening_mrad));
        nearest.filter(|&(_, opening_mrad)| off_mrad(opening_mrad) <= i32::from(within_mrad))
    }
}

/// The openings of several scans, merged by their bearings.
#[derive(Clone, Copy, Debug)]
pub(super) struct MergedOpenings {
    /// The mean bearing of each opening, and the number of scans that show it.
    openings: [(i16, u8); MERGED_MAX],
    scans: u8,
}

impl MergedOpenings {
    pub(super) const fn new() -> Self {
        Self { openings: [(0, 0); MERGED_MAX], scans: 0 }
    }

    /// Adds the openings of a scan, rotated by `by_mrad`.
    pub(super) fn add(&mut self, openings: &Openings, by_mrad: i32) {
        self.scans = self.scans.saturating_add(1);
        for &bearing_mrad in openings.bearings_mrad() {
            let bearing_mrad = rotated(bearing_mrad, by_mrad);
            let is_same = |&&mut (mean_mrad, scans): &&mut (i16, u8)| {
                scans == 0 || turn_mrad(mean_mrad, bearing_mrad).abs() <= SAME_OPENING_MRAD
            };
            if let Some((mean_mrad, scans)) = self.openings.iter_mut().find(is_same) {
                let weight = i32::from(*scans) + 1;
                *scans = scans.saturating_add(1);
                let off_mrad = if weight == 1 { 0 } else { turn_mrad(*mean_mrad, bearing_mrad) / weight };
                *mean_mrad = if weight == 1 { bearing_mrad } else { rotated(*mean_mrad, off_mrad) };
            }
        }
    }

    /// The openings that at least half of the scans show.
    pub(super) fn agreed(&self) -> Openings {
        let mut bearings_mrad = TopK::new(0);
        for &(mean_mrad, scans) in &self.openings {
            if scans > 0 && scans.saturating_mul(2) >= self.scans {
                bearings_mrad.insert(mean_mrad, |one, other| one <= other);
            }
        }
        Openings { bearings_mrad }
    }
}

impl<const SONARS: usize> RingScan<'_, SONARS> {
    /// Finds the openings between the equidistant obstacles.
    ///
    /// A gap between two obstacles is open when a sensor in it measures more than 1.6 times the mean range of the
    /// equidistant obstacles, or silence. The bearing of the opening is the mean of these sensors' bearings. A corridor
    /// that ends within 1.6 times that range is not an opening. Time `O(SONARS)` for each obstacle.
    pub fn openings(&self, obstacles: &Obstacles) -> Openings {
        let mut bearings_mrad = TopK::new(0);
        let radius_mm = obstacles.radius_mm();
        let bearings = obstacles.equidistant().map(|obstacle| obstacle.bearing_mrad);
        for from_mrad in bearings.clone() {
            let gap_mrad = bearings.clone().filter_map(|to_mrad| {
                let gap_mrad = counter_clockwise_mrad(from_mrad, to_mrad);
                (gap_mrad > 0).then_some(gap_mrad)
            });
            let gap_mrad = gap_mrad.min().unwrap_or(2 * i32::from(HALF_TURN_MRAD));
            let open = self.ranges().filter_map(|(range_mm, bearing_mrad)| {
                let within_mrad = counter_clockwise_mrad(from_mrad, bearing_mrad);
                let is_within = within_mrad > 0 && within_mrad < gap_mrad;
                (range_mm != DEAD_MM && is_within && is_open(range_mm, radius_mm)).then_some(within_mrad)
            });
            let (count, sum_mrad) =
                open.fold((0i32, 0i32), |(count, sum), within_mrad| (count + 1, sum.saturating_add(within_mrad)));
            if let Some(middle_mrad) = sum_mrad.checked_div(count) {
                bearings_mrad.insert(rotated(from_mrad, middle_mrad), |one, other| one <= other);
            }
        }
        Openings { bearings_mrad }
    }
}

/// Whether a range is too long for a corner between two equidistant walls.
fn is_open(range_mm: u16, radius_mm: u16) -> bool {
    u32::from(range_mm) * 100 > u32::from(radius_mm) * OPEN_PERCENT
}
