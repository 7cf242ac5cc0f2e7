//! The echoes of one ring frame in a compact form.

use core::fmt;

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeSeq, Serializer};

use crate::ring::Echo;

/// Up to 32 echoes. On the wire: their number, then one `u16` each: 0 for a dead sensor, 1 for silence, otherwise the
/// range in millimetres plus 2.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Echoes {
    count: u8,
    /// Unused codes are 0.
    codes: [u16; Self::MAX],
}

impl Echoes {
    /// The most echoes that one message holds.
    pub const MAX: usize = 32;

    const DEAD: u16 = 0;
    const SILENCE: u16 = 1;
    const RANGES: u16 = 2;

    /// No echoes.
    pub const EMPTY: Self = Self { count: 0, codes: [Self::DEAD; Self::MAX] };

    /// The first [`Self::MAX`] echoes of a ring frame; ranges saturate at 65533 mm.
    pub fn new(echoes: &[Echo]) -> Self {
        let mut this = Self::EMPTY;
        for (code, echo) in this.codes.iter_mut().zip(echoes) {
            *code = match *echo {
                Echo::Dead => Self::DEAD,
                Echo::Silence => Self::SILENCE,
                Echo::Range { range_mm } => range_mm.saturating_add(Self::RANGES),
            };
            this.count = this.count.saturating_add(1);
        }
        this
    }

    /// The echoes in the order of the ring.
    pub fn iter(&self) -> impl Iterator<Item = Echo> + '_ {
        self.codes().map(|code| match code {
            Self::DEAD => Echo::Dead,
            Self::SILENCE => Echo::Silence,
            code => Echo::Range { range_mm: code.saturating_sub(Self::RANGES) },
        })
    }

    pub(crate) fn codes(&self) -> impl Iterator<Item = u16> + '_ {
        self.codes.iter().copied().take(usize::from(self.count))
    }
}

impl fmt::Debug for Echoes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.codes()).finish()
    }
}

impl Serialize for Echoes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut sequence = serializer.serialize_seq(Some(usize::from(self.count)))?;
        for code in self.codes() {
            sequence.serialize_element(&code)?;
        }
        sequence.end()
    }
}

impl<'de> Deserialize<'de> for Echoes {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(EchoesVisitor)
    }
}

struct EchoesVisitor;

impl<'de> Visitor<'de> for EchoesVisitor {
    type Value = Echoes;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("at most 32 echoes")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Echoes, A::Error> {
        let mut echoes = Echoes::EMPTY;
        for slot in &mut echoes.codes {
            let Some(code) = sequence.next_element::<u16>()? else {
                return Ok(echoes);
            };
            *slot = code;
            echoes.count = echoes.count.saturating_add(1);
        }
        match sequence.next_element::<u16>()? {
            None => Ok(echoes),
            Some(_) => Err(A::Error::invalid_length(Echoes::MAX + 1, &self)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_echo_round_trips() {
        let ring = [Echo::Dead, Echo::Silence, Echo::Range { range_mm: 0 }, Echo::Range { range_mm: 65533 }];
        assert_eq!(Echoes::new(&ring).iter().collect::<Vec<_>>(), ring);
    }

    #[test]
    fn echoes_beyond_the_capacity_are_dropped_and_far_ranges_saturate() {
        let ring = [Echo::Range { range_mm: u16::MAX }; Echoes::MAX + 1];
        let echoes = Echoes::new(&ring);
        assert_eq!(echoes.iter().count(), Echoes::MAX);
        assert!(echoes.iter().all(|echo| echo == Echo::Range { range_mm: 65533 }));
    }
}
