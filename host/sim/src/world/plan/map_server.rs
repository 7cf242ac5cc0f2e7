//! Maps of the ROS map_server: a YAML file that names an image and gives its scale and thresholds.

use std::path::Path;

use super::bitmap::Bitmap;
use super::contour::{PER_CELL, trace};
use super::rings::{Shape, row_free};
use super::{CELL_MM, Drawn, PlanError, PlanFileError, pgm, rings, scaled};
use crate::world::Point;
use crate::world::walls::Segment;

/// How far a corner of a cell may lie from the simplified wall, in cells.
const TOLERANCE_CELLS: f64 = 0.6;

/// What a YAML file says about an image.
#[derive(Clone, Debug, PartialEq)]
struct Settings {
    image: String,
    resolution_m: f64,
    origin_m: (f64, f64),
    is_negated: bool,
    free_below: f64,
}

/// Reads a YAML file and the image that it names.
pub(super) fn load(file: &Path) -> Result<Drawn, PlanFileError> {
    let read = |file: &Path| {
        let failed =
            |error: std::io::Error| PlanFileError { file: file.to_owned(), error: PlanError::Read(error.to_string()) };
        std::fs::read(file).map_err(failed)
    };
    let text = read(file)?;
    let at = |file: &Path| {
        let file = file.to_owned();
        move |error| PlanFileError { file, error }
    };
    let settings = Settings::parse(&String::from_utf8_lossy(&text)).map_err(at(file))?;
    let image = file.parent().unwrap_or(Path::new("")).join(&settings.image);
    settings.plan(&read(&image)?).map_err(at(&image))
}

impl Settings {
    /// Reads `key: value` lines; keys that say nothing about walls are passed over.
    fn parse(text: &str) -> Result<Self, PlanError> {
        let text = text.trim_start_matches('\u{feff}');
        const RESOLUTION: &str = "a number of metres from 0.01 to 1";
        const IMAGE: &str = "the name of a PNG or PGM file";
        const THRESHOLD: &str = "a number from 0 to 1";
        let (mut image, mut resolution_m, mut origin_m) = (None, None, (0.0, 0.0));
        let (mut is_negated, mut occupied_above, mut free_below) = (false, 0.65, 0.196);
        let mut thresholds_at = 0;
        for (line, content) in (1..).zip(text.lines()) {
            let content = content.split_once(" #").map_or(content, |(content, _)| content);
            let Some((key, value)) = content.split_once(':').filter(|_| !content.trim_start().starts_with('#')) else {
                continue;
            };
            let value = value.trim().trim_matches(['"', '\'']);
            let wrong = |key, allowed| PlanError::YamlValue { line, key, allowed };
            let share = || value.parse().ok().filter(|share| (0.0..=1.0).contains(share));
            match key.trim() {
                "image" => image = Some(value.to_owned()).filter(|value| !value.is_empty()),
                "resolution" => {
                    let number = value.parse::<f64>().ok().filter(|metres| CELL_MM.contains(&(1000.0 * metres)));
                    resolution_m = Some(number.ok_or(wrong("resolution", RESOLUTION))?);
                }
                "origin" => {
                    let allowed = "[x, y, 0] in metres; a map that is turned is not read";
                    let numbers = value.strip_prefix('[').and_then(|value| value.strip_suffix(']'));
                    let numbers: Option<Vec<f64>> =
                        numbers.and_then(|list| list.split(',').map(|number| number.trim().parse().ok()).collect());
                    origin_m = match numbers.as_deref() {
                        Some([x, y] | [x, y, 0.0]) if x.is_finite() && y.is_finite() => (*x, *y),
                        _ => return Err(wrong("origin", allowed)),
                    };
                }
                "negate" => {
                    is_negated = match value {
                        "0" | "false" => false,
                        "1" | "true" => true,
                        _ => return Err(wrong("negate", "0 or 1")),
                    };
                }
                "occupied_thresh" => {
                    (occupied_above, thresholds_at) = (share().ok_or(wrong("occupied_thresh", THRESHOLD))?, line);
                }
                "free_thresh" => {
                    (free_below, thresholds_at) = (share().ok_or(wrong("free_thresh", THRESHOLD))?, line);
                }
                "mode" if value != "trinary" => return Err(wrong("mode", "trinary")),
                _ => {}
            }
        }
        if free_below > occupied_above {
            let (key, allowed) = ("free_thresh", "at most occupied_thresh");
            return Err(PlanError::YamlValue { line: thresholds_at, key, allowed });
        }
        let missing = |key, allowed| PlanError::YamlKey { key, allowed };
        Ok(Self {
            image: image.ok_or(missing("image", IMAGE))?,
            resolution_m: resolution_m.ok_or(missing("resolution", RESOLUTION))?,
            origin_m,
            is_negated,
            free_below,
        })
    }

    /// The plan of an image. What is not known to be free is wall.
    fn plan(&self, image: &[u8]) -> Result<Drawn, PlanError> {
        let grey = pgm::read(image)?;
        let occupied = |pixel: f32| f64::from(if self.is_negated { pixel } else { 1.0 - pixel });
        let northernmost_first = grey.pixels.chunks_exact(grey.columns);
        let free = northernmost_first.rev().flatten().map(|pixel| occupied(*pixel) < self.free_below).collect();
        let bitmap = Bitmap::new(grey.columns, free);
        let cell_mm = 1000.0 * self.resolution_m;
        let unit_mm = cell_mm / f64::from(PER_CELL);
        let contours = trace(&bitmap, TOLERANCE_CELLS);
        let in_mm =
            |contour: &Vec<_>| contour.iter().map(|at| scaled(Segment { from: *at, to: *at }, unit_mm).from).collect();
        let shape = Shape { rings: contours.iter().map(in_mm).collect(), is_free: true };
        let size_mm = (bitmap.columns() as f64 * cell_mm, bitmap.rows() as f64 * cell_mm);
        let origin_mm = Point::new(1000.0 * self.origin_m.0, 1000.0 * self.origin_m.1);
        let segments = rings::outlines(&shape);
        let shapes = [shape];
        Drawn::new(segments, size_mm, origin_mm, None, |y, xs| row_free(&shapes, y, xs))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Plan;

    const YAML: &str = "image: map.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";

    fn with(line: &str) -> Result<Settings, PlanError> {
        let key = line.split(':').next().unwrap();
        let others = YAML.lines().filter(|other| !other.starts_with(key)).collect::<Vec<_>>().join("\n");
        Settings::parse(&format!("{others}\n{line}\n"))
    }

    #[test]
    fn the_settings_of_a_map_are_read() {
        let settings = Settings::parse(YAML).unwrap();
        assert_eq!(
            (settings.image.as_str(), settings.resolution_m, settings.origin_m),
            ("map.pgm", 0.05, (-1.0, -2.0))
        );
        assert_eq!((settings.is_negated, settings.free_below), (false, 0.196));
        let quoted = with("image: \"other map.png\" # a comment\nmode: trinary\ncolour: red").unwrap();
        assert_eq!(quoted.image, "other map.png");
        assert!(with("negate: true").unwrap().is_negated);
    }

    #[test]
    fn a_setting_that_is_not_allowed_is_named_with_its_line() {
        for (line, key) in [
            ("resolution: -0.05", "resolution"),
            ("resolution: 0", "resolution"),
            ("resolution: wide", "resolution"),
            ("resolution: nan", "resolution"),
            ("origin: [0, 0, 1.57]", "origin"),
            ("origin: [0]", "origin"),
            ("origin: 0, 0, 0", "origin"),
            ("negate: 2", "negate"),
            ("mode: scale", "mode"),
            ("occupied_thresh: 1.5", "occupied_thresh"),
            ("free_thresh: 0.9", "free_thresh"),
        ] {
            let error = with(line).unwrap_err();
            let expected_line = line_of(line);
            assert!(
                matches!(error, PlanError::YamlValue { line, key: named, .. } if line == expected_line && named == key),
                "{line}: {error:?}"
            );
        }
        fn line_of(line: &str) -> usize {
            if line.starts_with("mode") { 7 } else { 6 }
        }
        for key in ["image", "resolution"] {
            let text: String =
                YAML.lines().filter(|line| !line.starts_with(key)).map(|line| format!("{line}\n")).collect();
            assert!(matches!(Settings::parse(&text), Err(PlanError::YamlKey { key: named, .. }) if named == key));
        }
    }

    /// A room of 2 by 1 m with a wall of 0.2 m around it, in pixels of 50 mm; unknown outside.
    fn room() -> Vec<u8> {
        let mut image = b"P5 60 40 255\n".to_vec();
        for y in 0..40 {
            image.extend((0..60).map(|x| match (x, y) {
                (10..50, 10..30) => 254,
                (6..54, 6..34) => 0,
                _ => 205,
            }));
        }
        image
    }

    #[test]
    fn a_map_is_a_plan_in_its_own_frame() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("map.pgm"), room()).unwrap();
        let file = folder.path().join("map.yaml");
        std::fs::write(&file, YAML).unwrap();
        let plan = Plan::load(&file).unwrap();
        assert_eq!(plan.surfaces(), 4);
        assert_eq!((plan.width_mm(), plan.height_mm()), (3000.0, 2000.0));
        assert!(!plan.is_wall_at(Point::new(510.0, 510.0)) && plan.is_wall_at(Point::new(100.0, 100.0)));
        assert!((plan.in_file_m(plan.start()).1 - -1.0).abs() < 0.1, "{:?}", plan.start());
        let moved = plan.with_start_m(0.1, -1.0);
        assert_eq!(moved.start(), Point::new(1100.0, 1000.0));
        std::fs::write(folder.path().join("map.pgm"), &room()[..1000]).unwrap();
        let error = Plan::load(&file).unwrap_err();
        assert!(error.file.ends_with("map.pgm") && matches!(error.error, PlanError::Truncated { .. }), "{error}");
        std::fs::remove_file(folder.path().join("map.pgm")).unwrap();
        assert!(matches!(Plan::load(&file).unwrap_err().error, PlanError::Read(_)));
        assert_eq!(Plan::load(&folder.path().join("map.pgm")).unwrap_err().error, PlanError::NoYaml);
    }
}
