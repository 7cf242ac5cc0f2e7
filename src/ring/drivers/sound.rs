//! Time of flight of an ultrasonic pulse to range.

/// Whether a speed of sound in metres per second is plausible for air: it is 331 at 0 °C and 355 at 40 °C.
pub(super) fn is_speed_of_sound(speed_m_per_s: u16) -> bool {
    (300..=400).contains(&speed_m_per_s)
}

/// Range in millimetres for a round trip of `flight_us` microseconds, rounded to the nearest.
pub(super) fn range_mm(flight_us: u32, speed_m_per_s: u16) -> u32 {
    // Half of time × speed; 1 m/s is 1 mm/ms.
    flight_us.saturating_mul(speed_m_per_s.into()).saturating_add(1000) / 2000
}
