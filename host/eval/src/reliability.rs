//! How reliable the stated probability of a map is: among maps of one probability, the share that is exact. With the reliability
//! diagram.

use crate::chart::{self, INK, colour, line, scale, words};
use serde::Serialize;
use svg::node::element::{Circle, Group};

/// Number of bins of the stated probability.
pub const BINS: usize = 10;

/// The maps of one bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Bin {
    /// How many maps there are.
    pub maps: usize,
    /// How many of them are exact.
    pub exact: usize,
    /// The sum of their stated probabilities.
    pub probability_sum: f64,
}

impl Bin {
    /// The mean stated probability and the share that is exact; `None` without maps.
    pub fn shares(&self) -> Option<(f64, f64)> {
        let maps = self.maps as f64;
        (self.maps > 0).then(|| (self.probability_sum / maps, self.exact as f64 / maps))
    }
}

/// Maps in equal bins of their stated probability, from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Reliability {
    /// The bins, the lowest probabilities first.
    pub bins: [Bin; BINS],
}

impl Reliability {
    /// Counts maps by their stated probability, each with whether it is exact.
    pub fn of(maps: impl IntoIterator<Item = (f64, bool)>) -> Self {
        let mut reliability = Self::default();
        for (probability, exact) in maps {
            let bin = &mut reliability.bins[((probability * BINS as f64) as usize).min(BINS - 1)];
            bin.maps += 1;
            bin.exact += usize::from(exact);
            bin.probability_sum += probability;
        }
        reliability
    }

    /// The maps of all these reliabilities.
    pub fn sum<'a>(all: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut sum = Self::default();
        for one in all {
            for (total, bin) in sum.bins.iter_mut().zip(&one.bins) {
                total.maps += bin.maps;
                total.exact += bin.exact;
                total.probability_sum += bin.probability_sum;
            }
        }
        sum
    }

    /// The expected calibration error: the mean over all maps of the distance between stated probability and share of exact maps in
    /// their bin.
    pub fn error(&self) -> f64 {
        let maps: usize = self.bins.iter().map(|bin| bin.maps).sum();
        let off = |bin: &Bin| bin.shares().map_or(0.0, |(stated, exact)| bin.maps as f64 * (stated - exact).abs());
        self.bins.iter().map(off).sum::<f64>() / maps.max(1) as f64
    }
}

const SIDE: f64 = 320.0;
const LEFT: f64 = 64.0;
const ABOVE: f64 = 76.0;

/// Draws a reliability diagram for each filter: the share of exact maps over the stated probability. The area of a point stands for the
/// number of maps. The lines beside the diagonal are .1 away.
pub fn draw(filters: &[(&str, Reliability)]) -> String {
    let (width, height) = (LEFT + filters.len() as f64 * (SIDE + LEFT), ABOVE + SIDE + 60.0);
    let title = "Maps that are exact, over the stated probability of the map";
    let mut document = chart::page((width, height), title, (LEFT, 28.0), 16.0);
    for (number, (name, reliability)) in filters.iter().enumerate() {
        let left = LEFT + number as f64 * (SIDE + LEFT);
        let heading = format!("{name} filter: mean error {:.3}", reliability.error());
        document = document
            .add(words(&heading, left, ABOVE - 16.0, 14.0).set("fill", colour(number)))
            .add(panel(reliability, number).set("transform", format!("translate({left:.0} {ABOVE:.0})")));
    }
    document.to_string()
}

fn panel(reliability: &Reliability, number: usize) -> Group {
    let at = |stated: f64, exact: f64| (SIDE * stated, SIDE * (1.0 - exact));
    let mut panel = Group::new();
    for tenth in (0..=10).step_by(2) {
        let share = f64::from(tenth) / 10.0;
        let name = format!("{share:.1}");
        panel = scale(panel, SIDE, &name, at(0.0, share).1)
            .add(words(&name, at(share, 0.0).0, SIDE + 18.0, 12.0).set("text-anchor", "middle"));
    }
    panel = panel
        .add(line(at(0.0, 0.0), at(1.0, 1.0), INK))
        .add(line(at(0.0, 0.1), at(0.9, 1.0), INK).set("stroke-dasharray", "4 4"))
        .add(line(at(0.1, 0.0), at(1.0, 0.9), INK).set("stroke-dasharray", "4 4"));
    let most = reliability.bins.iter().map(|bin| bin.maps).max().unwrap_or(0).max(1) as f64;
    for bin in &reliability.bins {
        if let Some((stated, exact)) = bin.shares() {
            let (x, y) = at(stated, exact);
            let radius = 3.0 + 11.0 * (bin.maps as f64 / most).sqrt();
            let circle = Circle::new().set("cx", format!("{x:.1}")).set("cy", format!("{y:.1}"));
            let circle = circle.set("r", format!("{radius:.1}")).set("fill", colour(number));
            let count = words(&bin.maps.to_string(), x + radius + 3.0, y + 4.0, 11.0);
            panel = panel.add(circle.set("fill-opacity", 0.6)).add(count);
        }
    }
    panel
        .add(line(at(0.0, 0.0), at(1.0, 0.0), INK))
        .add(words("stated probability", SIDE / 2.0, SIDE + 38.0, 13.0).set("text-anchor", "middle"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_counted_in_ten_bins_of_their_stated_probability() {
        let reliability = Reliability::of([(0.0, false), (0.95, true), (1.0, false), (0.55, true)]);
        let counts = reliability.bins.map(|bin| (bin.maps, bin.exact));
        assert_eq!((counts[0], counts[5], counts[9]), ((1, 0), (1, 1), (2, 1)));
        let (stated, exact) = reliability.bins[9].shares().unwrap();
        assert!((stated - 0.975).abs() < 1e-12 && exact == 0.5);
        assert_eq!(reliability.bins[1].shares(), None);
        // 0 of 1 at 0, 1 of 1 at .55, 1 of 2 at .975.
        assert!((reliability.error() - (0.45 + 2.0 * 0.475) / 4.0).abs() < 1e-12);
        let twice = Reliability::sum([&reliability, &reliability]);
        assert_eq!((twice.bins[9].maps, twice.error()), (4, reliability.error()));
    }

    #[test]
    fn a_diagram_has_a_point_for_each_bin_with_maps() {
        let ours = Reliability::of([(0.2, false), (0.9, true)]);
        let picture = draw(&[("robust", ours), ("paper", Reliability::default())]);
        assert_eq!(picture.matches("<circle").count(), 2);
        assert!(picture.contains("robust filter") && picture.contains("paper filter"));
    }
}
