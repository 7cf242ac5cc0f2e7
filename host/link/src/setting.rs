//! Settings of a robot by name, as typed by a user.
//!
//! ```
//! use toposlam::wire::Setting;
//! use toposlam_link::setting;
//!
//! assert_eq!(setting::named("noise-mm", 40), Some(Setting::NoiseMm(40)));
//! assert_eq!(setting::named("colour", 40), None);
//! ```

use toposlam::wire::Setting;

/// Name of each setting, in the order of the wire numbers.
pub const NAMES: [&str; 9] = [
    "noise-mm",
    "hypotheses",
    "moves",
    "wrong-turn-permille",
    "wrong-degree-permille",
    "equidistance-mm",
    "leave-mm",
    "speed-permille",
    "snapshot-every-places",
];

const MAKE: [fn(u16) -> Setting; NAMES.len()] = [
    Setting::NoiseMm,
    Setting::Hypotheses,
    Setting::Moves,
    Setting::WrongTurnPermille,
    Setting::WrongDegreePermille,
    Setting::EquidistanceMm,
    Setting::LeaveMm,
    Setting::SpeedPermille,
    Setting::SnapshotEveryPlaces,
];

/// The setting with a name and a value; `None` if the name is unknown. The robot checks the range of the value.
pub fn named(name: &str, value: u16) -> Option<Setting> {
    NAMES.iter().zip(MAKE).find(|&(&known, _)| known == name).map(|(_, make)| make(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_has_the_name_of_its_kind() {
        for name in NAMES {
            let words: String = name.split('-').map(|word| word[..1].to_uppercase() + &word[1..]).collect();
            assert_eq!(format!("{:?}", named(name, 7).unwrap()), format!("{words}(7)"));
        }
    }
}
