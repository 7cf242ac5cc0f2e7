//! `defmt::Format` for the types that a firmware logs (feature `defmt`).
//!
//! Written out in this one file, so that no other one mentions the integration. A log line holds a number for each text.

use defmt::{Format, Formatter, write};

use crate::config_error::ConfigError;
use crate::fault::{FaultCounters, FaultKind};
use crate::filter::{
    Exit, NgramError, NgramsFull, Observation, OrderedFactors, PaperFactors, RobustFactors, Update, Ways,
    WeightFactors, WorstNgram,
};
use crate::map::{VertexId, VerticesFull};
use crate::place::Place;
use crate::place::{Fingerprint, FingerprintError};
use crate::ring::Echo;
use crate::ring::drivers::{AddressError, BridgeError, SonarError, SonarFault};

/// A text for each variant of an enum without fields.
macro_rules! texts {
    ($enum:ty { $($variant:ident => $text:literal,)* }) => {
        impl Format for $enum {
            fn format(&self, f: Formatter<'_>) {
                match self { $(Self::$variant => write!(f, $text),)* }
            }
        }
    };
}

texts!(FaultKind {
    SonarSilent => "SonarSilent",
    SonarOutOfRange => "SonarOutOfRange",
    BusError => "BusError",
    RingBlind => "RingBlind",
    RadiusOutOfRange => "RadiusOutOfRange",
    VerticesFull => "VerticesFull",
    NgramsFull => "NgramsFull",
    HistoryFull => "HistoryFull",
    WireFull => "WireFull",
    WireCorrupt => "WireCorrupt",
    StoreFailed => "StoreFailed",
    SnapshotRejected => "SnapshotRejected",
    CommandRefused => "CommandRefused",
    CommandFlood => "CommandFlood",
    DriveLost => "DriveLost",
    LoopLate => "LoopLate",
    InvalidHint => "InvalidHint",
    SonarImplausible => "SonarImplausible",
});

texts!(SonarFault {
    Silent => "timed out",
    OutOfRange => "returned a range outside its limits",
    Bus => "is not reachable: bus or pin error",
    Stuck => "holds its echo line high before the trigger",
    Clock => "cannot be timed: the clock does not advance",
});

texts!(AddressError {
    From => "from is out of its range",
    To => "to is out of its range",
    Taken => "a device already answers at the new address",
    Silent => "no sensor acknowledged the present address",
    Bus => "bus error",
    Unchanged => "no device answers at the new address afterwards",
});

texts!(BridgeError {
    AddressNotAcknowledged => "no device acknowledged the address",
    DataNotAcknowledged => "the device refused a byte",
    BusTimeout => "the bus was stuck",
    Silent => "the bridge does not answer",
    Line => "the line to the bridge had an error",
    OutOfStep => "the bridge's reply makes no sense",
    TooLong => "more than 16 bytes in one direction",
    BaudRate => "no divider for this line speed",
});

impl Format for Fingerprint {
    fn format(&self, f: Formatter<'_>) {
        write!(f, "{=u16} mm", self.radius_mm());
    }
}

impl Format for FingerprintError {
    fn format(&self, f: Formatter<'_>) {
        match self {
            Self::TooLarge { radius_mm } => write!(f, "radius of {=u16} mm is beyond 8188 mm", radius_mm),
        }
    }
}

impl Format for Echo {
    fn format(&self, f: Formatter<'_>) {
        match self {
            Self::Range { range_mm } => write!(f, "{=u16} mm", range_mm),
            Self::Silence => write!(f, "silence"),
            Self::Dead => write!(f, "dead"),
        }
    }
}

impl Format for Place {
    fn format(&self, f: Formatter<'_>) {
        let Self { fingerprint, frame_index, degree, ways, behind_mrad: _, spread_mm } = self;
        write!(f, "place of {} in frame {=u32}, degree {}", fingerprint, frame_index, degree);
        write!(f, ", ways at {} mrad, spread {=u16} mm", ways.bearings_mrad(), spread_mm);
    }
}

impl Format for Observation {
    fn format(&self, f: Formatter<'_>) {
        let Self { fingerprint, ways, exit, travel_frames, starts_sequence } = self;
        write!(f, "{}, ways {}, exit {}, travel {} frames", fingerprint, ways, exit, travel_frames);
        write!(f, ", starts a sequence: {=bool}", starts_sequence);
    }
}

impl Format for Ways {
    fn format(&self, f: Formatter<'_>) {
        write!(f, "{=u8}, bearings {} / 256", self.count(), self.others());
    }
}

impl Format for Exit {
    fn format(&self, f: Formatter<'_>) {
        match self {
            Self::Back => write!(f, "back"),
            Self::On => write!(f, "on"),
            Self::Bearing(bearing) => write!(f, "at {=u8} / 256", bearing),
        }
    }
}

impl Format for VertexId {
    fn format(&self, f: Formatter<'_>) {
        write!(f, "{=u8}", (*self).into());
    }
}

impl Format for WorstNgram {
    fn format(&self, f: Formatter<'_>) {
        let Self { distance_mm, newest_age, .. } = self;
        write!(f, "{=u16} mm from the walk {}, {=u16} places ago", distance_mm, self.walk(), newest_age);
    }
}

impl Format for Update {
    fn format(&self, f: Formatter<'_>) {
        let Self { place_index, vertex, is_new, consistency_mm, factors, lead_q16, distinct } = self;
        write!(f, "place {=u32} is vertex {} (new: {=bool})", place_index, vertex, is_new);
        write!(f, ", consistency {=u16} mm, {}", consistency_mm, factors);
        write!(f, ", lead {=i32} / 65536 nats, {=u8} hypotheses", lead_q16, distinct);
    }
}

impl Format for WeightFactors {
    fn format(&self, f: Formatter<'_>) {
        let ln_size_q16 = match self {
            Self::Robust(RobustFactors { ln_labels_q16, ln_moves_q16, ln_size_q16 }) => {
                write!(f, "labels {=i32}, moves {=i32}", ln_labels_q16, ln_moves_q16);
                ln_size_q16
            }
            Self::Paper(PaperFactors { ln_label_q16, ln_consistency_q16, ln_size_q16 }) => {
                write!(f, "label {=i32}, consistency {=i32}", ln_label_q16, ln_consistency_q16);
                ln_size_q16
            }
            Self::Ordered(OrderedFactors { ln_labels_q16, ln_moves_q16 }) => {
                write!(f, "labels {=i32}, moves {=i32} / 65536 nats", ln_labels_q16, ln_moves_q16);
                return;
            }
        };
        write!(f, ", size {=i32} / 65536 nats", ln_size_q16);
    }
}

impl Format for FaultCounters {
    fn format(&self, f: Formatter<'_>) {
        for kind in FaultKind::ALL.into_iter().filter(|kind| self.count(*kind) > 0) {
            write!(f, "{} {=u32} ", kind, self.count(kind));
        }
    }
}

impl Format for SonarError {
    fn format(&self, f: Formatter<'_>) {
        write!(f, "sonar {=u8} {}", self.sensor, self.fault);
    }
}

impl Format for ConfigError {
    fn format(&self, f: Formatter<'_>) {
        match self {
            Self::OutOfRange { field, value, min, max } => {
                write!(f, "{=str} is {=i32}, but must be from {=i32} to {=i32}", field, value, min, max);
            }
            Self::ReservedAddress { field, address } => {
                write!(f, "{=str}: a sensor would have the reserved address {=u8:#x}", field, address);
            }
        }
    }
}

impl Format for NgramError {
    fn format(&self, f: Formatter<'_>) {
        match self {
            Self::Length { labels } => write!(f, "an n-gram has 2 to 7 labels, not {=u8}", labels),
            Self::Labels => write!(f, "the number of labels is not the length of the n-gram"),
        }
    }
}

impl Format for NgramsFull {
    fn format(&self, f: Formatter<'_>) {
        write!(f, "the n-gram table has no room for another n-gram");
    }
}

impl Format for VerticesFull {
    fn format(&self, f: Formatter<'_>) {
        write!(f, "the map has no room for another vertex");
    }
}

/// The types of the serial protocol.
#[cfg(feature = "wire")]
mod wire {
    use super::{Format, Formatter, write};
    use crate::wire::{EncodeError, QueueFull};

    texts!(EncodeError {
        OutputTooShort => "the output buffer is shorter than the frame",
        MessageTooLong => "the message is longer than a frame can be",
    });

    impl Format for QueueFull {
        fn format(&self, f: Formatter<'_>) {
            write!(f, "the transmit queue has no room for the message");
        }
    }
}
