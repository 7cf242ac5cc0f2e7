//! Measures how closely a recorded robot followed the Voronoi graph.
//!
//! The place detector detects the places of a robot that follows the generalised Voronoi graph, where the two nearest
//! obstacles are equidistant. Only the frames of a recording that are on this graph can give places.

use std::fmt;

use toposlam::place::PlaceConfig;
use toposlam::ring::{Echo, RingFrame, RingGeometry};

/// Number of frames, and number of those on the Voronoi graph.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GvgAdherence {
    /// All frames.
    pub frames: usize,
    /// Frames whose second obstacle is about as near as the nearest.
    pub on_graph: usize,
    /// Frames whose third obstacle is about as near, too.
    pub at_meet_point: usize,
    /// Largest difference between equally near obstacles, in millimetres.
    pub equidistance_mm: u16,
}

impl GvgAdherence {
    /// Measures a recording frame by frame, with the place detector's definition of obstacles but without its
    /// smoothing.
    pub fn of<const SONARS: usize>(
        frames: &[RingFrame<SONARS>],
        geometry: &RingGeometry<SONARS>,
        config: &PlaceConfig,
    ) -> Self {
        let mut adherence = Self { frames: frames.len(), equidistance_mm: config.equidistance_mm, ..Self::default() };
        for frame in frames {
            let nearest_mm = nearest_mm(frame, geometry, config);
            let is_near = |number: usize| {
                let range_mm = nearest_mm.get(number);
                range_mm.is_some_and(|range_mm| range_mm - nearest_mm[0] <= config.equidistance_mm)
            };
            adherence.on_graph += usize::from(is_near(1));
            adherence.at_meet_point += usize::from(is_near(2));
        }
        adherence
    }
}

/// Ranges of the three nearest obstacles in separate bearings, the nearest first.
fn nearest_mm<const SONARS: usize>(
    frame: &RingFrame<SONARS>,
    geometry: &RingGeometry<SONARS>,
    config: &PlaceConfig,
) -> Vec<u16> {
    let obstacles = frame.echoes.iter().zip(&geometry.bearings_mrad).filter_map(|(echo, bearing_mrad)| match echo {
        Echo::Range { range_mm } if (config.range_min_mm..=config.range_max_mm).contains(range_mm) => {
            Some((*range_mm, *bearing_mrad))
        }
        _ => None,
    });
    let mut obstacles: Vec<(u16, i16)> = obstacles.collect();
    obstacles.sort_unstable();
    let mut nearest: Vec<(u16, i16)> = Vec::new();
    for (range_mm, bearing_mrad) in obstacles {
        let is_apart = |&(_, other_mrad): &(u16, i16)| {
            let turn_mrad = i32::from(bearing_mrad).abs_diff(other_mrad.into());
            turn_mrad.min(6283_u32.saturating_sub(turn_mrad)) >= config.separation_mrad.into()
        };
        if nearest.len() < 3 && nearest.iter().all(is_apart) {
            nearest.push((range_mm, bearing_mrad));
        }
    }
    nearest.into_iter().map(|(range_mm, _)| range_mm).collect()
}

impl fmt::Display for GvgAdherence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |count: usize| 100.0 * count as f64 / self.frames.max(1) as f64;
        write!(
            f,
            "the two nearest obstacles are equally near (within {} mm) in {:.0} % of the frames, the three nearest in {:.0} %",
            self.equidistance_mm,
            percent(self.on_graph),
            percent(self.at_meet_point),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_on_the_graph_when_two_obstacles_in_separate_bearings_are_equally_near() {
        // Eight sonars, 45 degrees apart: two neighbours are one obstacle, and the last is a neighbour of the first.
        let frame = |ranges_mm: [u16; 8]| RingFrame { echoes: ranges_mm.map(|range_mm| Echo::Range { range_mm }) };
        let measured = |ranges_mm| {
            let config = PlaceConfig::DEFAULT.with_separation_mrad(1047).with_equidistance_mm(150);
            let adherence = GvgAdherence::of(&[frame(ranges_mm)], &RingGeometry::even(), &config);
            (adherence.on_graph, adherence.at_meet_point)
        };
        assert_eq!(measured([500, 510, 900, 900, 900, 900, 900, 520]), (0, 0));
        assert_eq!(measured([500, 900, 900, 900, 650, 900, 900, 900]), (1, 0));
        assert_eq!(measured([500, 900, 900, 900, 651, 900, 900, 900]), (0, 0));
        assert_eq!(measured([500, 900, 600, 900, 650, 900, 900, 900]), (1, 1));
        assert_eq!(measured([500, 900, 20, 900, 9000, 900, 900, 900]), (0, 0), "invalid and silent sonars are ignored");
        assert_eq!(measured([7000; 8]), (0, 0));
    }

    #[test]
    fn the_text_gives_shares_of_all_frames() {
        let adherence = GvgAdherence { frames: 8, on_graph: 4, at_meet_point: 2, equidistance_mm: 150 };
        let text = adherence.to_string();
        assert!(text.contains("150 mm") && text.contains("50 %") && text.contains("25 %"), "{text}");
        assert!(!GvgAdherence::default().to_string().contains("NaN"));
    }
}
