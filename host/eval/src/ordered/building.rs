//! An environment with ways: a rotation system, bearings, and lengths.

use crate::{
    environment::Environment,
    family::{Family, FamilyError},
    walk::{PathRng, path_rng},
};
use rand::{RngExt, seq::SliceRandom};
use std::{f64::consts::TAU, fmt};

/// How often the order of the ways is drawn until an environment lies in the plane.
const DRAWS: usize = 200_000;
/// Corridors take so many ring frames, and up to e² times as many.
const LEAST_FRAMES: f64 = 30.0;
/// The most ways of a place.
const MOST_WAYS: usize = 7;

/// How the ways of a place lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bearings {
    /// The gaps between ways are equal but for this share, 0 to 1, drawn for each gap.
    Spread(f64),
    /// Multiples of a right angle, or of half of one at a place with more than four ways.
    Grid,
}

/// An environment with the ways of each place in counter-clockwise order. Darts are numbered from 0.
#[derive(Clone, Debug)]
pub struct Building {
    environment: Environment,
    ways: Vec<Vec<usize>>,
    place: Vec<usize>,
    partner: Vec<usize>,
    bearing_rad: Vec<f64>,
    frames: Vec<f64>,
}

/// No order of the ways was found with which an environment lies in the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BuildingError;

impl fmt::Display for BuildingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the environment was not drawn in the plane")
    }
}

impl std::error::Error for BuildingError {}

impl Building {
    /// An environment with an order of its ways that lies in the plane, drawn like bearings and lengths from a seed.
    ///
    /// # Errors
    /// [`BuildingError`] for an environment that is not planar, or too large to find an order by chance.
    pub fn of_environment(environment: Environment, bearings: Bearings, seed: u64) -> Result<Self, BuildingError> {
        let mut rng = path_rng(seed, 0);
        let mut building = Self::unordered(environment);
        for _ in 0..DRAWS {
            if building.genus() == 0 {
                building.draw_bearings(bearings, &mut rng);
                return Ok(building);
            }
            building.ways.iter_mut().for_each(|ways| ways.shuffle(&mut rng));
        }
        Err(BuildingError)
    }

    /// Environment number `index` of a family, its ways in the order in which they lie; with `extra`, some corridors get a
    /// parallel one and some places a loop.
    ///
    /// # Errors
    /// As [`Family::environment`].
    pub fn of_family(family: &Family, index: usize, bearings: Bearings, extra: bool) -> Result<Self, FamilyError> {
        let (environment, points) = family.with_points(index)?;
        let mut rng = path_rng(family.seed ^ 0xABCD, index as u64);
        let mut building = Self::unordered(environment);
        for (place, ways) in building.ways.iter_mut().enumerate() {
            let angle = |dart: usize| {
                let (from, to) = (points[place], points[building.place[building.partner[dart]]]);
                (to.1 - from.1).atan2(to.0 - from.0)
            };
            ways.sort_by(|&a, &b| angle(a).total_cmp(&angle(b)));
        }
        if extra {
            for _ in 0..=building.ways.len() / 6 {
                building.add_parallel(&mut rng);
                building.add_loop(&mut rng);
            }
        }
        building.draw_bearings(bearings, &mut rng);
        Ok(building)
    }

    fn unordered(environment: Environment) -> Self {
        let mut ways = vec![Vec::new(); environment.places().len()];
        let (mut place, mut partner) = (Vec::new(), Vec::new());
        for &(a, b) in environment.graph().edges() {
            let dart = place.len();
            place.extend([a, b]);
            partner.extend([dart + 1, dart]);
            ways[a].push(dart);
            ways[b].push(dart + 1);
        }
        Self { environment, ways, place, partner, bearing_rad: Vec::new(), frames: Vec::new() }
    }

    /// Adds a corridor beside a random one.
    fn add_parallel(&mut self, rng: &mut PathRng) {
        let beside = rng.random_range(0..self.place.len());
        let other = self.partner[beside];
        let (a, b) = (self.place[beside], self.place[other]);
        if a == b || self.ways[a].len().max(self.ways[b].len()) >= MOST_WAYS - 2 {
            return;
        }
        let dart = self.place.len();
        self.place.extend([a, b]);
        self.partner.extend([dart + 1, dart]);
        let slot = |ways: &[usize], dart| ways.iter().position(|&way| way == dart).unwrap_or(0);
        let here = slot(&self.ways[a], beside) + 1;
        self.ways[a].insert(here, dart);
        let there = slot(&self.ways[b], other);
        self.ways[b].insert(there, dart + 1);
    }

    /// Adds a corridor from a random place to itself.
    fn add_loop(&mut self, rng: &mut PathRng) {
        let place = rng.random_range(0..self.ways.len());
        if self.ways[place].len() >= MOST_WAYS - 3 {
            return;
        }
        let dart = self.place.len();
        self.place.extend([place, place]);
        self.partner.extend([dart + 1, dart]);
        let slot = rng.random_range(0..=self.ways[place].len());
        self.ways[place].splice(slot..slot, [dart, dart + 1]);
    }

    fn draw_bearings(&mut self, bearings: Bearings, rng: &mut PathRng) {
        self.bearing_rad = vec![0.0; self.place.len()];
        for ways in &self.ways {
            let mut bearing_rad = rng.random_range(0.0..TAU);
            let gaps: Vec<f64> = match bearings {
                Bearings::Spread(share) => ways.iter().map(|_| 1.0 + share * rng.random_range(-1.0..1.0)).collect(),
                Bearings::Grid => {
                    let directions = if ways.len() <= 4 { 4 } else { 8 };
                    let mut taken: Vec<usize> = (0..directions).collect();
                    taken.shuffle(rng);
                    taken.truncate(ways.len());
                    taken.sort_unstable();
                    let after = taken.iter().skip(1).copied().chain(taken.first().map(|first| first + directions));
                    taken.iter().zip(after).map(|(&before, after)| (after - before) as f64).collect()
                }
            };
            let sum: f64 = gaps.iter().sum();
            for (&dart, gap) in ways.iter().zip(gaps) {
                self.bearing_rad[dart] = bearing_rad % TAU;
                bearing_rad += gap * TAU / sum;
            }
        }
        self.frames = vec![0.0; self.place.len()];
        for dart in 0..self.place.len() {
            let other = self.partner[dart];
            if dart < other {
                self.frames[dart] = LEAST_FRAMES * rng.random_range(0.0..2.0_f64).exp();
                self.frames[other] = self.frames[dart];
            }
        }
    }

    /// The genus of the rotation system by Euler's formula.
    pub fn genus(&self) -> usize {
        let mut passed = vec![false; self.place.len()];
        let mut faces = 0;
        for start in 0..self.place.len() {
            faces += usize::from(!passed[start]);
            let mut dart = start;
            while !std::mem::replace(&mut passed[dart], true) {
                dart = self.next_way(self.partner[dart]);
            }
        }
        (2 + self.place.len() / 2).saturating_sub(self.ways.len() + faces) / 2
    }

    /// The next way of the same place, counter-clockwise.
    fn next_way(&self, dart: usize) -> usize {
        let ways = &self.ways[self.place[dart]];
        let slot = ways.iter().position(|&way| way == dart).unwrap_or(0);
        ways[(slot + 1) % ways.len()]
    }

    /// The environment without the order of its ways.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// The ways of a place, counter-clockwise.
    pub fn ways(&self, place: usize) -> &[usize] {
        &self.ways[place]
    }

    /// The place of a dart.
    pub fn place(&self, dart: usize) -> usize {
        self.place[dart]
    }

    /// The other end of the corridor of a dart.
    pub fn partner(&self, dart: usize) -> usize {
        self.partner[dart]
    }

    /// How many darts there are.
    pub fn darts(&self) -> usize {
        self.place.len()
    }

    /// The bearing of a dart in radians, in the frame of its place.
    pub fn bearing_rad(&self, dart: usize) -> f64 {
        self.bearing_rad[dart]
    }

    /// How many ring frames a corridor takes.
    pub fn frames(&self, dart: usize) -> f64 {
        self.frames[dart]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn shipped_environments_and_families_lie_in_the_plane() {
        for file in ["wean-surrogate-sd", "table-i"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("environments/{file}.toml"));
            let environment = Environment::load(&path).unwrap();
            let building = Building::of_environment(environment, Bearings::Grid, 1).unwrap();
            assert_eq!(building.genus(), 0);
        }
        let family: Family = "1,10,8,24,2-3,3-6,0.03-0.12,general".parse().unwrap();
        let (mut loops, mut parallels) = (0, 0);
        for index in 0..family.count {
            for extra in [false, true] {
                let building = Building::of_family(&family, index, Bearings::Spread(0.5), extra).unwrap();
                assert_eq!(building.genus(), 0);
                let pairs = (0..building.darts()).map(|dart| {
                    let (a, b) = (building.place(dart), building.place(building.partner(dart)));
                    (a.min(b), a.max(b))
                });
                let pairs: Vec<_> = pairs.collect();
                loops += pairs.iter().filter(|(a, b)| a == b).count() / 2;
                parallels +=
                    usize::from(pairs.iter().any(|pair| pairs.iter().filter(|other| pair == *other).count() > 2));
                assert!(
                    (0..building.environment().places().len()).all(|place| building.ways(place).len() <= MOST_WAYS)
                );
            }
        }
        assert!(loops >= 10 && parallels >= 8, "{loops} {parallels}");
    }

    #[test]
    fn bearings_ascend_around_a_place_and_keep_apart() {
        let family: Family = "1,5,8,14,2-3,3-6,0.03,general".parse().unwrap();
        for bearings in [Bearings::Grid, Bearings::Spread(0.5)] {
            for index in 0..5 {
                let building = Building::of_family(&family, index, bearings, true).unwrap();
                for place in 0..building.environment().places().len() {
                    let ways = building.ways(place);
                    let gaps = ways.iter().map(|&dart| {
                        (building.bearing_rad(building.next_way(dart)) - building.bearing_rad(dart)).rem_euclid(TAU)
                    });
                    let gaps: Vec<f64> = gaps.filter(|&gap| gap > 0.0).collect();
                    assert!(ways.len() == 1 || (gaps.iter().sum::<f64>() - TAU).abs() < 1e-9);
                    assert!(gaps.iter().all(|&gap| gap > 0.25), "{gaps:?}");
                }
            }
        }
    }
}
