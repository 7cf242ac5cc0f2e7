//! Where the doors are: for the ways of the map that lead through a narrow gap, the position of the gap relative to the place.
//!
//! From most places of a room no sonar looks through its door. The robot has come in by it once, and the position of the gap was
//! measured then. The way by which it comes to the place the next time may be another one. The best map says at which of its ways the
//! measurement was made, so that every revision of the map applies.

use super::way_back::Gap;
use crate::bearing::Vector;
use crate::filter::Filter;
use crate::map::DartId;

/// The number of remembered doors.
const DOORS: usize = 32;
/// The unit of the positions, in thousandths of the way of a ring frame at full speed.
const UNIT_PERMILLE: i32 = 10;

/// A door on the way by which the robot came to a place. With a range of 0 it is none; so a `static` robot lies in `.bss`.
#[derive(Clone, Copy, Debug)]
struct Door {
    /// The number of the place.
    place: u16,
    /// Where the door is: along the way and to the left of it.
    along: i16,
    left: i16,
    /// The range of the obstacles beside it, in millimetres.
    range_mm: u16,
}

/// The doors that the robot has come through, the newest first. Memory: 260 bytes.
#[derive(Clone, Debug)]
pub(super) struct Doors {
    doors: [Door; DOORS],
    /// The number of the present place.
    place: u16,
}

impl Doors {
    pub(super) const fn new() -> Self {
        Self { doors: [Door { place: 0, along: 0, left: 0, range_mm: 0 }; DOORS], place: 0 }
    }

    /// The filter has observed a place.
    pub(super) const fn arrive(&mut self) {
        self.place = self.place.wrapping_add(1);
    }

    /// The way of the best map that a door is on.
    fn way<const V: usize>(&self, filter: &impl Filter<V>, door: &Door) -> Option<DartId> {
        if door.range_mm == 0 {
            return None;
        }
        filter.recent_arrival(self.place.wrapping_sub(door.place).into())
    }

    /// The robot has come to the present place through a door, at this position relative to the way by which it came.
    pub(super) fn note<const V: usize>(&mut self, filter: &impl Filter<V>, door: Option<Gap>) {
        let (Some(door), Some(way)) = (door, filter.arrival()) else { return };
        if self.doors.iter().any(|known| known.range_mm > 0 && known.place == self.place) {
            return;
        }
        let known = self.doors.iter().position(|door| self.way(filter, door) == Some(way)).unwrap_or(DOORS - 1);
        if let Some(newest) = self.doors.get_mut(..=known) {
            newest.rotate_right(1);
        }
        let part = |permille: i32| (permille / UNIT_PERMILLE).clamp(i16::MIN.into(), i16::MAX.into()) as i16;
        let (along, left) = (part(door.at.x), part(door.at.y));
        if let Some(newest) = self.doors.first_mut() {
            *newest = Door { place: self.place, along, left, range_mm: door.range_mm };
        }
    }

    /// The door on a way of the map, relative to the way.
    pub(super) fn on<const V: usize>(&self, filter: &impl Filter<V>, way: DartId) -> Option<Gap> {
        let door = self.doors.iter().find(|door| self.way(filter, door) == Some(way))?;
        let permille = |part: i16| i32::from(part) * UNIT_PERMILLE;
        Some(Gap {
            at: Vector { x: permille(door.along), y: permille(door.left) },
            range_mm: door.range_mm,
            is_door: true,
        })
    }
}
