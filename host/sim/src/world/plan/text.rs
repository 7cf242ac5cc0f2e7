//! Text plans: a character for each cell (docs/plans.md).

use super::bitmap::{Bitmap, CELLS_MAX};
use super::{CELL_MM, Drawn, PlanError, scaled};
use crate::world::Point;

/// Reads a text plan.
pub(super) fn parse(text: &str) -> Result<Drawn, PlanError> {
    let mut lines = text.lines();
    let header = lines.next().and_then(|line| line.strip_prefix("cell_mm "));
    let cell_mm: u16 = header.and_then(|number| number.trim().parse().ok()).ok_or(PlanError::Header)?;
    if !CELL_MM.contains(&f64::from(cell_mm)) {
        return Err(PlanError::Header);
    }
    let cell_mm = f64::from(cell_mm);
    let rows: Vec<&str> = lines.collect();
    let columns = rows.iter().map(|row| row.chars().count()).max().unwrap_or(0);
    if columns.saturating_mul(rows.len()) > CELLS_MAX {
        return Err(PlanError::TooLarge { columns, rows: rows.len() });
    }
    let mut free = vec![false; columns * rows.len()];
    let mut start = None;
    for (row, cells) in rows.iter().rev().enumerate() {
        let line = rows.len() - row + 1;
        for (column, character) in cells.chars().enumerate() {
            free[row * columns + column] = match character {
                '#' => false,
                '.' => true,
                'S' => {
                    let centre = Point::new((column as f64 + 0.5) * cell_mm, (row as f64 + 0.5) * cell_mm);
                    if start.replace(centre).is_some() {
                        return Err(PlanError::Start);
                    }
                    true
                }
                _ => return Err(PlanError::Character { character, line }),
            };
        }
    }
    let bitmap = Bitmap::new(columns, free);
    let segments = bitmap.faces().into_iter().map(|face| scaled(face, cell_mm)).collect();
    let size_mm = (columns as f64 * cell_mm, rows.len() as f64 * cell_mm);
    let cell = |at_mm: f64| (at_mm / cell_mm).floor() as i32;
    let row_free = |y: f64, xs: &[f64]| xs.iter().map(|x| bitmap.is_free(cell(*x), cell(y))).collect();
    Drawn::new(segments, size_mm, Point::default(), start, row_free)
}
