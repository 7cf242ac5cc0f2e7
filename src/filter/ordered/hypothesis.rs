//! One hypothesis: an edge-ordered map, the way the robot came by, and what was counted on the way there.

use super::choice::{Choice, Gain, OFF_MAP, ReportedExit, Target, UNSEEN};
use super::label::Label;
use super::model::{LN_WAYS, Model, SAME_WAY};
use super::record::{Entry, Record};
use crate::filter::Exit;
use crate::filter::beam::Ranked;
use crate::map::{Bearing, DartMap, NONE, WAYS_MAX};

/// Labels that are this many standard deviations off are not looked at.
const FAR: f32 = 5.0;

/// The log likelihood of a place that is not on the map, in nats.
pub(super) const LN_OFF_MAP: f32 = -20.0;

/// The largest number of darts of a hypothesis.
pub(super) const DARTS_MAX: usize = 253;

#[derive(Debug)]
pub(crate) struct Hypothesis<const V: usize, const D: usize, const T: usize> {
    pub(crate) map: DartMap<V, D>,
    pub(crate) labels: [Label; V],
    /// The way by which the robot came to the newest place; [`NONE`] before the first.
    pub(crate) at: u8,
    pub(crate) label_evidence: f32,
    /// All evidence but that of the labels.
    pub(crate) rest: f32,
    /// A hash of the edges.
    pub(crate) map_key: u32,
    /// The way by which the robot came to each place of the record.
    pub(crate) path: [u8; T],
}

impl<const V: usize, const D: usize, const T: usize> Ranked for Hypothesis<V, D, T> {
    const UNUSED: Self = Self {
        map: DartMap::EMPTY,
        labels: [Label::NONE; V],
        at: 0,
        label_evidence: 0.0,
        rest: 0.0,
        map_key: 0,
        path: [0; T],
    };

    fn clear(&mut self) {
        self.map.clear();
        self.labels.fill(Label::NONE);
        self.at = NONE;
        self.label_evidence = 0.0;
        self.rest = 0.0;
        self.map_key = 0;
    }

    fn score(&self) -> f32 {
        self.label_evidence + self.rest
    }

    fn key(&self) -> u32 {
        keyed(self.map_key, self.at)
    }
}

impl<const V: usize, const D: usize, const T: usize> Clone for Hypothesis<V, D, T> {
    fn clone(&self) -> Self {
        Self { map: self.map.clone(), ..*self }
    }

    /// In place: a hypothesis is too large for a temporary on the stack of a microcontroller.
    fn clone_from(&mut self, source: &Self) {
        self.map.clone_from(&source.map);
        self.labels = source.labels;
        self.at = source.at;
        self.label_evidence = source.label_evidence;
        self.rest = source.rest;
        self.map_key = source.map_key;
        self.path = source.path;
    }
}

impl<const V: usize, const D: usize, const T: usize> Hypothesis<V, D, T> {
    pub(super) fn label(&self, vertex: u8) -> Label {
        self.labels.get(usize::from(vertex)).copied().unwrap_or(Label::NONE)
    }

    /// The way that the robot came by at a place of the record.
    pub(super) fn came_by(&self, index: usize) -> u8 {
        self.path.get(index).copied().unwrap_or(NONE)
    }

    /// Weighs all labels again, for a new scale of the noise.
    pub(super) fn weigh_labels(&mut self, model: &Model) {
        self.label_evidence =
            self.labels.iter().take(usize::from(self.map.vertices())).map(|label| label.evidence(model)).sum();
    }

    /// What it gains to be at a vertex, having come there by `reference`.
    pub(super) fn arrival(&self, model: &Model, entry: &Entry, reference: u8) -> Gain {
        let vertex = self.map.vertex(reference);
        Gain {
            labels: self.label_gain(model, entry, vertex),
            rest: self.ways_evidence(model, entry, vertex, reference),
        }
    }

    /// What the label of a vertex gains by another observation.
    pub(super) fn label_gain(&self, model: &Model, entry: &Entry, vertex: u8) -> f32 {
        let label = self.label(vertex);
        label.including(entry.steps).evidence(model) - label.evidence(model)
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

    /// Whether a label is too far off for a vertex.
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
        if from == OFF_MAP {
            return ReportedExit::Before(record.get(index.wrapping_sub(1)).ln_travel);
        }
        let bearing = match record.get(index).exit() {
            None => return ReportedExit::Unknown,
            Some(Exit::On) => return ReportedExit::NotBack(from),
            Some(Exit::Back) => return ReportedExit::Way(from),
            Some(Exit::Bearing(bearing)) => u16::from(bearing) << 8,
        };
        let target = self.map.bearing(from).wrapping_add(bearing);
        match self.map.nearest_way(self.map.vertex(from), target) {
            Some((way, off)) if off.unsigned_abs() <= SAME_WAY => ReportedExit::Way(way),
            _ => ReportedExit::Unseen,
        }
    }

    /// Whether the robot's place is on the map.
    pub(super) fn is_on_map(&self) -> bool {
        self.at < UNSEEN
    }

    /// The key that the hypothesis would have with a choice.
    pub(super) fn key_with(&self, choice: Choice) -> u32 {
        // A way that no visit has shown is added first.
        let darts = self.map.darts();
        let (exit, added) = if choice.exit == UNSEEN { (darts, darts.saturating_add(1)) } else { (choice.exit, darts) };
        let (at, is_joined) = match choice.target {
            Target::Known => (self.map.partner(choice.exit).unwrap_or(NONE), false),
            Target::New | Target::Unseen(..) => (added, exit != NONE),
            Target::At(dart) => (dart, exit != NONE),
            Target::Back => (exit, false),
            Target::Beyond(dart) => (dart, false),
            Target::Spurious(_) | Target::OffMap => (OFF_MAP, false),
        };
        let vertex = match choice.target {
            Target::New => self.map.vertices(),
            Target::Unseen(vertex, _) => vertex,
            _ => self.map.vertex(at),
        };
        let from = self.map.vertex(if choice.exit == UNSEEN { self.at } else { exit });
        let map_key =
            if is_joined { self.map_key.wrapping_add(edge_key((exit, from), (at, vertex))) } else { self.map_key };
        keyed(map_key, at)
    }

    /// Whether there is room for another vertex.
    pub(super) fn has_room_for_vertex(&self) -> bool {
        self.has_room(Choice { exit: NONE, target: Target::New })
    }

    /// Whether there is room for what a choice adds.
    pub(super) fn has_room(&self, choice: Choice) -> bool {
        let unseen = usize::from(choice.exit == UNSEEN);
        let vertices = usize::from(choice.target == Target::New);
        let ways = usize::from(matches!(choice.target, Target::Unseen(..)));
        usize::from(self.map.vertices()) + vertices <= V
            && usize::from(self.map.darts()) + vertices * WAYS_MAX + unseen + ways <= D
            && (unseen == 0 || self.map.ways(self.map.vertex(self.at)).len() < WAYS_MAX)
    }

    /// Explains observation `index` by a choice; `frame` is the bearing of the first way of a new vertex. Returns whether a way
    /// that was seen found no room.
    pub(super) fn extend(&mut self, entry: &Entry, index: usize, choice: Choice, gain: Gain, frame: Bearing) -> bool {
        self.label_evidence += gain.labels;
        self.rest += gain.rest;
        let exit = match choice.exit {
            UNSEEN => self.map.add_way(self.map.vertex(self.at), self.unseen_bearing(entry)).unwrap_or(NONE),
            exit => exit,
        };
        if choice.exit == UNSEEN && matches!(entry.exit(), Some(Exit::Bearing(_))) {
            self.map.see(exit, 0);
        }
        let at = match choice.target {
            Target::Known => self.map.partner(exit).unwrap_or(NONE),
            Target::New => {
                let vertex = self.map.add_vertex().unwrap_or(NONE);
                if let Some(label) = self.labels.get_mut(usize::from(vertex)) {
                    *label = Label::NONE;
                }
                self.map.add_way(vertex, frame).unwrap_or(NONE)
            }
            Target::At(dart) => dart,
            Target::Unseen(vertex, bearing) => self.map.add_way(vertex, bearing).unwrap_or(NONE),
            Target::Back => exit,
            Target::Beyond(dart) => dart,
            Target::Spurious(_) | Target::OffMap => OFF_MAP,
        };
        // The travel time is that of one edge only without places that are none or were not detected.
        let is_timed = entry.ln_travel > 0 && self.is_on_map() && !matches!(choice.target, Target::Beyond(_));
        self.at = at;
        if let Some(slot) = self.path.get_mut(index) {
            *slot = at;
        }
        if at == OFF_MAP {
            return false;
        }
        let joins = matches!(choice.target, Target::New | Target::At(_) | Target::Unseen(..));
        if joins && exit != NONE {
            self.map.join(exit, at);
            self.map_key = self.map_key.wrapping_add(self.edge_key(exit, at));
        }
        if is_timed && exit != NONE {
            self.map.time(at, entry.ln_travel);
        }
        self.visit(entry, at)
    }

    /// The bearing of an exit that no visit has shown: the reported one, or the middle of the widest gap.
    fn unseen_bearing(&self, entry: &Entry) -> Bearing {
        if let Some(Exit::Bearing(bearing)) = entry.exit() {
            return self.map.bearing(self.at).wrapping_add(u16::from(bearing) << 8);
        }
        let gap =
            |way: u8| self.map.bearing(self.map.next_way(way)).wrapping_sub(self.map.bearing(way)).wrapping_sub(1);
        let ways = self.map.ways(self.map.vertex(self.at));
        let before = ways.iter().copied().max_by_key(|&way| gap(way)).unwrap_or(self.at);
        self.map.bearing(before).wrapping_add(gap(before) / 2)
    }

    /// Takes observation `index` for a visit by a way, on a map that does not change.
    pub(super) fn follow_to(&mut self, index: usize, at: u8, gain: Gain) {
        self.label_evidence += gain.labels;
        self.rest += gain.rest;
        self.at = at;
        if let Some(slot) = self.path.get_mut(index) {
            *slot = at;
        }
    }

    /// Halves the counts of vertices that were visited more often than their means need.
    pub(super) fn fade(&mut self, model: &Model) {
        for label in self.labels.iter_mut().take(usize::from(self.map.vertices())) {
            label.fade();
        }
        self.weigh_labels(model);
    }

    /// Drops the oldest places of the path.
    pub(super) fn forget_oldest(&mut self, count: usize) {
        self.path.copy_within(count.min(T).., 0);
    }

    /// Counts a visit. Returns whether a way that was seen found no room.
    fn visit(&mut self, entry: &Entry, at: u8) -> bool {
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
        let mut lacks_room = false;
        for (bearing, (way, off)) in entry.others().zip(found) {
            if way != NONE {
                self.map.see(way, off.saturating_sub(reference_off));
            } else if let Some(way) = self.map.add_way(vertex, base.wrapping_add(bearing)) {
                self.map.see(way, 0);
            } else {
                lacks_room |= usize::from(self.map.darts()) >= D;
            }
        }
        lacks_room
    }

    fn edge_key(&self, a: u8, b: u8) -> u32 {
        edge_key((a, self.map.vertex(a)), (b, self.map.vertex(b)))
    }

    /// Computes the key of the map from its edges. Cost: O(D).
    pub(super) fn rekey(&mut self) {
        self.map_key = self.map.edges().map(|(a, b)| self.edge_key(a, b)).fold(0, u32::wrapping_add);
    }
}

const fn mix(value: u32) -> u32 {
    let value = (value ^ value >> 16).wrapping_mul(0x7FEB_352D);
    let value = (value ^ value >> 15).wrapping_mul(0x846C_A68B);
    value ^ value >> 16
}

/// Darts are numbered in the order of the places at which they were seen first, so equal maps have equal numbers.
fn edge_key(a: (u8, u8), b: (u8, u8)) -> u32 {
    let (a, b) = (a.min(b), a.max(b));
    mix(u32::from_be_bytes([a.0, a.1, b.0, b.1]))
}

fn keyed(map_key: u32, at: u8) -> u32 {
    map_key ^ mix(0x2_0000 | u32::from(at))
}
