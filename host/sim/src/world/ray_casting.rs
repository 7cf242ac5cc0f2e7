//! Simulates the readings of a ring of sonars in a floor plan by ray casting.

use std::f64::consts::{PI, TAU};

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use toposlam::ring::{Echo, RingFrame};

use super::plan::Plan;
use super::{Point, Pose};

/// Number of sonars of the simulated ring of the reference robot: evenly spaced and counter-clockwise, the first straight ahead.
pub const SONARS: usize = 16;
/// Largest number of sonars of a simulated ring.
pub const SONARS_MAX: usize = 24;
/// Number of rays of an even ring. Overlapping cones share their rays.
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
    pub dead_sonars: u32,
    /// Distance of the sonars from the centre of the ring, along their bearings, in millimetres. Default 0. The ranges of a frame are
    /// from the centre: drivers add it.
    pub offset_mm: f64,
    /// Bearings of the sonars, counter-clockwise from straight ahead, in radians. Default evenly spaced from straight ahead.
    pub bearings_rad: Option<[f64; SONARS_MAX]>,
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
            offset_mm: 0.0,
            bearings_rad: None,
        }
    }
}

/// Position and axis of a sensor.
struct Sensor {
    position: Point,
    axis_rad: f64,
    /// Cosine and sine of the axis.
    direction: (f64, f64),
}

impl Sensor {
    /// Distance of a point along the axis, in millimetres.
    fn along_mm(&self, to: Point) -> f64 {
        (to.x_mm - self.position.x_mm) * self.direction.0 + (to.y_mm - self.position.y_mm) * self.direction.1
    }
}

impl SonarModel {
    /// The sensors of a ring at a pose.
    fn sensors<const SONARS: usize>(&self, pose: &Pose) -> [Sensor; SONARS] {
        std::array::from_fn(|sonar| {
            let even_rad = TAU * sonar as f64 / SONARS as f64;
            let axis_rad = pose.heading_rad + self.bearings_rad.map_or(even_rad, |bearings_rad| bearings_rad[sonar]);
            let (sine, cosine) = axis_rad.sin_cos();
            let Point { x_mm, y_mm } = pose.position;
            let position = Point::new(x_mm + cosine * self.offset_mm, y_mm + sine * self.offset_mm);
            Sensor { position, axis_rad, direction: (cosine, sine) }
        })
    }
}

/// Wraps an angle to −π to π.
pub(crate) fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

/// What the ring measures of a floor plan.
pub(super) struct Scene {
    plan: Plan,
}

impl Scene {
    pub(super) fn new(plan: &Plan) -> Self {
        Self { plan: plan.clone() }
    }

    /// Simulates one reading of a ring of up to [`SONARS_MAX`] sonars.
    pub(super) fn frame<const SONARS: usize>(
        &self,
        pose: &Pose,
        model: &SonarModel,
        random: &mut impl Rng,
    ) -> RingFrame<SONARS> {
        const { assert!(SONARS <= SONARS_MAX, "each sonar has a bearing and a bit") };
        let sensors = model.sensors::<SONARS>(pose);
        let half_rays = model.cone_half_angle_rad / (TAU / RAYS as f64);
        let is_even = model.bearings_rad.is_none() && model.offset_mm == 0.0 && RAYS.is_multiple_of(SONARS);
        let mut heard_mm = if is_even && (half_rays - half_rays.round()).abs() < 1e-9 {
            self.walls_around(pose, model, half_rays.round() as usize)
        } else {
            sensors.each_ref().map(|sensor| self.wall_in_cone(sensor, model))
        };
        self.hear_corners(pose, &sensors, model, &mut heard_mm);
        let mut echoes = [Echo::Dead; SONARS];
        for (sonar, (echo, heard_mm)) in echoes.iter_mut().zip(heard_mm).enumerate() {
            // Drawn for every sonar, so that a dead one does not change the readings of the others.
            let noise_mm: f64 = StandardNormal.sample(random);
            let missed = random.random_bool(model.missed_share);
            let range_mm = (heard_mm + noise_mm * model.range_sd_mm).max(model.range_min_mm);
            let is_heard = !missed && range_mm <= model.range_max_mm;
            if model.dead_sonars >> sonar & 1 == 1 {
                *echo = Echo::Dead;
            } else if is_heard {
                *echo = Echo::Range { range_mm: (range_mm + model.offset_mm).round() as u16 };
            } else {
                *echo = Echo::Silence;
            }
        }
        RingFrame { echoes }
    }

    /// Range of the nearest wall that each sonar of an even ring measures, in millimetres; infinite without an echo. The cones are this
    /// many rays wide on either side.
    fn walls_around<const SONARS: usize>(&self, pose: &Pose, model: &SonarModel, half_rays: usize) -> [f64; SONARS] {
        let rays: [f64; RAYS] = std::array::from_fn(|ray| {
            let direction = pose.heading_rad + ray as f64 * (TAU / RAYS as f64);
            self.wall_along(pose.position, direction, model)
        });
        let half = half_rays.min(RAYS / 2);
        std::array::from_fn(|sonar| {
            let first = sonar * (RAYS / SONARS) + RAYS - half;
            (first..=first + 2 * half).map(|ray| rays[ray % RAYS]).fold(f64::INFINITY, f64::min)
        })
    }

    /// Range of the nearest wall in one cone, in millimetres; infinite without an echo.
    fn wall_in_cone(&self, sensor: &Sensor, model: &SonarModel) -> f64 {
        let half_rays = (model.cone_half_angle_rad / (TAU / RAYS as f64)).ceil().max(1.0);
        let step_rad = model.cone_half_angle_rad / half_rays;
        let rays = -(half_rays as i32)..=half_rays as i32;
        let direction_rad = |ray: i32| sensor.axis_rad + f64::from(ray) * step_rad;
        let ranges_mm = rays.map(|ray| self.wall_along(sensor.position, direction_rad(ray), model));
        ranges_mm.fold(f64::INFINITY, f64::min)
    }

    /// Range of the wall along a ray, in millimetres; infinite without an echo.
    fn wall_along(&self, from: Point, direction_rad: f64, model: &SonarModel) -> f64 {
        let hit = self.plan.walls().cast(from, direction_rad, model.range_max_mm);
        if hit.cosine_off_normal >= model.specular_limit_rad.cos() { hit.range_mm } else { f64::INFINITY }
    }

    /// Adds the echoes of the visible corners in each cone.
    fn hear_corners<const SONARS: usize>(
        &self,
        pose: &Pose,
        sensors: &[Sensor; SONARS],
        model: &SonarModel,
        heard_mm: &mut [f64; SONARS],
    ) {
        let walls = self.plan.walls();
        let reach_mm = model.range_max_mm + model.offset_mm;
        let least_cosine = model.cone_half_angle_rad.cos();
        for corner in walls.corners_near(pose.position, reach_mm) {
            let from_centre_mm = pose.position.distance_mm(corner);
            if from_centre_mm > reach_mm {
                continue;
            }
            for (sensor, heard_mm) in sensors.iter().zip(&mut *heard_mm) {
                let is_central = model.offset_mm == 0.0;
                let range_mm = if is_central { from_centre_mm } else { sensor.position.distance_mm(corner) };
                let is_nearer = range_mm < *heard_mm && range_mm <= model.range_max_mm;
                if is_nearer
                    && sensor.along_mm(corner) >= least_cosine * range_mm
                    && walls.is_in_sight(sensor.position, corner)
                {
                    *heard_mm = range_mm;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
        // The same from sensors on a circle of 120 mm, and with a sensor ahead that looks to the left.
        let outside = SonarModel { offset_mm: 120.0, ..perfect };
        let frame: RingFrame<SONARS> = closet().frame(&pose, &outside, &mut random);
        let heard = frame.echoes.map(|echo| echo.range_mm().unwrap_or(0));
        assert_eq!((heard[0], heard[4], heard[8], heard[12]), (1000, 1000, 3000, 1000));
        let mut bearings_rad = [0.0; SONARS_MAX];
        (bearings_rad[0], bearings_rad[1]) = (PI / 2.0, PI);
        let turned = SonarModel { bearings_rad: Some(bearings_rad), ..perfect };
        let frame: RingFrame<5> = closet().frame(&pose, &turned, &mut random);
        let heard = frame.echoes.map(|echo| echo.range_mm().unwrap_or(0));
        assert_eq!(heard, [1000, 3000, 1000, 1000, 1000]);
        let dead = SonarModel { dead_sonars: 1 << 4, ..perfect };
        assert_eq!(closet().frame::<SONARS>(&pose, &dead, &mut random).echoes[4], Echo::Dead);
        let missed = SonarModel { missed_share: 1.0, ..perfect };
        assert_eq!(closet().frame(&pose, &missed, &mut random).echoes, [Echo::Silence; SONARS]);
    }
}
