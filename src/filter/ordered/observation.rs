//! What the ordered filter hears of one place: the radius, the ways seen, how the robot left the place before, and how long it
//! drove.

use crate::filter::WaysError;
use crate::map::darts::{Bearing, WAYS};
use crate::place::Fingerprint;

/// The ways seen at a visit: the way the robot came by, and the bearings of the others relative to it, counter-clockwise. At the
/// first place of a sequence any way stands for the one it came by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WaysSeen {
    count: u8,
    others: [u8; WAYS - 1],
}

/// A full turn in milliradians, rounded down.
const TURN_MRAD: u32 = 6283;

impl WaysSeen {
    /// Nothing is known of the ways.
    pub const UNKNOWN: Self = Self { count: 0, others: [0; WAYS - 1] };

    /// The ways at a place from the bearings of all but the one the robot came by, relative to that one, in milliradians
    /// counter-clockwise, ascending between 0 and 6283. A dead end has none.
    ///
    /// # Errors
    /// [`WaysError`] names what is wrong.
    pub fn from_bearings_mrad(bearings_mrad: &[u16]) -> Result<Self, WaysError> {
        let mut seen = Self { count: 1, ..Self::UNKNOWN };
        let mut before = 0;
        for &bearing_mrad in bearings_mrad {
            let slot = seen.others.get_mut(usize::from(seen.count) - 1).ok_or(WaysError::TooMany)?;
            if bearing_mrad <= before || u32::from(bearing_mrad) > TURN_MRAD {
                return Err(WaysError::NotAscending);
            }
            before = bearing_mrad;
            *slot = ((u32::from(bearing_mrad) * 256 + TURN_MRAD / 2) / TURN_MRAD).clamp(1, 255) as u8;
            seen.count += 1;
        }
        Ok(seen)
    }

    /// How many ways were seen, the one the robot came by included; 0 when that is unknown.
    pub const fn count(self) -> u8 {
        self.count
    }

    /// The bearings of the other ways relative to the one the robot came by.
    pub(super) fn others(&self) -> impl Iterator<Item = Bearing> + '_ {
        self.others.iter().take(usize::from(self.count.saturating_sub(1))).map(|&bearing| u16::from(bearing) << 8)
    }

    /// The bearing of a way relative to the one the robot came by, that one being number 0.
    pub(super) fn bearing(&self, way: u8) -> Option<Bearing> {
        match way.checked_sub(1) {
            None => (self.count > 0).then_some(0),
            Some(other) if way < self.count => {
                self.others.get(usize::from(other)).map(|&bearing| u16::from(bearing) << 8)
            }
            Some(_) => None,
        }
    }
}

/// One visit to a place. Everything but the radius may be unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrderedObservation {
    /// The radius of the place.
    pub fingerprint: Fingerprint,
    /// The ways seen.
    pub ways: WaysSeen,
    /// By which of the ways seen at the place before the robot left it: 0 for the one it had come by, then counter-clockwise. A
    /// number beyond the ways seen there counts as unknown.
    pub exit: Option<u8>,
    /// How many ring frames the robot drove from the place before; 0 counts as unknown.
    pub travel_frames: Option<u16>,
    /// Whether the robot did not drive here from the place before.
    pub starts_sequence: bool,
}

impl OrderedObservation {
    /// A place of which only the radius is known, next to the place before.
    pub const fn new(fingerprint: Fingerprint) -> Self {
        Self { fingerprint, ways: WaysSeen::UNKNOWN, exit: None, travel_frames: None, starts_sequence: false }
    }
}
