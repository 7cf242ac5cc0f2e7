//! Settings of a robot by name, as typed by a user.
//!
//! ```
//! use toposlam::wire::Setting;
//! use toposlam_link::setting;
//!
//! assert_eq!(setting::named("noise-mm", 40), Some(Setting::NoiseMm(40)));
//! assert_eq!(setting::named("colour", 40), None);
//! ```

use toposlam::wire::{Refusal, Setting};

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

/// The range of each setting, as docs/wire.md has it.
const RANGES: [&str; NAMES.len()] = [
    "1 to 1000",
    "1 to the number of hypotheses of the robot",
    "0 to 255",
    "1 to 500",
    "1 to 500",
    "1 to 300, and at most leave-mm",
    "150 to 65535, and at least equidistance-mm",
    "1 to 1000",
    "0 to 65535",
];

/// The wire number and the value of a setting; `None` if it is newer than this program.
fn numbered(setting: Setting) -> Option<(usize, u16)> {
    let value = match setting {
        Setting::NoiseMm(value)
        | Setting::Hypotheses(value)
        | Setting::Moves(value)
        | Setting::WrongTurnPermille(value)
        | Setting::WrongDegreePermille(value)
        | Setting::EquidistanceMm(value)
        | Setting::LeaveMm(value)
        | Setting::SpeedPermille(value)
        | Setting::SnapshotEveryPlaces(value) => value,
        _ => return None,
    };
    MAKE.iter().position(|make| make(value) == setting).map(|number| (number, value))
}

/// The name and the value of a setting; `None` if it is newer than this program.
pub fn parts(setting: Setting) -> Option<(&'static str, u16)> {
    numbered(setting).map(|(number, value)| (NAMES[number], value))
}

/// A setting as its name and value.
pub fn text(setting: Setting) -> String {
    parts(setting).map_or_else(|| format!("{setting:?}"), |(name, value)| format!("{name} {value}"))
}

/// Why a robot refuses a setting as out of range: its name and its range.
pub fn out_of_range(setting: Setting) -> String {
    numbered(setting).map_or_else(
        || Refusal::OutOfRange.to_string(),
        |(number, value)| format!("{} {value} is out of its range, {}", NAMES[number], RANGES[number]),
    )
}

/// The setting with a name and a value; `None` if the name is unknown. The robot checks the range of the value.
pub fn named(name: &str, value: u16) -> Option<Setting> {
    NAMES.iter().zip(MAKE).find(|&(&known, _)| known == name).map(|(_, make)| make(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_range_is_that_of_the_specification() {
        let specification = include_str!("../../../docs/wire.md");
        for (name, range) in NAMES.iter().zip(RANGES) {
            let kind = format!("{:?}", named(name, 0).unwrap());
            let row =
                specification.lines().find(|line| line.contains(&format!("| {} | ", kind.trim_end_matches("(0)"))));
            let row = row.unwrap_or_else(|| panic!("{kind}"));
            let ends = |text: &str| -> Vec<u16> {
                text.split(&[' ', ',', '|'][..]).filter_map(|word| word.parse().ok()).collect()
            };
            let specified = ends(row.split('|').nth(3).unwrap());
            assert!(specified.iter().all(|end| ends(range).contains(end)), "{name}: {range}; {row}");
        }
        assert_eq!(out_of_range(Setting::NoiseMm(0)), "noise-mm 0 is out of its range, 1 to 1000");
    }

    #[test]
    fn every_setting_has_the_name_of_its_kind() {
        for name in NAMES {
            let words: String = name.split('-').map(|word| word[..1].to_uppercase() + &word[1..]).collect();
            assert_eq!(format!("{:?}", named(name, 7).unwrap()), format!("{words}(7)"));
            assert_eq!(parts(named(name, 7).unwrap()), Some((name, 7)));
        }
    }
}
