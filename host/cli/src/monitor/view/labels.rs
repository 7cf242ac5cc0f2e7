//! Places the labels of a map so that none is printed over another.
//!
//! The numbers of all vertices come first, and then, where there is room to their right, the details.

use ratatui::layout::Rect;

/// A label: the cell of its vertex, and the widths of its number and of its details, the longest first.
pub(super) struct Label {
    pub(super) column: u16,
    pub(super) row: u16,
    pub(super) number_width: u16,
    pub(super) details: Vec<u16>,
}

/// Where a label is: the cell of its number, and which of its details fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Placed {
    pub(super) column: u16,
    pub(super) row: u16,
    pub(super) detail: Option<usize>,
}

/// The place of each label within an area; `None` for one without room. Earlier labels come first.
pub(super) fn place(labels: &[Label], area: Rect) -> Vec<Option<Placed>> {
    let mut taken: Vec<Rect> = Vec::new();
    let numbers: Vec<Option<Rect>> = labels
        .iter()
        .map(|label| {
            let found = candidates(label).find(|rect| is_free(*rect, area, &taken))?;
            taken.push(found);
            Some(found)
        })
        .collect();
    let details = |(label, number): (&Label, Option<Rect>)| {
        let number = number?;
        let fits = |&width: &u16| {
            // A blank separates it from the number.
            let rect = Rect { x: number.right() + 1, width, ..number };
            is_free(rect, area, &taken).then_some(rect)
        };
        let found = label.details.iter().enumerate().find_map(|(detail, width)| Some((detail, fits(width)?)));
        if let Some((_, rect)) = found {
            taken.push(rect);
        }
        Some(Placed { column: number.x, row: number.y, detail: found.map(|(detail, _)| detail) })
    };
    labels.iter().zip(numbers).map(details).collect()
}

/// The cell of the vertex, and those around it.
fn candidates(label: &Label) -> impl Iterator<Item = Rect> {
    let Label { column, row, number_width, .. } = *label;
    let left = i32::from(number_width) + 1;
    let steps =
        [(0, 0), (0, 1), (0, -1), (2, 0), (-left, 0), (2, 1), (2, -1), (-left, 1), (-left, -1), (0, 2), (0, -2)];
    steps.into_iter().filter_map(move |(across, down)| {
        let x = u16::try_from(i32::from(column) + across).ok()?;
        let y = u16::try_from(i32::from(row) + down).ok()?;
        Some(Rect { x, y, width: number_width, height: 1 })
    })
}

fn is_free(rect: Rect, area: Rect, taken: &[Rect]) -> bool {
    let is_inside =
        rect.x >= area.x && rect.right() <= area.right() && rect.y >= area.y && rect.bottom() <= area.bottom();
    is_inside && taken.iter().all(|other| !touches(rect, *other))
}

/// Whether two texts overlap or have no blank between them.
fn touches(a: Rect, b: Rect) -> bool {
    a.y == b.y && a.x <= b.right() && b.x <= a.right()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Crowded labels of every density on the small and the large screen.
    #[test]
    fn no_label_is_printed_over_another_and_most_numbers_are_printed() {
        for (width, height) in [(40, 15), (68, 23), (20, 8)] {
            let area = Rect { x: 3, y: 2, width, height };
            for count in 1..40u32 {
                let cell = |number: u32, size: u16| (number.wrapping_mul(2_654_435_761) >> 16) as u16 % size;
                let labels: Vec<Label> = (0..count)
                    .map(|number| Label {
                        column: area.x + cell(number * 2 + count * 97, width),
                        row: area.y + cell(number * 2 + 1 + count * 97, height),
                        number_width: 1 + u16::from(number > 9),
                        details: vec![10, 4],
                    })
                    .collect();
                let placed = place(&labels, area);
                let mut texts = Vec::new();
                for (label, placed) in labels.iter().zip(&placed) {
                    let Some(Placed { column, row, detail }) = *placed else { continue };
                    let detail = detail.map_or(0, |detail| 1 + label.details[detail]);
                    texts.push(Rect { x: column, y: row, width: label.number_width + detail, height: 1 });
                }
                for (number, text) in texts.iter().enumerate() {
                    assert_eq!(text.intersection(area), *text, "inside");
                    assert!(
                        texts[..number].iter().all(|other| !touches(*text, *other)),
                        "{count} of {width} × {height}"
                    );
                }
                let shown = texts.len() as u32;
                assert!(shown == count || count > 12, "{shown} of {count} numbers at {width} × {height}");
            }
        }
    }
}
