//! The ring frames of a robot's recording, for `toposlam replay`.

use std::path::Path;

use anyhow::{Context, bail, ensure};
use toposlam::ring::{Echo, RingFrame};
use toposlam::wire::{Echoes, Message};
use toposlam_cli::errln;
use toposlam_eval::range_csv::{Recorded, Ring, SONARS_MAX};
use toposlam_link::listener::{Event, Listener};
use toposlam_link::recording::Recording;

/// Reads the ring frames of a recording. Without a ring, the sonars are at equal distances.
pub(super) fn load(path: &Path, ring: Option<Ring>) -> anyhow::Result<(Ring, Recorded)> {
    let mut listener = Listener::new();
    let mut rings = Rings::default();
    for frame in Recording::open(path)? {
        listener.feed(&frame?.bytes, |_, event| {
            if let Event::Message(_, Message::Ring { frame_index, echoes }) = event {
                rings.push(*frame_index, echoes);
            }
        });
    }
    if rings.missing > 0 {
        errln!("{} of {} ring frames are missing in the recording", rings.missing, rings.missing + rings.count());
    }
    let sonars = rings.recorded.blanks.len();
    ensure!(sonars > 0, "no ring frames: the robot does not send them");
    if rings.has_other_sizes {
        bail!("ring frames of different sizes");
    }
    let ring = match ring {
        Some(ring) => ring,
        None => Ring::even(sonars).context("the ring of the recording")?,
    };
    ensure!(ring.sonars == sonars, "the ring has {} sonars, the recording {sonars}", ring.sonars);
    Ok((ring, rings.recorded))
}

#[derive(Default)]
struct Rings {
    recorded: Recorded,
    has_other_sizes: bool,
    last_index: Option<u32>,
    missing: usize,
}

impl Rings {
    fn count(&self) -> usize {
        self.recorded.frames.len()
    }

    fn push(&mut self, frame_index: u32, echoes: &Echoes) {
        // A restarted robot counts from 0 again.
        let gap = self.last_index.and_then(|last_index| frame_index.checked_sub(last_index + 1));
        self.missing += gap.unwrap_or(0) as usize;
        self.last_index = Some(frame_index);
        let sonars = echoes.iter().count();
        if self.recorded.frames.is_empty() {
            self.recorded.blanks = vec![0; sonars];
        }
        self.has_other_sizes |= self.recorded.blanks.len() != sonars;
        let mut frame = RingFrame { echoes: [Echo::Dead; SONARS_MAX] };
        for ((slot, echo), blanks) in frame.echoes.iter_mut().zip(echoes.iter()).zip(&mut self.recorded.blanks) {
            *slot = echo;
            *blanks += usize::from(echo == Echo::Dead);
        }
        self.recorded.frames.push(frame);
    }
}
