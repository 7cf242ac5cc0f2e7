//! Damaged streams for the golden file: line errors, restarts of the robot, and invalid payloads.

use super::damage::with_crc;
use super::samples::{extremes, largest, requests, typical};
use super::{decode, frame};
use toposlam::wire::{
    Belief, Echoes, Encoder, FRAME_VERSION, GoalState, GoalStatus, Hello, List, Location, Message, Name,
    PROTOCOL_VERSION, Remapped, ResetCause, VertexProbability, VertexWays, Way, WayId, Worst, crc32,
};

/// Frames lost, repeated and overtaken.
pub(crate) fn lossy(frames: &[Vec<u8>]) -> Vec<u8> {
    let mut draw = Draw(7);
    let mut bytes = vec![0];
    let mut overtaken: &[u8] = &[];
    for (number, frame) in frames.iter().enumerate() {
        // The last round is not damaged.
        match if number + 40 > frames.len() { 9 } else { draw.below(20) } {
            0 => {}
            1 => bytes.extend([&frame[..], frame].concat()),
            2 => overtaken = frame,
            _ => bytes.extend([&frame[..], std::mem::take(&mut overtaken)].concat()),
        }
    }
    bytes
}

/// The same robot twice; the second time after a restart and without its first frames.
pub(crate) fn restarted(frames: &[Vec<u8>]) -> Vec<u8> {
    let Message::Hello(hello) = decode(&frames[0]).messages[0].1 else { panic!("the first message is a Hello") };
    let again = Message::Hello(Hello { session: hello.session ^ 1, reset_cause: ResetCause::Watchdog, ..hello });
    [&frames[..60].concat()[..], &[0], &frame(&mut Encoder::new(0), &again), &frames[1..30].concat()].concat()
}

/// A robot that restarts while nobody listens: its first frames are missing, and its numbers have passed the last one. The
/// clock of its ring frames shows the restart.
pub(crate) fn restarted_unheard(frames: &[Vec<u8>]) -> Vec<u8> {
    let ring = |sequence, frame_index| {
        frame(&mut Encoder::new(sequence), &Message::Ring { frame_index, echoes: Echoes::EMPTY })
    };
    let count = frames.len() as u16;
    let again = frames[1..30].iter().zip(count + 101..);
    let again = again.flat_map(|(bytes, sequence)| frame(&mut Encoder::new(sequence), &decode(bytes).messages[0].1));
    [&frames.concat()[..], &ring(count, 5000), &ring(count + 100, 400), &again.collect::<Vec<u8>>()].concat()
}

/// Names that are given, moved, merged, removed with their vertices and cleared.
pub(crate) fn named() -> Vec<Vec<u8>> {
    let name = |vertex, text: &str| Message::Name { vertex, name: Name::new(text).expect("a valid name") };
    let ids = |ids: &[u8]| Message::Remapped(Remapped { place_index: 2, vertices: List::new(ids.iter().copied()) });
    let map = |vertices| Message::Map { vertices, edges: 0, digest: 0 };
    let messages = [
        map(8),
        name(0, "hall"),
        name(1, "Küche"),
        name(2, "lift"),
        name(6, "roof"),
        // Another vertex takes a name.
        name(3, "hall"),
        // 1 and 2 are merged, 3 is removed.
        ids(&[1, 2, 2, 255]),
        name(0, "door"),
        name(4, "stairs"),
        Message::Named { vertices: 0b101_0101 },
        ids(&[1, 0]),
        map(6),
        name(64, "beyond"),
        Message::Name { vertex: 2, name: Name::NONE },
    ];
    let mut encoder = Encoder::new(0);
    messages.iter().map(|message| frame(&mut encoder, message)).collect()
}

/// The frames of two robots in turns.
pub(crate) fn two_robots(frames: &[Vec<u8>]) -> Vec<u8> {
    let Message::Hello(hello) = decode(&frames[0]).messages[0].1 else { panic!("the first message is a Hello") };
    let other = Message::Hello(Hello { session: hello.session ^ 1, ..hello });
    let turn = |number: usize| [&frames[0..20], &[frame(&mut Encoder::new(20 + number as u16), &other)]].concat();
    (0..4).flat_map(turn).flatten().collect()
}

/// An old Hello ends before the session id, a later one has more fields.
pub(crate) fn version_5() -> Vec<u8> {
    let Message::Hello(hello) = typical()[0] else { panic!("the first sample is a Hello") };
    let old = Message::Hello(Hello { protocol_version: 5, session: 0, ..hello });
    let later = Message::Hello(Hello { protocol_version: PROTOCOL_VERSION + 1, ..hello });
    let mut old = unpacked(&frame(&mut Encoder::new(0), &old));
    assert_eq!(old.pop(), Some(0), "the session id is the last field");
    let mut later = unpacked(&frame(&mut Encoder::new(1), &later));
    later.extend([1, 2, 3]);
    [with_crc(&old), with_crc(&later)].concat()
}

pub(crate) fn every_damage() -> Vec<u8> {
    let edge = |sequence, b| frame(&mut Encoder::new(sequence), &Message::Edge { a: 1, b, present: true });
    let request = frame(&mut Encoder::new(3), &requests()[0]);
    let mut corrupt = edge(1, 3);
    corrupt[3] ^= 0x40;
    [
        &edge(0, 2)[..],
        &corrupt,
        &edge(2, 4)[..6],
        &[0, 0, 0],
        &[1; 2],
        &[0],
        &[0xFF; 120],
        &[0],
        &with_crc(&[FRAME_VERSION + 1, 3, 0, 4, 1, 2, 1]),
        &request,
        // An unknown message counts as received in sequence, and not after a gap.
        &with_crc(&[FRAME_VERSION, 9, 0, 0x7F]),
        &edge(4, 5),
        &with_crc(&[FRAME_VERSION, 5, 0, 4, 1, 2, 1, 9]),
        &with_crc(&[FRAME_VERSION, 6, 0, 4, 1, 2]),
        &with_crc(&[FRAME_VERSION, 7, 0, 4, 1, 2, 2]),
        &with_crc(&[FRAME_VERSION]),
        &edge(8, 6),
        &edge(8, 7),
        &edge(9, 63),
        &edge(10, 64),
    ]
    .concat()
}

pub(crate) fn wrapping() -> Vec<u8> {
    let edge = Message::Edge { a: 0, b: 1, present: true };
    let numbers = [65500, 65535, 0, 65535, 40, 65535, 32_807, 32_806, 32_743, 32_744, 65511, 65510, 32_742, 65510];
    numbers.iter().flat_map(|&number| frame(&mut Encoder::new(number), &edge)).collect()
}

/// Each list with one element too many, and lengths that overflow.
pub(crate) fn long_lists() -> Vec<u8> {
    let list = |head: &[u8], count: u8, element: &[u8]| {
        let body = [&[FRAME_VERSION, 0, 0], head, &[count], &element.repeat(count.into())].concat();
        with_crc(&body)
    };
    [
        list(&[10, 0], 33, &[5]),
        list(&[11, 0, 0], 9, &[1, 1]),
        list(&[12, 0], 65, &[1]),
        list(&[13, 0, 0, 0], 8, &[1]),
        list(&[14, 0, 2, 0, 0], 65, &[1]),
        list(&[17, 0], 8, &[1, 0, 0]),
        with_crc(&[FRAME_VERSION, 0, 0, 12, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 1]),
        with_crc(&[FRAME_VERSION, 0, 0, 12, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 3]),
        // A varint may have redundant bytes, and must not exceed the range of its type.
        with_crc(&[FRAME_VERSION, 0, 0, 12, 0x80, 0x80, 0, 0x81, 0, 7]),
        with_crc(&[FRAME_VERSION, 1, 0, 12, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F, 0]),
        with_crc(&[FRAME_VERSION, 2, 0, 12, 0xFF, 0xFF, 0xFF, 0xFF, 0x1F, 0]),
        with_crc(&[FRAME_VERSION, 2, 0, 12, 0x80, 0x80, 0x80, 0x80, 0x80, 0, 0]),
    ]
    .concat()
}

/// Ways that no map has, each in an intact frame, and one that a map has.
pub(crate) fn impossible_ways() -> Vec<Vec<u8>> {
    let ways: [&[u8]; 10] = [
        &[64, 0],
        // A bearing of a full turn, and descending bearings.
        &[0, 1, 0x8B, 0x31, 0, 0],
        &[0, 2, 5, 0, 0, 4, 0, 0],
        // Other ends beyond the vertices and ways of any map, and one that is the way itself.
        &[0, 1, 5, 1, 64, 0, 0],
        &[0, 1, 5, 1, 1, 7, 0],
        &[0, 1, 5, 1, 0, 0, 0],
        // Loops with one end.
        &[0, 1, 5, 1, 0, 1, 0],
        &[0, 2, 5, 1, 0, 1, 0, 6, 0, 0],
        // A travel time of a frontier, and one of 0.
        &[0, 1, 5, 0, 1, 9],
        &[0, 1, 5, 1, 1, 0, 1, 0],
    ];
    let ways = ways.into_iter().chain([&[0, 2, 5, 1, 0, 1, 0, 6, 1, 0, 0, 0][..]]);
    (0..).zip(ways).map(|(sequence, ways)| with_crc(&[&[FRAME_VERSION, sequence, 0, 17], ways].concat())).collect()
}

/// The frames of a small map whose vertex ids change repeatedly.
pub(crate) fn renamed() -> Vec<Vec<u8>> {
    let canonical: [&[u8]; 3] =
        [&[2], &[232, 3, 1, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0], &[232, 3, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]];
    let map = Message::Map { vertices: 2, edges: 1, digest: crc32(&canonical.concat()) };
    let vertex = |vertex| Message::Vertex { vertex, radius_mm: 1000, visits: 1 };
    let names =
        |names: &[u8]| Message::Remapped(Remapped { place_index: 2, vertices: List::new(names.iter().copied()) });
    let place = |(vertex, permille)| VertexProbability { vertex, permille };
    let messages = [
        vertex(0),
        vertex(1),
        Message::Edge { a: 0, b: 1, present: true },
        Message::Edge { a: 1, b: 5, present: true },
        vertex(5),
        map,
        // A removed vertex does not return with its id.
        vertex(5),
        map,
        names(&[0, 1]),
        map,
        Message::Belief(Belief {
            place_index: 2,
            map_permille: 500,
            vertices: List::new([(1, 600), (0, 300), (2, 70)].map(place)),
        }),
        Message::Location(Location { place_index: 2, vertex: 1 }),
        Message::GoalStatus(GoalStatus { vertex: 0, state: GoalState::Active }),
        Message::Worst(Worst { place_index: 2, distance_mm: 9, newest_age: 1, vertices: List::new([0, 1, 0]) }),
        names(&[2, 2, 0]),
        names(&[0, 1, 255, 4]),
        names(&[]),
        Message::Edge { a: 0, b: 3, present: true },
        Message::Edge { a: 3, b: 3, present: true },
        names(&[64, 1, 2, 63]),
        names(&[200]),
    ];
    let ways = |vertex, ends: &[Option<(u8, u8)>]| {
        let way = |(bearing_mrad, end): (u16, &Option<(u8, u8)>)| Way {
            bearing_mrad,
            leads_to: end.map(|(vertex, way)| WayId { vertex, way }),
            travel_frames: end.map(|(_, way)| 40 + u16::from(way)),
        };
        Message::Ways(VertexWays { vertex, ways: List::new((0..).zip(ends).map(way)) })
    };
    // Two parallel edges, a loop and a frontier; the digest covers them.
    let (two, loops) = ([Some((1, 1)), Some((1, 0)), None], [Some((0, 1)), Some((0, 0)), Some((1, 3)), Some((1, 2))]);
    let bytes = |ends: &[Option<(u8, u8)>]| {
        let way = |(bearing, end): (u8, &Option<(u8, u8)>)| match end {
            Some((vertex, way)) => [bearing, 0, *vertex, *way, 40 + way, 0],
            None => [bearing, 0, 255, 255, 0, 0],
        };
        [vec![ends.len() as u8], (0..).zip(ends).flat_map(way).collect()].concat()
    };
    let canonical = [&canonical.concat()[..], &bytes(&two), &bytes(&loops)].concat();
    let with_ways = [
        names(&[255, 255, 255, 255, 255]),
        vertex(0),
        vertex(1),
        Message::Edge { a: 0, b: 1, present: true },
        ways(0, &two),
        ways(1, &loops),
        Message::Map { vertices: 2, edges: 1, digest: crc32(&canonical) },
        names(&[1, 0]),
        names(&[1, 0]),
        ways(5, &[Some((0, 2))]),
        Message::Map { vertices: 1, edges: 0, digest: 0 },
        ways(1, &loops),
        names(&[0, 0]),
        names(&[255]),
    ];
    let messages: Vec<Message> = messages.into_iter().chain(with_ways).collect();
    let mut encoder = Encoder::new(0);
    messages.iter().map(|message| frame(&mut encoder, message)).collect()
}

/// Changes, removes, repeats and inserts some bytes.
pub(crate) fn damage(mut bytes: Vec<u8>, draw: &mut Draw) -> Vec<u8> {
    for _ in 0..5 {
        let place = draw.below(bytes.len());
        let byte = draw.byte();
        match draw.below(6) {
            0 => bytes[place] ^= byte | 1,
            1 => bytes[place] = 0,
            2 => drop(bytes.remove(place)),
            3 => bytes.insert(place, byte),
            4 => {
                let end = (place + draw.below(60)).min(bytes.len());
                drop(bytes.drain(place..end));
            }
            _ => {
                let end = (place + draw.below(140)).min(bytes.len());
                let again = bytes[place..end].to_vec();
                bytes.splice(place..place, again);
            }
        }
    }
    bytes
}

/// Intact frames with mutated messages.
pub(crate) fn foreign_payloads(draw: &mut Draw) -> Vec<u8> {
    let messages: Vec<Message> = typical().into_iter().chain(largest()).chain(extremes()).collect();
    let mut bytes = Vec::new();
    for sequence in 0..20u16 {
        let message = messages[draw.below(messages.len())];
        let mut body = unpacked(&frame(&mut Encoder::new(sequence), &message));
        for _ in 0..draw.below(4) {
            // Rarely mutate the header.
            let place = if draw.below(12) == 0 { draw.below(3) } else { 3 + draw.below(body.len() - 3) };
            let byte = draw.byte();
            match draw.below(5) {
                0 => body[place] = byte,
                1 => body[place] ^= 0x80,
                2 => body[place] = [0, 1, 2, 0x7F, 0x80, 0xFF][draw.below(6)],
                3 if body.len() > 4 => drop(body.remove(place)),
                _ => body.insert(place, byte),
            }
        }
        bytes.extend(with_crc(&body));
    }
    bytes
}

/// Header and payload of a frame.
fn unpacked(frame: &[u8]) -> Vec<u8> {
    let (mut raw, mut code) = (frame[..frame.len() - 1].to_vec(), 0);
    while let Some(slot) = raw.get_mut(code) {
        code += usize::from(std::mem::take(slot));
    }
    raw[1..raw.len() - 4].to_vec()
}

/// Reproducible pseudo-random numbers: SplitMix64.
pub(crate) struct Draw(pub(crate) u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    pub(crate) fn byte(&mut self) -> u8 {
        self.next() as u8
    }
}
