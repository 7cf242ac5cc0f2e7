//! Small buildings whose corridors have an order, and robots that walk through them.
#![allow(unreachable_pub, reason = "the modules of this test share it")]

use crate::split_mix::Random;
use toposlam::{DartMap, Exit, Filter, Fingerprint, Map, Observation, OrderedFilter, Ways};

/// A way of a place: its bearing in milliradians, the dart it leads to, and the ring frames of its corridor.
pub type Way = (u16, usize, u16);

/// A building: for each place a radius in millimetres and its ways, counter-clockwise. Darts are numbered through all places.
pub struct Building {
    pub radius_mm: &'static [u16],
    pub ways: &'static [&'static [Way]],
}

/// Places 0 and 2 look alike. A loop at place 0, two parallel corridors from 0 to 1, and a dead end 2 behind 1.
pub const HOUSE: Building = Building {
    radius_mm: &[1000, 1600, 1008],
    ways: &[
        &[(0, 1, 40), (1100, 0, 40), (2500, 6, 20), (4300, 5, 90)],
        &[(300, 7, 30), (2000, 3, 90), (4100, 2, 20)],
        &[(1000, 4, 30)],
    ],
};

/// A ring of six places with two dead ends, of four radii.
pub const RING: Building = Building {
    radius_mm: &[900, 1300, 900, 1700, 1300, 2200, 700, 720],
    ways: &[
        &[(0, 3, 50), (2100, 16, 25), (4200, 13, 60)],
        &[(0, 0, 50), (3000, 5, 70)],
        &[(0, 4, 70), (3300, 7, 30)],
        &[(0, 6, 30), (1500, 17, 20), (3000, 10, 44)],
        &[(200, 9, 44), (3400, 12, 35)],
        &[(0, 11, 35), (3000, 2, 60), (4000, 15, 80), (5000, 14, 80)],
        &[(0, 1, 25)],
        &[(0, 8, 20)],
    ],
};

impl Building {
    pub fn place(&self, dart: usize) -> usize {
        let mut first = 0;
        let holds = |ways: &&[Way]| {
            first += ways.len();
            dart < first
        };
        self.ways.iter().position(holds).unwrap()
    }

    fn first(&self, place: usize) -> usize {
        self.ways[..place].iter().map(|ways| ways.len()).sum()
    }

    fn way(&self, dart: usize) -> Way {
        let place = self.place(dart);
        self.ways[place][dart - self.first(place)]
    }

    pub fn partner(&self, dart: usize) -> usize {
        self.way(dart).1
    }

    pub fn darts(&self) -> usize {
        self.first(self.ways.len())
    }

    /// The building as a known map, with this many visits of each place.
    pub fn known<const V: usize, const D: usize>(&self, visits: u32) -> (Map<V>, DartMap<V, D>) {
        let (mut map, mut darts) = (Map::new(), DartMap::EMPTY);
        for (&radius_mm, ways) in self.radius_mm.iter().zip(self.ways) {
            let label = Fingerprint::from_radius_mm(radius_mm).unwrap();
            let vertex = map.add_vertex(label).unwrap();
            (1..visits).for_each(|_| map.observe(vertex, label));
            let vertex = darts.add_vertex().unwrap();
            for &(bearing_mrad, ..) in *ways {
                darts.add_way(vertex, (f64::from(bearing_mrad) / 6283.2 * 65536.0) as u16).unwrap();
            }
        }
        (0..self.darts()).for_each(|dart| darts.join(dart as u8, self.partner(dart) as u8));
        for (a, b) in darts.view().edges() {
            map.add_edge(darts.view().vertex(a).unwrap(), darts.view().vertex(b).unwrap());
        }
        (map, darts)
    }
}

/// A robot that walks through a building at random exits.
pub struct Robot<'a> {
    building: &'a Building,
    random: Random,
    /// The dart by which the robot came to the newest place.
    pub at: usize,
    left: Option<(Exit, u16)>,
    /// The frames of the corridor that are left after a place that is none.
    rest: Option<u16>,
    is_kidnapping_reported: bool,
    is_started: bool,
}

impl<'a> Robot<'a> {
    pub fn new(building: &'a Building, seed: u64) -> Self {
        let random = Random(seed);
        Self { building, random, at: 0, left: None, rest: None, is_kidnapping_reported: true, is_started: false }
    }

    /// Carries the robot to another place.
    pub fn carry_off(&mut self, is_reported: bool) {
        let place = self.building.place(self.at);
        while self.building.place(self.at) == place {
            self.at = self.random.below(self.building.darts());
        }
        self.left = None;
        self.is_kidnapping_reported = is_reported;
        self.is_started = false;
    }

    /// Drives to the next place, unless the robot was carried off, and observes it.
    pub fn step(&mut self) -> Observation {
        if self.is_started {
            self.left = Some(self.leave());
        }
        self.observe()
    }

    /// Drives half a corridor, and reports a place there that is none.
    pub fn step_to_no_place(&mut self, radius_mm: u16) -> Observation {
        let (exit, frames) = self.leave();
        // Half of the corridor is left.
        self.rest = Some(frames - frames / 2);
        Observation {
            ways: Ways::from_bearings_mrad(&[3142]).ok(),
            exit: Some(exit),
            travel_frames: Some(frames / 2),
            ..Observation::new(Fingerprint::from_radius_mm(radius_mm).unwrap())
        }
    }

    /// Drives on from a place that is none, or back.
    pub fn step_from_no_place(&mut self, goes_back: bool) -> Observation {
        if goes_back {
            self.at = self.building.partner(self.at);
        }
        let exit = if goes_back { Exit::Back } else { Exit::Bearing(128) };
        self.left = self.rest.take().map(|frames| (exit, frames));
        self.observe()
    }

    /// Passes a place that is not detected, and observes the next one.
    pub fn step_past(&mut self) -> Observation {
        let (exit, frames) = self.leave();
        let passed = self.at;
        let mut more = (Exit::Back, 0);
        while more.0 == Exit::Back && self.building.ways[self.building.place(passed)].len() > 1 {
            self.at = passed;
            more = self.leave();
        }
        self.left = Some((exit, frames + more.1));
        self.observe()
    }

    /// Leaves the place by any exit, and comes to the other end of the corridor. Returns the exit and the frames of the corridor.
    fn leave(&mut self) -> (Exit, u16) {
        let place = self.building.place(self.at);
        let others = self.others();
        let exit = self.random.below(others.len() + 1);
        let (reported, left) = match exit.checked_sub(1) {
            None => (Exit::Back, self.at),
            Some(other) => (Exit::from_bearing_mrad(others[other].0).unwrap(), others[other].1),
        };
        assert_eq!(self.building.place(left), place);
        let (_, partner, frames) = self.building.way(left);
        self.at = partner;
        (reported, frames)
    }

    fn observe(&mut self) -> Observation {
        let bearings: Vec<u16> = self.others().iter().map(|&(bearing, _)| bearing).collect();
        let noise_mm = 2 * self.random.below(9) as u16;
        let radius_mm = self.building.radius_mm[self.building.place(self.at)] + noise_mm;
        let observation = Observation {
            ways: Ways::from_bearings_mrad(&bearings).ok(),
            exit: self.left.map(|(exit, _)| exit),
            travel_frames: self.left.map(|(_, frames)| frames),
            starts_sequence: !self.is_started && self.is_kidnapping_reported,
            ..Observation::new(Fingerprint::from_radius_mm(radius_mm).unwrap())
        };
        self.is_started = true;
        observation
    }

    /// The other ways of the place, by bearing relative to the way the robot came by.
    fn others(&self) -> Vec<(u16, usize)> {
        let place = self.building.place(self.at);
        let (ways, first) = (self.building.ways[place], self.building.first(place));
        let own = i32::from(ways[self.at - first].0);
        let relative = |bearing: u16| (i32::from(bearing) - own).rem_euclid(6283) as u16;
        let mut others: Vec<(u16, usize)> = (0..ways.len())
            .filter(|slot| first + slot != self.at)
            .map(|slot| (relative(ways[slot].0), first + slot))
            .collect();
        others.sort_unstable();
        others
    }

    /// Maps this many places, with refinement.
    pub fn drive<const N: usize, const V: usize, const D: usize, const T: usize>(
        &mut self,
        filter: &mut OrderedFilter<N, V, D, T>,
        places: usize,
    ) {
        for _ in 0..places {
            filter.observe(self.step());
            (0..6).for_each(|_| filter.refine());
        }
    }
}
