//! Compares the hints of the drive with the ground truth: exits, ways, bearings and travel times.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use toposlam::{Exit, Passage, Ways};

use super::ray_casting::wrapped;
use super::{GroundTruth, TrueWay};

/// A bearing that was reported belongs to the way within this angle, in radians.
const SAME_WAY_RAD: f64 = 0.55;
/// The same while only the true bearings are known: those of the Voronoi graph, not those of the openings.
const NEAR_WAY_RAD: f64 = 0.9;
/// Rounds of the fit of the bearings.
const FIT_ROUNDS: usize = 20;

/// The hints of one detected place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReportedHints {
    /// How the robot drove to the place.
    pub passage: Passage,
    /// The ways that it saw there.
    pub ways: Option<Ways>,
}

impl ReportedHints {
    /// The hints in numbers: the bearings of the ways other than the one the robot came by and the exit, in milliradians from that
    /// way, and the travel time, 0 if it is unknown.
    pub fn recorded(&self) -> (Option<Vec<u16>>, Option<u16>, u16) {
        let milliradians = |bearing: u8| ((u32::from(bearing) * 6283 + 128) / 256) as u16;
        let others = self.ways.and_then(|ways| Some(ways.others()?.iter().copied().map(milliradians).collect()));
        let exit = match self.passage.exit {
            None | Some(Exit::On) => None,
            Some(Exit::Back) => Some(0),
            Some(Exit::Bearing(bearing)) => Some(milliradians(bearing)),
        };
        (others, exit, self.passage.travel_frames.unwrap_or(0))
    }
}

/// Counts of right, wrong and missing hints. Places count where the robot drove along one edge from the place before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HintReport {
    /// Number of exits that were reported, of wrong ones among them, and of exits that were not reported.
    pub exits: (usize, usize, usize),
    /// Number of places whose ways were reported, and of places whose ways were not.
    pub places: (usize, usize),
    /// Number of true ways, other than the one the robot came by, at places whose ways were reported; of those that were missed; and
    /// of ways that were reported and do not exist.
    pub ways: (usize, usize, usize),
    /// Reported bearing of each way that was found minus its mean over all places at the node, in radians.
    pub bearing_errors_rad: Vec<f64>,
    /// ln of each travel time minus the mean of its edge. Edges with one passage do not count.
    pub travel_errors: Vec<f64>,
    /// The same with the mean of each direction of an edge.
    pub one_way_travel_errors: Vec<f64>,
    /// Number of travel times that were not reported.
    pub unknown_travels: usize,
}

impl HintReport {
    /// Adds the counts of another report.
    pub fn add(&mut self, other: &Self) {
        self.exits = (self.exits.0 + other.exits.0, self.exits.1 + other.exits.1, self.exits.2 + other.exits.2);
        self.places = (self.places.0 + other.places.0, self.places.1 + other.places.1);
        self.ways = (self.ways.0 + other.ways.0, self.ways.1 + other.ways.1, self.ways.2 + other.ways.2);
        self.bearing_errors_rad.extend(&other.bearing_errors_rad);
        self.travel_errors.extend(&other.travel_errors);
        self.one_way_travel_errors.extend(&other.one_way_travel_errors);
        self.unknown_travels += other.unknown_travels;
    }
}

impl GroundTruth {
    /// Compares the hints of all detected places, in their order, with the truth.
    pub fn hint_report(&self, reported: &[ReportedHints]) -> HintReport {
        let mut report = HintReport::default();
        let driven = self.driven();
        let visits = self.visits_of_places();
        let mut travels: BTreeMap<(usize, bool), Vec<f64>> = BTreeMap::new();
        let mut sightings: BTreeMap<usize, Vec<Sighting>> = BTreeMap::new();
        let mut exits = Vec::new();
        for (place, reported) in reported.iter().enumerate().skip(1) {
            let (Some(Some(before)), Some(Some(now))) = (visits.get(place - 1), visits.get(place)) else { continue };
            if *now != before + 1 {
                continue;
            }
            let Some(&Some((edge, is_reversed))) = driven.get(*before) else { continue };
            if let Some(frames) = reported.passage.travel_frames {
                travels.entry((edge, is_reversed)).or_default().push(f64::from(frames).ln());
            } else {
                report.unknown_travels += 1;
            }
            let arrival = self.map.way(edge, !is_reversed);
            if let Some(ways) = reported.ways {
                report.places.0 += 1;
                let others = ways.others().unwrap_or(&[]).iter();
                let seen: Vec<f64> = others.map(|&other| f64::from(other) / 256.0 * TAU).collect();
                let sighting = Sighting { arrival: arrival.dart(), seen_rad: seen };
                sightings.entry(self.visits[*now].node).or_default().push(sighting);
            } else {
                report.places.1 += 1;
            }
            // The exit is relative to the way by which the robot came to the place before.
            let Some(&Some((edge_before, reversed_before))) = before.checked_sub(1).and_then(|visit| driven.get(visit))
            else {
                continue;
            };
            let came_by = self.map.way(edge_before, !reversed_before);
            match reported.passage.exit {
                None | Some(Exit::On) => report.exits.2 += 1,
                Some(exit) => {
                    let binary = if let Exit::Bearing(binary) = exit { binary } else { 0 };
                    let bearing_rad = f64::from(binary) / 256.0 * TAU;
                    exits.push((self.visits[*before].node, came_by.dart(), bearing_rad, (edge, is_reversed)));
                }
            }
        }
        let mut bearings: BTreeMap<(usize, bool), f64> = BTreeMap::new();
        for (&node, sightings) in &sightings {
            bearings.extend(self.fitted_bearings(node, sightings));
        }
        for node in 0..self.map.nodes.len() {
            for way in self.map.ways(node) {
                bearings.entry(way.dart()).or_insert(way.bearing_rad);
            }
        }
        for (node, came_by, bearing_rad, taken) in exits {
            report.exits.0 += 1;
            let off_rad = |way: &TrueWay| wrapped(bearings[&way.dart()] - bearings[&came_by] - bearing_rad).abs();
            let ways = self.map.ways(node);
            let nearest = ways.iter().min_by(|one, other| off_rad(one).total_cmp(&off_rad(other)));
            report.exits.1 += usize::from(nearest.is_none_or(|nearest| nearest.dart() != taken));
        }
        for (&node, sightings) in &sightings {
            let ways = self.map.ways(node);
            for sighting in sightings {
                let matches = sighting.matches(&ways, &bearings, SAME_WAY_RAD);
                report.ways.0 += ways.len() - 1;
                report.ways.1 += ways.len() - 1 - matches.len();
                report.ways.2 += sighting.seen_rad.len() - matches.len();
                for (dart, seen_rad) in matches {
                    let expected_rad = bearings[&dart] - bearings[&sighting.arrival];
                    report.bearing_errors_rad.push(wrapped(seen_rad - expected_rad));
                }
            }
        }
        for edge in 0..self.map.edges.len() {
            let times = [false, true].map(|is_reversed| travels.remove(&(edge, is_reversed)).unwrap_or_default());
            times.iter().for_each(|times| report.one_way_travel_errors.extend(deviations(times)));
            report.travel_errors.extend(deviations(&times.concat()));
        }
        report
    }

    /// The bearings of the ways of a node that agree best with all sightings, up to a common rotation.
    fn fitted_bearings(&self, node: usize, sightings: &[Sighting]) -> BTreeMap<(usize, bool), f64> {
        let ways = self.map.ways(node);
        let mut bearings: BTreeMap<_, _> = ways.iter().map(|way| (way.dart(), way.bearing_rad)).collect();
        for _ in 0..FIT_ROUNDS {
            let mut corrections: BTreeMap<(usize, bool), Vec<f64>> = BTreeMap::new();
            for sighting in sightings {
                for (dart, seen_rad) in sighting.matches(&ways, &bearings, NEAR_WAY_RAD) {
                    let error_rad = wrapped(seen_rad - (bearings[&dart] - bearings[&sighting.arrival]));
                    corrections.entry(dart).or_default().push(0.5 * error_rad);
                    corrections.entry(sighting.arrival).or_default().push(-0.5 * error_rad);
                }
            }
            for (dart, corrections) in corrections {
                *bearings.entry(dart).or_default() += corrections.iter().sum::<f64>() / corrections.len() as f64;
            }
        }
        bearings
    }
}

/// The ways seen at one visit to a node.
struct Sighting {
    /// The way by which the robot came.
    arrival: (usize, bool),
    /// The bearings of the others relative to it.
    seen_rad: Vec<f64>,
}

impl Sighting {
    /// The ways that were seen, with their bearings relative to the arrival.
    fn matches(
        &self,
        ways: &[TrueWay],
        bearings: &BTreeMap<(usize, bool), f64>,
        within_rad: f64,
    ) -> Vec<((usize, bool), f64)> {
        let others: Vec<_> = ways.iter().map(TrueWay::dart).filter(|dart| *dart != self.arrival).collect();
        let off_rad =
            |dart: &(usize, bool), seen_rad: f64| wrapped(seen_rad - (bearings[dart] - bearings[&self.arrival])).abs();
        let mut pairs: Vec<(f64, (usize, bool), usize)> = Vec::new();
        for dart in &others {
            for (index, &seen_rad) in self.seen_rad.iter().enumerate() {
                pairs.push((off_rad(dart, seen_rad), *dart, index));
            }
        }
        pairs.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut matches: Vec<((usize, bool), usize)> = Vec::new();
        for (off_rad, dart, index) in pairs {
            if off_rad <= within_rad && matches.iter().all(|known| known.0 != dart && known.1 != index) {
                matches.push((dart, index));
            }
        }
        matches.into_iter().map(|(dart, index)| (dart, self.seen_rad[index])).collect()
    }
}

/// The differences of values from their mean, none for a single value.
fn deviations(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    if values.len() < 2 { Vec::new() } else { values.iter().map(|value| value - mean).collect() }
}
