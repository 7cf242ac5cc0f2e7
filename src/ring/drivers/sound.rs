//! Time of flight of an ultrasonic pulse to range.

use crate::config_error::ConfigError;

/// Checks that the setting `speed_of_sound_m_per_s` is plausible for air: 331 at 0 °C, 355 at 40 °C.
pub(super) fn check_speed_of_sound(speed_m_per_s: u16) -> Result<(), ConfigError> {
    ConfigError::check("speed_of_sound_m_per_s", speed_m_per_s.into(), 300, 400)
}

/// The shortest round trip in microseconds that [`range_mm`] rounds to at least a range.
pub(super) fn flight_us(range_mm: u16, speed_m_per_s: u16) -> i32 {
    let half_steps = (2000 * i32::from(range_mm)).saturating_sub(1000);
    half_steps.max(0).saturating_add(i32::from(speed_m_per_s) - 1).checked_div(speed_m_per_s.into()).unwrap_or(0)
}

/// Range in millimetres for a round trip of `flight_us` microseconds, rounded to the nearest.
pub(super) fn range_mm(flight_us: u32, speed_m_per_s: u16) -> u32 {
    // Half of time × speed; 1 m/s is 1 mm/ms.
    flight_us.saturating_mul(speed_m_per_s.into()).saturating_add(1000) / 2000
}
