//! The directed distance of Eq. 2 from the history to the map, and the n-gram that has it.
//!
//! The path of a hypothesis is a walk, so it bounds the distance of each n-gram from above. The n-grams are evaluated in the
//! order of their bounds, until a bound is no larger than the distance found.

use super::WorstNgram;
use crate::map::PerVertex;
use crate::map::{Map, VertexId};
use crate::place::Fingerprint;

/// n: how many labels an n-gram has, as in Section IV of the paper.
pub(crate) const LENGTH: usize = 5;

/// How many n-grams are evaluated at most. Where more would have to be, which is rare, the result is a lower bound.
const EVALUATIONS: usize = 32;

/// One half of **Eq. 2**: the maximum over the n-grams of the history of the minimum over the walks of the map of Eq. 3. U-turns
/// in the history add nothing, since the map has the U-turns of its walks too. `place` gives for each of `len` observations, `T` at
/// most, its label in steps, whether it starts a sequence, and its vertex. Cost: at most 32 times O(T) + O(n · V · degree).
pub(crate) fn worst_ngram<const V: usize, const T: usize>(
    len: usize,
    map: &Map<V>,
    place: impl Fn(usize) -> Option<(u16, bool, Option<VertexId>)>,
) -> WorstNgram {
    // The bound of each n-gram by its newest label: first of that label alone.
    let mut bounds = [0_u16; T];
    for (index, bound) in bounds.iter_mut().enumerate().take(len) {
        let Some((steps, _, vertex)) = place(index) else { break };
        let label = vertex.and_then(|vertex| map.label(vertex));
        *bound = label.map_or(u16::MAX, |label| steps.abs_diff(label.steps()));
    }
    for end in (LENGTH - 1..len).rev() {
        let largest = bounds.get(end + 1 - LENGTH..=end).and_then(|bounds| bounds.iter().max()).copied();
        if let (Some(bound), Some(largest)) = (bounds.get_mut(end), largest) {
            *bound = largest;
        }
    }
    let mut worst = WorstNgram::NONE;
    let mut found: Option<u16> = None;
    let mut ceiling = u16::MAX;
    let mut after = 0;
    for _ in 0..EVALUATIONS {
        // The next n-gram by bound; of equal bounds the older one.
        let mut next: Option<(u16, usize)> = None;
        let mut labels = 0;
        for (end, &bound) in bounds.iter().enumerate().take(len) {
            let starts = place(end).is_none_or(|(_, starts, _)| starts);
            labels = if starts { 1 } else { labels + 1 };
            let is_next = bound < ceiling || bound == ceiling && end > after;
            if labels >= LENGTH && is_next && next.is_none_or(|(largest, _)| bound > largest) {
                next = Some((bound, end));
            }
        }
        let Some((bound, end)) = next.filter(|&(bound, _)| found.is_none_or(|found| bound > found)) else { break };
        (ceiling, after) = (bound, end);
        let labels = core::array::from_fn(|index| place(end + 1 + index - LENGTH).map_or(0, |(steps, ..)| steps));
        let (distance, walk) = nearest_walk(map, &labels);
        if found.is_none_or(|found| distance > found) {
            found = Some(distance);
            worst.distance_mm = distance.saturating_mul(Fingerprint::STEP_MM);
            worst.length = LENGTH as u8;
            worst.newest_age = (len - 1 - end) as u16;
            worst.vertices.iter_mut().zip(walk).for_each(|(to, vertex)| *to = vertex);
        }
    }
    worst
}

/// The walk of the map that is nearest to an n-gram, and its distance in steps: **Eq. 3**, the maximum norm.
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
