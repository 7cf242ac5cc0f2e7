//! Recorded ring ranges: a CSV file with a column for each sonar and optionally the robot's pose, and a TOML file with the geometry
//! of the ring.

use std::io::Read;
use std::str::FromStr;

use anyhow::{Context, bail, ensure};
use csv::StringRecord;
use serde::Deserialize;
use toposlam::ring::{Echo, RingFrame, RingGeometry};
use toposlam_sim::world::{Point, Pose};

/// The largest ring that can be replayed. A smaller ring fills the first positions, and the others are dead.
pub const SONARS_MAX: usize = 32;

/// The description of a ring in a TOML file.
///
/// ```
/// let ring = toposlam_eval::range_csv::Ring::parse(
///     r#"
///     sonars = 4
///     unit = "mm"
///     max_range = 6000
///     columns = ["front", "left", "back", "right"]
///     bearings_deg = [0, 90, 180, -90]
///     "#,
/// )?;
/// assert_eq!(ring.geometry().bearings_mrad[..4], [0, 1571, 3142, -1571]);
/// # Ok::<(), anyhow::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// Number of sonars of the ring, 3 to 32.
    pub sonars: usize,
    /// The unit of the ranges.
    pub unit: Unit,
    /// Ranges from this value on mean silence, in `unit`.
    pub max_range: f64,
    /// The CSV column of each sonar.
    pub columns: Vec<String>,
    /// The bearing of each sonar in degrees, counter-clockwise from straight ahead. Alternative to `first_bearing_deg` and
    /// `step_deg`.
    #[serde(default)]
    pub bearings_deg: Vec<f64>,
    /// The bearing of the first sonar in degrees, counter-clockwise from straight ahead.
    #[serde(default)]
    pub first_bearing_deg: f64,
    /// The angle from each sonar to the next in degrees, counter-clockwise positive.
    #[serde(default)]
    pub step_deg: f64,
    /// The distance of the sensors from the centre of the ring, in `unit`. Ranges are measured from the sensors.
    #[serde(default)]
    pub ring_radius: f64,
}

/// The names of the columns of a pose: x, y and heading.
///
/// ```
/// let columns: toposlam_eval::range_csv::PoseColumns = "x,y,theta".parse()?;
/// # Ok::<(), anyhow::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PoseColumns([String; 3]);

impl FromStr for PoseColumns {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
        let Ok(names) = <[String; 3]>::try_from(names) else { bail!("three columns, X,Y,THETA") };
        Ok(Self(names))
    }
}

/// The frames of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recorded {
    /// The frames in order.
    pub frames: Vec<RingFrame<SONARS_MAX>>,
    /// The pose of each frame, `None` where the recording has none; empty if no columns of poses were requested.
    pub poses: Vec<Option<Pose>>,
    /// For each sonar the number of frames without a range, in which it is a dead sensor.
    pub blanks: Vec<usize>,
}

/// The unit of a recording's ranges.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// Metres.
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
}

impl Unit {
    /// One unit in millimetres.
    pub const fn mm(self) -> f64 {
        match self {
            Self::M => 1000.0,
            Self::Cm => 10.0,
            Self::Mm => 1.0,
        }
    }
}

impl Ring {
    /// Parses the description of a ring.
    ///
    /// # Errors
    /// The field that is missing, unknown or out of range.
    pub fn parse(text: &str) -> anyhow::Result<Self> {
        let mut ring: Self = toml::from_str(text).context("the ring's description")?;
        ensure!((3..=SONARS_MAX).contains(&ring.sonars), "sonars must be 3 to {SONARS_MAX}, not {}", ring.sonars);
        ensure!(ring.columns.len() == ring.sonars, "{} columns for {} sonars", ring.columns.len(), ring.sonars);
        ensure!(ring.max_range > 0.0, "max_range must be above 0");
        if ring.bearings_deg.is_empty() {
            ensure!(ring.step_deg != 0.0, "either bearings_deg or step_deg must be given");
            let bearing_deg = |sonar| ring.first_bearing_deg + ring.step_deg * sonar as f64;
            ring.bearings_deg = (0..ring.sonars).map(bearing_deg).collect();
        }
        let bearings = ring.bearings_deg.len();
        ensure!(bearings == ring.sonars, "{bearings} bearings for {} sonars", ring.sonars);
        for (number, bearing_deg) in ring.bearings_deg.iter().enumerate() {
            let apart_deg = |other: &f64| (other - bearing_deg + 180.0).rem_euclid(360.0) - 180.0;
            let same = ring.bearings_deg[..number].iter().find(|other| apart_deg(other).abs() < 1e-6);
            ensure!(same.is_none(), "two sonars in one direction, {bearing_deg}°");
        }
        Ok(ring)
    }

    /// A ring of sonars at equal distances, counter-clockwise from straight ahead, with ranges in millimetres.
    ///
    /// # Errors
    /// When the number of sonars is not 3 to [`SONARS_MAX`].
    pub fn even(sonars: usize) -> anyhow::Result<Self> {
        ensure!((3..=SONARS_MAX).contains(&sonars), "sonars must be 3 to {SONARS_MAX}, not {sonars}");
        Ok(Self {
            sonars,
            unit: Unit::Mm,
            max_range: f64::INFINITY,
            columns: (0..sonars).map(|sonar| sonar.to_string()).collect(),
            bearings_deg: (0..sonars).map(|sonar| 360.0 * sonar as f64 / sonars as f64).collect(),
            first_bearing_deg: 0.0,
            step_deg: 0.0,
            ring_radius: 0.0,
        })
    }

    /// The geometry of the ring.
    pub fn geometry(&self) -> RingGeometry<SONARS_MAX> {
        let mut geometry = RingGeometry { bearings_mrad: [0; SONARS_MAX] };
        for (bearing_mrad, bearing_deg) in geometry.bearings_mrad.iter_mut().zip(&self.bearings_deg) {
            let degrees = if *bearing_deg == 180.0 { 180.0 } else { (bearing_deg + 180.0).rem_euclid(360.0) - 180.0 };
            *bearing_mrad = (degrees.to_radians() * 1000.0).round() as i16;
        }
        geometry
    }

    /// Reads a recording; other columns are ignored.
    ///
    /// An empty, negative or unreadable range is a dead sensor. A range of `max_range` or more, or infinite, is
    /// silence. The position of a pose has the unit of the ranges, its heading is in radians.
    ///
    /// # Errors
    /// When a column is missing, or a line is no CSV or has too few fields.
    pub fn read(&self, csv_text: impl Read, poses: Option<&PoseColumns>) -> anyhow::Result<Recorded> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(csv_text);
        let headers = reader.headers().context("the recording's header line")?.clone();
        let positions = |names: &[String]| -> anyhow::Result<Vec<usize>> {
            names.iter().map(|name| position(&headers, name)).collect()
        };
        let of_ranges = positions(&self.columns)?;
        let of_pose = poses.map(|poses| positions(&poses.0)).transpose()?;
        let mut recorded = Recorded { blanks: vec![0; self.sonars], ..Recorded::default() };
        for record in reader.records() {
            let record = record?;
            let mut frame = RingFrame { echoes: [Echo::Dead; SONARS_MAX] };
            for ((echo, position), blanks) in frame.echoes.iter_mut().zip(&of_ranges).zip(&mut recorded.blanks) {
                *echo = self.echo(record.get(*position).unwrap_or(""));
                *blanks += usize::from(*echo == Echo::Dead);
            }
            recorded.frames.push(frame);
            if let Some(of_pose) = &of_pose {
                recorded.poses.push(self.pose(&record, of_pose));
            }
        }
        Ok(recorded)
    }

    fn pose(&self, record: &StringRecord, positions: &[usize]) -> Option<Pose> {
        let field = |number: usize| {
            let value: f64 = record.get(*positions.get(number)?)?.parse().ok()?;
            value.is_finite().then_some(value)
        };
        let position = Point::new(field(0)? * self.unit.mm(), field(1)? * self.unit.mm());
        Some(Pose { position, heading_rad: field(2)? })
    }

    fn echo(&self, field: &str) -> Echo {
        match field.parse::<f64>() {
            Ok(range) if range >= self.max_range => Echo::Silence,
            Ok(range) if range >= 0.0 => {
                let range_mm = ((range + self.ring_radius) * self.unit.mm()).round();
                Echo::Range { range_mm: range_mm.min(f64::from(u16::MAX)) as u16 }
            }
            _ => Echo::Dead,
        }
    }
}

/// The position of a column.
fn position(headers: &StringRecord, name: &str) -> anyhow::Result<usize> {
    let Some(position) = headers.iter().position(|header| header == name) else {
        let first = headers.get(0).unwrap_or("");
        bail!("no column {name:?}: the first line must name the columns, and begins with {first:?}");
    };
    Ok(position)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FOUR: &str =
        "sonars = 4\nunit = \"cm\"\nmax_range = 600\ncolumns = [\"a\", \"b\", \"c\", \"d\"]\nstep_deg = 90\n";

    #[test]
    fn columns_are_found_by_name_and_ranges_scaled() {
        let ring = Ring::parse(FOUR).unwrap();
        let frames = ring.read("x,d,c,b,a\nfoo,1,2.5,600,\nbar,inf,-1,abc,9999".as_bytes(), None).unwrap();
        let Recorded { frames, poses, blanks } = frames;
        assert_eq!((frames.len(), poses.len()), (2, 0));
        assert_eq!(blanks, [1, 1, 1, 0]);
        let range = |range_mm| Echo::Range { range_mm };
        assert_eq!(frames[0].echoes[..5], [Echo::Dead, Echo::Silence, range(25), range(10), Echo::Dead]);
        assert_eq!(frames[1].echoes[..4], [Echo::Silence, Echo::Dead, Echo::Dead, Echo::Silence]);
    }

    #[test]
    fn a_recording_with_a_missing_column_or_a_short_line_is_rejected() {
        let ring = Ring::parse(FOUR).unwrap();
        assert!(ring.read("a,b,c\n1,2,3".as_bytes(), None).unwrap_err().to_string().contains("\"d\""));
        assert!(ring.read("a,b,c,d\n1,2,3".as_bytes(), None).is_err());
        let no_header = ring.read("0.438,2,3,4".as_bytes(), None).unwrap_err().to_string();
        assert_eq!(no_header, "no column \"a\": the first line must name the columns, and begins with \"0.438\"");
    }

    #[test]
    fn poses_are_read_in_the_unit_of_the_ranges() {
        let ring = Ring::parse(FOUR).unwrap();
        let columns: PoseColumns = "px,py,phi".parse().unwrap();
        let text = "a,b,c,d,px,py,phi\n1,1,1,1,100,-50,0.5\n1,1,1,1,,0,0\n1,1,1,1,0,0,nan";
        let recorded = ring.read(text.as_bytes(), Some(&columns)).unwrap();
        let first = Pose { position: Point::new(1000.0, -500.0), heading_rad: 0.5 };
        assert_eq!(recorded.poses, [Some(first), None, None]);
        let missing = ring.read("a,b,c,d\n1,2,3,4".as_bytes(), Some(&columns)).unwrap_err().to_string();
        assert!(missing.contains("\"px\""), "{missing}");
        assert!("x,y".parse::<PoseColumns>().is_err());
    }

    #[test]
    fn an_inconsistent_ring_is_rejected() {
        assert!(Ring::parse(&FOUR.replace("sonars = 4", "sonars = 5")).is_err());
        assert!(Ring::parse(&FOUR.replace("sonars = 4", "sonars = 2")).is_err());
        assert!(Ring::parse(&FOUR.replace("step_deg = 90", "")).is_err());
        assert!(Ring::parse(&format!("{FOUR}bearings_deg = [1, 2]")).is_err());
        assert!(Ring::parse(&format!("{FOUR}typo = 1")).is_err());
    }

    #[test]
    fn the_bearings_of_the_shipped_ring_run_clockwise_from_the_front() {
        let ring = Ring::parse(include_str!("../rings/scitos-g5.toml")).unwrap();
        let bearings_mrad = ring.geometry().bearings_mrad;
        assert_eq!((bearings_mrad[0], bearings_mrad[6], bearings_mrad[23]), (0, -1571, 262));
    }
}
