//! Folding: when two darts are one, so are their vertices, their neighbours in order, and their partners.

use super::hypothesis::Hypothesis;
use super::label::Label;
use super::model::{Model, SAME_WAY};
use crate::map::NONE;

/// What a contradiction costs the estimate of what a fold gains, in nats.
const TORN: f32 = 8.0;

/// How many pairs of darts can wait to be identified.
const WAITING: usize = 32;

/// Vertices whose labels fit so much worse together stay apart, in nats.
const UNFIT: f32 = -8.0;

/// For each dart the one it was identified with; itself when with none.
#[derive(Clone, Debug)]
pub(super) struct Union<const D: usize> {
    parent: [u8; D],
}

impl<const D: usize> Union<D> {
    pub(super) const fn new() -> Self {
        Self { parent: [0; D] }
    }

    pub(super) fn clear(&mut self) {
        for (number, slot) in (0..).zip(&mut self.parent) {
            *slot = number;
        }
    }

    /// The dart that stands for all that were identified with one.
    pub(super) fn find(&self, mut dart: u8) -> u8 {
        while let Some(&parent) = self.parent.get(usize::from(dart)).filter(|&&parent| parent != dart) {
            dart = parent;
        }
        dart
    }

    fn set(&mut self, dart: u8, parent: u8) {
        if let Some(slot) = self.parent.get_mut(usize::from(dart)) {
            *slot = parent;
        }
    }
}

/// Identifies two darts of a hypothesis and all that follows from it: its map becomes the folded one, its path leads over the
/// darts that are left. What that gains, roughly; `None` when the two stay apart.
///
/// Cost: O(darts) for each pair of vertices that is united.
pub(super) fn fold<const V: usize, const D: usize, const T: usize>(
    model: &Model,
    hypothesis: &mut Hypothesis<V, D, T>,
    union: &mut Union<D>,
    (a, b): (u8, u8),
    len: usize,
) -> Option<f32> {
    union.clear();
    let mut waiting = [(NONE, NONE); WAITING];
    let mut count = 1_usize;
    if let Some(first) = waiting.first_mut() {
        *first = (a, b);
    }
    let mut is_made = false;
    let mut gained = 0.0;
    // Each pair unites two vertices, or is passed over.
    let mut left = hypothesis.map.vertices();
    while let Some(&(a, b)) = count.checked_sub(1).and_then(|last| waiting.get(last)).filter(|_| left > 0) {
        count -= 1;
        let (a, b) = (union.find(a), union.find(b));
        if a == b {
            continue;
        }
        let (kept, gone) = (hypothesis.map.vertex(a), hypothesis.map.vertex(b));
        if kept == gone {
            // Two ways of one vertex are one.
            gained -= 0.5 * TORN;
            unite(hypothesis, union, &mut waiting, &mut count, (a, b));
            continue;
        }
        let (label, other) = (hypothesis.label(kept), hypothesis.label(gone));
        let both = label.with(&other);
        let fit = both.evidence(model)
            - label.evidence(model)
            - other.evidence(model)
            - model.vertex(hypothesis.map.vertices());
        if fit < UNFIT {
            // They stay apart: the path that says otherwise is decided again.
            gained -= TORN;
            continue;
        }
        gained += fit + self::fit(model, hypothesis, (a, b));
        is_made = true;
        left -= 1;
        set_label(hypothesis, kept, both);
        let turn = hypothesis.map.bearing(a).wrapping_sub(hypothesis.map.bearing(b));
        let mut ways = [NONE; crate::map::WAYS_MAX];
        ways.iter_mut().zip(hypothesis.map.ways(gone)).for_each(|(slot, &way)| *slot = way);
        let mut taken = [NONE; crate::map::WAYS_MAX];
        for (slot, &way) in ways.iter().enumerate() {
            // What was left behind or identified before is no longer a way of the vertex.
            if way == NONE || hypothesis.map.vertex(way) != gone || union.find(way) != way {
                continue;
            }
            let bearing = hypothesis.map.bearing(way).wrapping_add(turn);
            let same = if way == b {
                Some(a)
            } else {
                let near = |&&other: &&u8| {
                    other != a
                        && union.find(other) == other
                        && !taken.contains(&other)
                        && off(bearing, hypothesis.map.bearing(other)) <= SAME_WAY
                };
                let by_off = |other: &&u8| off(bearing, hypothesis.map.bearing(**other));
                hypothesis.map.ways(kept).iter().filter(near).min_by_key(by_off).copied()
            };
            let Some(same) = same else {
                if !hypothesis.map.move_way(way, kept, bearing) {
                    // No room: the way stays behind.
                    continue;
                }
                if let Some(taken) = taken.get_mut(slot) {
                    *taken = way;
                }
                continue;
            };
            if let Some(taken) = taken.get_mut(slot) {
                *taken = same;
            }
            unite(hypothesis, union, &mut waiting, &mut count, (same, way));
        }
    }
    for slot in hypothesis.path.iter_mut().take(len) {
        *slot = union.find(*slot);
    }
    for dart in 0..hypothesis.map.darts() {
        if union.find(dart) == dart
            && let Some(partner) = hypothesis.map.partner(dart)
        {
            hypothesis.map.set_partner(dart, union.find(partner));
        }
    }
    is_made.then_some(gained)
}

/// Takes a way for another one; their partners are to be identified next.
fn unite<const V: usize, const D: usize, const T: usize>(
    hypothesis: &mut Hypothesis<V, D, T>,
    union: &mut Union<D>,
    waiting: &mut [(u8, u8); WAITING],
    count: &mut usize,
    (kept, gone): (u8, u8),
) {
    union.set(gone, kept);
    match (hypothesis.map.partner(kept), hypothesis.map.partner(gone)) {
        (Some(here), Some(there)) => {
            if let Some(next) = waiting.get_mut(*count) {
                *next = (here, there);
                *count += 1;
            }
        }
        (None, Some(there)) => hypothesis.map.set_partner(kept, there),
        _ => {}
    }
}

fn set_label<const V: usize, const D: usize, const T: usize>(
    hypothesis: &mut Hypothesis<V, D, T>,
    vertex: u8,
    label: Label,
) {
    if let Some(slot) = hypothesis.labels.get_mut(usize::from(vertex)) {
        *slot = label;
    }
}

fn off(a: u16, b: u16) -> u16 {
    (a.wrapping_sub(b) as i16).unsigned_abs()
}

/// How well two vertices fit when two of their darts are one: 2 nats for each way that both have, less what the difference of
/// the bearings costs, and 3 nats off for each that one of them has not.
pub(super) fn fit<const V: usize, const D: usize, const T: usize>(
    model: &Model,
    hypothesis: &Hypothesis<V, D, T>,
    (a, b): (u8, u8),
) -> f32 {
    let (kept, gone) = (hypothesis.map.vertex(a), hypothesis.map.vertex(b));
    let turn = hypothesis.map.bearing(a).wrapping_sub(hypothesis.map.bearing(b));
    let mut sum = 0.0;
    let mut found = 0;
    for &way in hypothesis.map.ways(gone) {
        let bearing = hypothesis.map.bearing(way).wrapping_add(turn);
        match hypothesis.map.nearest_way(kept, bearing) {
            _ if way == b => found += 1,
            Some((_, off)) if off.unsigned_abs() <= SAME_WAY => {
                found += 1;
                sum += 2.0 + model.bearing_off(off);
            }
            _ => sum -= 3.0,
        }
    }
    sum - 3.0 * (hypothesis.map.ways(kept).len() as f32 - found as f32).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::config::OrderedConfig;
    use super::*;
    use crate::filter::beam::Ranked as _;
    use std::collections::BTreeSet;

    type Small = Hypothesis<24, 96, 8>;

    /// Ways of the places of a building: bearing and the way it leads to, both numbered through.
    const BUILDING: &[&[(u16, usize)]] =
        &[&[(1_000, 3), (20_000, 5), (50_000, 6)], &[(0, 0), (9_000, 7), (30_000, 1), (50_000, 2)], &[(40_000, 4)]];

    /// `copies` of the building, an edge of copy `i` leading to copy `i + shift(dart)`: a covering map, which folds onto the
    /// building.
    fn cover(copies: usize, shift: impl Fn(usize) -> usize) -> Small {
        let mut hypothesis = Small::UNUSED;
        let mut partner = Vec::new();
        for _ in 0..copies {
            for (place, ways) in BUILDING.iter().enumerate() {
                let vertex = hypothesis.map.add_vertex().unwrap();
                hypothesis.labels[usize::from(vertex)] =
                    Label { visits: 3, mean: 300.0 + 100.0 * place as f32, scatter: 40.0, ..Label::default() };
                for &(bearing, leads_to) in *ways {
                    hypothesis.map.add_way(vertex, bearing).unwrap();
                    partner.push(leads_to);
                }
            }
        }
        let darts = partner.len() / copies;
        for copy in 0..copies {
            for (dart, &other) in partner.iter().enumerate().take(darts) {
                if dart < other {
                    let target = (copy + shift(dart)) % copies * darts + other;
                    hypothesis.map.join((copy * darts + dart) as u8, target as u8);
                }
            }
        }
        hypothesis
    }

    /// The classes of darts by the definition: identified darts have identified partners, and all darts of their vertices are
    /// identified by their bearings.
    fn naive(hypothesis: &Small, pair: (u8, u8)) -> Vec<BTreeSet<u8>> {
        let map = &hypothesis.map;
        let mut classes: Vec<BTreeSet<u8>> = (0..map.darts()).map(|dart| BTreeSet::from([dart])).collect();
        let mut open = vec![pair];
        while let Some((a, b)) = open.pop() {
            let of =
                |classes: &Vec<BTreeSet<u8>>, dart| classes.iter().position(|class| class.contains(&dart)).unwrap();
            let (kept, gone) = (of(&classes, a), of(&classes, b));
            if kept == gone {
                continue;
            }
            let moved = classes[gone].clone();
            classes[kept].extend(&moved);
            classes.remove(gone);
            if let (Some(here), Some(there)) = (map.partner(a), map.partner(b)) {
                open.push((here, there));
            }
            for &way in map.ways(map.vertex(a)) {
                for &other in map.ways(map.vertex(b)) {
                    if map.bearing(way) == map.bearing(other) {
                        open.push((way, other));
                    }
                }
            }
        }
        classes
    }

    #[test]
    fn a_fold_is_the_smallest_congruence_that_holds_the_pair() {
        let mut model = Model::new();
        model.configure(&OrderedConfig::DEFAULT.with_noise_mm(20));
        let darts = 8_u8;
        for (copies, shifts) in [(2, [0, 1, 0, 0]), (3, [0, 1, 1, 0]), (4, [1, 2, 0, 0]), (2, [0, 0, 0, 0])] {
            for dart in 0..darts {
                let mut hypothesis = cover(copies, |edge| shifts[edge.min(3)]);
                let expected = naive(&hypothesis, (dart, dart + darts));
                let mut union = Union::<96>::new();
                assert!(fold(&model, &mut hypothesis, &mut union, (dart, dart + darts), 0).is_some());
                for class in &expected {
                    let roots: BTreeSet<u8> = class.iter().map(|&dart| union.find(dart)).collect();
                    assert_eq!(roots.len(), 1, "{copies} copies, dart {dart}: {class:?}");
                }
                let roots: BTreeSet<u8> = (0..copies as u8 * darts).map(|dart| union.find(dart)).collect();
                assert_eq!(roots.len(), expected.len());
                // Partners of roots are roots, and joined both ways.
                for &root in &roots {
                    let partner = hypothesis.map.partner(root).unwrap();
                    assert_eq!((union.find(partner), hypothesis.map.partner(partner)), (partner, Some(root)));
                }
            }
        }
    }

    #[test]
    fn vertices_whose_labels_differ_stay_apart() {
        let mut model = Model::new();
        model.configure(&OrderedConfig::DEFAULT.with_noise_mm(20));
        let mut hypothesis = cover(2, |_| 0);
        assert_eq!(fold(&model, &mut hypothesis, &mut Union::<96>::new(), (0, 4), 0), None);
    }
}
