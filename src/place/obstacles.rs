//! The closest obstacles of a reading of the ring.

use crate::bearing::{rotated, turn_mrad};

/// An obstacle within this angle of a way is in it: half the cone of a sonar and half the angle between two sensors, in
/// milliradians.
const IN_WAY_MRAD: i32 = 450;
/// Two obstacles within this angle of a way are those beside it, in milliradians.
const BESIDE_WAY_MRAD: i32 = 1100;
/// The obstacles beside a way that is narrower than the cone of a sonar are at most this far from it, in milliradians.
const JAMB_MRAD: i32 = 350;

/// An obstacle of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Obstacle {
    /// Range of its nearest echo, in millimetres.
    pub range_mm: u16,
    /// Mean bearing of the sensors that receive an echo from it, in milliradians.
    pub bearing_mrad: i16,
}

/// The closest obstacles of a scan, nearest first: all equidistant ones, and the next one, at least three in all if there
/// are as many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Obstacles {
    pub(super) obstacles: [Obstacle; Self::MAX],
    pub(super) len: usize,
    pub(super) equidistant: usize,
    pub(super) spread_mm: Option<u16>,
    /// Whether there are three equidistant obstacles only because a sensor looks through between two of them.
    pub(super) is_at_door: bool,
}

impl Obstacles {
    /// Maximum number of obstacles in a scan: with 60° between them no more fit.
    pub const MAX: usize = 6;

    /// No obstacle.
    pub(super) const NONE: Self = Self {
        obstacles: [Obstacle { range_mm: 0, bearing_mrad: 0 }; Self::MAX],
        len: 0,
        equidistant: 0,
        spread_mm: None,
        is_at_door: false,
    };

    /// Iterates over the obstacles, nearest first.
    pub fn iter(&self) -> impl Iterator<Item = &Obstacle> + Clone {
        self.obstacles.iter().take(self.len)
    }

    /// Iterates over the obstacles that are at most `equidistance_mm` farther than the nearest, nearest first.
    pub fn equidistant(&self) -> impl Iterator<Item = &Obstacle> + Clone {
        self.obstacles.iter().take(self.equidistant)
    }

    /// Range of the third closest obstacle minus the range of the closest, in millimetres; `None` with fewer than three.
    ///
    /// Two obstacles beside a gap narrower than `separation_mrad` count as two only at a junction or an end: with exactly two ways
    /// the robot is on an edge that passes through a door.
    pub const fn spread_mm(&self) -> Option<u16> {
        self.spread_mm
    }

    /// Whether there are three equidistant obstacles only because a sensor looks through between two of them, as through a door.
    pub const fn is_at_door(&self) -> bool {
        self.is_at_door
    }

    /// Range of the third closest obstacle minus the range of the closest.
    pub(super) fn third_spread_mm(&self) -> Option<u16> {
        match (self.iter().next(), self.iter().nth(2)) {
            (Some(first), Some(third)) => Some(third.range_mm.saturating_sub(first.range_mm)),
            _ => None,
        }
    }

    /// Mean range of the equidistant obstacles, in millimetres; 0 without any.
    pub fn radius_mm(&self) -> u16 {
        let sum_mm: u32 = self.equidistant().map(|obstacle| u32::from(obstacle.range_mm)).sum();
        sum_mm.checked_div(self.equidistant as u32).unwrap_or(0) as u16
    }

    /// Counts the only equidistant obstacle in a way as the two obstacles beside it: the robot came by that way, so it is no wall.
    pub(super) fn split(&mut self, way_mrad: i16) {
        let off_mrad = |obstacle: &Obstacle| turn_mrad(way_mrad, obstacle.bearing_mrad).abs();
        let is_beside = |obstacle: &&Obstacle| off_mrad(obstacle) < BESIDE_WAY_MRAD;
        let Some(index) = self.equidistant().position(|obstacle| off_mrad(obstacle) < IN_WAY_MRAD) else { return };
        if self.equidistant().filter(is_beside).count() > 1 || self.len >= Self::MAX {
            return;
        }
        let Some(&obstacle) = self.obstacles.get(index) else { return };
        let jamb = |aside_mrad| Obstacle { bearing_mrad: rotated(way_mrad, aside_mrad), ..obstacle };
        let mut carried = jamb(-JAMB_MRAD);
        for (place, slot) in self.obstacles.iter_mut().enumerate().skip(index) {
            core::mem::swap(slot, &mut carried);
            if place == index {
                carried = jamb(JAMB_MRAD);
            }
        }
        self.len += 1;
        self.equidistant += 1;
    }
}
