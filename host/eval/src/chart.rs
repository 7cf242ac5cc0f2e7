//! The parts that charts share: the page with its title, text, lines, the vertical scale and the colours.

use svg::{
    Document,
    node::element::{Group, Line, Rectangle, Text, Title},
};

/// The colour of text and axes.
pub(crate) const INK: &str = "#222222";
/// The colour of the lines of a scale.
const FAINT: &str = "#dcdcdc";

/// The colour of a data series. The colours repeat after six series.
pub(crate) fn colour(number: usize) -> &'static str {
    const COLOURS: [&str; 6] = ["#1f6f8b", "#b3261e", "#6a8f2f", "#8b5fbf", "#c77d11", "#4d4d4d"];
    COLOURS[number % COLOURS.len()]
}

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

/// A straight line.
pub(crate) fn line(from: (f64, f64), to: (f64, f64), colour: &str) -> Line {
    Line::new().set("x1", from.0).set("y1", from.1).set("x2", to.0).set("y2", to.1).set("stroke", colour)
}

/// Adds a line of the vertical scale to a panel of this width, with its name at the left.
pub(crate) fn scale(panel: Group, width: f64, name: &str, y: f64) -> Group {
    panel.add(line((0.0, y), (width, y), FAINT)).add(words(name, -8.0, y + 4.0, 12.0).set("text-anchor", "end"))
}
