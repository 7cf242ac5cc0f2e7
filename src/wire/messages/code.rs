//! Enums that are one byte on the wire, so that old listeners can read numbers that are appended later.

/// Defines an enum without fields that is a `u8` on the wire. The first variant has the number 0; unknown numbers decode to it.
macro_rules! codes {
    (
        $(#[$about:meta])*
        $name:ident {
            $(#[$doc_of_other:meta])* $other:ident => $text_of_other:literal,
            $($(#[$doc:meta])* $variant:ident = $number:literal => $text:literal,)*
        }
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        #[serde(from = "u8", into = "u8")]
        #[repr(u8)]
        #[non_exhaustive]
        pub enum $name {
            $(#[$doc_of_other])* $other = 0,
            $($(#[$doc])* $variant = $number,)*
        }

        impl $name {
            /// All variants in the order of their numbers.
            pub const ALL: &[Self] = &[Self::$other, $(Self::$variant,)*];
        }

        impl From<u8> for $name {
            fn from(number: u8) -> Self {
                match number {
                    $($number => Self::$variant,)*
                    _ => Self::$other,
                }
            }
        }

        impl From<$name> for u8 {
            fn from(kind: $name) -> Self {
                kind as Self
            }
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str(match self {
                    Self::$other => $text_of_other,
                    $(Self::$variant => $text,)*
                })
            }
        }
    };
}

pub(in crate::wire) use codes;
