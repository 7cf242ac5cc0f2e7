//! The ways of a place as a robot sees them, and the exit by which it leaves: bearings relative to the way it came by.

use crate::map::WAYS_MAX;
use core::fmt;

/// A full turn in milliradians, rounded down.
const TURN_MRAD: u16 = 6283;

/// A bearing in 1/256 of a full turn.
fn binary_angle(bearing_mrad: u16) -> u8 {
    ((u32::from(bearing_mrad) * 256 + u32::from(TURN_MRAD) / 2) / u32::from(TURN_MRAD)) as u8
}

/// The same for a way that is not the one by which the robot came.
fn nearest_other(bearing_mrad: u16) -> u8 {
    match binary_angle(bearing_mrad) {
        0 if bearing_mrad > TURN_MRAD / 2 => 255,
        0 => 1,
        bearing => bearing,
    }
}

/// The ways seen at a visit to a place, 1 to 7: their number, and optionally the bearing of each relative to the way by which
/// the robot came, counter-clockwise.
///
/// At the first place of a sequence any way stands for the one by which the robot came. Bearings are rounded to 1/256 of a full
/// turn. Memory: 7 bytes.
///
/// ```
/// use toposlam::{Ways, WaysError};
///
/// // A T-junction, entered by its stem: one way to the right and one to the left.
/// let ways = Ways::from_bearings_mrad(&[1571, 4712])?;
/// assert_eq!(ways.count(), 3);
/// assert_eq!(Ways::from_count(8), Err(WaysError::TooMany));
/// # Ok::<(), WaysError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ways {
    /// Bits 0 to 2: the number. Bit 3: the bearings are known.
    count: u8,
    others: [u8; WAYS_MAX - 1],
}

impl Ways {
    const HAS_BEARINGS: u8 = 1 << 3;

    /// A number of ways, 1 to 7, with unknown bearings.
    ///
    /// # Errors
    /// [`WaysError`] if the number is out of its range.
    pub const fn from_count(count: u8) -> Result<Self, WaysError> {
        match count {
            0 => Err(WaysError::NoWay),
            1..=7 => Ok(Self { count, others: [0; WAYS_MAX - 1] }),
            _ => Err(WaysError::TooMany),
        }
    }

    /// The way by which the robot came and up to 6 others, from the bearings of the others relative to it: in milliradians
    /// counter-clockwise, ascending, 1 to 6282. A dead end has no other way.
    ///
    /// # Errors
    /// [`WaysError`] says what is invalid.
    pub fn from_bearings_mrad(others_mrad: &[u16]) -> Result<Self, WaysError> {
        let mut others = [0; WAYS_MAX - 1];
        if others_mrad.len() > others.len() {
            return Err(WaysError::TooMany);
        }
        let mut before_mrad = 0;
        for (slot, &bearing_mrad) in others.iter_mut().zip(others_mrad) {
            if bearing_mrad >= TURN_MRAD {
                return Err(WaysError::BearingOutOfRange);
            }
            if bearing_mrad <= before_mrad {
                return Err(WaysError::NotAscending);
            }
            before_mrad = bearing_mrad;
            *slot = nearest_other(bearing_mrad);
        }
        Ok(Self { count: (others_mrad.len() as u8 + 1) | Self::HAS_BEARINGS, others })
    }

    /// The number of ways, including the one by which the robot came.
    pub const fn count(self) -> u8 {
        self.count & 7
    }

    /// The bearings of the ways other than the one by which the robot came, in 1/256 of a full turn; `None` if they are unknown.
    pub fn others(&self) -> Option<&[u8]> {
        if self.count & Self::HAS_BEARINGS == 0 {
            return None;
        }
        self.others.get(..usize::from(self.count().saturating_sub(1)))
    }

    /// The seven bytes of a record.
    pub(crate) const fn to_bytes(self) -> [u8; WAYS_MAX] {
        let [a, b, c, d, e, f] = self.others;
        [self.count, a, b, c, d, e, f]
    }

    /// From the bytes of a record; `None` if the number of ways is 0.
    pub(crate) const fn from_bytes([count, a, b, c, d, e, f]: [u8; WAYS_MAX]) -> Option<Self> {
        let count = count & (Self::HAS_BEARINGS | 7);
        if count & 7 == 0 { None } else { Some(Self { count, others: [a, b, c, d, e, f] }) }
    }
}

/// Why ways are invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WaysError {
    /// There is no way: the robot came by one.
    NoWay,
    /// There are more than 7 ways.
    TooMany,
    /// A bearing is a full turn or more.
    BearingOutOfRange,
    /// A bearing is 0, or not larger than the one before.
    NotAscending,
}

impl fmt::Display for WaysError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoWay => "a place has at least one way",
            Self::TooMany => "a place has at most 7 ways",
            Self::BearingOutOfRange => "a bearing is not below a full turn",
            Self::NotAscending => "the bearings are not ascending from above 0",
        })
    }
}

impl core::error::Error for WaysError {}

/// The exit by which the robot left a place, relative to the way by which it came there. A wrong exit makes the right map less
/// likely but not impossible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Exit {
    /// The way by which it came: it turned back.
    Back,
    /// Another way, of unknown bearing.
    On,
    /// The way at this bearing, in 1/256 of a full turn counter-clockwise; see [`Exit::from_bearing_mrad`].
    Bearing(u8),
}

impl Exit {
    /// The exit at a bearing in milliradians, counter-clockwise from the way by which the robot came. Bearings within 1/512 of a
    /// turn of that way are [`Exit::Back`].
    ///
    /// # Errors
    /// [`WaysError::BearingOutOfRange`] from 6283 on.
    pub fn from_bearing_mrad(bearing_mrad: u16) -> Result<Self, WaysError> {
        if bearing_mrad >= TURN_MRAD {
            return Err(WaysError::BearingOutOfRange);
        }
        let bearing = binary_angle(bearing_mrad);
        Ok(if bearing == 0 { Self::Back } else { Self::Bearing(bearing) })
    }

    /// Whether the robot turned back.
    pub const fn is_back(self) -> bool {
        matches!(self, Self::Back | Self::Bearing(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_out_of_range_are_refused() {
        assert_eq!(Ways::from_count(0), Err(WaysError::NoWay));
        assert_eq!(Ways::from_count(8), Err(WaysError::TooMany));
        assert_eq!(Ways::from_bearings_mrad(&[1, 2, 3, 4, 5, 6, 7]), Err(WaysError::TooMany));
        assert_eq!(Ways::from_bearings_mrad(&[10, 6283]), Err(WaysError::BearingOutOfRange));
        assert_eq!(Ways::from_bearings_mrad(&[0]), Err(WaysError::NotAscending));
        assert_eq!(Ways::from_bearings_mrad(&[20, 20]), Err(WaysError::NotAscending));
        assert_eq!(Exit::from_bearing_mrad(6283), Err(WaysError::BearingOutOfRange));
    }

    #[test]
    fn bearings_are_rounded_to_a_256th_of_a_turn() {
        let ways = Ways::from_bearings_mrad(&[1, 1571, 3142, 6282]).unwrap();
        assert_eq!((ways.count(), ways.others()), (5, Some(&[1, 64, 128, 255][..])));
        assert_eq!(Exit::from_bearing_mrad(1571), Ok(Exit::Bearing(64)));
        assert_eq!(Exit::from_bearing_mrad(6282), Ok(Exit::Back));
        assert_eq!(Exit::from_bearing_mrad(5), Ok(Exit::Back));
    }

    #[test]
    fn a_count_has_no_bearings_and_a_dead_end_has_no_others() {
        assert_eq!(Ways::from_count(3).unwrap().others(), None);
        assert_eq!(Ways::from_bearings_mrad(&[]).unwrap().others(), Some(&[][..]));
    }

    #[test]
    fn the_bytes_of_ways_give_the_same_ways() {
        for ways in [Ways::from_count(7).unwrap(), Ways::from_bearings_mrad(&[500, 900]).unwrap()] {
            assert_eq!(Ways::from_bytes(ways.to_bytes()), Some(ways));
        }
        assert_eq!(Ways::from_bytes([0; WAYS_MAX]), None);
    }
}
