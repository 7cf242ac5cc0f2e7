//! Compares the detected places with the visited true nodes.

use std::fmt;

use toposlam::place::Place;

use super::{TrueMap, Truth};

/// A place farther than this from every true node is a phantom, in millimetres.
const MATCH_MM: f64 = 500.0;
/// Largest offset between a visit and a place that belongs to it, in frames.
const MATCH_FRAMES: u32 = 30;

/// A robot that drove a way is at most this far from it, at each quarter of the time, in millimetres. Through a hall the robot may drive along
/// the walls: there it is at most as far from the way as the walls are.
const ON_WAY_MM: f64 = 1500.0;

/// One visit to a true node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Visit {
    pub(super) node: usize,
    first_frame: u32,
    last_frame: u32,
}

impl Visit {
    /// Number of frames between the visit and a frame.
    fn frames_off(&self, frame_index: u32) -> u32 {
        self.first_frame.saturating_sub(frame_index).max(frame_index.saturating_sub(self.last_frame))
    }
}

/// A detected place and the true node it was detected at, if any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// The place that the detector reported.
    pub place: Place,
    /// Position of the robot in the frame of the place.
    pub position: super::Point,
    /// The true node nearby; `None` for a phantom.
    pub node: Option<usize>,
}

/// A log of a drive: the visited nodes and the detected places. Memory grows by some 40 bytes per frame.
pub struct GroundTruth {
    pub(super) map: TrueMap,
    pub(super) truths: Vec<Truth>,
    pub(super) visits: Vec<Visit>,
    detections: Vec<Detection>,
}

/// Comparison of the detected places with the visits.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Completed visits to true nodes.
    pub visits: usize,
    /// Visits with at least one detected place.
    pub found: usize,
    /// Visits without a detected place.
    pub missed: usize,
    /// Places after the first one of the same visit.
    pub doubled: usize,
    /// Places away from every true node.
    pub phantom: usize,
    /// Detected minus true radius of every found place, in millimetres, in ascending order.
    pub radius_errors_mm: Vec<f64>,
    /// Number of found places with a reported degree, and number of those whose degree is right.
    pub degrees: (usize, usize),
    /// Visits and misses of each true node.
    pub nodes: Vec<(usize, usize)>,
}

impl GroundTruth {
    /// An empty log of a drive on a map.
    pub fn new(map: &TrueMap) -> Self {
        Self { map: map.clone(), truths: Vec::new(), visits: Vec::new(), detections: Vec::new() }
    }

    /// Logs the pose of the robot. Call it once for every frame, before logging a place of that frame.
    pub fn drive(&mut self, truth: &Truth) {
        self.truths.push(*truth);
        let Some(node) = truth.node else { return };
        match self.visits.last_mut() {
            Some(visit) if visit.node == node && visit.last_frame + 2 >= truth.frame_index => {
                visit.last_frame = truth.frame_index;
            }
            _ => {
                self.visits.push(Visit { node, first_frame: truth.frame_index, last_frame: truth.frame_index });
            }
        }
    }

    /// Logs a detected place and assigns it to a true node.
    pub fn detect(&mut self, place: &Place) -> Detection {
        let truth = self.truths.get(place.frame_index as usize).or(self.truths.last());
        let position = truth.map(|truth| truth.pose.position).unwrap_or_default();
        let near = self.map.nearest_node(position).filter(|(_, distance_mm)| *distance_mm <= MATCH_MM);
        let detection = Detection { place: *place, position, node: near.map(|(node, _)| node) };
        self.detections.push(detection);
        detection
    }

    /// The true map.
    pub const fn true_map(&self) -> &TrueMap {
        &self.map
    }

    /// For each visit but the first the way by which the robot left the node before: its edge, and whether the edge was driven
    /// from its second node. `None` where it did not drive along an edge.
    pub fn driven(&self) -> Vec<Option<(usize, bool)>> {
        self.visits.windows(2).map(|visits| self.driven_between(visits[0], visits[1])).collect()
    }

    fn driven_between(&self, from: Visit, to: Visit) -> Option<(usize, bool)> {
        let (first, last) = (from.last_frame as usize, to.first_frame as usize);
        let position = |share: f64| {
            let frame = first + ((last - first) as f64 * share) as usize;
            self.truths.get(frame).map(|truth| truth.pose.position)
        };
        let off_mm = |edge: usize, is_reversed: bool| {
            let off_mm = |share: f64| {
                let on_way = self.map.edges[edge].point_at(if is_reversed { 1.0 - share } else { share });
                position(share).map_or(f64::MAX, |position| position.distance_mm(on_way))
            };
            [0.25, 0.5, 0.75].map(off_mm).into_iter().fold(0.0, f64::max)
        };
        let ways = (0..self.map.edges.len()).flat_map(|edge| [(edge, false), (edge, true)]);
        let joins = |&(edge, is_reversed): &(usize, bool)| {
            let nodes = self.map.edges[edge].nodes;
            nodes == if is_reversed { [to.node, from.node] } else { [from.node, to.node] }
        };
        let offs = ways.filter(joins).map(|(edge, is_reversed)| (off_mm(edge, is_reversed), (edge, is_reversed)));
        let nearest = offs.min_by(|one, other| one.0.total_cmp(&other.0));
        let is_on_way =
            |&(off_mm, (edge, _)): &(f64, (usize, bool))| off_mm <= ON_WAY_MM.max(self.map.edges[edge].room_mm);
        nearest.filter(is_on_way).map(|(_, way)| way)
    }

    /// The visit that each detected place belongs to; `None` for a phantom.
    pub(super) fn visits_of_places(&self) -> Vec<Option<usize>> {
        let visit_of = |detection: &Detection| {
            let frames_off = |visit: &Visit| visit.frames_off(detection.place.frame_index);
            let begun = self.visits.iter().enumerate().filter(|(_, visit)| Some(visit.node) == detection.node);
            let nearest = begun.min_by_key(|(_, visit)| frames_off(visit));
            nearest.filter(|(_, visit)| frames_off(visit) <= MATCH_FRAMES).map(|(index, _)| index)
        };
        self.detections.iter().map(visit_of).collect()
    }

    /// Number of visits to true nodes that have begun so far.
    pub fn visits(&self) -> usize {
        self.visits.len()
    }

    /// Every detected place so far.
    pub fn detections(&self) -> &[Detection] {
        &self.detections
    }

    /// Compares the places with the visits. The last visit is left out, because its place may not be reported yet.
    pub fn report(&self) -> Report {
        let completed = self.visits.len().saturating_sub(1);
        let mut places_of = vec![0usize; self.visits.len()];
        let mut report = Report {
            visits: completed,
            found: 0,
            missed: 0,
            doubled: 0,
            phantom: 0,
            radius_errors_mm: Vec::new(),
            degrees: (0, 0),
            nodes: vec![(0, 0); self.map.nodes.len()],
        };
        for (Detection { place, .. }, index) in self.detections.iter().zip(self.visits_of_places()) {
            let Some(index) = index else {
                report.phantom += 1;
                continue;
            };
            places_of[index] += 1;
            let truth = &self.map.nodes[self.visits[index].node];
            report.radius_errors_mm.push(f64::from(place.fingerprint.radius_mm()) - truth.radius_mm);
            if let Some(degree) = place.degree {
                report.degrees.0 += 1;
                report.degrees.1 += usize::from(usize::from(degree) == truth.degree);
            }
        }
        for (visit, places) in self.visits.iter().zip(places_of).take(completed) {
            let node = &mut report.nodes[visit.node];
            node.0 += 1;
            node.1 += usize::from(places == 0);
            report.missed += usize::from(places == 0);
            report.found += usize::from(places > 0);
            report.doubled += places.saturating_sub(1);
        }
        report.radius_errors_mm.sort_by(f64::total_cmp);
        report
    }
}

impl Report {
    /// Median of the absolute radius error, in millimetres.
    pub fn radius_error_median_mm(&self) -> f64 {
        self.radius_error_mm(0.5)
    }

    /// 90th percentile of the absolute radius error, in millimetres.
    pub fn radius_error_p90_mm(&self) -> f64 {
        self.radius_error_mm(0.9)
    }

    fn radius_error_mm(&self, share: f64) -> f64 {
        let mut sizes: Vec<f64> = self.radius_errors_mm.iter().map(|error_mm| error_mm.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let rank = (share * sizes.len() as f64) as usize;
        sizes.get(rank.min(sizes.len().saturating_sub(1))).copied().unwrap_or(0.0)
    }

    /// Mean and standard deviation of the radius errors, in millimetres.
    pub fn radius_error_mean_and_sd_mm(&self) -> (f64, f64) {
        let count = self.radius_errors_mm.len().max(1) as f64;
        let mean = self.radius_errors_mm.iter().sum::<f64>() / count;
        let variance = self.radius_errors_mm.iter().map(|error_mm| (error_mm - mean).powi(2)).sum::<f64>() / count;
        (mean, variance.sqrt())
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mean, sd) = self.radius_error_mean_and_sd_mm();
        writeln!(
            f,
            "visits {}: found {}, missed {}, doubled {}, phantom {}",
            self.visits, self.found, self.missed, self.doubled, self.phantom
        )?;
        writeln!(
            f,
            "radius error: median {:.0} mm, 90 % within {:.0} mm, mean {mean:+.0} mm, standard deviation {sd:.0} mm",
            self.radius_error_median_mm(),
            self.radius_error_p90_mm()
        )?;
        write!(f, "degree: reported for {} places, right for {}", self.degrees.0, self.degrees.1)
    }
}
