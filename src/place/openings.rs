//! The openings between equidistant obstacles: the directions in which edges leave a meet point.

use super::obstacles::Obstacles;
use super::scan::RingScan;
use super::smoothing::DEAD_MM;
use crate::bearing::{HALF_TURN_MRAD, counter_clockwise_mrad, rotated, turn_mrad};
use crate::top_k::TopK;

/// A sensor looks into an opening when its range is above this percentage of the radius. The corner of a square room is at
/// 1.41 times the radius of the inscribed disc.
const OPEN_PERCENT: u32 = 160;

/// The corners beside a wall that ends an opening are nearer than this percentage of the radius.
const FAR_PERCENT: u32 = 220;

/// The sensors that look into an opening between two obstacles `separation_mrad` apart are at this many bearings or more, in milliradians: a single
/// sensor of a dense ring may miss both a wall and its corner.
const LEAST_OPEN_MRAD: i32 = 300;
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

    /// The angle within which the openings of two scans of a ring with this angle between two sensors are the same: at least this,
    /// because an opening may be one sensor aside in the next scan.
    pub(super) const fn same_mrad(spacing_mrad: u16) -> i32 {
        let most_mrad = spacing_mrad as i32;
        if most_mrad > SAME_OPENING_MRAD { most_mrad } else { SAME_OPENING_MRAD }
    }

    /// Inserts an opening that is none of those present.
    pub(super) fn insert(&mut self, bearing_mrad: i16, same_mrad: i32) {
        if self.nearest(bearing_mrad, same_mrad as u16).is_none() {
            self.bearings_mrad.insert(bearing_mrad, |one, other| one <= other);
        }
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

    /// Adds the openings of a scan, rotated by `by_mrad`. Those within `same_mrad` of each other are one.
    pub(super) fn add(&mut self, openings: &Openings, by_mrad: i32, same_mrad: i32) {
        self.scans = self.scans.saturating_add(1);
        for &bearing_mrad in openings.bearings_mrad() {
            let bearing_mrad = rotated(bearing_mrad, by_mrad);
            let is_same = |&&mut (mean_mrad, scans): &&mut (i16, u8)| {
                scans == 0 || turn_mrad(mean_mrad, bearing_mrad).abs() <= same_mrad
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
        self.shown_by(self.scans.div_ceil(2).max(1))
    }

    /// The openings that at least this many scans show.
    pub(super) fn shown_by(&self, least: u8) -> Openings {
        let mut bearings_mrad = TopK::new(0);
        for &(mean_mrad, scans) in &self.openings {
            if scans >= least {
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
    /// that ends within 1.6 times that range is not an opening, nor is a wall between two corners that are nearer than 2.2 times
    /// that range. The gap with the way by which the robot came is open, whatever
    /// the sonars measure. Time `O(SONARS)` for each obstacle.
    pub fn openings(&self, obstacles: &Obstacles) -> Openings {
        self.gaps(obstacles, 0)
    }

    /// The openings between two obstacles that are less than `separation_mrad` apart, as a door.
    pub(crate) fn narrow_openings(&self, obstacles: &Obstacles) -> Openings {
        self.gaps(obstacles, self.separation_mrad)
    }

    /// The openings of the gaps that are narrower than `narrow_mrad`, or of all gaps if it is 0.
    #[inline(never)]
    fn gaps(&self, obstacles: &Obstacles, narrow_mrad: u16) -> Openings {
        let mut bearings_mrad = TopK::new(0);
        let radius_mm = obstacles.radius_mm();
        let bearings = obstacles.equidistant().map(|obstacle| obstacle.bearing_mrad);
        for from_mrad in bearings.clone() {
            let gap_mrad = bearings.clone().filter_map(|to_mrad| {
                let gap_mrad = counter_clockwise_mrad(from_mrad, to_mrad);
                (gap_mrad > 0).then_some(gap_mrad)
            });
            let gap_mrad = gap_mrad.min().unwrap_or(2 * i32::from(HALF_TURN_MRAD));
            if narrow_mrad > 0 && gap_mrad >= narrow_mrad.into() {
                continue;
            }
            let inside_mrad = |bearing_mrad: i16| {
                let within_mrad = counter_clockwise_mrad(from_mrad, bearing_mrad);
                (within_mrad > 0 && within_mrad < gap_mrad).then_some(within_mrad)
            };
            let inside = || {
                self.ranges().filter_map(|(range_mm, bearing_mrad)| {
                    let within_mrad = inside_mrad(bearing_mrad)?;
                    (range_mm != DEAD_MM).then_some((range_mm, within_mrad))
                })
            };
            let open = inside().filter(|&(range_mm, _)| is_open(range_mm, radius_mm));
            let mut sensors = OpenSensors { count: 0, sum_mrad: 0, first_mrad: gap_mrad, last_mrad: 0, is_far: false };
            open.for_each(|(range_mm, within_mrad)| {
                sensors.add(within_mrad, is_beyond(FAR_PERCENT, range_mm, radius_mm))
            });
            let is_wall = inside().any(|(range_mm, within_mrad)| {
                sensors.first_mrad < within_mrad && within_mrad < sensors.last_mrad && !is_open(range_mm, radius_mm)
            });
            let open_mrad = sensors.count.saturating_mul(self.spacing_mrad().into());
            let is_lone = self.separates(gap_mrad) && open_mrad < LEAST_OPEN_MRAD;
            let is_closed = is_lone || is_wall && !sensors.is_far;
            let middle_mrad = sensors.sum_mrad.checked_div(if is_closed { 0 } else { sensors.count });
            let middle_mrad = middle_mrad.or_else(|| inside_mrad(self.came_by_mrad?));
            if let Some(middle_mrad) = middle_mrad {
                bearings_mrad.insert(rotated(from_mrad, middle_mrad), |one, other| one <= other);
            }
        }
        Openings { bearings_mrad }
    }
}

/// The sensors that look into an opening.
struct OpenSensors {
    count: i32,
    sum_mrad: i32,
    first_mrad: i32,
    last_mrad: i32,
    /// Whether one of them looks farther than a corner of the room is.
    is_far: bool,
}

impl OpenSensors {
    fn add(&mut self, within_mrad: i32, is_far: bool) {
        self.count = self.count.saturating_add(1);
        self.sum_mrad = self.sum_mrad.saturating_add(within_mrad);
        self.first_mrad = self.first_mrad.min(within_mrad);
        self.last_mrad = self.last_mrad.max(within_mrad);
        self.is_far |= is_far;
    }
}

/// Whether a range is too long for a corner between two equidistant walls.
pub(crate) fn is_open(range_mm: u16, radius_mm: u16) -> bool {
    is_beyond(OPEN_PERCENT, range_mm, radius_mm)
}

fn is_beyond(percent: u32, range_mm: u16, radius_mm: u16) -> bool {
    u32::from(range_mm) * 100 > u32::from(radius_mm) * percent
}
