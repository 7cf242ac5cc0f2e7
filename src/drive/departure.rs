//! How the robot left a place, and how far it has driven since: the hints of the next observation.

use crate::filter::{Exit, Passage};

/// How the robot left the place that was reported last. It is all zero while unknown, so a `static` robot lies in `.bss`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Departure {
    pub(super) is_known: bool,
    /// The bearing of the exit relative to the way by which the robot entered.
    pub(super) exit_mrad: u16,
    /// The sum of the speeds of all frames since then, in thousandths of full speed.
    driven_permille: u32,
}

impl Departure {
    pub(super) const UNKNOWN: Self = Self { is_known: false, exit_mrad: 0, driven_permille: 0 };

    /// The robot leaves by this exit.
    pub(super) const fn by(exit_mrad: u16) -> Self {
        Self { is_known: true, exit_mrad, driven_permille: 0 }
    }

    /// The robot drives for a frame at this speed.
    pub(super) fn drive(&mut self, speed_permille: u16) {
        self.driven_permille = self.driven_permille.saturating_add(speed_permille.into());
    }

    /// The hints of the next observation; `entry_mrad` is the bearing of the way by which the robot comes.
    pub(super) fn passage(&self, entry_mrad: Option<i16>) -> Passage {
        if !self.is_known {
            return Passage { entry_mrad, ..Passage::UNKNOWN };
        }
        let frames = self.driven_permille.saturating_add(500) / 1000;
        let travel_frames = Some(frames.clamp(1, u16::MAX.into()) as u16);
        Passage { exit: Exit::from_bearing_mrad(self.exit_mrad).ok(), travel_frames, entry_mrad, returns: false }
    }
}
