//! Floor plans: text files of walls and free cells.

use std::fmt;

use super::Point;

/// A floor plan on a grid of square cells.
///
/// # File format
/// The first line is `cell_mm N`, the side of a cell in millimetres (50 to 1000). Every other line is a row of cells,
/// the northernmost first: `#` is wall, `.` is free, and exactly one `S` is the free cell where the robot starts. Short
/// rows are filled up with wall, and everything outside the plan is wall.
#[derive(Clone, Debug)]
pub struct Plan {
    cell_mm: u16,
    columns: usize,
    /// Row by row, the southernmost first.
    walls: Vec<bool>,
    start: Point,
}

/// A straight piece of wall surface between two corners, in millimetres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Face {
    pub(super) from: (i32, i32),
    pub(super) to: (i32, i32),
}

impl Face {
    /// Distance of a point from the face.
    pub(super) fn distance_mm(&self, point: Point) -> f64 {
        let x = point.x_mm.clamp(f64::from(self.from.0), f64::from(self.to.0));
        let y = point.y_mm.clamp(f64::from(self.from.1), f64::from(self.to.1));
        point.distance_mm(Point::new(x, y))
    }
}

/// Why a text is no floor plan.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PlanError {
    /// The first line is not `cell_mm N` with N from 50 to 1000.
    Header,
    /// A character other than `#`, `.` and `S`.
    Character {
        /// The character.
        character: char,
        /// The line, counted from 1.
        line: usize,
    },
    /// No `S`, or more than one.
    Start,
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Header => write!(f, "the first line must be `cell_mm N` with N from 50 to 1000"),
            Self::Character { character, line } => {
                write!(f, "line {line}: {character:?} is none of '#' (wall), '.' (free), 'S' (start)")
            }
            Self::Start => write!(f, "there must be exactly one start cell 'S'"),
        }
    }
}

impl std::error::Error for PlanError {}

impl Plan {
    /// The plans that are compiled in, by name.
    pub const BUILT_IN: [(&'static str, &'static str); 7] = [
        ("ring", include_str!("../../plans/ring.txt")),
        ("office", include_str!("../../plans/office.txt")),
        ("flat", include_str!("../../plans/flat.txt")),
        ("grid", include_str!("../../plans/grid.txt")),
        ("plus", include_str!("../../plans/plus.txt")),
        ("comb", include_str!("../../plans/comb.txt")),
        ("ladder", include_str!("../../plans/ladder.txt")),
    ];

    /// The built-in plan of this name.
    pub fn built_in(name: &str) -> Option<Self> {
        let (_, text) = Self::BUILT_IN.iter().find(|(built_in, _)| *built_in == name)?;
        Self::parse(text).ok()
    }

    /// Parses a plan.
    ///
    /// # Errors
    /// [`PlanError`] when the text is not a plan.
    pub fn parse(text: &str) -> Result<Self, PlanError> {
        let mut lines = text.lines();
        let header = lines.next().and_then(|line| line.strip_prefix("cell_mm "));
        let cell_mm = header.and_then(|number| number.trim().parse().ok()).ok_or(PlanError::Header)?;
        if !(50..=1000).contains(&cell_mm) {
            return Err(PlanError::Header);
        }
        let rows: Vec<&str> = lines.collect();
        let columns = rows.iter().map(|row| row.chars().count()).max().unwrap_or(0);
        let mut walls = vec![true; columns * rows.len()];
        let mut starts = Vec::new();
        for (row, cells) in rows.iter().rev().enumerate() {
            for (column, character) in cells.chars().enumerate() {
                walls[row * columns + column] = match character {
                    '#' => true,
                    '.' => false,
                    'S' => {
                        starts.push(Point::new(column as f64 + 0.5, row as f64 + 0.5));
                        false
                    }
                    _ => return Err(PlanError::Character { character, line: rows.len() - row + 1 }),
                };
            }
        }
        let [start] = starts[..] else { return Err(PlanError::Start) };
        let start = Point::new(start.x_mm * f64::from(cell_mm), start.y_mm * f64::from(cell_mm));
        Ok(Self { cell_mm, columns, walls, start })
    }

    /// The side of a cell, in millimetres.
    pub const fn cell_mm(&self) -> u16 {
        self.cell_mm
    }

    /// Width of the plan, in millimetres.
    pub fn width_mm(&self) -> f64 {
        self.columns as f64 * f64::from(self.cell_mm)
    }

    /// Height of the plan, in millimetres.
    pub fn height_mm(&self) -> f64 {
        self.rows() as f64 * f64::from(self.cell_mm)
    }

    /// Number of cells in a row.
    pub const fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.walls.len() / self.columns.max(1)
    }

    /// The start position of the robot.
    pub const fn start(&self) -> Point {
        self.start
    }

    /// Whether a cell is wall; column 0 is west, row 0 is south, everything outside is wall.
    pub fn is_wall(&self, column: i32, row: i32) -> bool {
        let (Ok(column), Ok(row)) = (usize::try_from(column), usize::try_from(row)) else { return true };
        column >= self.columns || self.walls.get(row * self.columns + column).copied().unwrap_or(true)
    }

    /// Whether a point lies in a wall.
    pub fn is_wall_at(&self, point: Point) -> bool {
        let cell_mm = f64::from(self.cell_mm);
        self.is_wall((point.x_mm / cell_mm).floor() as i32, (point.y_mm / cell_mm).floor() as i32)
    }

    /// The surfaces of the walls, one face for each maximal straight piece.
    pub(super) fn faces(&self) -> Vec<Face> {
        let (columns, rows) = (self.columns as i32, self.rows() as i32);
        let along_x = runs(rows, columns, |row, column| (self.is_wall(column, row - 1), self.is_wall(column, row)));
        let along_y = runs(columns, rows, |column, row| (self.is_wall(column - 1, row), self.is_wall(column, row)));
        let cell_mm = i32::from(self.cell_mm);
        let scaled = |from: (i32, i32), to: (i32, i32)| Face {
            from: (from.0 * cell_mm, from.1 * cell_mm),
            to: (to.0 * cell_mm, to.1 * cell_mm),
        };
        let along_x = along_x.into_iter().map(|(y, from, to)| scaled((from, y), (to, y)));
        let along_y = along_y.into_iter().map(|(x, from, to)| scaled((x, from), (x, to)));
        along_x.chain(along_y).collect()
    }

    /// The corners of the walls, convex and concave.
    pub(super) fn corners(&self) -> Vec<Point> {
        let mut ends: Vec<(i32, i32)> = self.faces().iter().flat_map(|face| [face.from, face.to]).collect();
        ends.sort_unstable();
        ends.dedup();
        ends.into_iter().map(|(x, y)| Point::new(f64::from(x), f64::from(y))).collect()
    }
}

/// The maximal runs `(line, from, to)` along which the cells on the two sides of a grid line differ the same way.
fn runs(lines: i32, length: i32, sides: impl Fn(i32, i32) -> (bool, bool)) -> Vec<(i32, i32, i32)> {
    let mut found = Vec::new();
    for line in 0..=lines {
        let mut begun: Option<(i32, bool)> = None;
        for place in 0..=length {
            let (before, behind) = sides(line, place);
            let side = (place < length && before != behind).then_some(before);
            begun = match begun {
                Some((from, was)) if side == Some(was) => Some((from, was)),
                _ => {
                    found.extend(begun.map(|(from, _)| (line, from, place)));
                    side.map(|side| (place, side))
                }
            };
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closet_has_four_faces_and_four_corners() {
        let plan = Plan::parse("cell_mm 500\n####\n#S.#\n####\n").unwrap();
        assert_eq!((plan.start().x_mm, plan.start().y_mm), (750.0, 750.0));
        let faces = plan.faces();
        assert_eq!(faces.len(), 4);
        assert!(faces.contains(&Face { from: (500, 500), to: (1500, 500) }));
        assert_eq!(plan.corners().len(), 4);
        assert_eq!(faces.iter().map(|face| face.distance_mm(Point::new(800.0, 900.0))).fold(f64::MAX, f64::min), 100.0);
    }

    #[test]
    fn an_invalid_plan_is_rejected_with_its_error() {
        assert_eq!(Plan::parse("#S#").unwrap_err(), PlanError::Header);
        assert_eq!(Plan::parse("cell_mm 20\n#S#").unwrap_err(), PlanError::Header);
        assert_eq!(Plan::parse("cell_mm 250\n#.#").unwrap_err(), PlanError::Start);
        assert_eq!(Plan::parse("cell_mm 250\n#SS").unwrap_err(), PlanError::Start);
        let wrong = PlanError::Character { character: 'x', line: 3 };
        assert_eq!(Plan::parse("cell_mm 250\n#S#\n#x#").unwrap_err(), wrong);
    }

    #[test]
    fn cells_outside_the_plan_are_wall() {
        let plan = Plan::parse("cell_mm 500\nS").unwrap();
        assert!(plan.is_wall(-1, 0) && plan.is_wall(0, 1) && plan.is_wall(1, 0) && !plan.is_wall(0, 0));
        assert_eq!(plan.faces().len(), 4);
    }

    #[test]
    fn every_built_in_plan_parses() {
        for (name, _) in Plan::BUILT_IN {
            assert!(Plan::built_in(name).is_some(), "{name}");
        }
    }
}
