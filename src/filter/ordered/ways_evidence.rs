//! The ways seen at a visit as evidence: which way of the vertex each of them is, by its bearing, and how likely that is.

use super::choice::Gain;
use super::hypothesis::Hypothesis;
use super::model::{Model, SAME_WAY};
use super::record::Entry;
use crate::map::{Bearing, NONE, WAYS_MAX};

/// A way that none of more looks has shown is not considered.
const UNSEEN_LOOKS: u8 = 2;

impl<const V: usize, const D: usize, const T: usize> Hypothesis<V, D, T> {
    /// Which way of a vertex each of the other ways seen is, the robot having come by `reference`, and how far it is off; the
    /// closest first.
    pub(super) fn identify(&self, entry: &Entry, vertex: u8, reference: u8) -> [(u8, i16); WAYS_MAX - 1] {
        self.identify_from(entry, vertex, reference, self.map.bearing(reference))
    }

    /// As [`Hypothesis::identify`], with the bearing of the way that the robot came by, which need not be on the map.
    fn identify_from(&self, entry: &Entry, vertex: u8, reference: u8, base: Bearing) -> [(u8, i16); WAYS_MAX - 1] {
        let ways = self.map.ways(vertex);
        let mut found = [(NONE, 0); WAYS_MAX - 1];
        // Where no two ways seen have the same closest way, each is that one.
        let mut are_different = true;
        for (slot, bearing) in entry.others().enumerate() {
            let mut best = (NONE, 0, SAME_WAY + 1);
            for &way in ways {
                let off = base.wrapping_add(bearing).wrapping_sub(self.map.bearing(way)) as i16;
                if way != reference && off.unsigned_abs() < best.2 {
                    best = (way, off, off.unsigned_abs());
                }
            }
            are_different &= best.0 == NONE || found.iter().take(slot).all(|&(taken, _)| taken != best.0);
            if let Some(slot) = found.get_mut(slot) {
                *slot = (best.0, best.1);
            }
        }
        if are_different {
            return found;
        }
        found.fill((NONE, 0));
        for _ in ways {
            let mut best = (NONE, 0, 0, SAME_WAY + 1);
            for (slot, bearing) in entry.others().enumerate() {
                if found.get(slot).is_none_or(|&(way, _)| way != NONE) {
                    continue;
                }
                let target = base.wrapping_add(bearing);
                for &way in ways {
                    let off = target.wrapping_sub(self.map.bearing(way)) as i16;
                    if way != reference && off.unsigned_abs() < best.3 && found.iter().all(|&(taken, _)| taken != way) {
                        best = (way, off, slot, off.unsigned_abs());
                    }
                }
            }
            let (way, off, slot, _) = best;
            match found.get_mut(slot).filter(|_| way != NONE) {
                Some(slot) => *slot = (way, off),
                None => break,
            }
        }
        found
    }

    /// The bearing of a way of a vertex that no visit has shown, if the robot came by it: the one at which the ways seen are closest to
    /// those of the vertex. `None` when the vertex was looked at too often for that, or when it is the bearing of one of its ways.
    /// Cost: O(ways²) for each way seen.
    pub(super) fn unseen_reference(&self, entry: &Entry, vertex: u8) -> Option<Bearing> {
        let ways = self.map.ways(vertex);
        if !(1..=UNSEEN_LOOKS).contains(&self.label(vertex).looks) || ways.len() >= WAYS_MAX {
            return None;
        }
        let off =
            |bearing: Bearing| self.map.nearest_way(vertex, bearing).map_or(u16::MAX, |(_, off)| off.unsigned_abs());
        let mut best = (u32::MAX, None);
        for seen in entry.others() {
            for &way in ways {
                let base = self.map.bearing(way).wrapping_sub(seen);
                if off(base) > SAME_WAY {
                    let sum = entry.others().map(|seen| u32::from(off(base.wrapping_add(seen)).min(SAME_WAY))).sum();
                    if sum < best.0 {
                        best = (sum, Some(base));
                    }
                }
            }
        }
        best.1
    }

    /// What it gains to be at a vertex, having come there by a way with this bearing that no visit has shown.
    pub(super) fn unseen_arrival(&self, model: &Model, entry: &Entry, vertex: u8, bearing: Bearing) -> Gain {
        Gain {
            labels: self.label_gain(model, entry, vertex),
            rest: self.ways_evidence_from(model, entry, vertex, NONE, bearing),
        }
    }

    /// The first way of a vertex counter-clockwise from a bearing.
    pub(super) fn way_after(&self, vertex: u8, bearing: Bearing) -> u8 {
        let ahead = |&way: &u8| self.map.bearing(way).wrapping_sub(bearing);
        self.map.ways(vertex).iter().copied().min_by_key(ahead).unwrap_or(NONE)
    }

    /// How far the mean bearing of the way that the robot came by seems to be off, and how much the offs of the others weigh.
    pub(super) fn reference_off(&self, found: &[(u8, i16)], reference: u8) -> (f32, f32) {
        let (mut sum, mut weight) = (0.0, 0.0);
        for &(way, off) in found.iter().filter(|(way, _)| self.map.seen(*way) > 0) {
            let seen = f32::from(self.map.seen(way));
            let share = seen / (seen + 1.0);
            sum += share * f32::from(off);
            weight += share;
        }
        let known = f32::from(self.map.seen(reference));
        (sum / (weight + known).max(1.0), weight)
    }

    /// ln P of the ways seen at a vertex that the robot came to by `reference`.
    pub(super) fn ways_evidence(&self, model: &Model, entry: &Entry, vertex: u8, reference: u8) -> f32 {
        self.ways_evidence_from(model, entry, vertex, reference, self.map.bearing(reference))
    }

    fn ways_evidence_from(&self, model: &Model, entry: &Entry, vertex: u8, reference: u8, base: Bearing) -> f32 {
        if entry.count() == 0 {
            return 0.0;
        }
        let looks = self.label(vertex).looks;
        let others = usize::from(entry.count()) - 1;
        let found = self.identify_from(entry, vertex, reference, base);
        let (reference_off, weight) = self.reference_off(&found, reference);
        let mut evidence = model.reference(reference_off, self.map.seen(reference), looks, weight);
        for &(way, off) in found.iter().take(others) {
            evidence += if way == NONE {
                model.way_new(looks)
            } else {
                model.way_seen(self.map.seen(way), looks, f32::from(off) - reference_off)
            };
        }
        for &way in self.map.ways(vertex) {
            if way != reference && found.iter().all(|&(seen, _)| seen != way) {
                evidence += model.way_missed(self.map.seen(way), looks);
            }
        }
        evidence
    }
}

#[cfg(test)]
mod tests {
    use super::super::config::OrderedConfig;
    use super::super::label::Label;
    use super::*;
    use crate::filter::beam::Ranked as _;
    use crate::filter::{Observation, Ways};
    use crate::place::Fingerprint;

    type Small = Hypothesis<4, 20, 8>;

    fn entry(bearings_mrad: &[u16]) -> Entry {
        let ways = Ways::from_bearings_mrad(bearings_mrad).ok();
        Entry::new(&Observation { ways, ..Observation::new(Fingerprint::from_steps(500).unwrap()) })
    }

    /// A vertex with ways: their bearings in radians and how often each was seen.
    fn vertex(ways: &[(f64, u8)], looks: u8) -> Small {
        let mut hypothesis = Small::UNUSED;
        let vertex = hypothesis.map.add_vertex().unwrap();
        for &(bearing_rad, seen) in ways {
            let bearing = (bearing_rad / core::f64::consts::TAU * 65536.0) as u16;
            let way = hypothesis.map.add_way(vertex, bearing).unwrap();
            (0..seen).for_each(|_| hypothesis.map.see(way, 0));
        }
        hypothesis.labels[0] = Label { mean: 500.0, scatter: 50.0, visits: looks.into(), looks };
        hypothesis
    }

    fn normal(off: f64, variance: f64) -> f64 {
        (-off * off / (2.0 * variance)).exp() / (core::f64::consts::TAU * variance).sqrt()
    }

    /// ln P of the bearings of ways by a sum over the offset of the way that the robot came by.
    fn summed(offs_rad: &[(f64, f64)], seen_reference: f64) -> f64 {
        let variance = 0.01;
        let step = 1e-4;
        let sum: f64 = (-20_000..20_000)
            .map(|index| {
                let offset = f64::from(index) * step;
                let others = offs_rad.iter().map(|&(off, seen)| normal(off - offset, variance * (1.0 + 1.0 / seen)));
                normal(offset, variance / seen_reference) * others.product::<f64>() * step
            })
            .sum();
        sum.ln()
    }

    #[test]
    fn the_evidence_of_bearings_is_that_of_a_sum_over_the_reference() {
        let mut model = Model::new();
        model.configure(&OrderedConfig::DEFAULT.with_noise_mm(20));
        let ways = [(0.5, 3), (2.0, 2), (4.0, 3)];
        let hypothesis = vertex(&ways, 3);
        for (first, second) in [(1500, 3500), (1620, 3560), (1400, 3650), (1700, 3700)] {
            let entry = entry(&[first, second]);
            let reference = hypothesis.map.ways(0)[0];
            let evidence = f64::from(hypothesis.ways_evidence(&model, &entry, 0, reference));
            let offs = [(f64::from(first) / 1000.0 - 1.5, 2.0), (f64::from(second) / 1000.0 - 3.5, 3.0)];
            // Both were seen: of 3 looks with a prior weight of 20, at 2 and 3 of them.
            let hits = ((2.0 + 19.0) / 23.0_f64).ln() + ((3.0 + 19.0) / 23.0_f64).ln();
            let expected = summed(&offs, 3.0) + hits;
            // Bearings of the record are rounded to 25 mrad.
            assert!((evidence - expected).abs() < 0.35, "{evidence} {expected}");
        }
    }

    #[test]
    fn a_way_is_identified_by_its_bearing_whichever_others_were_missed() {
        let hypothesis = vertex(&[(0.0, 1), (1.0, 1), (2.5, 1), (4.5, 1)], 1);
        let ways: Vec<u8> = hypothesis.map.ways(0).to_vec();
        let found = hypothesis.identify(&entry(&[2400, 4700]), 0, ways[0]);
        assert_eq!([found[0].0, found[1].0], [ways[2], ways[3]]);
        assert!(found[2..].iter().all(|&(way, _)| way == NONE));
        // Two close ways: the closest pair goes first.
        let found = hypothesis.identify(&entry(&[700, 1100]), 0, ways[0]);
        assert_eq!([found[0].0, found[1].0], [NONE, ways[1]]);
    }

    #[test]
    fn a_missed_way_costs_less_than_a_vertex_with_another_number_of_ways() {
        let mut model = Model::new();
        model.configure(&OrderedConfig::DEFAULT.with_noise_mm(20));
        let hypothesis = vertex(&[(0.0, 4), (1.5, 4), (3.0, 4)], 4);
        let reference = hypothesis.map.ways(0)[0];
        let evidence = |bearings: &[u16]| hypothesis.ways_evidence(&model, &entry(bearings), 0, reference);
        assert!(evidence(&[1500, 3000]) > evidence(&[1500]));
        assert!(evidence(&[1500]) > evidence(&[1500, 3000, 4500]) - 6.0);
        assert!(evidence(&[700, 4500]) < evidence(&[1500]) - 6.0);
    }

    #[test]
    fn the_bearing_of_a_way_that_was_always_missed_follows_from_the_others() {
        let hypothesis = vertex(&[(0.0, 1), (1.5, 1), (3.0, 1)], 1);
        // A robot that comes by a way at 4.6 sees the others at 1.68, 3.18 and 4.68 from there.
        let bearing = hypothesis.unseen_reference(&entry(&[1680, 3180, 4680]), 0).unwrap();
        assert!(off(bearing, 4.6) < 0.1, "{bearing}");
        let mut model = Model::new();
        model.configure(&OrderedConfig::DEFAULT.with_noise_mm(20));
        let gain = hypothesis.unseen_arrival(&model, &entry(&[1680, 3180, 4680]), 0, bearing);
        let by_a_known_way = hypothesis.arrival(&model, &entry(&[1680, 3180, 4680]), hypothesis.map.ways(0)[0]);
        assert!(gain.rest > by_a_known_way.rest && gain.labels == by_a_known_way.labels);
        // It is none of the ways that were seen, and not missed again and again.
        assert_eq!(hypothesis.unseen_reference(&entry(&[1500]), 0).map(|bearing| off(bearing, 0.0) > 0.55), Some(true));
        assert_eq!(vertex(&[(0.0, 3), (1.5, 3), (3.0, 3)], 3).unseen_reference(&entry(&[1680, 3180, 4680]), 0), None);
    }

    /// The angle between a bearing and one in radians.
    fn off(bearing: Bearing, radians: f64) -> f64 {
        let radians = radians * 65536.0 / core::f64::consts::TAU;
        f64::from(bearing.wrapping_sub(radians as u16) as i16).abs() / 65536.0 * core::f64::consts::TAU
    }
}
