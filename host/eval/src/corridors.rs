//! The corridors of an environment as a robot perceives them: the order and the bearings of the ways at each place, and the
//! travel times.

use super::{embedding::draw_embedding, environment::Environment, rotation::RotationSystem, walk::PathRng};
use rand::RngExt;
use std::{f64::consts::TAU, fmt};
use toposlam::WAYS_MAX;

/// The gaps between the ways of a place are equal up to this share, which is drawn for each gap.
const GAP_SPREAD: f64 = 0.5;
/// Ring frames per metre: the robot of the simulation drives 0.3 m/s and fires its ring ten times a second.
const FRAMES_PER_M: f64 = 10.0 / 0.3;
/// The natural logarithm of a drawn length in metres lies between 0 and this.
const LN_LENGTH: f64 = 2.0;

/// How the bearings of the ways of a place are drawn, in the order of the ways.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bearings {
    /// The gaps between the ways are equal up to a half of the mean gap, drawn for each gap.
    #[default]
    Spread,
    /// Multiples of a right angle; of half a right angle at a place with more than four ways.
    RightAngles,
}

impl Bearings {
    /// The name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spread => "spread",
            Self::RightAngles => "right-angles",
        }
    }
}

/// The ways of all places and their bearings, and the travel times of all corridors.
#[derive(Clone, Debug, PartialEq)]
pub struct Corridors {
    rotation: RotationSystem,
    bearing_rad: Vec<f64>,
    travel_frames: Vec<f64>,
}

/// Why an environment has no corridors that a robot can perceive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CorridorsError {
    /// The environment is not planar.
    NotPlanar,
    /// A place has more than 7 ways.
    TooManyWays {
        /// The id of the place.
        id: u32,
        /// How many it has.
        ways: usize,
    },
}

impl fmt::Display for CorridorsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotPlanar => write!(f, "the environment cannot be drawn in the plane"),
            Self::TooManyWays { id, ways } => {
                write!(f, "place {id} has {ways} ways, but at most {WAYS_MAX} are possible")
            }
        }
    }
}

impl std::error::Error for CorridorsError {}

impl Corridors {
    /// The corridors of an environment. What it does not say is drawn: an embedding in the plane, bearings, and lengths from 1 to
    /// 7.4 m.
    ///
    /// # Errors
    /// [`CorridorsError`] for an environment that is not planar, or has a place with more than 7 ways.
    pub fn draw(environment: &Environment, bearings: Bearings, rng: &mut PathRng) -> Result<Self, CorridorsError> {
        for (place, exits) in environment.places().iter().zip(environment.exits()) {
            if exits.len() > WAYS_MAX {
                return Err(CorridorsError::TooManyWays { id: place.id, ways: exits.len() });
            }
        }
        let rotation = match environment.rotation() {
            Some(rotation) => rotation.clone(),
            None => draw_embedding(environment.places().len(), environment.corridors(), rng)
                .ok_or(CorridorsError::NotPlanar)?,
        };
        let bearing_rad = draw_bearings(&rotation, bearings, rng);
        let mut draw_length_m = |_| rng.random_range(0.0..LN_LENGTH).exp();
        let lengths_m = environment
            .lengths_m()
            .map_or_else(|| (0..environment.corridors().len()).map(&mut draw_length_m).collect(), <[f64]>::to_vec);
        let travel_frames = lengths_m.into_iter().map(|length_m| FRAMES_PER_M * length_m).collect();
        Ok(Self { rotation, bearing_rad, travel_frames })
    }

    /// The order of the ways.
    pub fn rotation(&self) -> &RotationSystem {
        &self.rotation
    }

    /// The bearing of a dart relative to another way of the same place, in radians counter-clockwise, 0 to 2π.
    ///
    /// # Panics
    /// When there is no such dart.
    pub fn bearing_rad(&self, dart: usize, relative_to: usize) -> f64 {
        (self.bearing_rad[dart] - self.bearing_rad[relative_to]).rem_euclid(TAU)
    }

    /// The mean number of ring frames that the corridor of a dart takes.
    ///
    /// # Panics
    /// When there is no such dart.
    pub fn travel_frames(&self, dart: usize) -> f64 {
        self.travel_frames[dart / 2]
    }
}

/// The bearing of each dart in an arbitrary frame of its place.
fn draw_bearings(rotation: &RotationSystem, bearings: Bearings, rng: &mut PathRng) -> Vec<f64> {
    let mut bearing_rad = vec![0.0; rotation.dart_count()];
    for place in 0..rotation.vertex_count() {
        let ways = rotation.ways(place);
        let gaps: Vec<f64> = match bearings {
            Bearings::Spread => ways.iter().map(|_| 1.0 + GAP_SPREAD * rng.random_range(-1.0..1.0)).collect(),
            Bearings::RightAngles => {
                let directions = if ways.len() <= 4 { 4 } else { 8 };
                let mut taken = rand::seq::index::sample(rng, directions, ways.len()).into_vec();
                taken.sort_unstable();
                let next = taken.iter().skip(1).copied().chain(taken.first().map(|first| first + directions));
                taken.iter().zip(next).map(|(&taken, next)| (next - taken) as f64).collect()
            }
        };
        let sum: f64 = gaps.iter().sum();
        let mut bearing = 0.0;
        for (&dart, gap) in ways.iter().zip(gaps) {
            bearing_rad[dart] = bearing;
            bearing += gap * TAU / sum;
        }
    }
    bearing_rad
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{environment::Place, walk::path_rng};
    use std::path::Path;

    fn places(count: u32) -> Vec<Place> {
        (1..=count).map(|id| Place { id, mean_mm: 900.0, sd_mm: 20.0 }).collect()
    }

    #[test]
    fn shipped_environments_lie_in_the_plane() {
        for file in ["wean-surrogate-sd", "wean-surrogate-variance", "table-i"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("environments/{file}.toml"));
            let corridors =
                Corridors::draw(&Environment::load(&path).unwrap(), Bearings::Spread, &mut path_rng(1, 0)).unwrap();
            assert_eq!(corridors.rotation().genus(), 0);
        }
    }

    #[test]
    fn bearings_ascend_around_a_place_and_keep_apart() {
        let edges = [[1, 2], [1, 3], [1, 4], [1, 1], [1, 5], [1, 5]];
        let star = Environment::new("star".into(), places(5), &edges[..5]).unwrap();
        for path in 0..50 {
            let corridors = Corridors::draw(&star, Bearings::Spread, &mut path_rng(1, path)).unwrap();
            let ways = corridors.rotation().ways(0);
            let gap = |&dart: &usize| corridors.bearing_rad(corridors.rotation().next_way(dart), dart);
            let gaps: Vec<f64> = ways.iter().map(gap).collect();
            assert!((gaps.iter().sum::<f64>() - TAU).abs() < 1e-9);
            assert!(gaps.iter().all(|&gap| gap > TAU / 6.0 / 3.1), "{gaps:?}");
            assert_eq!(corridors.bearing_rad(ways[0], ways[0]), 0.0);
        }
    }

    #[test]
    fn right_angles_are_multiples_of_a_quarter_of_a_turn() {
        let cross = Environment::new("cross".into(), places(4), &[[1, 2], [1, 3], [1, 4]]).unwrap();
        let mut gaps = Vec::new();
        for path in 0..50 {
            let corridors = Corridors::draw(&cross, Bearings::RightAngles, &mut path_rng(1, path)).unwrap();
            let gap = |&dart: &usize| corridors.bearing_rad(corridors.rotation().next_way(dart), dart) / TAU * 4.0;
            gaps.extend(corridors.rotation().ways(0).iter().map(gap));
        }
        assert!(gaps.iter().all(|gap| (gap - gap.round()).abs() < 1e-9));
        assert_eq!(gaps.iter().filter(|gap| gap.round() == 2.0).count(), 50);
    }

    #[test]
    fn given_ways_and_lengths_are_taken() {
        let edges = [[1, 2], [2, 3], [3, 1]];
        let environment = Environment::new("triangle".into(), places(3), &edges).unwrap();
        let environment = environment.with_ways(&[vec![0, 2], vec![0, 1], vec![1, 2]]).unwrap();
        let environment = environment.with_lengths_m(vec![3.0, 6.0, 9.0]).unwrap();
        let corridors = Corridors::draw(&environment, Bearings::Spread, &mut path_rng(1, 0)).unwrap();
        assert_eq!(corridors.rotation().ways(1), [1, 2]);
        assert!((corridors.travel_frames(3) - 200.0).abs() < 1e-9);
    }

    #[test]
    fn what_a_robot_cannot_perceive_is_refused() {
        let complete: Vec<[u32; 2]> = (1..=5).flat_map(|a| (a + 1..=5).map(move |b| [a, b])).collect();
        let draw = |count, edges: &[[u32; 2]]| {
            let environment = Environment::new("test".into(), places(count), edges).unwrap();
            Corridors::draw(&environment, Bearings::Spread, &mut path_rng(1, 0))
        };
        assert_eq!(draw(5, &complete), Err(CorridorsError::NotPlanar));
        let star: Vec<[u32; 2]> = (2..=9).map(|other| [1, other]).collect();
        assert_eq!(draw(9, &star), Err(CorridorsError::TooManyWays { id: 1, ways: 8 }));
    }
}
