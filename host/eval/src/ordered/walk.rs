//! Walks along the ways of a building.

use super::Building;
use crate::walk::{EXHAUSTIVE_FROM_LENGTH, MAX_DRAWS, PathRng};
use rand::RngExt;
use std::{collections::VecDeque, fmt, str::FromStr};

/// How the robot chooses the way by which it leaves a place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WalkKind {
    /// Each way is as likely as another, back included.
    #[default]
    Uniform,
    /// As `Uniform`, but back only from a dead end.
    Forward,
    /// To the nearest way that it has not driven; when there is none, as `Uniform`.
    Explore,
}

/// A text is no kind of walk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WalkKindError(String);

impl fmt::Display for WalkKindError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a walk is uniform, forward or explore, not {}", self.0)
    }
}

impl std::error::Error for WalkKindError {}

impl FromStr for WalkKind {
    type Err = WalkKindError;

    fn from_str(text: &str) -> Result<Self, WalkKindError> {
        match text {
            "uniform" => Ok(Self::Uniform),
            "forward" => Ok(Self::Forward),
            "explore" => Ok(Self::Explore),
            _ => Err(WalkKindError(text.into())),
        }
    }
}

impl Building {
    /// Draws a walk: the dart by which the robot came to each of `length` places. At the first place any dart stands for it.
    ///
    /// As for [`draw_walk`](crate::walk::draw_walk), long walks are drawn again until they drive every corridor.
    pub fn draw_walk(&self, length: usize, kind: WalkKind, rng: &mut PathRng) -> Vec<usize> {
        let draws = if length >= EXHAUSTIVE_FROM_LENGTH { MAX_DRAWS } else { 1 };
        let (mut walk, mut is_exhaustive) = self.draw_once(length, kind, rng);
        for _ in 1..draws {
            if is_exhaustive {
                break;
            }
            (walk, is_exhaustive) = self.draw_once(length, kind, rng);
        }
        walk
    }

    fn draw_once(&self, length: usize, kind: WalkKind, rng: &mut PathRng) -> (Vec<usize>, bool) {
        let start = rng.random_range(0..self.environment().places().len());
        let ways = self.ways(start);
        let mut at = ways[rng.random_range(0..ways.len())];
        let mut driven = vec![false; self.darts()];
        let mut walk = vec![at];
        while walk.len() < length {
            let ways = self.ways(self.place(at));
            let mut any = || ways[rng.random_range(0..ways.len())];
            let exit = match kind {
                WalkKind::Uniform => any(),
                WalkKind::Forward if ways.len() > 1 => loop {
                    let exit = any();
                    if exit != at {
                        break exit;
                    }
                },
                WalkKind::Forward => at,
                WalkKind::Explore => self.towards_frontier(at, &driven).unwrap_or_else(any),
            };
            at = self.partner(exit);
            driven[exit] = true;
            driven[at] = true;
            walk.push(at);
        }
        (walk, driven.iter().all(|&driven| driven))
    }

    /// The way that leads to the nearest dart that was not driven, by the number of corridors; counter-clockwise from the one
    /// the robot came by among equals.
    fn towards_frontier(&self, at: usize, driven: &[bool]) -> Option<usize> {
        let around = |at: usize| {
            let ways = self.ways(self.place(at));
            let slot = ways.iter().position(|&way| way == at).unwrap_or(0);
            (1..=ways.len()).map(move |turn| ways[(slot + turn) % ways.len()])
        };
        let mut seen = vec![false; self.environment().places().len()];
        let mut open: VecDeque<(usize, Option<usize>)> = VecDeque::from([(at, None)]);
        while let Some((at, first)) = open.pop_front() {
            if std::mem::replace(&mut seen[self.place(at)], true) {
                continue;
            }
            if let Some(way) = around(at).find(|&way| !driven[way]) {
                return Some(first.unwrap_or(way));
            }
            open.extend(around(at).map(|way| (self.partner(way), first.or(Some(way)))));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{family::Family, ordered::Bearings, walk::path_rng};

    fn building() -> Building {
        let family: Family = "2,1,10,10,2.6,5,0.03,general".parse().unwrap();
        Building::of_family(&family, 0, Bearings::Spread(0.5), true).unwrap()
    }

    #[test]
    fn every_step_follows_a_corridor() {
        let building = building();
        for kind in [WalkKind::Uniform, WalkKind::Forward, WalkKind::Explore] {
            let walk = building.draw_walk(200, kind, &mut path_rng(1, 0));
            assert_eq!(walk.len(), 200);
            for step in walk.windows(2) {
                let exit = building.partner(step[1]);
                assert_eq!(building.place(exit), building.place(step[0]));
                let is_dead_end = building.ways(building.place(exit)).len() == 1;
                assert!(kind != WalkKind::Forward || exit != step[0] || is_dead_end);
            }
        }
    }

    #[test]
    fn exploring_drives_every_corridor_with_few_repetitions() {
        let building = building();
        let corridors = building.darts() / 2;
        let walk = building.draw_walk(3 * corridors, WalkKind::Explore, &mut path_rng(1, 0));
        let driven: std::collections::BTreeSet<usize> =
            walk[1..].iter().map(|&dart| dart.min(building.partner(dart))).collect();
        assert_eq!(driven.len(), corridors);
    }
}
