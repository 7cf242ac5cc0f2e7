//! Histograms of two filters side by side, as SVG: the paper's Fig. 4 and 5.

use super::report::{BIN_MM, Row};
use crate::chart::{self, INK, colour, line, scale, words};
use std::collections::{BTreeMap, BTreeSet};
use svg::node::element::{Group, Rectangle};

/// The quantity that a histogram shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The distance of the map from the n-grams of the environment (Fig. 4).
    Consistency,
    /// The number of vertices of the map (Fig. 5).
    Vertices,
}

/// The rows of two filters for the same case and check point, drawn side by side.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// The rows; the second one is that of the paper's filter.
    pub rows: [&'a Row; 2],
    /// Number of places of the environments, if they all have the same number.
    pub places: Option<usize>,
}

const PANEL: (f64, f64) = (420.0, 220.0);
/// Margins of a panel: left for the shares, above for the name, below for the axis.
const LEFT: f64 = 66.0;
const ABOVE: f64 = 62.0;
const BELOW: f64 = 54.0;
const HEAD: f64 = 44.0;
const RIGHT: f64 = 24.0;
/// The bin of [`Row::consistency_bins`] that infinite distances are in.
const INFINITE: u16 = u16::MAX / BIN_MM * BIN_MM;

/// Draws one quantity for every pair, one line of two panels for each. Both panels of a line share their axes.
pub fn draw(quantity: Quantity, pairs: &[Pair]) -> String {
    let line_height = ABOVE + PANEL.1 + BELOW;
    let (width, height) = (2.0 * (LEFT + PANEL.0) + RIGHT, HEAD + line_height * pairs.len() as f64);
    let title = match quantity {
        Quantity::Consistency => "Distance of the maps from the n-grams of the environment (d_H, Eq. 2)",
        Quantity::Vertices => "Number of vertices of the maps",
    };
    let mut document = chart::page((width, height), title, (LEFT, 32.0), 19.0);
    for (line, pair) in pairs.iter().enumerate() {
        let top = HEAD + line_height * line as f64;
        let [row, _] = pair.rows;
        let name = format!("{}, {} paths of {} places", row.name, row.paths, row.length);
        document = document.add(words(&name, LEFT, top + 24.0, 14.0));
        let axes = Axes::of(quantity, pair);
        for (side, row) in pair.rows.into_iter().enumerate() {
            let left = LEFT + (LEFT + PANEL.0) * side as f64;
            document = document.add(
                panel(quantity, row, &axes, pair.places, side)
                    .set("transform", format!("translate({left:.0} {:.0})", top + ABOVE)),
            );
        }
    }
    document.to_string()
}

/// Bins and largest share of two panels.
struct Axes {
    /// The number of each bin, in order; `None` is the bin of infinite distances.
    bins: Vec<Option<usize>>,
    /// The top of the axis of shares, in percent.
    top_percent: usize,
}

impl Axes {
    fn of(quantity: Quantity, pair: &Pair) -> Self {
        let counts = pair.rows.map(|row| counts(quantity, row));
        let occurring: BTreeSet<Option<usize>> = counts.iter().flat_map(BTreeMap::keys).copied().collect();
        let numbers = occurring.iter().copied().flatten().chain(pair.places.filter(|_| quantity == Quantity::Vertices));
        let least = if quantity == Quantity::Consistency { Some(0) } else { numbers.clone().min() };
        let most = numbers.max();
        let mut bins: Vec<Option<usize>> = match (least, most) {
            (Some(least), Some(most)) => (least.saturating_sub(1)..=most + 1).map(Some).collect(),
            _ => Vec::new(),
        };
        // A panel with few bars gets empty bins.
        while bins.len() < 8 {
            bins.push(Some(bins.last().copied().flatten().map_or(0, |last| last + 1)));
        }
        if occurring.contains(&None) {
            bins.push(None);
        }
        let largest = counts
            .iter()
            .zip(pair.rows)
            .flat_map(|(counts, row)| counts.values().map(move |&maps| 100.0 * maps as f64 / row.paths as f64));
        let largest = largest.fold(1.0, f64::max);
        let step = share_step(largest);
        Self { bins, top_percent: (largest / step as f64).ceil() as usize * step }
    }
}

/// Number of maps in each bin; the bin of infinite distances is `None`.
fn counts(quantity: Quantity, row: &Row) -> BTreeMap<Option<usize>, usize> {
    match quantity {
        Quantity::Vertices => row.vertices.iter().map(|(&vertices, &maps)| (Some(vertices), maps)).collect(),
        Quantity::Consistency => {
            let bin = |start_mm: u16| (start_mm != INFINITE).then_some(usize::from(start_mm / BIN_MM));
            row.consistency_bins.iter().map(|(&start_mm, &maps)| (bin(start_mm), maps)).collect()
        }
    }
}

/// Distance between the grid lines of the axis of shares, in percent.
fn share_step(largest_percent: f64) -> usize {
    [1, 2, 5, 10].into_iter().find(|&step| largest_percent <= 5.0 * step as f64).unwrap_or(20)
}

fn panel(quantity: Quantity, row: &Row, axes: &Axes, places: Option<usize>, side: usize) -> Group {
    let (width, height) = PANEL;
    let bin_width = width / axes.bins.len() as f64;
    let y = |percent: f64| height - height * percent / axes.top_percent as f64;
    let filter = if row.filter == "paper" { "paper's" } else { row.filter };
    let exact = format!("{filter} filter: {:.1} % exact", 100.0 * row.exact);
    let mut panel =
        Group::new().add(words(&exact, 0.0, -14.0, 14.0).set("fill", colour(side)).set("font-weight", "bold"));
    for percent in (0..=axes.top_percent).step_by(share_step(axes.top_percent as f64)) {
        panel = scale(panel, width, &format!("{percent} %"), y(percent as f64));
    }
    let counts = counts(quantity, row);
    for (slot, bin) in axes.bins.iter().enumerate() {
        let left = bin_width * slot as f64;
        if let Some(&maps) = counts.get(bin) {
            let top = y(100.0 * maps as f64 / row.paths as f64);
            let bar = Rectangle::new().set("x", left + 0.08 * bin_width).set("y", top).set("width", 0.84 * bin_width);
            panel = panel.add(bar.set("height", height - top).set("fill", colour(side)));
        }
    }
    panel = panel.add(line((0.0, height), (width, height), INK));
    for (slot, label) in tick_labels(quantity, &axes.bins) {
        // Distances are labelled at the edges of bins, numbers of vertices in the middle.
        let between = quantity == Quantity::Consistency && label != "∞";
        let at = bin_width * (slot as f64 + if between { 0.0 } else { 0.5 });
        panel = panel
            .add(line((at, height), (at, height + 5.0), INK))
            .add(words(&label, at, height + 20.0, 12.0).set("text-anchor", "middle"));
    }
    let places = places.filter(|_| quantity == Quantity::Vertices);
    let true_bin = places.and_then(|places| Some((axes.bins.iter().position(|&bin| bin == Some(places))?, places)));
    if let Some((slot, places)) = true_bin {
        let at = bin_width * (slot as f64 + 0.5);
        // A white outline keeps the text legible over the bars.
        let label = words(&format!("{places} places"), at + 6.0, 10.0, 12.0).set("font-style", "italic");
        panel = panel
            .add(line((at, -4.0), (at, height), INK).set("stroke-dasharray", "4 4"))
            .add(label.set("stroke", "white").set("stroke-width", 4).set("paint-order", "stroke"));
    }
    let axis = match quantity {
        Quantity::Consistency => "distance in mm",
        Quantity::Vertices => "vertices",
    };
    panel.add(words(axis, width / 2.0, height + 41.0, 13.0).set("text-anchor", "middle"))
}

/// The labelled bins and their labels: at most about a dozen.
fn tick_labels(quantity: Quantity, bins: &[Option<usize>]) -> Vec<(usize, String)> {
    let (steps, factor) = match quantity {
        // 20, 100, 200, 500 mm and 1 m.
        Quantity::Consistency => ([1, 5, 10, 25, 50], usize::from(BIN_MM)),
        Quantity::Vertices => ([1, 2, 5, 10, 20], 1),
    };
    let step = steps.into_iter().find(|step| bins.len() <= 12 * step).unwrap_or(100);
    let label = |(slot, bin): (usize, &Option<usize>)| match bin {
        Some(bin) => bin.is_multiple_of(step).then(|| (slot, (bin * factor).to_string())),
        None => Some((slot, "∞".to_owned())),
    };
    bins.iter().enumerate().filter_map(label).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Distribution;

    fn row(vertices: &[(usize, usize)], bins_mm: &[(u16, usize)]) -> Row {
        Row {
            name: "a < b".into(),
            environments: 1,
            environment_seed: None,
            filter: "robust",
            paths: 10,
            length: 50,
            exact: 0.5,
            exact_interval: [0.2, 0.8],
            exact_edges: None,
            isomorphic: 0.5,
            reliability: Default::default(),
            vertices: vertices.iter().copied().collect(),
            edge_f1: 0.9,
            location_online: 0.9,
            location_smoothed: 0.9,
            consistency_mm: Distribution::default(),
            consistency_bins: bins_mm.iter().copied().collect(),
            places_until_exact: Distribution::default(),
            paths_not_exhaustive: 0,
            vertices_full: 0,
            limit: None,
            prior_seconds: 0.0,
            seconds_per_place: 0.0,
        }
    }

    #[test]
    fn a_figure_has_a_bar_for_each_nonempty_bin() {
        let ours = row(&[(11, 9), (12, 1)], &[(0, 4), (20, 6)]);
        let theirs = row(&[(9, 2), (11, 3), (14, 5)], &[(40, 9), (INFINITE, 1)]);
        let pairs = [Pair { rows: [&ours, &theirs], places: Some(11) }];
        for (quantity, words) in [(Quantity::Vertices, "11 places"), (Quantity::Consistency, "∞")] {
            let picture = draw(quantity, &pairs);
            let bars = |colour| picture.split("<rect").filter(|rest| rest.contains(&format!("\"{colour}\""))).count();
            assert!(bars(colour(0)) >= 2 && bars(colour(1)) >= 2, "{picture}");
            assert!(picture.contains(words) && picture.contains("50.0 % exact") && picture.contains("a &lt; b"));
        }
    }

    #[test]
    fn both_panels_share_bins_that_cover_all_values() {
        let ours = row(&[(11, 10)], &[(0, 10)]);
        let theirs = row(&[(20, 10)], &[(INFINITE, 10)]);
        let pair = Pair { rows: [&ours, &theirs], places: Some(25) };
        let bins = Axes::of(Quantity::Vertices, &pair).bins;
        assert_eq!((bins.first(), bins.last()), (Some(&Some(10)), Some(&Some(26))));
        let bins = Axes::of(Quantity::Consistency, &pair).bins;
        assert_eq!((bins.first(), bins.last()), (Some(&Some(0)), Some(&None)));
    }

    #[test]
    fn ticks_are_few_and_round() {
        let bins: Vec<_> = (0..40).map(Some).chain([None]).collect();
        let labels: Vec<String> =
            tick_labels(Quantity::Consistency, &bins).into_iter().map(|(_, label)| label).collect();
        assert_eq!(labels, ["0", "100", "200", "300", "400", "500", "600", "700", "∞"]);
    }
}
