//! The obstacles that a place detector can distinguish at a point: the nearest points of walls in separate bearings.

use std::f64::consts::TAU;

use super::walls::{Segment, Walls, point};
use super::{Limits, Point};

/// Obstacles that must be apart for a meet point.
const APART: usize = 3;
/// Rays for the range between obstacles.
const RAYS: usize = 72;

/// An obstacle: a local minimum of range over bearing.
#[derive(Clone, Copy, Debug)]
struct Obstacle {
    range_mm: f64,
    bearing_rad: f64,
}

/// The obstacles around a point.
pub(super) struct Obstacles<'a> {
    walls: &'a Walls,
    at: Point,
    limits: &'a Limits,
    /// The nearest first.
    found: Vec<Obstacle>,
}

impl<'a> Obstacles<'a> {
    /// The obstacles in sight within a range.
    pub(super) fn around(walls: &'a Walls, at: Point, range_mm: f64, limits: &'a Limits) -> Self {
        let mut near: Vec<&Segment> = walls.segments_near(at, range_mm).collect();
        near.sort_unstable();
        near.dedup();
        let closest: Vec<(&Segment, Point, f64)> = near
            .into_iter()
            .map(|segment| (segment, segment.closest(at)))
            .map(|(segment, closest)| (segment, closest, closest.distance_mm(at)))
            .filter(|(_, _, distance_mm)| *distance_mm <= range_mm)
            .collect();
        let mut found: Vec<Obstacle> = Vec::new();
        for (_, nearest, distance_mm) in &closest {
            // A corner is no minimum when a wall leads from it to a nearer point.
            let leads_nearer = |(segment, _, other_mm): &(&Segment, Point, f64)| {
                (point(segment.from) == *nearest || point(segment.to) == *nearest) && *other_mm < distance_mm - 1e-6
            };
            if !closest.iter().any(leads_nearer) && walls.is_in_sight(at, *nearest) {
                found.push(Obstacle { range_mm: *distance_mm, bearing_rad: at.direction_to(*nearest) });
            }
        }
        found.sort_by(|one, other| {
            one.range_mm.total_cmp(&other.range_mm).then(one.bearing_rad.total_cmp(&other.bearing_rad))
        });
        Self { walls, at, limits, found }
    }

    /// How much farther the third of the obstacles that are apart is than the nearest of all, in millimetres; `None` when there are
    /// no three.
    pub(super) fn spread_mm(&self) -> Option<f64> {
        let nearest_mm = self.found.first()?.range_mm;
        let mut profile = None;
        let enough = (APART..=self.found.len()).find(|count| {
            let mut round = self.found[..*count].to_vec();
            round.sort_by(|one, other| one.bearing_rad.total_cmp(&other.bearing_rad));
            (0..round.len()).any(|first| self.are_apart(&round, first, &mut profile))
        })?;
        Some(self.found[enough - 1].range_mm - nearest_mm)
    }

    /// Whether three of some obstacles in the order of their bearings are apart, the first of them given.
    fn are_apart(&self, round: &[Obstacle], first: usize, profile: &mut Option<[f64; RAYS]>) -> bool {
        let from = round[first];
        let (mut last, mut count) = (from, 1);
        for step in 1..round.len() {
            let turns = ((first + step) / round.len()) as f64;
            let next = round[(first + step) % round.len()];
            let next = Obstacle { bearing_rad: next.bearing_rad + turns * TAU, ..next };
            let again = Obstacle { bearing_rad: from.bearing_rad + TAU, ..from };
            if self.is_pair_apart(last, next, profile) && self.is_pair_apart(next, again, profile) {
                (last, count) = (next, count + 1);
            }
        }
        count >= APART
    }

    /// Whether two obstacles are apart, the second counter-clockwise of the first.
    fn is_pair_apart(&self, one: Obstacle, other: Obstacle, profile: &mut Option<[f64; RAYS]>) -> bool {
        // Obstacles exactly as far apart as the limit are apart.
        let apart_rad = other.bearing_rad - one.bearing_rad + 1e-6;
        if apart_rad >= self.limits.separation_rad {
            return true;
        }
        if apart_rad < self.limits.separation_rad - self.limits.cone_half_angle_rad {
            return false;
        }
        // As far as a corner between two walls whose normals are the limit apart.
        let open_mm = one.range_mm.max(other.range_mm) / (self.limits.separation_rad / 2.0).cos();
        let profile = profile.get_or_insert_with(|| self.profile());
        let ray = |bearing_rad: f64| bearing_rad / TAU * RAYS as f64;
        let between = ray(one.bearing_rad).ceil() as i64..=ray(other.bearing_rad).floor() as i64;
        between.into_iter().any(|ray| profile[ray.rem_euclid(RAYS as i64) as usize] >= open_mm)
    }

    /// The range in every direction, in millimetres.
    fn profile(&self) -> [f64; RAYS] {
        let far_mm = 2.0 * self.found.last().map_or(0.0, |farthest| farthest.range_mm);
        std::array::from_fn(|ray| self.walls.cast(self.at, ray as f64 / RAYS as f64 * TAU, far_mm).range_mm)
    }
}
