//! An observation: the fingerprint of a place, and two optional hints that need no odometry.

use crate::place::Fingerprint;

/// How the robot left the place before: whether it drove back along the edge by which it had come.
///
/// The drive of the robot knows this without odometry. A wrong hint makes the right map less likely but not impossible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Turn {
    /// It turned back: this place should be the second last one.
    Back,
    /// It drove on: this place should not be the second last one.
    On,
}

/// An observation of a place.
///
/// ```
/// use toposlam::{Fingerprint, Observation, Turn};
///
/// // A dead end, to which the robot drove on. `None` stands for a hint that the detector or the drive does not know.
/// let radius = Fingerprint::from_radius_mm(640)?;
/// let observation = Observation { turn: Some(Turn::On), degree: Some(1), ..Observation::new(radius) };
/// assert!(!observation.starts_sequence);
/// # Ok::<(), toposlam::FingerprintError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Observation {
    /// The radius of the place.
    pub fingerprint: Fingerprint,
    /// How the robot left the place before. It has no meaning at the first two places of a sequence.
    pub turn: Option<Turn>,
    /// The number of exits of the place, 1 to 7, if the detector could count them. Larger numbers count as 7, and 0 as
    /// unknown.
    pub degree: Option<u8>,
    /// Whether the robot did not drive here from the place before: it was kidnapped, or this is the first place of an n-gram of
    /// an earlier exploration. The first place of all always starts a sequence.
    pub starts_sequence: bool,
}

impl Observation {
    /// An observation without hints.
    pub const fn new(fingerprint: Fingerprint) -> Self {
        Self { fingerprint, turn: None, degree: None, starts_sequence: false }
    }
}

impl From<Fingerprint> for Observation {
    fn from(fingerprint: Fingerprint) -> Self {
        Self::new(fingerprint)
    }
}
