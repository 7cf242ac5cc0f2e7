//! The evidence for and against an alignment: log-likelihood ratios of what both maps report of the same thing, against what
//! they would report of two things of the same building.

use std::fmt;

use toposlam::wire::{Way, WayId};

use crate::topology::TopologicalMap;

pub(super) const TURN_MRAD: f64 = 6283.0;
/// The standard deviation of the difference of two mean radii of one place.
const RADIUS_SD_MM: f64 = 60.0;
/// The standard deviation of the difference of two logarithms of the mean travel time of one edge.
const LN_TRAVEL_SD: f64 = 0.15;
/// Two ways with a smaller difference of bearings can be the same.
const LIKE_MRAD: f64 = 450.0;
/// The share of places whose radius or travel time one of the maps has wrong.
const WRONG: f64 = 0.02;
/// The share of places of which both maps have all ways.
const SAME_WAYS: f64 = 0.9;
/// The weight of each further way that only one map has.
const LN_MISSING: f64 = -1.2;
/// The weight of a contradiction: the same way leads to two places.
const LN_CONTRADICTION: f64 = -8.0;

/// Evidence of an alignment in nats: positive is for it, negative against it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// The radii of the common vertices.
    pub labels: f64,
    /// Number and bearings of their ways.
    pub ways: f64,
    /// The travel times of the common edges.
    pub travel: f64,
    /// Loops of edges that close in both maps.
    pub loops: f64,
    /// Number of edges that lead to different vertices.
    pub contradictions: u32,
    /// Number of radii and travel times that both maps have.
    measured: u32,
    /// The sum of the squares of their differences in standard deviations.
    squares: f64,
}

impl Evidence {
    /// The sum.
    pub fn total(&self) -> f64 {
        self.labels + self.ways + self.travel + self.loops + LN_CONTRADICTION * f64::from(self.contradictions)
    }

    /// The root mean square of the differences of radii and travel times, in standard deviations; 0 without any.
    pub fn misfit(&self) -> f64 {
        (self.squares / f64::from(self.measured.max(1))).sqrt()
    }

    pub(super) fn add_label(&mut self, radius_mm: u16, other_mm: u16, image: u8, background: &Background) {
        self.labels += background.label_nats(radius_mm, other_mm, image);
        self.measure((f64::from(other_mm) - f64::from(radius_mm)) / RADIUS_SD_MM);
    }

    pub(super) fn add_travel(&mut self, frames: u16, other_frames: u16, background: &Background) {
        self.travel += background.travel_nats(frames, other_frames);
        self.measure((ln_frames(other_frames) - ln_frames(frames)) / LN_TRAVEL_SD);
    }

    fn measure(&mut self, deviations: f64) {
        self.measured += 1;
        self.squares += deviations * deviations;
    }
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { labels, ways, travel, loops, contradictions, .. } = self;
        write!(
            f,
            "{:.1} nats: radii {labels:+.1}, ways {ways:+.1}, travel times {travel:+.1}, loops {loops:+.1}, \
             contradictions {contradictions}, misfit {:.2}",
            self.total(),
            self.misfit(),
        )
    }
}

/// What two maps of the building have: how often unrelated places and edges report what the second map does.
pub(super) struct Background {
    ln_travel: Vec<f64>,
    /// For each vertex of the second map, the density of its radius.
    radius: Vec<f64>,
    /// For each way of the second map, the share of all ways from which a vertex has ways at the same bearings.
    shape: Vec<Vec<f64>>,
    vertices: f64,
}

impl Background {
    pub(super) fn of(first: &TopologicalMap, second: &TopologicalMap) -> Self {
        let maps = [first, second];
        let ways = || maps.into_iter().flat_map(|map| map.all_ways().map(|(_, way)| way));
        let labels = maps.iter().flat_map(|map| &map.vertices);
        let radii_mm: Vec<f64> = labels.map(|vertex| vertex.radius_mm.into()).collect();
        let vertices = || maps.into_iter().flat_map(|map| &map.ways);
        let shapes: Vec<Vec<f64>> =
            vertices().flat_map(|ways| ways.iter().map(|way| shape(ways, way.bearing_mrad))).collect();
        let share =
            |own: &Vec<f64>| shapes.iter().filter(|shape| is_like(shape, own)).count() as f64 / shapes.len() as f64;
        let of_vertex = |ways: &Vec<Way>| ways.iter().map(|way| share(&shape(ways, way.bearing_mrad))).collect();
        Self {
            ln_travel: ways().filter_map(|way| way.travel_frames).map(ln_frames).collect(),
            radius: second
                .vertices
                .iter()
                .map(|vertex| mean_density(vertex.radius_mm.into(), RADIUS_SD_MM, &radii_mm))
                .collect(),
            shape: second.ways.iter().map(of_vertex).collect(),
            vertices: first.vertices.len().min(second.vertices.len()) as f64,
        }
    }

    /// The evidence of a radius of the first map and that of a vertex of the second.
    fn label_nats(&self, radius_mm: u16, other_mm: u16, image: u8) -> f64 {
        let same = density(f64::from(other_mm) - f64::from(radius_mm), RADIUS_SD_MM);
        nats(same, self.radius[usize::from(image)], 3000.0)
    }

    fn travel_nats(&self, frames: u16, other_frames: u16) -> f64 {
        let (ln, other_ln) = (ln_frames(frames), ln_frames(other_frames));
        nats(density(other_ln - ln, LN_TRAVEL_SD), mean_density(other_ln, LN_TRAVEL_SD, &self.ln_travel), 4.0)
    }

    /// The evidence of the ways of a vertex, seen from one way of the second map, of which some are missing in one of the maps.
    pub(super) fn shape_nats(&self, other: WayId, missing: usize) -> f64 {
        if missing > 0 {
            return (1.0 - SAME_WAYS).ln() + LN_MISSING * (missing - 1) as f64;
        }
        SAME_WAYS.ln() - self.shape[usize::from(other.vertex)][usize::from(other.way)].ln()
    }

    /// The evidence of an edge that closes a loop in both maps.
    pub(super) fn loop_nats(&self) -> f64 {
        self.vertices.ln()
    }
}

fn ln_frames(frames: u16) -> f64 {
    f64::from(frames.max(1)).ln()
}

fn density(off: f64, sd: f64) -> f64 {
    (-0.5 * (off / sd).powi(2)).exp() / (sd * (2.0 * std::f64::consts::PI).sqrt())
}

fn mean_density(value: f64, sd: f64, all: &[f64]) -> f64 {
    all.iter().map(|it| density(value - it, sd)).sum::<f64>() / all.len().max(1) as f64
}

/// The log ratio of two densities of a value, one of a second measurement of the same thing. Some values are wrong, and lie
/// anywhere within a range of `width`.
fn nats(same: f64, unrelated: f64, width: f64) -> f64 {
    let robust = |density: f64| (1.0 - WRONG) * density + WRONG / width;
    (robust(same) / robust(unrelated)).ln()
}

/// The bearing of a way from another one, −half a turn to half a turn.
pub(super) fn bearing_between(from_mrad: f64, to_mrad: f64) -> f64 {
    (to_mrad - from_mrad + TURN_MRAD / 2.0).rem_euclid(TURN_MRAD) - TURN_MRAD / 2.0
}

fn shape(ways: &[Way], origin_mrad: u16) -> Vec<f64> {
    ways.iter().map(|way| bearing_between(origin_mrad.into(), way.bearing_mrad.into())).collect()
}

fn is_like(shape: &[f64], other: &[f64]) -> bool {
    shape.len() == other.len() && pairs(shape, other).len() == shape.len()
}

/// The pairs of bearings that can be the same, the closest first; each bearing is in one pair at most.
fn pairs(shape: &[f64], other: &[f64]) -> Vec<(usize, usize)> {
    let mut close: Vec<(f64, usize, usize)> = Vec::new();
    for (a, &bearing) in shape.iter().enumerate() {
        close.extend(other.iter().enumerate().map(|(b, &to)| (bearing_between(bearing, to).abs(), a, b)));
    }
    close.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (off_mrad, a, b) in close {
        if off_mrad <= LIKE_MRAD && pairs.iter().all(|&(x, y)| x != a && y != b) {
            pairs.push((a, b));
        }
    }
    pairs
}

/// The ways of two vertices that have the same bearings from one way of each, by their positions.
pub(super) fn like_bearings(ways: &[Way], origin_mrad: u16, others: &[Way], other_mrad: u16) -> Vec<(usize, usize)> {
    pairs(&shape(ways, origin_mrad), &shape(others, other_mrad))
}
