//! SVG drawings: dark shapes are wall and light ones free, painted one over the other on a ground of wall (docs/plans.md).

use roxmltree::{Document, Node};

use super::rings::{Shape, border, row_free};
use super::{Drawn, PlanError};
use crate::world::Point;
use crate::world::walls::Vertex;

/// The longest side of a drawing, in millimetres.
const SIDE_MAX_MM: f64 = 1e6;
/// The most corners of all shapes.
const CORNERS_MAX: usize = 20_000;
/// A circle is drawn as a polygon whose sides lie within this of it, in millimetres.
const ROUND_MM: f64 = 5.0;

const COLOUR: &str = "fill, or stroke of a line, to be black, white, none, #rgb or #rrggbb";
const NUMBER: &str = "finite numbers without a unit, in millimetres";
const PATH: &str = "a path of M, L, H, V and Z";

/// Reads a drawing.
pub(super) fn parse(text: &str) -> Result<Drawn, PlanError> {
    let document = Document::parse(text).map_err(|error| PlanError::Xml(error.to_string()))?;
    let mut reader = Reader { document: &document, shapes: Vec::new(), start: None, corners: 0, frame: [0.0; 4] };
    let root = document.root_element();
    let frame = root.attribute("viewBox").and_then(numbers).and_then(|list| <[f64; 4]>::try_from(list).ok());
    let is_sound = |frame: &[f64; 4]| frame[2..].iter().all(|side| (1.0..=SIDE_MAX_MM).contains(side));
    let allowed = "viewBox=\"x y width height\" in millimetres, at most 1000000";
    reader.frame = frame.filter(is_sound).ok_or_else(|| reader.wrong(root, allowed))?;
    for node in root.descendants().filter(Node::is_element) {
        reader.read(node)?;
    }
    let Reader { shapes, start, frame, .. } = reader;
    let segments = border(&shapes);
    Drawn::new(segments, (frame[2], frame[3]), Point::default(), start, |y, xs| row_free(&shapes, y, xs))
}

/// What has been read so far.
struct Reader<'a> {
    document: &'a Document<'a>,
    /// The shapes in the order in which they are painted.
    shapes: Vec<Shape>,
    start: Option<Point>,
    corners: usize,
    /// x, y, width and height of the drawing.
    frame: [f64; 4],
}

impl Reader<'_> {
    fn wrong(&self, node: Node<'_, '_>, allowed: &'static str) -> PlanError {
        let line = self.document.text_pos_at(node.range().start).row;
        PlanError::Svg { line, element: node.tag_name().name().to_owned(), allowed }
    }

    /// The value of a numeric attribute; `None` is the default without one.
    fn number(&self, node: Node<'_, '_>, name: &str, default: Option<f64>) -> Result<f64, PlanError> {
        let value = match node.attribute(name) {
            Some(text) => text.trim().parse().ok().filter(|value: &f64| value.abs() <= SIDE_MAX_MM),
            None => default,
        };
        value.ok_or_else(|| self.wrong(node, NUMBER))
    }

    fn read(&mut self, node: Node<'_, '_>) -> Result<(), PlanError> {
        if node.has_attribute("transform") {
            return Err(self.wrong(node, "no transform"));
        }
        let number = |name| self.number(node, name, None);
        match node.tag_name().name() {
            "rect" => {
                let (x, y) = (self.number(node, "x", Some(0.0))?, self.number(node, "y", Some(0.0))?);
                let (width, height) = (number("width")?, number("height")?);
                let ring = vec![(x, y), (x + width, y), (x + width, y + height), (x, y + height)];
                self.fill(node, vec![ring])
            }
            "circle" | "ellipse" if node.attribute("id") == Some("start") => {
                self.start = Some(self.placed((number("cx")?, number("cy")?)));
                Ok(())
            }
            "circle" => {
                let (x, y, radius) = (number("cx")?, number("cy")?, number("r")?);
                self.fill(node, vec![circle((x, y), radius.max(1.0))])
            }
            "polygon" => {
                let ring = points(node.attribute("points")).ok_or_else(|| self.wrong(node, NUMBER))?;
                self.fill(node, vec![ring])
            }
            "line" => {
                let way = vec![(number("x1")?, number("y1")?), (number("x2")?, number("y2")?)];
                self.stroke(node, &way)
            }
            "polyline" => {
                let way = points(node.attribute("points")).ok_or_else(|| self.wrong(node, NUMBER))?;
                self.stroke(node, &way)
            }
            "path" => {
                let rings = node.attribute("d").and_then(path).ok_or_else(|| self.wrong(node, PATH))?;
                self.fill(node, rings)
            }
            "svg" | "g" | "title" | "desc" | "metadata" | "defs" | "text" | "tspan" => Ok(()),
            _ => Err(self.wrong(node, "rect, circle, polygon, path, line, polyline or g")),
        }
    }

    /// Adds a filled shape.
    fn fill(&mut self, node: Node<'_, '_>, rings: Vec<Vec<(f64, f64)>>) -> Result<(), PlanError> {
        let Some(is_free) = self.is_light(node, "fill", Some("black"))? else { return Ok(()) };
        self.corners += rings.iter().map(Vec::len).sum::<usize>();
        if self.corners > CORNERS_MAX {
            return Err(self.wrong(node, "20000 corners at most"));
        }
        let rings = rings.into_iter().map(|ring| {
            let whole = |at| {
                let Point { x_mm, y_mm } = self.placed(at);
                (x_mm.round() as i32, y_mm.round() as i32)
            };
            let mut ring: Vec<Vertex> = ring.into_iter().map(whole).collect();
            ring.dedup();
            ring
        });
        let shape = Shape { rings: rings.filter(|ring| ring.len() > 2).collect(), is_free };
        self.shapes.push(shape);
        Ok(())
    }

    /// Adds the wall or gap along a line.
    fn stroke(&mut self, node: Node<'_, '_>, way: &[(f64, f64)]) -> Result<(), PlanError> {
        let width =
            self.number(node, "stroke-width", inherited(node, "stroke-width").and_then(|text| text.parse().ok()))?;
        let Some(is_free) = self.is_light(node, "stroke", None)? else { return Ok(()) };
        let before = self.shapes.len();
        for ends in way.windows(2) {
            let ((x, y), (to_x, to_y)) = (ends[0], ends[1]);
            let length = (to_x - x).hypot(to_y - y).max(1.0);
            // Square ends, so that walls close in a corner.
            let (along_x, along_y) = ((to_x - x) / length * width / 2.0, (to_y - y) / length * width / 2.0);
            let ring = vec![
                (x - along_x - along_y, y - along_y + along_x),
                (x - along_x + along_y, y - along_y - along_x),
                (to_x + along_x + along_y, to_y + along_y - along_x),
                (to_x + along_x - along_y, to_y + along_y + along_x),
            ];
            self.fill(node, vec![ring])?;
        }
        self.shapes[before..].iter_mut().for_each(|shape| shape.is_free = is_free);
        Ok(())
    }

    /// Whether a shape is light; `None` when it is not painted.
    fn is_light(&self, node: Node<'_, '_>, name: &str, default: Option<&str>) -> Result<Option<bool>, PlanError> {
        if node.has_attribute("style") || node.has_attribute("class") {
            return Err(self.wrong(node, "fill and stroke as attributes, no style and no class"));
        }
        let Some(colour) = inherited(node, name).or(default) else { return Ok(None) };
        let digits = |width: usize| {
            let channels = (0..3).map(|channel| colour.get(1 + channel * width..1 + (channel + 1) * width));
            let most = 16_u32.pow(width as u32) - 1;
            channels.map(|channel| Some(u32::from_str_radix(channel?, 16).ok()? * 255 / most)).sum::<Option<u32>>()
        };
        let brightness = match colour {
            "none" => return Ok(None),
            "black" => Some(0),
            "white" => Some(3 * 255),
            _ if colour.starts_with('#') && colour.len() == 4 => digits(1),
            _ if colour.starts_with('#') && colour.len() == 7 => digits(2),
            _ => None,
        };
        brightness.map(|brightness| Some(brightness > 3 * 127)).ok_or_else(|| self.wrong(node, COLOUR))
    }

    /// A point of the drawing, whose y axis points down, as one of the plan.
    fn placed(&self, (x, y): (f64, f64)) -> Point {
        Point::new(x - self.frame[0], self.frame[1] + self.frame[3] - y)
    }
}

/// The value of an attribute of an element, or of the groups around it.
fn inherited<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    node.ancestors().find_map(|node| node.attribute(name)).map(str::trim)
}

/// Numbers apart by white space or commas.
fn numbers(text: &str) -> Option<Vec<f64>> {
    let words = text.split(|character: char| character.is_whitespace() || character == ',');
    let number = |word: &str| word.parse().ok().filter(|value: &f64| value.abs() <= SIDE_MAX_MM);
    words.filter(|word| !word.is_empty()).map(number).collect()
}

fn points(text: Option<&str>) -> Option<Vec<(f64, f64)>> {
    let numbers = numbers(text?)?;
    (numbers.len() % 2 == 0).then(|| numbers.chunks_exact(2).map(|point| (point[0], point[1])).collect())
}

fn circle((x, y): (f64, f64), radius: f64) -> Vec<(f64, f64)> {
    let sides = (std::f64::consts::PI / (1.0 - ROUND_MM / radius.max(2.0 * ROUND_MM)).acos()).ceil().max(8.0);
    let corner = |side: f64| {
        let (sine, cosine) = (side / sides * std::f64::consts::TAU).sin_cos();
        (x + radius * cosine, y + radius * sine)
    };
    (0..sides as u32).map(|side| corner(f64::from(side))).collect()
}

/// The rings of a path of straight lines.
fn path(text: &str) -> Option<Vec<Vec<(f64, f64)>>> {
    let mut rings: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut at = (0.0, 0.0);
    let mut rest = text.trim();
    while let Some(command) = rest.chars().next() {
        let after = rest.get(1..)?;
        let end =
            after.find(|character: char| character.is_ascii_alphabetic() && character != 'e').unwrap_or(after.len());
        let values = numbers(&after[..end].replace('-', " -").replace("e -", "e-"))?;
        rest = after[end..].trim_start();
        let base = |at: (f64, f64)| if command.is_ascii_lowercase() { at } else { (0.0, 0.0) };
        match command.to_ascii_uppercase() {
            'M' | 'L' if values.len() % 2 == 0 && !values.is_empty() => {
                for (index, point) in values.chunks_exact(2).enumerate() {
                    at = (base(at).0 + point[0], base(at).1 + point[1]);
                    if index == 0 && command.eq_ignore_ascii_case(&'m') {
                        rings.push(Vec::new());
                    }
                    rings.last_mut()?.push(at);
                }
            }
            'H' => {
                for x in values {
                    at.0 = base(at).0 + x;
                    rings.last_mut()?.push(at);
                }
            }
            'V' => {
                for y in values {
                    at.1 = base(at).1 + y;
                    rings.last_mut()?.push(at);
                }
            }
            'Z' if values.is_empty() => at = *rings.last()?.first()?,
            _ => return None,
        }
    }
    Some(rings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::Plan;

    fn plan(content: &str) -> Result<Plan, PlanError> {
        Plan::parse(&format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 6000 4000\">\n{content}\n</svg>"))
    }

    #[test]
    fn rooms_walls_and_doors_are_painted_one_over_the_other() {
        let plan = plan(
            "<rect x='200' y='200' width='5600' height='3600' fill='white'/>
             <g stroke='black' stroke-width='100'><line x1='3000' y1='100' x2='3000' y2='3900'/></g>
             <path d='M2900 1000h200v900h-200Z' fill='#fff'/>
             <circle cx='1500' cy='3000' r='150'/>
             <circle id='start' cx='1000' cy='1000' r='10'/>",
        )
        .unwrap();
        assert_eq!(plan.start(), Point::new(1000.0, 3000.0));
        let free = |x_mm, y_mm| !plan.is_wall_at(Point::new(x_mm, y_mm));
        assert!(free(1000.0, 1000.0 + 500.0) && free(3000.0, 2500.0) && free(5000.0, 300.0));
        assert!(!free(3000.0, 1500.0) && !free(1500.0, 1000.0) && !free(100.0, 100.0));
        // Four walls of two rooms joined by a door, and the column.
        assert_eq!(plan.surfaces(), 12 + 13);
    }

    #[test]
    fn what_is_not_part_of_a_plan_is_named_with_its_line() {
        let at_line_2 = |content: &str| match plan(content) {
            Err(PlanError::Svg { line: 2, element, allowed }) => (element, allowed),
            other => panic!("{content}: {other:?}"),
        };
        assert_eq!(at_line_2("<image href='x.png'/>").0, "image");
        assert_eq!(at_line_2("<rect width='2m' height='3'/>"), ("rect".to_owned(), NUMBER));
        assert_eq!(at_line_2("<rect width='1e9' height='3'/>").1, NUMBER);
        assert_eq!(at_line_2("<rect width='1' height='nan'/>").1, NUMBER);
        assert_eq!(at_line_2("<polygon points='1 2 3'/>").1, NUMBER);
        assert_eq!(at_line_2("<path d='M1 2C3 4 5 6 7 8'/>").1, PATH);
        assert_eq!(at_line_2("<path d='L1 2'/>").1, PATH);
        assert_eq!(at_line_2("<rect width='1' height='2' fill='red'/>").1, COLOUR);
        assert_eq!(at_line_2("<g transform='scale(2)'/>").1, "no transform");
        assert!(matches!(Plan::parse("<svg><rect"), Err(PlanError::Xml(_))));
        assert!(matches!(Plan::parse("<svg/>"), Err(PlanError::Svg { line: 1, .. })));
        assert!(matches!(Plan::parse("<svg viewBox='0 0 -1 5'/>"), Err(PlanError::Svg { .. })));
        assert_eq!(plan("<rect width='100' height='100'/>").unwrap_err(), PlanError::NoFreeSpace);
    }
}
