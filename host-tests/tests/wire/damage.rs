//! Streams that are split, cut, corrupted or mixed with foreign bytes, at every offset.

use super::samples::{largest, typical};
use super::streams::impossible_ways;
use super::{Decoded, decode, frame};
use proptest::prelude::*;
use toposlam::wire::{Decoder, Encoder, FRAME_VERSION, MAX_FRAME_BYTES, Message};

/// A stream of frames, and where each frame ends.
fn stream() -> (Vec<Message>, Vec<u8>, Vec<usize>) {
    let messages: Vec<_> = typical().into_iter().chain(largest()).collect();
    let mut encoder = Encoder::new(0);
    let mut bytes = Vec::new();
    let mut ends = Vec::new();
    for message in &messages {
        bytes.extend(frame(&mut encoder, message));
        ends.push(bytes.len());
    }
    (messages, bytes, ends)
}

/// Asserts that all sent messages but those in `missing` were decoded, each with its own sequence number.
fn assert_only_missing(sent: &[Message], decoded: &Decoded, missing: std::ops::RangeInclusive<usize>, what: &str) {
    let numbered: Vec<_> =
        decoded.messages.iter().map(|(header, message)| (header.sequence.into(), *message)).collect();
    let expected: Vec<_> = sent.iter().copied().enumerate().filter(|(number, _)| !missing.contains(number)).collect();
    assert_eq!(numbered, expected, "{what}");
}

#[test]
fn decoding_is_independent_of_the_split_points() {
    let (messages, bytes, _) = stream();
    for split in 0..=bytes.len() {
        let mut decoder = Decoder::new();
        let mut decoded = Decoded::default();
        decoded.decode(&mut decoder, &bytes[..split]);
        decoded.decode(&mut decoder, &bytes[split..]);
        assert_eq!(decoded.messages.len(), messages.len());
        assert_eq!(decoded, decode(&bytes), "split at {split}");
    }
    let mut decoder = Decoder::new();
    let mut decoded = Decoded::default();
    for byte in &bytes {
        decoded.decode(&mut decoder, std::slice::from_ref(byte));
    }
    assert_eq!(decoded, decode(&bytes), "byte by byte");
}

#[test]
fn a_listener_can_join_at_any_byte() {
    let (messages, bytes, ends) = stream();
    for start in 0..bytes.len() {
        let decoded = decode(&bytes[start..]);
        let touched = ends.iter().filter(|&&end| end <= start).count();
        let whole = start == 0 || ends.contains(&start);
        // If only the closing zero of a frame is left, it is not an error: a zero alone is not a frame.
        let cut_errors = usize::from(!whole && !ends.contains(&(start + 1)));
        let first = if whole { touched } else { touched + 1 };
        assert_eq!(decoded.messages.len(), messages.len() - first, "joined at {start}");
        assert_eq!(
            decoded.messages.first().map(|decoded| decoded.1),
            messages.get(first).copied(),
            "joined at {start}"
        );
        assert_eq!(decoded.errors, cut_errors, "joined at {start}");
    }
}

#[test]
fn a_lost_byte_invalidates_at_most_two_frames() {
    let (messages, bytes, ends) = stream();
    for gone in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged.remove(gone);
        let touched = ends.iter().filter(|&&end| end <= gone).count();
        // Without its closing zero, a frame merges with the next one.
        let last = touched + usize::from(bytes[gone] == 0);
        assert_only_missing(&messages, &decode(&damaged), touched..=last, &format!("without byte {gone}"));
    }
}

#[test]
fn a_changed_byte_invalidates_at_most_two_frames() {
    let edge = Message::Edge { a: 1, b: 2, present: true };
    for message in typical().into_iter().chain(largest()) {
        let mut encoder = Encoder::new(0);
        let [before, frame, after] = [edge, message, edge].map(|message| frame(&mut encoder, &message));
        for place in 0..frame.len() {
            let last = 1 + usize::from(frame[place] == 0);
            for flip in 1..=255 {
                let mut damaged = frame.clone();
                damaged[place] ^= flip;
                let decoded = decode(&[&before[..], &damaged, &after].concat());
                assert_only_missing(&[edge, message, edge], &decoded, 1..=last, &format!("byte {place} ^ {flip}"));
            }
        }
    }
}

#[test]
fn foreign_bytes_invalidate_at_most_one_frame() {
    let (messages, bytes, ends) = stream();
    let foreign: [&[u8]; 7] =
        [&[0], &[0, 0, 0], &[1], &[0xFF], b"panicked at src/main.rs\r\n", &[5, 0, 7, 0], &[0xA5; 3 * MAX_FRAME_BYTES]];
    for place in 0..=bytes.len() {
        for foreign in foreign {
            let mut damaged = bytes.clone();
            damaged.splice(place..place, foreign.iter().copied());
            let decoded = decode(&damaged);
            let touched = ends.iter().filter(|&&end| end <= place).count();
            let between_frames = place == 0 || ends.contains(&place);
            let closed = between_frames && foreign.ends_with(&[0]);
            // Foreign bytes that equal the rest of the frame complete it.
            let rest = ends.get(touched).and_then(|&end| bytes.get(place..end));
            let completed = rest.is_some_and(|rest| foreign.starts_with(rest));
            let what = format!("{foreign:?} at {place}");
            if place == bytes.len() || closed || completed {
                assert_eq!(decoded.messages.len(), messages.len(), "{what}");
            } else {
                assert_only_missing(&messages, &decoded, touched..=touched, &what);
            }
        }
    }
}

#[test]
fn every_kind_of_damage_has_its_counter() {
    let edge = Message::Edge { a: 1, b: 2, present: true };
    let good = frame(&mut Encoder::new(0), &edge);
    let mut corrupt = good.clone();
    corrupt[good.len() - 2] ^= 0x80;
    let mut cut = good[..3].to_vec();
    cut.push(0);
    let mut too_long = vec![0xAA; 2000];
    too_long.push(0);
    let mut decoder = Decoder::new();
    let mut decoded = Decoded::default();
    for bytes in [
        &corrupt,
        &cut,
        &too_long,
        &with_crc(&[FRAME_VERSION + 1, 0, 0, 4, 1, 2, 1]),
        &with_crc(&[FRAME_VERSION, 0, 0, 0x7F]),
        &good,
    ] {
        decoded.decode(&mut decoder, bytes);
    }
    let trailing = with_crc(&[FRAME_VERSION, 1, 0, 4, 1, 2, 1, 9]);
    decoded.decode(&mut decoder, &trailing);
    decoded.decode(&mut decoder, &frame(&mut Encoder::new(2), &edge));
    let counters = decoder.counters();
    assert_eq!((counters.corrupt, counters.cut, counters.too_long), (1, 1, 1));
    assert_eq!((counters.unknown_version, counters.unknown_message), (1, 2));
    assert_eq!((counters.messages, counters.lost), (2, 0), "an unknown message is not lost");
    assert_eq!((decoded.messages.len(), decoded.errors), (2, 6));
}

#[test]
fn ways_that_no_map_has_are_refused_and_counted() {
    let frames = impossible_ways();
    let (possible, impossible) = frames.split_last().expect("there are frames");
    let mut decoder = Decoder::new();
    let mut decoded = Decoded::default();
    for (frame, refused) in impossible.iter().zip(1..) {
        decoded.decode(&mut decoder, frame);
        assert_eq!(decoder.counters().unknown_message, refused);
    }
    assert_eq!(decoded.messages, []);
    decoded.decode(&mut decoder, possible);
    assert!(matches!(decoded.messages[..], [(_, Message::Ways(_))]), "{decoded:?}");
    assert_eq!(decoder.counters().lost, 0, "a refused message is not lost");
}

proptest! {
    #[test]
    fn noise_is_skipped_and_the_next_frame_is_decoded(noise in proptest::collection::vec(any::<u8>(), 0..600)) {
        let edge = Message::Edge { a: 1, b: 2, present: true };
        let stream = [&noise[..], &[0], &frame(&mut Encoder::new(0), &edge)].concat();
        let messages: Vec<_> = decode(&stream).messages.into_iter().map(|(_, message)| message).collect();
        prop_assert_eq!(messages, [edge]);
    }

    #[test]
    fn an_intact_frame_of_any_payload_is_one_message_or_one_error(payload in proptest::collection::vec(any::<u8>(), 0..103)) {
        let decoded = decode(&with_crc(&[&[FRAME_VERSION, 0, 0], &payload[..]].concat()));
        prop_assert_eq!(decoded.messages.len() + decoded.errors, 1);
    }
}

/// A frame with the given header and payload, by a CRC and COBS independent of the library.
pub(crate) fn with_crc(body: &[u8]) -> Vec<u8> {
    let mut crc = u32::MAX;
    for byte in body {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    let raw: Vec<u8> = body.iter().copied().chain((!crc).to_le_bytes()).collect();
    let mut out = vec![0];
    let mut code = 0;
    for byte in raw {
        if byte == 0 {
            code = out.len();
            out.push(0);
        } else {
            out.push(byte);
        }
        out[code] = u8::try_from(out.len() - code).expect("short");
    }
    out.push(0);
    out
}
