//! A walk through a large building: corridors like the joints of a brick wall, with random exits and without noise.

use toposlam::{Exit, Fingerprint, Observation, Ways};

/// Junctions in a row and in a column.
const WIDTH: u32 = 8;
const HEIGHT: u32 = 7;

/// A quarter of a turn in milliradians.
const QUARTER_MRAD: u16 = 1571;

/// The robot on the grid: its junction, the direction that it came from, and its last exit.
pub(crate) struct Grid {
    x: u32,
    y: u32,
    /// East, north, west, south.
    came_from: u32,
    exit: Option<Exit>,
    state: u32,
}

impl Grid {
    pub(crate) const fn new() -> Self {
        Self { x: 0, y: 0, came_from: 0, exit: None, state: 1 }
    }

    fn has_way(&self, direction: u32) -> bool {
        match direction {
            0 => self.x + 1 < WIDTH,
            // Every second junction has a way up, the others have one down.
            1 => self.y + 1 < HEIGHT && (self.x + self.y).is_multiple_of(2),
            2 => self.x > 0,
            _ => self.y > 0 && !(self.x + self.y).is_multiple_of(2),
        }
    }

    /// The directions of the ways, counter-clockwise from the one the robot came from.
    fn ways(&self) -> impl Iterator<Item = u32> + '_ {
        (0..4).map(|turn| (self.came_from + turn) % 4).filter(|&direction| self.has_way(direction))
    }

    fn bearing_mrad(&self, direction: u32) -> u16 {
        (direction + 4 - self.came_from) as u16 % 4 * QUARTER_MRAD
    }

    /// The observation at the junction; then the robot leaves by a random way.
    pub(crate) fn step(&mut self) -> Observation {
        let number = self.y * WIDTH + self.x;
        let Ok(fingerprint) = Fingerprint::from_radius_mm((600 + number * 37 % 56 * 60) as u16) else { panic!() };
        let mut others_mrad = [0; 3];
        let mut count = 0;
        for (slot, direction) in others_mrad.iter_mut().zip(self.ways().skip(1)) {
            *slot = self.bearing_mrad(direction);
            count += 1;
        }
        let ways = others_mrad.get(..count).and_then(|others_mrad| Ways::from_bearings_mrad(others_mrad).ok());
        let travel_frames = self.exit.map(|_| 100 + (number % 5) as u16);
        let observation = Observation { ways, exit: self.exit, travel_frames, ..Observation::new(fingerprint) };
        self.state = self.state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let choice = (self.state >> 16) as usize % (count + 1);
        let direction = self.ways().nth(choice).unwrap_or(self.came_from);
        self.exit = Exit::from_bearing_mrad(self.bearing_mrad(direction)).ok();
        match direction {
            0 => self.x += 1,
            1 => self.y += 1,
            2 => self.x -= 1,
            _ => self.y -= 1,
        }
        self.came_from = (direction + 2) % 4;
        observation
    }
}
