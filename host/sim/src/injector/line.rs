//! Faults of a serial line: lost and corrupted bytes, noise, and floods of requests.

use std::fmt;

use toposlam::wire::{Command, Encoder, Inbox, MAX_FRAME_BYTES, Request};

use super::{Chance, FaultRates};

/// Requests of a flood are numbered from this value on.
const FIRST_FLOOD_ID: u16 = 0x8000;

const _: () = assert!(
    LineInjector::BURST_BYTES > Inbox::BYTES_PER_TURN as u32,
    "a burst can exceed the bytes that a robot reads in a turn"
);

/// Counts of the injected faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineCounts {
    /// Lost bytes.
    pub dropped_bytes: u64,
    /// Bytes with a flipped bit.
    pub flipped_bits: u64,
    /// Bursts of noise.
    pub bursts: u64,
    /// Floods of requests.
    pub floods: u64,
    /// Requests in all floods.
    pub flood_requests: u64,
}

impl fmt::Display for LineCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} bytes lost, {} bits flipped, {} bursts of noise, {} floods of {} requests",
            self.dropped_bytes, self.flipped_bits, self.bursts, self.floods, self.flood_requests
        )
    }
}

/// Injects faults into one direction of a serial line.
#[derive(Clone, Debug)]
pub struct LineInjector {
    rates: FaultRates,
    chance: Chance,
    encoder: Encoder,
    next_id: u16,
    counts: LineCounts,
}

impl LineInjector {
    /// Length of the longest burst of noise, in bytes.
    pub const BURST_BYTES: u32 = 300;
    /// Largest number of requests in a flood.
    pub const FLOOD_REQUESTS: u32 = 40;

    /// An injector for one line.
    pub fn new(rates: FaultRates, seed: u64) -> Self {
        let counts = LineCounts::default();
        Self { rates, chance: Chance::new(seed, 1), encoder: Encoder::new(0), next_id: FIRST_FLOOD_ID, counts }
    }

    /// Returns what arrives of the sent bytes.
    pub fn carry(&mut self, sent: &[u8]) -> Vec<u8> {
        let Self { rates, chance, counts, .. } = self;
        let LineCounts { dropped_bytes, flipped_bits, .. } = counts;
        let arrives = |&byte: &u8| {
            chance.hurt(byte, rates.byte_dropped, rates.bit_flipped, (&mut *dropped_bytes, &mut *flipped_bits))
        };
        sent.iter().filter_map(arrives).collect()
    }

    /// Returns the other bytes that arrive during a ring frame, mostly none: noise and unsolicited requests.
    pub fn noise(&mut self) -> Vec<u8> {
        let mut noise = Vec::new();
        if self.chance.happens(self.rates.burst) {
            self.counts.bursts += 1;
            let bytes = self.chance.within(1, Self::BURST_BYTES);
            noise.extend((0..bytes).map(|_| self.chance.within(0, 255) as u8));
        }
        if self.chance.happens(self.rates.flood) {
            let requests = self.chance.within(2, Self::FLOOD_REQUESTS);
            self.counts.floods += 1;
            self.counts.flood_requests += u64::from(requests);
            noise.push(0);
            for _ in 0..requests {
                self.next_id = self.next_id.wrapping_add(1) | FIRST_FLOOD_ID;
                let request = Request { id: self.next_id, command: Command::Info };
                // A buffer of that size is always enough.
                noise.extend(self.encoder.encode(&request, &mut [0; MAX_FRAME_BYTES]).unwrap_or(&[]));
            }
        }
        noise
    }

    /// Counts of the faults so far.
    pub const fn counts(&self) -> LineCounts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use toposlam::wire::{Decoder, Progress};

    use super::*;

    #[test]
    fn a_line_is_transparent_at_zero_rates() {
        let mut line = LineInjector::new(FaultRates::NONE, 1);
        let sent: Vec<u8> = (0..=255).collect();
        assert_eq!(line.carry(&sent), sent);
        assert!(line.noise().is_empty());
        assert_eq!(line.counts(), LineCounts::default());
    }

    #[test]
    fn every_lost_or_corrupted_byte_is_counted() {
        let rates = FaultRates { byte_dropped: 0.1, bit_flipped: 0.1, ..FaultRates::NONE };
        let mut line = LineInjector::new(rates, 1);
        let arrived = line.carry(&[0; 10_000]);
        let counts = line.counts();
        assert_eq!(arrived.len() as u64, 10_000 - counts.dropped_bytes);
        assert_eq!(arrived.iter().filter(|byte| byte.count_ones() == 1).count() as u64, counts.flipped_bits);
        assert!((800..1200).contains(&counts.dropped_bytes) && (700..1100).contains(&counts.flipped_bits));
    }

    #[test]
    fn a_flood_consists_of_valid_requests() {
        let mut line = LineInjector::new(FaultRates { flood: 1.0, ..FaultRates::NONE }, 1);
        let bytes = line.noise();
        let mut decoder = Decoder::<Request>::new();
        let (mut rest, mut requests) = (&bytes[..], 0);
        while let Progress::Message { rest: behind, .. } = decoder.feed(rest) {
            (rest, requests) = (behind, requests + 1);
        }
        assert_eq!(requests, line.counts().flood_requests);
    }
}
