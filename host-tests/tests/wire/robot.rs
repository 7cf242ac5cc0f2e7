//! A robot whose map changes at random, and what it sends.

use super::frame;
use toposlam::wire::{Capacities, Encoder, Hello, Message, QueueFull, Reporter};
use toposlam::{FaultCounters, FaultKind, Fingerprint, Map, Update, WeightFactors};

pub(crate) const TICKS_PER_HELLO: u16 = 20;

/// SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }

    pub(crate) fn happens(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    pub(crate) fn fingerprint(&mut self) -> Fingerprint {
        Fingerprint::from_steps(self.below(4000) as u16).expect("in range")
    }
}

/// A robot whose map changes at random, and the frames it sends.
pub(crate) struct Robot<const V: usize> {
    pub(crate) map: Map<V>,
    pub(crate) faults: FaultCounters,
    pub(crate) reporter: Reporter<V>,
    pub(crate) encoder: Encoder,
    pub(crate) place_index: u32,
    pub(crate) location: u8,
    /// The share of messages that the transmit queue refuses, in percent.
    pub(crate) refused_percent: usize,
}

impl<const V: usize> Robot<V> {
    pub(crate) fn new(boot: u32) -> Self {
        let capacities = Capacities {
            vertices: V as u8,
            hypotheses: 10,
            history: 256,
            ngram_length: 5,
            fingerprint_step_mm: 2,
            sonars: 16,
        };
        let mut reporter = Reporter::new();
        reporter.start(Hello::new(boot, 1, capacities), TICKS_PER_HELLO);
        Self {
            map: Map::new(),
            faults: FaultCounters::new(),
            reporter,
            encoder: Encoder::new(0),
            place_index: 0,
            location: 0,
            refused_percent: 0,
        }
    }

    /// The map changes as it does from place to place: a new vertex or a known one, one new edge, one more visit.
    pub(crate) fn drive(&mut self, random: &mut Random) {
        let from = self.location;
        let known = self.map.vertices();
        self.location = if known == 0 || random.happens(30) {
            self.map.add_vertex(random.fingerprint()).unwrap_or(from)
        } else {
            let vertex = random.below(known.into()) as u8;
            self.map.observe(vertex, random.fingerprint());
            vertex
        };
        if known > 0 {
            self.map.add_edge(from, self.location);
        }
    }

    /// Another hypothesis becomes the best one: a map of another size with other labels and edges.
    pub(crate) fn change_hypothesis(&mut self, random: &mut Random) {
        self.map.clear();
        for _ in 0..=random.below(V) {
            self.map.add_vertex(random.fingerprint()).expect("there is room");
        }
        let vertices = usize::from(self.map.vertices());
        for _ in 0..random.below(2 * vertices) {
            self.map.add_edge(random.below(vertices) as u8, random.below(vertices) as u8);
        }
        self.location = random.below(vertices) as u8;
    }

    pub(crate) fn update(&self) -> Update {
        Update {
            place_index: self.place_index,
            vertex: self.location,
            is_new: false,
            consistency_mm: 40,
            factors: WeightFactors { ln_label_q16: -1, ln_consistency_q16: -2, ln_size_q16: -3 },
            lead_q16: 4,
            distinct: 5,
        }
    }

    /// The frames after a place.
    pub(crate) fn place(&mut self, random: &mut Random) -> Vec<Vec<u8>> {
        let update = self.update();
        self.place_index += 1;
        let mut frames = Vec::new();
        let Self { map, reporter, encoder, refused_percent, .. } = self;
        reporter.update(map, &update, |message| queue(encoder, message, random.happens(*refused_percent), &mut frames));
        assert!(frames.len() <= 2 * V + 3, "{} frames in one update", frames.len());
        frames
    }

    /// The frames of a tick.
    pub(crate) fn tick(&mut self, random: &mut Random) -> Vec<Vec<u8>> {
        let mut frames = Vec::new();
        let Self { map, faults, reporter, encoder, refused_percent, .. } = self;
        reporter.tick(map, faults, |message| queue(encoder, message, random.happens(*refused_percent), &mut frames));
        assert!(frames.len() <= FaultKind::ALL.len() + 2);
        frames
    }
}

fn queue(encoder: &mut Encoder, message: &Message, full: bool, frames: &mut Vec<Vec<u8>>) -> Result<(), QueueFull> {
    let frame = frame(encoder, message);
    if full {
        return Err(QueueFull);
    }
    frames.push(frame);
    Ok(())
}
