//! From the time of flight of a sound to the range of what sent it back.

/// Whether a speed of sound, in metres per second, is one of air: 331 at 0 °C, 355 at 40 °C, with room for both sides.
pub(super) fn is_speed_of_sound(speed_m_per_s: u16) -> bool {
    (300..=400).contains(&speed_m_per_s)
}

/// The range in millimetres of an echo that came back after so many microseconds, to the nearest.
pub(super) fn range_mm(flight_us: u32, speed_m_per_s: u16) -> u32 {
    // There and back: half of time times speed; 1 m/s is 1 mm/ms.
    flight_us.saturating_mul(speed_m_per_s.into()).saturating_add(1000) / 2000
}
