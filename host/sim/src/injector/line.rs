//! Faults of a serial line: bytes lost and changed, noise, and more requests than a robot takes.

use std::fmt;

use toposlam::wire::{Command, Encoder, Inbox, MAX_FRAME_BYTES, Request};

use super::{Chance, FaultRates};

/// Requests of a flood have numbers from this on.
const FIRST_FLOOD_ID: u16 = 0x8000;

const _: () = assert!(
    LineInjector::BURST_BYTES > Inbox::BYTES_PER_TURN as u32,
    "a burst can be more than a robot looks at in a turn"
);

/// What an injector did to a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineCounts {
    /// Bytes that were lost.
    pub dropped_bytes: u64,
    /// Bytes of which a bit was flipped.
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

/// Changes what goes over a line in one direction.
#[derive(Clone, Debug)]
pub struct LineInjector {
    rates: FaultRates,
    chance: Chance,
    encoder: Encoder,
    next_id: u16,
    counts: LineCounts,
}

impl LineInjector {
    /// The longest burst of noise, in bytes.
    pub const BURST_BYTES: u32 = 300;
    /// The most requests that a flood brings at once.
    pub const FLOOD_REQUESTS: u32 = 40;

    /// One for a line.
    pub fn new(rates: FaultRates, seed: u64) -> Self {
        let counts = LineCounts::default();
        Self { rates, chance: Chance::new(seed, 1), encoder: Encoder::new(0), next_id: FIRST_FLOOD_ID, counts }
    }

    /// What arrives of bytes that were sent.
    pub fn carry(&mut self, sent: &[u8]) -> Vec<u8> {
        let Self { rates, chance, counts, .. } = self;
        let LineCounts { dropped_bytes, flipped_bits, .. } = counts;
        let arrives = |&byte: &u8| {
            chance.hurt(byte, rates.byte_dropped, rates.bit_flipped, (&mut *dropped_bytes, &mut *flipped_bits))
        };
        sent.iter().filter_map(arrives).collect()
    }

    /// What else arrives in the time of a ring frame, mostly nothing: noise, and requests that nobody waits for.
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

    /// What was done so far.
    pub const fn counts(&self) -> LineCounts {
        self.counts
    }
}

#[cfg(test)]
mod tests {
    use toposlam::wire::{Decoder, Progress};

    use super::*;

    #[test]
    fn without_rates_a_line_carries_what_was_sent_and_nothing_else() {
        let mut line = LineInjector::new(FaultRates::NONE, 1);
        let sent: Vec<u8> = (0..=255).collect();
        assert_eq!(line.carry(&sent), sent);
        assert!(line.noise().is_empty());
        assert_eq!(line.counts(), LineCounts::default());
    }

    #[test]
    fn every_byte_that_is_hurt_is_counted() {
        let rates = FaultRates { byte_dropped: 0.1, bit_flipped: 0.1, ..FaultRates::NONE };
        let mut line = LineInjector::new(rates, 1);
        let arrived = line.carry(&[0; 10_000]);
        let counts = line.counts();
        assert_eq!(arrived.len() as u64, 10_000 - counts.dropped_bytes);
        assert_eq!(arrived.iter().filter(|byte| byte.count_ones() == 1).count() as u64, counts.flipped_bits);
        assert!((800..1200).contains(&counts.dropped_bytes) && (700..1100).contains(&counts.flipped_bits));
    }

    #[test]
    fn a_flood_is_made_of_requests_that_a_robot_understands() {
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
