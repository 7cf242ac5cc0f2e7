//! The help pane: the keys.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::{HERE, boxed};

const KEYS: [(&str, &str); 17] = [
    ("g", "go to a vertex of the map, and stand there"),
    ("n", "name a vertex, or clear its name"),
    ("e", "go on exploring"),
    ("p", "pause: stand still"),
    ("c", "go on after a pause"),
    ("l", "localise only: keep the map as it is"),
    ("m", "go on mapping"),
    ("i", "info: which robot this is and what it does"),
    ("u", "get the whole map at once"),
    ("s", "snapshot to a file"),
    ("r", "restore the map from a file"),
    ("t", "set a setting"),
    ("x", "reset: forget the map"),
    ("Tab", "the next pane: map, vertices, ring, robot"),
    ("Up Down", "scroll the vertices"),
    ("Esc", "leave a question unanswered"),
    ("q Ctrl-C", "quit"),
];

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect) {
    let lines = KEYS
        .iter()
        .map(|&(key, meaning)| Line::from(vec![Span::styled(format!("{key:>9}  "), HERE), Span::from(meaning)]));
    boxed(frame, area, "keys; any key goes back", lines.collect());
}
