//! The directed distance of Eq. 2 from the history to the map, with the n-gram that carries it.
//!
//! The path of a hypothesis shows how far each n-gram is at most: its vertices are a walk. So n-grams are looked at in the
//! order of that bound, and those whose bound is no more than the distance found already need no look.

use super::record::Record;
use crate::filter::WorstNgram;
use crate::map::PerVertex;
use crate::{Fingerprint, Map, VertexId};

/// n: how many labels an n-gram has, as in Section IV of the paper.
pub(in crate::filter) const LENGTH: usize = 5;

/// How many n-grams are looked at one by one. When more would have to be, which is rare, the distance told is a lower bound.
const LOOKS: usize = 32;

/// Finds max over the n-grams of the record of min over the walks of the map of Eq. 3: one half of Eq. 2. U-turns in the
/// history add nothing to it, since the map has the U-turns of its walks too. `path` gives the vertex of each observation.
/// Cost: O(T) and at most 32 times O(n · V · degree).
pub(crate) fn worst_ngram<const V: usize, const T: usize>(record: &Record<T>, map: &Map<V>, path: &[u8]) -> WorstNgram {
    // How far the path is from each n-gram, by the place of its newest label: first of that label alone.
    let mut bounds = [0_u16; T];
    for ((entry, &vertex), bound) in record.iter().zip(path).zip(&mut bounds) {
        *bound = VertexId::new(vertex)
            .and_then(|vertex| map.label(vertex))
            .map_or(0, |label| entry.steps.abs_diff(label.steps()));
    }
    for end in (LENGTH - 1..record.len()).rev() {
        let largest = bounds.get(end + 1 - LENGTH..=end).and_then(|bounds| bounds.iter().max()).copied();
        if let (Some(bound), Some(largest)) = (bounds.get_mut(end), largest) {
            *bound = largest;
        }
    }
    let mut worst = WorstNgram::NONE;
    let mut found: Option<u16> = None;
    let mut ceiling = u16::MAX;
    let mut after = 0;
    for _ in 0..LOOKS {
        // The next n-gram by bound; of equal ones the older first.
        let mut next: Option<(u16, usize)> = None;
        let mut labels = 0;
        for (end, (entry, &bound)) in record.iter().zip(&bounds).enumerate() {
            labels = if entry.begins() { 1 } else { labels + 1 };
            let is_next = bound < ceiling || bound == ceiling && end > after;
            if labels >= LENGTH && is_next && next.is_none_or(|(largest, _)| bound > largest) {
                next = Some((bound, end));
            }
        }
        let Some((bound, end)) = next.filter(|&(bound, _)| found.is_none_or(|found| bound > found)) else { break };
        (ceiling, after) = (bound, end);
        let labels = core::array::from_fn(|index| record.get(end + 1 + index - LENGTH).map_or(0, |entry| entry.steps));
        let (distance, walk) = nearest_walk(map, &labels);
        if found.is_none_or(|found| distance > found) {
            found = Some(distance);
            worst.distance_mm = distance.saturating_mul(Fingerprint::STEP_MM);
            worst.length = LENGTH as u8;
            worst.newest_age = (record.len() - 1 - end) as u16;
            worst.vertices.iter_mut().zip(walk).for_each(|(to, vertex)| *to = vertex);
        }
    }
    worst
}

/// The walk of the map that is nearest to an n-gram in the maximum norm (Eq. 3), and its distance in steps.
#[inline(never)]
fn nearest_walk<const V: usize>(map: &Map<V>, labels: &[u16; LENGTH]) -> (u16, [VertexId; LENGTH]) {
    let mut distances = PerVertex::<u16, V>::filled(0);
    let mut backs = [PerVertex::<VertexId, V>::filled(VertexId::FIRST); LENGTH];
    for (index, (&label, backs)) in labels.iter().zip(&mut backs).enumerate() {
        let mut next = PerVertex::filled(u16::MAX);
        for (vertex, own) in map.vertices().zip(map.labels()) {
            let mut arrival = (u16::MAX, vertex);
            if index == 0 {
                arrival.0 = 0;
            } else {
                for from in map.neighbours(vertex).iter() {
                    if distances[from] < arrival.0 {
                        arrival = (distances[from], from);
                    }
                }
            }
            next[vertex] = arrival.0.max(own.steps().abs_diff(label));
            backs[vertex] = arrival.1;
        }
        distances = next;
    }
    let end = map.vertices().min_by_key(|&vertex| distances[vertex]);
    let distance = end.map_or(0, |end| distances[end]);
    let mut vertex = end.unwrap_or(VertexId::FIRST);
    let mut walk = [vertex; LENGTH];
    for (slot, backs) in walk.iter_mut().zip(&backs).rev() {
        *slot = vertex;
        vertex = backs[vertex];
    }
    (distance, walk)
}
