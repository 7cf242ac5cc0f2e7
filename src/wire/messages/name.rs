//! The names of vertices that an operator gives.

use core::fmt;

use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::ser::{Serialize, Serializer};

/// The most bytes of a name.
pub const NAME_BYTES: usize = 16;

/// The name of a vertex: up to 16 bytes of UTF-8.
///
/// It has no control characters, begins and ends with no space, and is not a number, so that it is never taken for a vertex id.
///
/// ```
/// use toposlam::wire::{Name, NameError};
///
/// assert_eq!(Name::new("kitchen")?.as_str(), "kitchen");
/// assert_eq!(Name::new("3"), Err(NameError::Number));
/// # Ok::<(), NameError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Name {
    /// Filled up with zeros. The bytes before the first zero are UTF-8.
    bytes: [u8; NAME_BYTES],
}

impl Name {
    /// No name. In a command it clears the name of a vertex.
    pub const NONE: Self = Self { bytes: [0; NAME_BYTES] };

    /// A name.
    ///
    /// # Errors
    /// [`NameError`] for a text that is no name.
    pub fn new(text: &str) -> Result<Self, NameError> {
        let name = Self::filled(text).ok_or(NameError::TooLong)?;
        name.check()?;
        Ok(name)
    }

    /// Checks a name that was received.
    ///
    /// # Errors
    /// [`NameError`] for a text that is no name, [`Name::NONE`] included.
    pub fn check(&self) -> Result<(), NameError> {
        let text = self.as_bytes();
        match (text.first(), text.last()) {
            (None, _) | (_, None) => Err(NameError::Empty),
            (Some(b' '), _) | (_, Some(b' ')) => Err(NameError::Space),
            _ if text.iter().any(u8::is_ascii_control) => Err(NameError::Control),
            _ if text.iter().all(u8::is_ascii_digit) => Err(NameError::Number),
            _ => Ok(()),
        }
    }

    /// A text without zeros that has room.
    fn filled(text: &str) -> Option<Self> {
        let mut name = Self::NONE;
        if text.len() > NAME_BYTES || text.bytes().any(|byte| byte == 0) {
            return None;
        }
        for (slot, byte) in name.bytes.iter_mut().zip(text.bytes()) {
            *slot = byte;
        }
        Some(name)
    }

    /// Whether there is no name.
    pub const fn is_none(&self) -> bool {
        matches!(self.bytes, [0, ..])
    }

    /// The bytes of the text.
    pub(crate) fn as_bytes(&self) -> &[u8] {
        self.bytes.split(|&byte| byte == 0).next().unwrap_or(&[])
    }

    /// The text; empty without a name.
    pub fn as_str(&self) -> &str {
        core::str::from_utf8(self.as_bytes()).unwrap_or("")
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.as_str(), f)
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl Serialize for Name {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

impl<'de> Deserialize<'de> for Name {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(NameVisitor)
    }
}

struct NameVisitor;

impl Visitor<'_> for NameVisitor {
    type Value = Name;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("at most 16 bytes of UTF-8 without zeros")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Name, E> {
        Name::filled(text).ok_or_else(|| E::invalid_length(text.len(), &self))
    }
}

/// Why a text is no name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NameError {
    /// It is empty.
    Empty,
    /// It has more than [`NAME_BYTES`] bytes.
    TooLong,
    /// It begins or ends with a space.
    Space,
    /// It has a control character.
    Control,
    /// It is a number, as the ids of vertices are.
    Number,
}

impl fmt::Display for NameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Empty => "a name is not empty",
            Self::TooLong => "a name has at most 16 bytes of UTF-8",
            Self::Space => "a name does not begin or end with a space",
            Self::Control => "a name has no control characters",
            Self::Number => "a name is not a number, because numbers are the ids of vertices",
        })
    }
}

impl core::error::Error for NameError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_is_no_name_is_refused_with_the_reason() {
        let long = "Büro am Eingang 2";
        assert_eq!(long.len(), 18);
        for (text, error) in [
            ("", NameError::Empty),
            (long, NameError::TooLong),
            ("a name of 17 byte", NameError::TooLong),
            (" hall", NameError::Space),
            ("hall ", NameError::Space),
            ("a\nb", NameError::Control),
            ("0", NameError::Number),
            ("42", NameError::Number),
        ] {
            assert_eq!(Name::new(text), Err(error), "{text:?}");
        }
        for text in ["a", "Küche", "3b", "-1", "sixteen bytes ok", "a b"] {
            assert_eq!(Name::new(text).map(|name| name.as_str().len()), Ok(text.len()), "{text:?}");
        }
    }
}
