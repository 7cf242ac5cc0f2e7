//! One hypothesis: an edge-ordered map, the way the robot came by, and what was counted on the way there.

use super::model::{LN_WAYS, Model, SAME_WAY};
use super::record::{Entry, Record};
use crate::filter::Exit;
use crate::map::darts::{Bearing, DartMap, NONE, WAYS};
use crate::place::Fingerprint;

/// Labels that are this many standard deviations off are not looked at.
const FAR: f32 = 5.0;

/// From so many visits on the counts of a vertex are halved when places leave the record.
const FADE_VISITS: u16 = 512;

/// What it costs to leave a place unexplained, in nats.
const LOST: f32 = 20.0;

/// The statistics of one vertex: 12 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Label {
    pub(crate) mean: f32,
    pub(crate) scatter: f32,
    pub(crate) visits: u16,
    /// At how many visits the ways were seen; saturates.
    pub(crate) looks: u8,
}

impl Label {
    pub(crate) const NONE: Self = Self { mean: 0.0, scatter: 0.0, visits: 0, looks: 0 };

    /// With one more label (Welford's update).
    fn including(mut self, steps: u16) -> Self {
        self.visits = self.visits.saturating_add(1);
        let off = f32::from(steps) - self.mean;
        self.mean += off / f32::from(self.visits);
        self.scatter += off * (f32::from(steps) - self.mean);
        self
    }

    /// The statistics of both.
    pub(super) fn with(&self, other: &Self) -> Self {
        if self.visits == 0 || other.visits == 0 {
            return if self.visits == 0 { *other } else { *self };
        }
        let (here, there) = (f32::from(self.visits), f32::from(other.visits));
        let off = other.mean - self.mean;
        Self {
            mean: self.mean + off * there / (here + there),
            scatter: self.scatter + other.scatter + off * off * here * there / (here + there),
            visits: self.visits.saturating_add(other.visits),
            looks: self.looks.saturating_add(other.looks),
        }
    }

    /// The rounded mean.
    pub(super) fn fingerprint(&self) -> Fingerprint {
        Fingerprint::from_steps((self.mean + 0.5) as u16).unwrap_or(Fingerprint::MAX)
    }

    pub(super) fn evidence(&self, model: &Model) -> f32 {
        model.labels.evidence_of_labels(self.visits, self.scatter)
    }
}

/// Where the robot got to from the place before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// The other end of the edge it took.
    Known,
    /// A new vertex, by its first way.
    New,
    /// This way of a vertex that is on the map.
    At(u8),
}

/// One way to explain the newest place: the way by which the robot left, [`NONE`] at the first place of a sequence, and where it
/// got to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Choice {
    pub(super) exit: u8,
    pub(super) target: Target,
}

/// What the robot reported of the exit by which it left a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ReportedExit {
    Unknown,
    /// This way.
    Way(u8),
    /// Any but this one, by which it came.
    NotBack(u8),
}

impl ReportedExit {
    /// ln P of leaving by one of `ways` ways, and of the report: each way is as likely as another.
    pub(super) fn ln(self, model: &Model, exit: u8, ways: usize) -> f32 {
        let report = match self {
            Self::Unknown => 0.0,
            Self::Way(way) if way == exit => model.right_exit,
            Self::Way(_) => model.ln_wrong_exit(ways.saturating_sub(1)),
            Self::NotBack(came_by) if came_by != exit => model.right_exit,
            Self::NotBack(_) => model.ln_wrong_exit(1),
        };
        report - model.ln_of(ways)
    }
}

/// What a choice gains: the logarithms of the labels' evidence and of all else.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Gain {
    pub(super) labels: f32,
    pub(super) rest: f32,
}

impl Gain {
    pub(super) fn total(self) -> f32 {
        self.labels + self.rest
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Hypothesis<const V: usize, const D: usize, const T: usize> {
    pub(crate) map: DartMap<V, D>,
    pub(crate) labels: [Label; V],
    /// The way by which the robot came to the newest place; [`NONE`] before the first.
    pub(crate) at: u8,
    pub(crate) label_evidence: f32,
    /// All evidence but that of the labels.
    pub(crate) rest: f32,
    /// Identifies the map; vertices are numbered in the order of their first visit.
    pub(crate) map_key: u32,
    /// The way by which the robot came to each place of the record.
    pub(crate) path: [u8; T],
}

impl<const V: usize, const D: usize, const T: usize> Hypothesis<V, D, T> {
    /// All zero. It has to be cleared before its first use.
    pub(super) const ZERO: Self = Self {
        map: DartMap::EMPTY,
        labels: [Label::NONE; V],
        at: 0,
        label_evidence: 0.0,
        rest: 0.0,
        map_key: 0,
        path: [0; T],
    };

    pub(crate) fn clear(&mut self) {
        self.map.clear();
        self.labels.fill(Label::NONE);
        self.at = NONE;
        self.label_evidence = 0.0;
        self.rest = 0.0;
        self.map_key = 0;
    }

    pub(super) fn score(&self) -> f32 {
        self.label_evidence + self.rest
    }

    pub(super) fn label(&self, vertex: u8) -> Label {
        self.labels.get(usize::from(vertex)).copied().unwrap_or(Label::NONE)
    }

    /// The way that the robot came by at a place of the record.
    pub(super) fn came_by(&self, index: usize) -> u8 {
        self.path.get(index).copied().unwrap_or(NONE)
    }

    pub(super) fn key(&self) -> u32 {
        keyed(self.map_key, self.map.vertex(self.at), self.at)
    }

    /// Weighs all labels again, for a new scale of the noise.
    pub(super) fn weigh_labels(&mut self, model: &Model) {
        self.label_evidence =
            self.labels.iter().take(usize::from(self.map.vertices())).map(|label| label.evidence(model)).sum();
    }

    /// Which way of a vertex each of the other ways seen is, the robot having come by `reference`, and how far it is off; the
    /// closest first.
    fn identify(&self, entry: &Entry, vertex: u8, reference: u8) -> [(u8, i16); WAYS - 1] {
        let base = self.map.bearing(reference);
        let ways = self.map.ways(vertex);
        let mut found = [(NONE, 0); WAYS - 1];
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

    /// How far the mean bearing of the way that the robot came by seems to be off, and how much the offs of the others weigh.
    fn reference_off(&self, found: &[(u8, i16)], reference: u8) -> (f32, f32) {
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
    fn ways_evidence(&self, model: &Model, entry: &Entry, vertex: u8, reference: u8) -> f32 {
        if entry.count() == 0 {
            return 0.0;
        }
        let looks = self.label(vertex).looks;
        let others = usize::from(entry.count()) - 1;
        let found = self.identify(entry, vertex, reference);
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

    /// What it gains to be at a vertex, having come there by `reference`.
    pub(super) fn arrival(&self, model: &Model, entry: &Entry, reference: u8) -> Gain {
        let vertex = self.map.vertex(reference);
        let label = self.label(vertex);
        Gain {
            labels: label.including(entry.steps).evidence(model) - label.evidence(model),
            rest: self.ways_evidence(model, entry, vertex, reference),
        }
    }

    /// What it gains to be at a new vertex.
    pub(super) fn new_arrival(&self, model: &Model, entry: &Entry) -> Gain {
        let others = f32::from(entry.count().saturating_sub(1));
        let number = if entry.count() == 0 { 0.0 } else { -LN_WAYS };
        Gain {
            labels: Label::NONE.including(entry.steps).evidence(model),
            rest: others * model.way_new(0) + number + model.vertex(self.map.vertices()),
        }
    }

    /// Whether a label is so far off that a vertex is out of the question.
    pub(super) fn is_far(&self, model: &Model, steps: u16, vertex: u8) -> bool {
        self.is_label_far(model, f32::from(steps), vertex)
    }

    /// As [`Hypothesis::is_far`], of a mean label.
    pub(super) fn is_label_far(&self, model: &Model, steps: f32, vertex: u8) -> bool {
        let label = self.label(vertex);
        let freedom = f32::from(label.visits.max(1)) - 1.0 + 4.0;
        let variance = (2.0 * model.labels.scale + label.scatter) / freedom;
        let off = steps - label.mean;
        off * off > FAR * FAR * 2.0 * variance
    }

    /// What observation `index` says of the exit that led to it, when the robot came to the place before by `from`.
    pub(super) fn reported_exit(&self, record: &Record<T>, index: usize, from: u8) -> ReportedExit {
        let bearing = match record.get(index).exit() {
            None => return ReportedExit::Unknown,
            Some(Exit::On) => return ReportedExit::NotBack(from),
            Some(Exit::Back) => return ReportedExit::Way(from),
            Some(Exit::Bearing(bearing)) => u16::from(bearing) << 8,
        };
        let target = self.map.bearing(from).wrapping_add(bearing);
        match self.map.nearest_way(self.map.vertex(from), target) {
            Some((way, off)) if off.unsigned_abs() <= SAME_WAY => ReportedExit::Way(way),
            _ => ReportedExit::Unknown,
        }
    }

    /// Proposes every way to explain observation `index`, with what it gains, but for those whose exit costs more than `worst`.
    pub(super) fn propose(
        &self,
        model: &Model,
        record: &Record<T>,
        index: usize,
        worst: f32,
        mut proposed: impl FnMut(Choice, Gain),
    ) {
        let entry = record.get(index);
        if self.at == NONE || entry.starts() {
            let mut propose = |target| {
                let choice = Choice { exit: NONE, target };
                proposed(choice, self.gain(model, &entry, ReportedExit::Unknown, choice));
            };
            propose(Target::New);
            let near = |&dart: &u8| !self.is_far(model, entry.steps, self.map.vertex(dart));
            (0..self.map.darts()).filter(near).for_each(|dart| propose(Target::At(dart)));
            return;
        }
        let reported = self.reported_exit(record, index, self.at);
        let ways = self.map.ways(self.map.vertex(self.at));
        for &exit in ways {
            if reported.ln(model, exit, ways.len()) < worst {
                continue;
            }
            let mut propose = |target| {
                let choice = Choice { exit, target };
                proposed(choice, self.gain(model, &entry, reported, choice));
            };
            if self.map.partner(exit).is_some() {
                propose(Target::Known);
                continue;
            }
            propose(Target::New);
            for frontier in self.map.frontiers() {
                if frontier != exit && !self.is_far(model, entry.steps, self.map.vertex(frontier)) {
                    propose(Target::At(frontier));
                }
            }
        }
    }

    /// What a choice gains, given what the robot reported of its exit.
    pub(super) fn gain(&self, model: &Model, entry: &Entry, reported: ReportedExit, choice: Choice) -> Gain {
        let Choice { exit, target } = choice;
        let mut gain = match target {
            Target::New => self.new_arrival(model, entry),
            Target::At(dart) => self.arrival(model, entry, dart),
            Target::Known => self.arrival(model, entry, self.map.partner(exit).unwrap_or(NONE)),
        };
        if exit == NONE {
            gain.rest -= if target == Target::New { 0.0 } else { model.ln_of(self.map.darts().into()) };
            return gain;
        }
        let ways = self.map.ways(self.map.vertex(exit)).len();
        gain.rest += reported.ln(model, exit, ways);
        gain.rest += match target {
            Target::Known => model.travel(self.map.travel(exit), entry.ln_travel),
            Target::New => model.travel((0, 0), entry.ln_travel),
            Target::At(dart) => model.travel((0, 0), entry.ln_travel) + self.closure(model, exit, dart),
        };
        gain
    }

    /// What it gains that an edge joins two frontiers.
    fn closure(&self, model: &Model, exit: u8, frontier: u8) -> f32 {
        let keeps_genus = self.map.share_face(exit, frontier)
            || !self.map.are_connected(self.map.vertex(exit), self.map.vertex(frontier));
        model.closure(self.map.frontiers().count(), keeps_genus)
    }

    /// The key that the hypothesis would have.
    pub(super) fn key_with(&self, choice: Choice) -> u32 {
        match choice.target {
            Target::Known => {
                let at = self.map.partner(choice.exit).unwrap_or(NONE);
                keyed(self.map_key, self.map.vertex(at), at)
            }
            Target::New => {
                let key = edge_key(self.map.vertex(choice.exit), self.map.vertices());
                keyed(self.map_key.wrapping_add(key), self.map.vertices(), self.map.darts())
            }
            Target::At(dart) if choice.exit == NONE => keyed(self.map_key, self.map.vertex(dart), dart),
            Target::At(dart) => {
                let key = edge_key(self.map.vertex(choice.exit), self.map.vertex(dart));
                keyed(self.map_key.wrapping_add(key), self.map.vertex(dart), dart)
            }
        }
    }

    /// Whether there is room for what a choice adds.
    pub(super) fn has_room(&self, choice: Choice) -> bool {
        choice.target != Target::New
            || usize::from(self.map.vertices()) < V && usize::from(self.map.darts()) + WAYS <= D
    }

    /// Explains observation `index` by a choice; `frame` is the bearing of the first way of a new vertex.
    pub(super) fn extend(&mut self, entry: &Entry, index: usize, choice: Choice, gain: Gain, frame: Bearing) {
        let at = match choice.target {
            Target::Known => self.map.partner(choice.exit).unwrap_or(NONE),
            Target::New => {
                let Some(vertex) = self.map.add_vertex() else { return };
                if let Some(label) = self.labels.get_mut(usize::from(vertex)) {
                    *label = Label::NONE;
                }
                self.map.add_way(vertex, frame).unwrap_or(NONE)
            }
            Target::At(dart) => dart,
        };
        if choice.target != Target::Known && choice.exit != NONE {
            self.map.join(choice.exit, at);
        }
        self.at = at;
        if let Some(slot) = self.path.get_mut(index) {
            *slot = at;
        }
        if entry.ln_travel > 0 && choice.exit != NONE {
            self.map.time(at, entry.ln_travel);
        }
        self.label_evidence += gain.labels;
        self.rest += gain.rest;
        self.visit(entry, at);
        self.map_key = self.key_of_edges();
    }

    /// Halves the counts of vertices that were visited more often than their means need.
    pub(super) fn fade(&mut self, model: &Model) {
        for label in self.labels.iter_mut().take(usize::from(self.map.vertices())) {
            if label.visits >= FADE_VISITS {
                label.visits /= 2;
                label.scatter *= 0.5;
            }
        }
        self.weigh_labels(model);
    }

    /// Drops the oldest places of the path.
    pub(super) fn forget_oldest(&mut self, count: usize) {
        self.path.copy_within(count.min(T).., 0);
    }

    /// Leaves open where the robot is at a place.
    pub(super) fn lose_way(&mut self, index: usize) {
        self.at = NONE;
        self.rest -= LOST;
        if let Some(slot) = self.path.get_mut(index) {
            *slot = NONE;
        }
    }

    /// Counts a visit.
    fn visit(&mut self, entry: &Entry, at: u8) {
        let vertex = self.map.vertex(at);
        let found = self.identify(entry, vertex, at);
        let looks = u8::from(entry.count() > 0);
        if let Some(label) = self.labels.get_mut(usize::from(vertex)) {
            *label = label.including(entry.steps);
            label.looks = label.looks.saturating_add(looks);
        }
        let reference_off = self.reference_off(&found, at).0 as i16;
        self.map.turn(at, -reference_off);
        self.map.see(at, 0);
        let base = self.map.bearing(at);
        for (bearing, (way, off)) in entry.others().zip(found) {
            if way == NONE {
                if let Some(way) = self.map.add_way(vertex, base.wrapping_add(bearing)) {
                    self.map.see(way, 0);
                }
            } else {
                self.map.see(way, off.saturating_sub(reference_off));
            }
        }
    }

    /// The key of the edges of the map.
    fn key_of_edges(&self) -> u32 {
        let key = |(a, b)| edge_key(self.map.vertex(a), self.map.vertex(b));
        self.map.edges().map(key).fold(0, u32::wrapping_add)
    }
}

fn mix(value: u32) -> u32 {
    let value = (value ^ value >> 16).wrapping_mul(0x7FEB_352D);
    let value = (value ^ value >> 15).wrapping_mul(0x846C_A68B);
    value ^ value >> 16
}

fn edge_key(a: u8, b: u8) -> u32 {
    mix(0x1_0000 | u32::from(a.min(b)) << 8 | u32::from(a.max(b)))
}

fn keyed(map_key: u32, vertex: u8, dart: u8) -> u32 {
    map_key ^ mix(0x2_0000 | u32::from(vertex) << 8 | u32::from(dart))
}

#[cfg(test)]
mod tests {
    use super::super::config::OrderedConfig;
    use super::*;
    use crate::filter::{Observation, Ways};

    type Small = Hypothesis<4, 20, 8>;

    fn entry(bearings_mrad: &[u16]) -> Entry {
        let ways = Ways::from_bearings_mrad(bearings_mrad).ok();
        Entry::new(&Observation { ways, ..Observation::new(Fingerprint::from_steps(500).unwrap()) })
    }

    /// A vertex whose ways have bearings in radians and were seen so often.
    fn vertex(ways: &[(f64, u8)], looks: u8) -> Small {
        let mut hypothesis = Small::ZERO;
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
}
