//! The ordered filter in `f64`: the faces of an edge-ordered map, and the evidence of a walk along its ways.
//!
//! The evidence is the sum of the formulas of `docs/inference.md`, computed place by place from all values observed so far. Angles
//! are in radians.

use crate::robust::ln_labels;
use std::f64::consts::TAU;

/// Two ways of one place are farther apart than this.
const SAME_WAY: f64 = 0.55;

/// The log prior of each unit of genus.
const LN_GENUS: f64 = -7.0;

/// The log prior of another part of the map, and what an edge that connects two parts gains.
const LN_PART: f64 = -10.0;

/// ln of the share of places that are none: after a place, on an edge where one was none before, and after the drive was lost; and of the
/// visits that are not detected.
const LN_SPURIOUS: [f64; 3] = [-6.0, -14.0, -2.0];
const LN_MISSED_PLACE: f64 = -8.0;

/// The range of labels in steps.
const LABELS: f64 = 1000.0;

/// How many visits the prior shares of seen and missed ways stand for: of a way that was seen once, and of others.
const PRIOR_VISITS: [f64; 2] = [2.0, 20.0];

/// A vertex with more visits has the deviation of one with this many for the bearings of its ways.
const COUNTS: f64 = 15.0;

/// An edge-ordered map: the darts of each vertex in counter-clockwise order, and the partner of each dart.
#[derive(Clone, Debug, Default)]
pub struct Rotation {
    /// The darts of each vertex, counter-clockwise.
    pub ways: Vec<Vec<usize>>,
    /// The partner of each dart; `None` for a frontier.
    pub partner: Vec<Option<usize>>,
}

impl Rotation {
    fn next_driven(&self, dart: usize) -> usize {
        let around = self.ways.iter().find(|ways| ways.contains(&dart)).expect("each dart has a vertex");
        let driven: Vec<usize> = around.iter().copied().filter(|&way| self.partner[way].is_some()).collect();
        driven[(driven.iter().position(|&way| way == dart).expect("it is driven") + 1) % driven.len()]
    }

    /// The number of faces: orbits of "follow the edge, take the next driven way", and one for each vertex without edges.
    pub fn faces(&self) -> usize {
        let mut smallest = std::collections::BTreeSet::new();
        for start in (0..self.partner.len()).filter(|&dart| self.partner[dart].is_some()) {
            let mut orbit = vec![start];
            loop {
                let last = orbit[orbit.len() - 1];
                let next = self.next_driven(self.partner[last].expect("it is driven"));
                if next == start {
                    break;
                }
                orbit.push(next);
            }
            smallest.insert(*orbit.iter().min().expect("an orbit has a dart"));
        }
        let is_alone = |ways: &&Vec<usize>| ways.iter().all(|&way| self.partner[way].is_none());
        smallest.len() + self.ways.iter().filter(is_alone).count()
    }

    fn vertex(&self, dart: usize) -> usize {
        self.ways.iter().position(|ways| ways.contains(&dart)).expect("each dart has a vertex")
    }

    /// The number of connected parts.
    pub fn components(&self) -> usize {
        let mut part: Vec<usize> = (0..self.ways.len()).collect();
        for dart in 0..self.partner.len() {
            if let Some(partner) = self.partner[dart] {
                let (kept, gone) = (part[self.vertex(dart)], part[self.vertex(partner)]);
                part.iter_mut().filter(|of| **of == gone).for_each(|of| *of = kept);
            }
        }
        part.sort_unstable();
        part.dedup();
        part.len()
    }

    /// The genus by Euler's formula: V − E + F = 2 · components − 2 · genus.
    pub fn genus(&self) -> usize {
        let edges = self.partner.iter().flatten().count() / 2;
        (2 * self.components() + edges - self.ways.len() - self.faces()) / 2
    }
}

/// One observation.
#[derive(Clone, Debug)]
pub struct Visit {
    /// The label in steps.
    pub label: f64,
    /// The bearings of the other ways relative to the one the robot came by; `None` when they are unknown.
    pub others: Option<Vec<f64>>,
    /// The bearing of the exit of the place before; `None` when it is unknown.
    pub exit: Option<f64>,
    /// ln of the travel time.
    pub ln_travel: Option<f64>,
}

/// The parameters of the model.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    /// The standard deviation of a label in steps.
    pub deviation: f64,
    /// The probability of a wrong exit.
    pub wrong_exit: f64,
    /// The probability that a way is not seen.
    pub missed_way: f64,
    /// The probability that something is seen that is no way.
    pub false_way: f64,
    /// The standard deviation of a bearing.
    pub bearing: f64,
    /// The standard deviation of the logarithm of a travel time.
    pub travel: f64,
}

#[derive(Clone, Debug, Default)]
struct Way {
    bearing: f64,
    seen: f64,
    ln_travels: Vec<f64>,
}

/// The map after each place of a walk, with all values observed.
#[derive(Clone, Debug, Default)]
pub struct Walk {
    rotation: Rotation,
    ways: Vec<Way>,
    labels: Vec<Vec<f64>>,
    looks: Vec<f64>,
    at: Option<usize>,
    /// After a place that is none: the dart by which the robot left the place before, and ln of the travel time until there.
    on: Option<(usize, Option<f64>)>,
    /// The edges on which places were none, as darts.
    spurious: Vec<usize>,
    /// The sum of all logarithms but those of the labels.
    pub ln_rest: f64,
}

/// The difference of two angles, −π to π.
fn difference(a: f64, b: f64) -> f64 {
    (a - b + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0
}

fn ln_normal(off: f64, variance: f64) -> f64 {
    -0.5 * (TAU * variance).ln() - off * off / (2.0 * variance)
}

impl Walk {
    /// The evidence of all labels.
    pub fn ln_labels(&self, deviation: f64) -> f64 {
        self.labels.iter().map(|labels| ln_labels(labels, deviation)).sum()
    }

    /// The number of darts so far.
    pub fn darts(&self) -> usize {
        self.ways.len()
    }

    fn vertex(&self, dart: usize) -> usize {
        self.rotation.vertex(dart)
    }

    fn add_way(&mut self, vertex: usize, bearing: f64) -> usize {
        let dart = self.ways.len();
        self.ways.push(Way { bearing: bearing.rem_euclid(TAU), ..Way::default() });
        self.rotation.partner.push(None);
        self.rotation.ways[vertex].push(dart);
        self.sort(vertex);
        dart
    }

    fn sort(&mut self, vertex: usize) {
        let ways = &self.ways;
        self.rotation.ways[vertex].sort_by(|&a, &b| ways[a].bearing.total_cmp(&ways[b].bearing));
    }

    /// Takes a visit for a place that is none.
    pub fn drive_to_no_place(&mut self, model: Model, visit: &Visit) {
        let exit = self.at.map(|at| self.reported(visit, at).expect("the robot is on an edge"));
        if let (Some(exit), Some(at)) = (exit, self.at) {
            self.ln_rest += self.ln_exit(model, visit, at, exit) - visit.ln_travel.map_or(0.0, |_| 2.5_f64.ln());
        }
        let again = |exit| {
            [Some(exit), self.rotation.partner[exit]].into_iter().flatten().any(|end| self.spurious.contains(&end))
        };
        let case = exit.map_or(2, |exit| usize::from(again(exit)));
        self.ln_rest += LN_SPURIOUS[case] - LABELS.ln();
        self.spurious.extend(exit);
        if let Some(others) = &visit.others {
            self.ln_rest -= 7_f64.ln() + others.len() as f64 * (TAU.ln() - self.ln_unseen(model, 0.0));
        }
        self.on = exit.map(|exit| (exit, visit.ln_travel));
        self.at = None;
    }

    /// Drives back from a place that is none, or on to the other end of the edge if it is known; or comes there from anywhere, if that is
    /// likelier.
    pub fn drive_from_no_place(&mut self, model: Model, visit: &Visit, arrival: usize) {
        let (edge, first) = self.on.take().expect("the place before is none");
        self.ln_rest += self.ln_ways(model, visit, arrival);
        let mut along = 0.0;
        if let Some(second) = visit.ln_travel {
            let known = &self.ways[edge.min(arrival)].ln_travels;
            let deviation = |count: f64| model.travel.powi(2) * (1.0 + 1.0 / count.min(COUNTS));
            along = match first {
                Some(first) if arrival == edge => ln_normal(second - first, deviation(1.0)),
                Some(first) if !known.is_empty() => {
                    let (count, sum) = (known.len() as f64, (first.exp() + second.exp()).ln());
                    ln_normal(sum - known.iter().sum::<f64>() / count, deviation(count))
                }
                _ => -(2.5_f64.ln()),
            };
        }
        self.ln_rest += f64::max(along, -(self.darts() as f64).ln());
        self.see(visit, arrival);
        self.at = Some(arrival);
    }

    /// Passes the place at the other end of `exit` without a detection, and comes to one beyond it by `arrival`.
    pub fn drive_past(&mut self, model: Model, visit: &Visit, exit: usize, arrival: usize) {
        let at = self.at.expect("the robot is at a place");
        let passed = self.rotation.partner[exit].expect("the edge is known");
        let ways = self.rotation.ways[self.vertex(passed)].len() as f64;
        self.ln_rest += self.ln_exit(model, visit, at, exit) + LN_MISSED_PLACE - (ways - 1.0).ln();
        self.ln_rest += self.ln_ways(model, visit, arrival);
        if let Some(ln_travel) = visit.ln_travel {
            let second = self.rotation.partner[arrival].expect("the edge is known");
            let [first, second] = [exit.min(passed), arrival.min(second)].map(|edge| &self.ways[edge].ln_travels);
            let count = first.len().min(second.len()) as f64;
            let mean = |known: &[f64]| known.iter().sum::<f64>() / known.len() as f64;
            self.ln_rest += if count > 0.0 {
                let sum = (mean(first).exp() + mean(second).exp()).ln();
                ln_normal(ln_travel - sum, model.travel.powi(2) * (1.0 + 1.0 / count.min(COUNTS)))
            } else {
                -(2.5_f64.ln())
            };
        }
        self.see(visit, arrival);
        self.at = Some(arrival);
    }

    /// The dart of the reported exit, to which the robot came by `at`.
    pub fn reported(&self, visit: &Visit, at: usize) -> Option<usize> {
        let bearing = visit.exit?;
        if bearing == 0.0 {
            return Some(at);
        }
        let target = self.ways[at].bearing + bearing;
        let off = |way: &usize| difference(target, self.ways[*way].bearing).abs();
        let ways = &self.rotation.ways[self.vertex(at)];
        ways.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b))).filter(|way| off(way) <= SAME_WAY)
    }

    /// The dart by which the robot came to the newest place; `None` at a place that is none.
    pub fn at(&self) -> Option<usize> {
        self.at
    }

    /// Whether the other end of a dart is known.
    pub fn is_driven(&self, dart: usize) -> bool {
        self.rotation.partner[dart].is_some()
    }

    /// Whether two darts are ways of one vertex.
    pub fn are_ways_of_one(&self, a: usize, b: usize) -> bool {
        b < self.darts() && self.vertex(a) == self.vertex(b)
    }

    /// The edge on which the robot is after a place that is none, as a dart.
    pub fn edge(&self) -> Option<usize> {
        self.on.map(|(edge, _)| edge)
    }

    /// Drives to the next place: by the way `exit` to the way `arrival`, both numbered in the order in which they were seen first.
    /// An exit that no visit has shown has the next number.
    pub fn drive(&mut self, model: Model, visit: &Visit, exit: Option<usize>, arrival: usize) {
        let is_unseen = exit == Some(self.darts());
        // The travel time from a place that is none is not that of the edge.
        let is_timed = self.on.take().is_none();
        if let (Some(exit), Some(at)) = (exit, self.at) {
            self.ln_rest += self.ln_exit(model, visit, at, exit);
            if is_unseen {
                let vertex = self.vertex(at);
                let bearing = visit.exit.expect("a way that no visit has shown has a bearing in tests");
                let way = self.add_way(vertex, self.ways[at].bearing + bearing);
                self.ways[way].seen = 1.0;
            }
        }
        let is_new = arrival == self.darts();
        if exit.is_none() && !is_new {
            self.ln_rest -= (self.darts() as f64).ln();
        }
        if is_new {
            let vertices = self.labels.len() as f64;
            self.rotation.ways.push(Vec::new());
            self.labels.push(Vec::new());
            self.looks.push(0.0);
            self.ln_rest += (vertices + 1.0).ln();
            if exit.is_none() && vertices > 0.0 {
                self.ln_rest += LN_PART;
            }
            if let Some(others) = &visit.others {
                self.ln_rest -= 7_f64.ln() + others.len() as f64 * (TAU.ln() - self.ln_unseen(model, 0.0));
            }
        } else {
            self.ln_rest += self.ln_ways(model, visit, arrival);
        }
        if let Some(exit) = exit {
            self.ln_rest += self.travel_and_closure(model, visit, (exit, is_unseen), arrival, is_new);
        }
        if is_new {
            let vertex = self.labels.len() - 1;
            self.add_way(vertex, 0.0);
        }
        if let Some(exit) = exit {
            self.rotation.partner[exit] = Some(arrival);
            self.rotation.partner[arrival] = Some(exit);
            if let Some(ln_travel) = visit.ln_travel.filter(|_| is_timed) {
                self.ways[exit.min(arrival)].ln_travels.push(ln_travel);
            }
        }
        self.see(visit, arrival);
        self.at = Some(arrival);
    }

    fn ln_exit(&self, model: Model, visit: &Visit, at: usize, exit: usize) -> f64 {
        let degree = self.rotation.ways[self.vertex(at)].len() as f64;
        if visit.exit.is_none() {
            return -degree.ln();
        }
        let reported = self.reported(visit, at);
        match reported {
            None if exit == self.darts() => {
                (1.0 - model.wrong_exit).ln() - (degree + 1.0).ln() + self.ln_unseen(model, self.looks[self.vertex(at)])
            }
            Some(way) if way == exit => (1.0 - model.wrong_exit).ln() - degree.ln(),
            _ => (model.wrong_exit / (degree - 1.0).max(1.0)).ln() - degree.ln(),
        }
    }

    fn travel_and_closure(
        &self,
        model: Model,
        visit: &Visit,
        (exit, is_unseen): (usize, bool),
        arrival: usize,
        is_new: bool,
    ) -> f64 {
        let known = if is_new { &[][..] } else { &self.ways[exit.min(arrival)].ln_travels[..] };
        let is_driven = self.rotation.partner[exit].is_some();
        let ln_travel = match visit.ln_travel {
            None => 0.0,
            Some(ln_travel) if is_driven && !known.is_empty() => {
                let count = known.len() as f64;
                let mean = known.iter().sum::<f64>() / count;
                ln_normal(ln_travel - mean, model.travel.powi(2) * (1.0 + 1.0 / count.min(COUNTS)))
            }
            Some(_) => -(2.5_f64.ln()),
        };
        if is_new || is_driven {
            return ln_travel;
        }
        let frontiers =
            self.rotation.partner.iter().filter(|partner| partner.is_none()).count() - usize::from(is_unseen);
        let mut closed = self.rotation.clone();
        closed.partner[exit] = Some(arrival);
        closed.partner[arrival] = Some(exit);
        let connected = if closed.components() < self.rotation.components() { -LN_PART } else { 0.0 };
        let raised = closed.genus() as f64 - self.rotation.genus() as f64;
        // Where an unseen exit lies among the ways is not certain.
        let raised = if is_unseen { 0.0 } else { raised };
        ln_travel - (frontiers as f64).ln() + raised * LN_GENUS + connected
    }

    /// ln P that no visit of some has shown a way.
    fn ln_unseen(&self, model: Model, looks: f64) -> f64 {
        (looks * model.missed_way.ln()).max(model.false_way.ln())
    }

    /// Which way each of the others seen is, and how far it is off; the closest first.
    fn identify(&self, others: &[f64], arrival: usize) -> Vec<Option<(usize, f64)>> {
        let mut pairs: Vec<(f64, usize, usize, f64)> = Vec::new();
        for (slot, bearing) in others.iter().enumerate() {
            for &way in self.rotation.ways[self.vertex(arrival)].iter().filter(|&&way| way != arrival) {
                let off = difference(self.ways[arrival].bearing + bearing, self.ways[way].bearing);
                pairs.push((off.abs(), slot, way, off));
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut found: Vec<Option<(usize, f64)>> = vec![None; others.len()];
        for (distance, slot, way, off) in pairs {
            let is_taken = found.iter().flatten().any(|&(taken, _)| taken == way);
            if distance <= SAME_WAY && found[slot].is_none() && !is_taken {
                found[slot] = Some((way, off));
            }
        }
        found
    }

    /// ln P of the ways seen. The offset of the way that the robot came by from its mean bearing is integrated out.
    fn ln_ways(&self, model: Model, visit: &Visit, arrival: usize) -> f64 {
        let Some(others) = &visit.others else { return 0.0 };
        let vertex = self.vertex(arrival);
        let looks = self.looks[vertex];
        let found = self.identify(others, arrival);
        let prior = |way: usize| if self.ways[way].seen <= 1.0 { PRIOR_VISITS[0] } else { PRIOR_VISITS[1] };
        let mut sum = 0.0;
        let mut offs: Vec<(f64, f64)> = Vec::new();
        for seen in &found {
            let Some((way, off)) = *seen else {
                sum += self.ln_unseen(model, looks) - TAU.ln();
                continue;
            };
            let (seen, prior) = (self.ways[way].seen, prior(way));
            if seen == 0.0 {
                sum += self.ln_unseen(model, looks) - TAU.ln();
                continue;
            }
            sum += ((seen.min(looks) + prior * (1.0 - model.missed_way)) / (looks.max(seen) + prior)).ln();
            offs.push((off, model.bearing.powi(2) * (1.0 + 1.0 / seen.min(COUNTS))));
        }
        for &way in &self.rotation.ways[vertex] {
            if way != arrival && found.iter().flatten().all(|&(seen, _)| seen != way) {
                let (seen, prior) = (self.ways[way].seen, prior(way));
                if seen == 0.0 {
                    continue;
                }
                sum += ((looks - seen).max(0.0) + prior * model.missed_way).ln() - (looks.max(seen) + prior).ln();
            }
        }
        if self.ways[arrival].seen == 0.0 {
            // No visit has shown it, and any bearing is possible.
            sum += looks * model.missed_way.ln();
            return if looks == 0.0 || offs.is_empty() { sum } else { sum - TAU.ln() + integral(&offs, None) };
        }
        sum + integral(&offs, Some(model.bearing.powi(2) / self.ways[arrival].seen))
    }

    fn see(&mut self, visit: &Visit, arrival: usize) {
        let vertex = self.vertex(arrival);
        self.labels[vertex].push(visit.label);
        let Some(others) = &visit.others else {
            self.ways[arrival].seen += 1.0;
            return;
        };
        self.looks[vertex] += 1.0;
        let found = self.identify(others, arrival);
        let (mut sum, mut weight) = (0.0, self.ways[arrival].seen);
        for &(way, off) in found.iter().flatten().filter(|&&(way, _)| self.ways[way].seen > 0.0) {
            let share = self.ways[way].seen / (self.ways[way].seen + 1.0);
            sum += share * off;
            weight += share;
        }
        let off_of_arrival = sum / weight.max(1.0);
        let base = self.ways[arrival].bearing - off_of_arrival;
        self.ways[arrival].bearing = base.rem_euclid(TAU);
        self.ways[arrival].seen += 1.0;
        for (bearing, seen) in others.iter().zip(found) {
            let way = match seen {
                Some((way, off)) => {
                    let held = &mut self.ways[way];
                    held.bearing = (held.bearing + (off - off_of_arrival) / (held.seen + 1.0)).rem_euclid(TAU);
                    way
                }
                None => self.add_way(vertex, base + bearing),
            };
            self.ways[way].seen += 1.0;
        }
        self.sort(vertex);
    }
}

/// ln ∫ N(d; 0, `variance`) Π N(off − d; its variance) dd, by the trapezoidal rule; without a variance the first factor is 1.
fn integral(offs: &[(f64, f64)], variance: Option<f64>) -> f64 {
    if offs.is_empty() {
        return 0.0;
    }
    let step = 1e-3;
    let prior = |d: f64| variance.map_or(0.0, |variance| ln_normal(d, variance));
    let ln_term = |d: f64| prior(d) + offs.iter().map(|&(off, of)| ln_normal(off - d, of)).sum::<f64>();
    let terms: Vec<f64> = (-1500..=1500).map(|index| ln_term(f64::from(index) * step)).collect();
    let most = terms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most + (terms.iter().map(|term| (term - most).exp()).sum::<f64>() * step).ln()
}
