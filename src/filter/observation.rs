//! An observation: the fingerprint of a place, and hints that need no odometry.

use super::ways::{Exit, Ways};
use crate::bearing::{counter_clockwise_mrad, rotated};
use crate::place::{Fingerprint, Obstacles, Place};
use crate::top_k::TopK;

/// The way by which the robot came is the opening within this angle of where it is expected, in milliradians.
const ENTRY_MRAD: u16 = 700;

/// How the robot drove from the place before to this one, as far as its drive knows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Passage {
    /// The exit by which the robot left the place before.
    pub exit: Option<Exit>,
    /// The number of ring frames since it left that place, 1 or more.
    pub travel_frames: Option<u16>,
    /// The bearing in the ring's geometry of the way by which it came to this place, in milliradians. `None` without a drive; the
    /// way is then searched at [`Place::behind_mrad`].
    pub entry_mrad: Option<i16>,
    /// Whether the robot turned back on its way, so that the next place is the last one again: it is not reported.
    pub returns: bool,
}

impl Passage {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self { exit: None, travel_frames: None, entry_mrad: None, returns: false };

    /// The ways of a place; `None` if no opening was seen. `rotation_mrad` is the change of all bearings since the frame that the
    /// passage was taken from.
    ///
    /// The robot came by the opening within 0.7 rad of `entry_mrad`, or of [`Place::behind_mrad`] if that is unknown. Without such
    /// an opening, it came by a way that was not seen. If `entry_mrad` is unknown, the number of ways is [`Place::degree`], and the
    /// bearings are known only if they are as many.
    pub fn ways(&self, place: &Place, rotation_mrad: i32) -> Option<Ways> {
        let ways = self.seen_ways(place, rotation_mrad);
        if self.entry_mrad.is_some() {
            return ways;
        }
        let counted = Ways::from_count(place.degree?).ok()?;
        ways.filter(|ways| ways.count() == counted.count()).or(Some(counted))
    }

    fn seen_ways(&self, place: &Place, rotation_mrad: i32) -> Option<Ways> {
        let openings = &place.ways;
        let entry_mrad = self.entry_mrad.map(|entry_mrad| rotated(entry_mrad, rotation_mrad));
        let expected_mrad = entry_mrad.unwrap_or(place.behind_mrad);
        let entry_mrad = openings.nearest(expected_mrad, ENTRY_MRAD).map_or(expected_mrad, |(_, seen_mrad)| seen_mrad);
        let mut others_mrad = TopK::<u16, { Obstacles::MAX }>::new(0);
        for &opening_mrad in openings.bearings_mrad().iter().filter(|&&opening_mrad| opening_mrad != entry_mrad) {
            let relative_mrad = counter_clockwise_mrad(entry_mrad, opening_mrad).clamp(1, 6282);
            others_mrad.insert(relative_mrad as u16, |one, other| one <= other);
        }
        if openings.count() == 0 { None } else { Ways::from_bearings_mrad(others_mrad.as_slice()).ok() }
    }
}

/// An observation of a place. `None` stands for a hint that the detector or the drive does not know.
///
/// ```
/// use toposlam::{Exit, Fingerprint, Observation, Ways};
///
/// // A dead end, 120 ring frames from the place before. The robot left that place by the way on its left.
/// let observation = Observation {
///     ways: Some(Ways::from_bearings_mrad(&[])?),
///     exit: Some(Exit::from_bearing_mrad(4712)?),
///     travel_frames: Some(120),
///     ..Observation::new(Fingerprint::from_radius_mm(640)?)
/// };
/// assert!(!observation.starts_sequence);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Observation {
    /// The radius of the place.
    pub fingerprint: Fingerprint,
    /// The ways of the place.
    pub ways: Option<Ways>,
    /// The exit by which the robot left the place before. It has no meaning at the first place of a sequence.
    pub exit: Option<Exit>,
    /// The number of ring frames between the place before and this one. 0 is invalid: a filter that uses it counts a
    /// [`FaultKind::InvalidHint`](crate::FaultKind::InvalidHint), and the time is unknown.
    pub travel_frames: Option<u16>,
    /// Whether the robot did not drive here from the place before: it was kidnapped, or this is the first place of an n-gram of
    /// an earlier exploration. The first place of all always starts a sequence.
    pub starts_sequence: bool,
}

impl Observation {
    /// An observation without hints.
    pub const fn new(fingerprint: Fingerprint) -> Self {
        Self { fingerprint, ways: None, exit: None, travel_frames: None, starts_sequence: false }
    }

    /// The number of ways; 0 if it is unknown.
    pub(crate) fn degree(&self) -> u8 {
        self.ways.map_or(0, Ways::count)
    }
}

impl From<Fingerprint> for Observation {
    fn from(fingerprint: Fingerprint) -> Self {
        Self::new(fingerprint)
    }
}
