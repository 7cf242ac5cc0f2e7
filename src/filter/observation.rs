//! What the robot tells the filter of one place: the fingerprint, and two optional facts that need no odometry.

use crate::Fingerprint;

/// How the robot left the place before: whether it drove back along the edge it had come by.
///
/// Its own drive knows this, without any odometry; a wrong hint costs the map likelihood and does not forbid it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Turn {
    /// Back: the place should be the one before the last.
    Back,
    /// On: the place should be another than the one before the last.
    On,
}

/// One visit to a place.
///
/// ```
/// use toposlam::{Fingerprint, Observation, Turn};
///
/// // A dead end, to which the robot did not turn back. A detector or a drive that does not know says `None`.
/// let radius = Fingerprint::from_radius_mm(640)?;
/// let observation = Observation { turn: Some(Turn::On), degree: Some(1), ..Observation::new(radius) };
/// assert!(!observation.starts_sequence);
/// # Ok::<(), toposlam::FingerprintError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Observation {
    /// The radius of the place.
    pub fingerprint: Fingerprint,
    /// How the robot left the place before, if it knows; meaningless for the first two places of a sequence.
    pub turn: Option<Turn>,
    /// How many ways lead away from the place, 1 to 7, if the detector could count them; larger numbers count as 7, and
    /// 0 as unknown.
    pub degree: Option<u8>,
    /// Whether the place need not be a neighbour of the previous one: the robot was kidnapped, or this is the first place of an
    /// n-gram of an earlier exploration. The first place of all always starts a sequence.
    pub starts_sequence: bool,
}

impl Observation {
    /// A place of which only the radius is known, next to the place before.
    pub const fn new(fingerprint: Fingerprint) -> Self {
        Self { fingerprint, turn: None, degree: None, starts_sequence: false }
    }
}

impl From<Fingerprint> for Observation {
    fn from(fingerprint: Fingerprint) -> Self {
        Self::new(fingerprint)
    }
}
