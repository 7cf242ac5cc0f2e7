//! Simulates the readings of a ring of sonars in a floor plan by ray casting.

use std::f64::consts::{PI, TAU};

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use toposlam::ring::{Echo, RingFrame};

use super::Pose;
use super::plan::Plan;

/// Number of sonars of the simulated ring of the reference robot: evenly spaced and counter-clockwise, the first straight ahead.
pub const SONARS: usize = 16;
/// Number of rays of a ring. Overlapping cones share their rays.
const RAYS: usize = 96;

/// Cone, range and noise of the sonars.
///
/// A sonar measures the nearest reflector in its cone: a wall that is hit close to its normal, or a corner, convex (its
/// edge scatters) or concave (it reflects straight back).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SonarModel {
    /// Half the opening angle of a cone, in radians. Default 0.262 (15°).
    pub cone_half_angle_rad: f64,
    /// Smallest range that a sonar measures, in millimetres. Default 30 (SRF08).
    pub range_min_mm: f64,
    /// Largest range that a sonar measures, in millimetres. Default 6000 (SRF08).
    pub range_max_mm: f64,
    /// Standard deviation of a range, in millimetres. Default 15.
    pub range_sd_mm: f64,
    /// Probability of a missed echo, 0 to 1. Default 0.02.
    pub missed_share: f64,
    /// Largest angle of incidence at which a wall returns an echo, in radians. Default 0.436 (25°).
    pub specular_limit_rad: f64,
    /// Sonars that never answer, one bit for each. Default none.
    pub dead_sonars: u16,
}

impl Default for SonarModel {
    fn default() -> Self {
        Self {
            cone_half_angle_rad: 15f64.to_radians(),
            range_min_mm: 30.0,
            range_max_mm: 6000.0,
            range_sd_mm: 15.0,
            missed_share: 0.02,
            specular_limit_rad: 25f64.to_radians(),
            dead_sonars: 0,
        }
    }
}

/// Wraps an angle to −π to π.
pub(super) fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

/// What the ring hears of a floor plan.
pub(super) struct Scene {
    plan: Plan,
}

impl Scene {
    pub(super) fn new(plan: &Plan) -> Self {
        Self { plan: plan.clone() }
    }

    /// Simulates one reading of a ring. `SONARS` divides the number of rays.
    pub(super) fn frame<const SONARS: usize>(
        &self,
        pose: &Pose,
        model: &SonarModel,
        random: &mut impl Rng,
    ) -> RingFrame<SONARS> {
        const { assert!(RAYS.is_multiple_of(SONARS) && SONARS <= 16, "the sonars are on rays and have a bit each") };
        let mut heard_mm: [f64; SONARS] = self.walls(pose, model);
        self.hear_corners(pose, model, &mut heard_mm);
        let mut echoes = [Echo::Dead; SONARS];
        for (sonar, (echo, heard_mm)) in echoes.iter_mut().zip(heard_mm).enumerate() {
            // Drawn for every sonar, so that a dead one does not change the readings of the others.
            let noise_mm: f64 = StandardNormal.sample(random);
            let missed = random.random_bool(model.missed_share);
            let range_mm = (heard_mm + noise_mm * model.range_sd_mm).max(model.range_min_mm);
            if model.dead_sonars >> sonar & 1 == 1 {
                *echo = Echo::Dead;
            } else if missed || range_mm > model.range_max_mm {
                *echo = Echo::Silence;
            } else {
                *echo = Echo::Range { range_mm: range_mm.round() as u16 };
            }
        }
        RingFrame { echoes }
    }

    /// Range of the nearest wall that each sonar measures, in millimetres; infinite without an echo.
    fn walls<const SONARS: usize>(&self, pose: &Pose, model: &SonarModel) -> [f64; SONARS] {
        let spacing = TAU / RAYS as f64;
        let least_cosine = model.specular_limit_rad.cos();
        let rays: [f64; RAYS] = std::array::from_fn(|ray| {
            let direction = pose.heading_rad + ray as f64 * spacing;
            let hit = self.plan.walls().cast(pose.position, direction, model.range_max_mm);
            if hit.cosine_off_normal >= least_cosine { hit.range_mm } else { f64::INFINITY }
        });
        let half = ((model.cone_half_angle_rad / spacing) as usize).min(RAYS / 2);
        std::array::from_fn(|sonar| {
            let first = sonar * (RAYS / SONARS) + RAYS - half;
            (first..=first + 2 * half).map(|ray| rays[ray % RAYS]).fold(f64::INFINITY, f64::min)
        })
    }

    /// Adds the echoes of the visible corners in each cone.
    fn hear_corners<const SONARS: usize>(&self, pose: &Pose, model: &SonarModel, heard_mm: &mut [f64; SONARS]) {
        for corner in self.plan.walls().corners_near(pose.position, model.range_max_mm) {
            let range_mm = pose.position.distance_mm(corner);
            if range_mm > model.range_max_mm {
                continue;
            }
            let direction = pose.position.direction_to(corner);
            let mut in_sight = None;
            for (sonar, heard_mm) in heard_mm.iter_mut().enumerate() {
                let axis = pose.heading_rad + TAU * sonar as f64 / SONARS as f64;
                if range_mm < *heard_mm && wrapped(direction - axis).abs() <= model.cone_half_angle_rad {
                    let in_sight = in_sight.get_or_insert_with(|| self.plan.walls().is_in_sight(pose.position, corner));
                    if *in_sight {
                        *heard_mm = range_mm;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Point;
    use rand::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn closet() -> Scene {
        let row = ".".repeat(16);
        let rows = [row.as_str(); 7].join("\n");
        Scene::new(&Plan::parse(&format!("cell_mm 250\n{}S\n{rows}", ".".repeat(15))).unwrap())
    }

    #[test]
    fn a_ray_ends_at_the_first_wall() {
        let hit = closet().plan.walls().cast(Point::new(1000.0, 600.0), 0.3, 6000.0);
        assert!((hit.range_mm - 3000.0 / 0.3f64.cos()).abs() < 1e-6);
        assert!((hit.cosine_off_normal - 0.3f64.cos()).abs() < 1e-9);
    }

    #[test]
    fn perpendicular_walls_and_corners_return_echoes_and_oblique_walls_do_not() {
        let perfect = SonarModel { range_sd_mm: 0.0, missed_share: 0.0, ..SonarModel::default() };
        let pose = Pose { position: Point::new(3000.0, 1000.0), heading_rad: 0.0 };
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let frame: RingFrame<SONARS> = closet().frame(&pose, &perfect, &mut random);
        let heard = frame.echoes.map(|echo| echo.range_mm().unwrap_or(0));
        assert_eq!((heard[0], heard[4], heard[8], heard[12]), (1000, 1000, 3000, 1000));
        assert_eq!((heard[2], heard[14]), (1414, 1414));
        let dead = SonarModel { dead_sonars: 1 << 4, ..perfect };
        assert_eq!(closet().frame::<SONARS>(&pose, &dead, &mut random).echoes[4], Echo::Dead);
        let missed = SonarModel { missed_share: 1.0, ..perfect };
        assert_eq!(closet().frame(&pose, &missed, &mut random).echoes, [Echo::Silence; SONARS]);
    }
}
