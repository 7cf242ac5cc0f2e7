//! Plans made of square cells: free or wall.

use crate::world::walls::{Segment, Vertex};

/// The most cells of a plan.
pub(super) const CELLS_MAX: usize = 16_000_000;

/// Square cells, row by row, the southernmost first. Everything outside is wall.
#[derive(Clone, Debug)]
pub(super) struct Bitmap {
    columns: usize,
    free: Vec<bool>,
}

impl Bitmap {
    /// Cells of rows of one length.
    pub(super) const fn new(columns: usize, free: Vec<bool>) -> Self {
        Self { columns, free }
    }

    pub(super) const fn columns(&self) -> usize {
        self.columns
    }

    pub(super) fn rows(&self) -> usize {
        self.free.len() / self.columns.max(1)
    }

    /// Whether a cell is free; column 0 is west, row 0 is south.
    pub(super) fn is_free(&self, column: i32, row: i32) -> bool {
        let (Ok(column), Ok(row)) = (usize::try_from(column), usize::try_from(row)) else { return false };
        column < self.columns && self.free.get(row * self.columns + column).copied().unwrap_or(false)
    }

    /// The surfaces of the walls along the cells, each as long as it is straight, in units of a cell.
    pub(super) fn faces(&self) -> Vec<Segment> {
        let (columns, rows) = (self.columns as i32, self.rows() as i32);
        let along_x = runs(rows, columns, |row, column| (self.is_free(column, row - 1), self.is_free(column, row)));
        let along_y = runs(columns, rows, |column, row| (self.is_free(column - 1, row), self.is_free(column, row)));
        // Free space is on the left: above a wall that leads east, and west of one that leads north.
        let along_x =
            along_x.into_iter().map(|run| directed((run.from, run.line), (run.to, run.line), run.is_free_behind));
        let along_y =
            along_y.into_iter().map(|run| directed((run.line, run.from), (run.line, run.to), !run.is_free_behind));
        along_x.chain(along_y).collect()
    }
}

fn directed(from: Vertex, to: Vertex, is_forwards: bool) -> Segment {
    if is_forwards { Segment { from, to } } else { Segment { from: to, to: from } }
}

/// A stretch of a grid line with free cells on one side and wall on the other.
struct Run {
    line: i32,
    from: i32,
    to: i32,
    /// Whether the cells of the higher row or column are the free ones.
    is_free_behind: bool,
}

/// The longest runs along which the cells on the two sides of a grid line differ the same way.
fn runs(lines: i32, length: i32, sides: impl Fn(i32, i32) -> (bool, bool)) -> Vec<Run> {
    let mut found = Vec::new();
    for line in 0..=lines {
        let mut begun: Option<(i32, bool)> = None;
        for place in 0..=length {
            let (before, behind) = sides(line, place);
            let side = (place < length && before != behind).then_some(behind);
            begun = match begun {
                Some((from, was)) if side == Some(was) => Some((from, was)),
                _ => {
                    found.extend(begun.map(|(from, is_free_behind)| Run { line, from, to: place, is_free_behind }));
                    side.map(|side| (place, side))
                }
            };
        }
    }
    found
}
