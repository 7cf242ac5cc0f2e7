//! Numbers with their nouns.
//!
//! ```
//! use toposlam_link::plural::count;
//!
//! assert_eq!(count(1_u8, "vertex", "vertices"), "1 vertex");
//! assert_eq!(count(0_usize, "place", "places"), "0 places");
//! ```

/// A number with the noun in the singular or the plural.
pub fn count(number: impl TryInto<u64>, one: &str, many: &str) -> String {
    let number = number.try_into().unwrap_or(u64::MAX);
    format!("{number} {}", if number == 1 { one } else { many })
}
