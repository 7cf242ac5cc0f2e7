//! The parts that all charts share: the page with its title, text, lines and the names of axes.

use svg::{
    Document,
    node::element::{Line, Rectangle, Text, Title},
};

/// The colour of text and axes.
pub(crate) const INK: &str = "#222222";
/// The colour of the lines of a scale.
pub(crate) const FAINT: &str = "#dcdcdc";

/// A white page with a title, its first letter at `at`.
pub(crate) fn page((width, height): (f64, f64), title: &str, at: (f64, f64), title_size: f64) -> Document {
    Document::new()
        .set("viewBox", (0, 0, width, height))
        .set("width", width)
        .set("font-family", "sans-serif")
        .add(Title::new(title))
        .add(Rectangle::new().set("width", "100%").set("height", "100%").set("fill", "white"))
        .add(words(title, at.0, at.1, title_size).set("font-weight", "bold"))
}

/// A line of text, its first letter at (x, y).
pub(crate) fn words(words: &str, x: f64, y: f64, size: f64) -> Text {
    Text::new(words).set("x", x).set("y", y).set("font-size", size).set("fill", INK)
}

/// The name of the vertical axis of a panel of this height.
pub(crate) fn vertical_axis(name: &str, height: f64) -> Text {
    words(name, -height / 2.0, -44.0, 13.0).set("text-anchor", "middle").set("transform", "rotate(-90)")
}

/// A straight line.
pub(crate) fn line(from: (f64, f64), to: (f64, f64), colour: &str) -> Line {
    Line::new().set("x1", from.0).set("y1", from.1).set("x2", to.0).set("y2", to.1).set("stroke", colour)
}
