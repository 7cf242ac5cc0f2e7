//! The settings that can be changed while the robot runs.

use serde::{Deserialize, Serialize};

use super::{List, Refusal};
use crate::filter::{OrderedConfig, PaperConfig, RobustConfig};
use crate::place::PlaceConfig;

/// The most settings of a robot.
pub const SETTINGS_MAX: usize = 16;

/// One setting and its value. Append-only; every value is a `u16`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Setting {
    /// [`RobustConfig::noise_mm`], [`OrderedConfig::noise_mm`] or [`PaperConfig::sigma_label_mm`].
    NoiseMm(u16),
    /// [`RobustConfig::hypotheses`] or [`PaperConfig::particles`].
    Hypotheses(u16),
    /// [`RobustConfig::moves`].
    Moves(u16),
    /// [`RobustConfig::wrong_turn_permille`].
    WrongTurnPermille(u16),
    /// [`RobustConfig::wrong_degree_permille`].
    WrongDegreePermille(u16),
    /// [`PlaceConfig::equidistance_mm`].
    EquidistanceMm(u16),
    /// [`PlaceConfig::leave_mm`].
    LeaveMm(u16),
    /// [`Settings::speed_permille`].
    SpeedPermille(u16),
    /// [`Settings::snapshot_every_places`].
    SnapshotEveryPlaces(u16),
}

impl Default for Setting {
    fn default() -> Self {
        Self::NoiseMm(0)
    }
}

/// The settings of a filter, as the robot and its line see them.
pub trait FilterSettings: Copy {
    /// Zero in every field: the settings of a robot that was not started.
    const UNSET: Self;

    /// Changes one setting of the filter; the ranges are not checked.
    ///
    /// # Errors
    /// [`Refusal::Unsupported`] for a setting that the filter does not have, [`Refusal::OutOfRange`] for a value that its field
    /// cannot hold.
    fn change(&mut self, setting: Setting) -> Result<(), Refusal>;

    /// The settings of the filter, in the order of their numbers.
    fn settings(&self) -> impl Iterator<Item = Setting>;

    /// Whether every field is in its range, for a filter with room for this many hypotheses.
    fn is_valid(&self, hypotheses: usize) -> bool;
}

fn byte(value: u16) -> Result<u8, Refusal> {
    u8::try_from(value).map_err(|_| Refusal::OutOfRange)
}

impl FilterSettings for RobustConfig {
    const UNSET: Self = Self::UNSET;

    fn change(&mut self, setting: Setting) -> Result<(), Refusal> {
        match setting {
            Setting::NoiseMm(value) => self.noise_mm = value,
            Setting::Hypotheses(value) => self.hypotheses = byte(value)?,
            Setting::Moves(value) => self.moves = byte(value)?,
            Setting::WrongTurnPermille(value) => self.wrong_turn_permille = value,
            Setting::WrongDegreePermille(value) => self.wrong_degree_permille = value,
            _ => return Err(Refusal::Unsupported),
        }
        Ok(())
    }

    fn settings(&self) -> impl Iterator<Item = Setting> {
        [
            Setting::NoiseMm(self.noise_mm),
            Setting::Hypotheses(self.hypotheses.into()),
            Setting::Moves(self.moves.into()),
            Setting::WrongTurnPermille(self.wrong_turn_permille),
            Setting::WrongDegreePermille(self.wrong_degree_permille),
        ]
        .into_iter()
    }

    fn is_valid(&self, hypotheses: usize) -> bool {
        self.check(hypotheses).is_ok()
    }
}

impl FilterSettings for OrderedConfig {
    const UNSET: Self = Self::UNSET;

    fn change(&mut self, setting: Setting) -> Result<(), Refusal> {
        match setting {
            Setting::NoiseMm(value) => self.noise_mm = value,
            _ => return Err(Refusal::Unsupported),
        }
        Ok(())
    }

    fn settings(&self) -> impl Iterator<Item = Setting> {
        [Setting::NoiseMm(self.noise_mm)].into_iter()
    }

    fn is_valid(&self, _: usize) -> bool {
        self.check().is_ok()
    }
}

impl FilterSettings for PaperConfig {
    const UNSET: Self = Self::UNSET;

    fn change(&mut self, setting: Setting) -> Result<(), Refusal> {
        match setting {
            Setting::NoiseMm(value) => self.sigma_label_mm = value,
            Setting::Hypotheses(value) => self.particles = byte(value)?,
            _ => return Err(Refusal::Unsupported),
        }
        Ok(())
    }

    fn settings(&self) -> impl Iterator<Item = Setting> {
        [Setting::NoiseMm(self.sigma_label_mm), Setting::Hypotheses(self.particles.into())].into_iter()
    }

    fn is_valid(&self, hypotheses: usize) -> bool {
        self.check(hypotheses).is_ok()
    }
}

/// The values of all settings that can be changed while the robot runs; `C` are those of its filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings<C> {
    /// The filter's settings.
    pub filter: C,
    /// The place detector's settings.
    pub place: PlaceConfig,
    /// The speed in thousandths of the drive's full speed, 1 to 1000.
    pub speed_permille: u16,
    /// A snapshot is stored every this many places; 0 for never.
    pub snapshot_every_places: u16,
}

impl<C: FilterSettings> Settings<C> {
    /// Every setting, in the order of their numbers.
    pub fn list(&self) -> List<Setting, SETTINGS_MAX> {
        let others = [
            Setting::EquidistanceMm(self.place.equidistance_mm),
            Setting::LeaveMm(self.place.leave_mm),
            Setting::SpeedPermille(self.speed_permille),
            Setting::SnapshotEveryPlaces(self.snapshot_every_places),
        ];
        List::new(self.filter.settings().chain(others))
    }

    /// The settings with one of them changed, for a robot of these capacities.
    ///
    /// # Errors
    /// [`Refusal::OutOfRange`] if the value is out of its range, [`Refusal::Unsupported`] if the filter has no such setting.
    pub fn with(mut self, setting: Setting, hypotheses: usize, sonars: usize) -> Result<Self, Refusal> {
        match setting {
            Setting::EquidistanceMm(value) => self.place.equidistance_mm = value,
            Setting::LeaveMm(value) => self.place.leave_mm = value,
            Setting::SpeedPermille(value) => self.speed_permille = value,
            Setting::SnapshotEveryPlaces(value) => self.snapshot_every_places = value,
            _ => self.filter.change(setting)?,
        }
        let is_sound = self.filter.is_valid(hypotheses)
            && self.place.check(sonars).is_ok()
            && (1..=1000).contains(&self.speed_permille);
        if is_sound { Ok(self) } else { Err(Refusal::OutOfRange) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: Settings<RobustConfig> = Settings {
        filter: RobustConfig::DEFAULT,
        place: PlaceConfig::DEFAULT,
        speed_permille: 1000,
        snapshot_every_places: 10,
    };

    #[test]
    fn every_setting_accepts_its_range_only() {
        type Make = fn(u16) -> Setting;
        type Of = fn(&Settings<RobustConfig>) -> u16;
        let settings: [(Make, Of, u16, u16); 9] = [
            (Setting::NoiseMm, |s| s.filter.noise_mm, 1, 1000),
            (Setting::Hypotheses, |s| s.filter.hypotheses.into(), 1, 7),
            (Setting::Moves, |s| s.filter.moves.into(), 0, 255),
            (Setting::WrongTurnPermille, |s| s.filter.wrong_turn_permille, 1, 500),
            (Setting::WrongDegreePermille, |s| s.filter.wrong_degree_permille, 1, 500),
            (Setting::EquidistanceMm, |s| s.place.equidistance_mm, 1, 300),
            (Setting::LeaveMm, |s| s.place.leave_mm, 150, u16::MAX),
            (Setting::SpeedPermille, |s| s.speed_permille, 1, 1000),
            (Setting::SnapshotEveryPlaces, |s| s.snapshot_every_places, 0, u16::MAX),
        ];
        let seven = SETTINGS.with(Setting::Hypotheses(7), 7, 16).unwrap();
        for (setting, value_of, least, most) in settings {
            for value in [least, most] {
                let changed = seven.with(setting(value), 7, 16).unwrap();
                assert_eq!(value_of(&changed), value);
                let before = value_of(&seven);
                assert_eq!(changed.with(setting(before), 7, 16), Ok(seven), "nothing else is changed");
            }
            let beyond = [least.checked_sub(1), most.checked_add(1)].into_iter().flatten();
            for value in beyond {
                assert_eq!(seven.with(setting(value), 7, 16), Err(Refusal::OutOfRange), "{:?}", setting(value));
            }
        }
    }

    #[test]
    fn the_list_has_every_setting_of_the_robot_in_order_and_restores_it() {
        let list = SETTINGS.list();
        assert_eq!((list.as_slice().len(), list.as_slice()[0]), (9, Setting::NoiseMm(SETTINGS.filter.noise_mm)));
        let changed = SETTINGS.with(Setting::Hypotheses(3), 7, 16).unwrap().with(Setting::LeaveMm(500), 7, 16).unwrap();
        let with = |settings: Settings<_>, &setting: &Setting| settings.with(setting, 10, 16).unwrap();
        assert_eq!(list.as_slice().iter().fold(changed, with), SETTINGS);
        let Settings { place, speed_permille, snapshot_every_places, .. } = SETTINGS;
        let ordered = Settings { filter: OrderedConfig::DEFAULT, place, speed_permille, snapshot_every_places };
        assert_eq!(ordered.list().as_slice().len(), 5);
    }

    #[test]
    fn a_setting_that_the_filter_does_not_have_is_refused() {
        let Settings { place, speed_permille, snapshot_every_places, .. } = SETTINGS;
        let paper = Settings { filter: PaperConfig::DEFAULT, place, speed_permille, snapshot_every_places };
        assert_eq!(paper.with(Setting::Moves(1), 10, 16), Err(Refusal::Unsupported));
        assert_eq!(paper.with(Setting::NoiseMm(70), 10, 16).unwrap().filter.sigma_label_mm, 70);
        assert_eq!(paper.with(Setting::Hypotheses(11), 10, 16), Err(Refusal::OutOfRange));
        let ordered = Settings { filter: OrderedConfig::DEFAULT, place, speed_permille, snapshot_every_places };
        assert_eq!(ordered.with(Setting::WrongTurnPermille(1), 10, 16), Err(Refusal::Unsupported));
        assert_eq!(ordered.with(Setting::NoiseMm(70), 10, 16).unwrap().filter.noise_mm, 70);
    }
}
