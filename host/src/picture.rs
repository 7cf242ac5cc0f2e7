//! Pictures: a map over its floor plan, as SVG.

use svg::Document;
use svg::node::element::{Circle, Group, Line, Path, Polyline, Rectangle, Text, Title, path::Data};

use crate::mapping::Mapping;
use crate::world::{Detection, Plan, Point, TrueMap};

/// A vertex of the map to be drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Vertex {
    /// Where it is drawn; for a map without coordinates, the mean true position at its visits.
    pub position: Point,
    /// The radius of its fingerprint, in millimetres.
    pub radius_mm: f64,
    /// What is written at it.
    pub label: String,
}

/// A map to be drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// The edges, as indices of vertices; an edge from a vertex to itself is a loop.
    pub edges: Vec<(usize, usize)>,
    /// What is written below.
    pub caption: String,
}

impl Drawing {
    /// A map as a drawing, each vertex at the mean true position of the places that were taken for it.
    pub fn of_mapping<const SONARS: usize>(
        mapping: &Mapping<SONARS>,
        detections: &[Detection],
        caption: String,
    ) -> Self {
        let map = mapping.map();
        let visits_of = |vertex: u8| {
            let visits =
                mapping.path().iter().zip(detections).filter(move |&(&visited, _)| visited == usize::from(vertex));
            visits.map(|(_, detection)| detection.position)
        };
        let vertices = (0..map.vertices()).map(|vertex| {
            let visits = visits_of(vertex).count().max(1) as f64;
            let radius_mm = map.label(vertex).map_or(0, |label| label.radius_mm());
            Vertex {
                position: Point {
                    x_mm: visits_of(vertex).map(|position| position.x_mm).sum::<f64>() / visits,
                    y_mm: visits_of(vertex).map(|position| position.y_mm).sum::<f64>() / visits,
                },
                radius_mm: radius_mm.into(),
                label: format!("{vertex}: {:.2} m", f64::from(radius_mm) / 1000.0),
            }
        });
        let edges = map.edges().map(|(a, b)| (usize::from(a), usize::from(b))).collect();
        Self { vertices: vertices.collect(), edges, caption }
    }

    /// The truth as a drawing, its nodes labelled with their number and radius.
    pub fn of_truth(map: &TrueMap, caption: String) -> Self {
        let vertices = map.nodes.iter().enumerate().map(|(index, node)| Vertex {
            position: node.position,
            radius_mm: node.radius_mm,
            label: format!("{index}: {:.2} m", node.radius_mm / 1000.0),
        });
        let edges = map.edges.iter().map(|edge| (edge.nodes[0], edge.nodes[1])).collect();
        Self { vertices: vertices.collect(), edges, caption }
    }
}

const MARGIN_MM: f64 = 600.0;
const MAP_COLOUR: &str = "#b3261e";

/// Draws a map over its floor plan: walls grey, the true Voronoi graph faint, each vertex with the disc of its radius.
///
/// One unit of the picture is 1 mm of the building; edges of the map that name no vertex are left out.
pub fn draw(plan: &Plan, truth: &TrueMap, drawing: &Drawing) -> String {
    let (width_mm, height_mm) = (plan.width_mm(), plan.height_mm());
    // The building's y axis points up, the picture's down.
    let at = |point: Point| (point.x_mm, height_mm - point.y_mm);
    let mut document = Document::new()
        .set("viewBox", (0, 0, width_mm, height_mm + 2.0 * MARGIN_MM))
        .set("width", width_mm / 25.0)
        .set("font-family", "sans-serif")
        .add(Rectangle::new().set("width", "100%").set("height", "100%").set("fill", "white"))
        .add(walls(plan));
    let mut ways = Group::new().set("fill", "none").set("stroke", "#7a9cc6").set("stroke-width", 50);
    for edge in &truth.edges {
        let points: Vec<String> =
            edge.way.iter().map(|point| at(*point)).map(|(x, y)| format!("{x:.0},{y:.0}")).collect();
        ways = ways.add(Polyline::new().set("points", points.join(" ")));
    }
    document = document.add(ways);
    let mut edges = Group::new().set("fill", "none").set("stroke", MAP_COLOUR).set("stroke-width", 90);
    for (from, to) in &drawing.edges {
        let (Some(from), Some(to)) = (drawing.vertices.get(*from), drawing.vertices.get(*to)) else { continue };
        let ((x1, y1), (x2, y2)) = (at(from.position), at(to.position));
        edges = if from == to {
            edges.add(Circle::new().set("cx", x1).set("cy", y1 - 350.0).set("r", 350))
        } else {
            edges.add(Line::new().set("x1", x1).set("y1", y1).set("x2", x2).set("y2", y2))
        };
    }
    document = document.add(edges);
    for vertex in &drawing.vertices {
        let (x, y) = at(vertex.position);
        let disc = Circle::new().set("cx", x).set("cy", y).set("r", vertex.radius_mm);
        document = document
            .add(
                disc.set("fill", MAP_COLOUR)
                    .set("fill-opacity", 0.12)
                    .set("stroke", MAP_COLOUR)
                    .set("stroke-width", 25),
            )
            .add(Circle::new().set("cx", x).set("cy", y).set("r", 180).set("fill", MAP_COLOUR))
            .add(words(&vertex.label, x + 250.0, y - 250.0, 420.0));
    }
    document
        .add(words(&drawing.caption, 300.0, height_mm + 1.3 * MARGIN_MM, 520.0))
        .add(Title::new(&*drawing.caption))
        .to_string()
}

/// The wall cells, a rectangle for each run of them in a row.
fn walls(plan: &Plan) -> Path {
    let cell_mm = f64::from(plan.cell_mm());
    let (columns, rows) = (plan.columns() as i32, plan.rows() as i32);
    let mut data = Data::new();
    for row in 0..rows {
        let mut column = 0;
        while column < columns {
            let run = (column..columns).take_while(|column| plan.is_wall(*column, row)).count() as i32;
            if run > 0 {
                let (x, y) = (f64::from(column) * cell_mm, f64::from(rows - 1 - row) * cell_mm);
                let run_mm = f64::from(run) * cell_mm;
                data = data.move_to((x, y)).horizontal_line_by(run_mm).vertical_line_by(cell_mm);
                data = data.horizontal_line_by(-run_mm).close();
            }
            column += run.max(1);
        }
    }
    Path::new().set("d", data).set("fill", "#c9c9c9")
}

fn words(words: &str, x: f64, y: f64, size_mm: f64) -> Text {
    Text::new(words).set("x", x).set("y", y).set("font-size", size_mm).set("fill", "#222222")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_holds_every_vertex_edge_and_way_and_its_words_are_escaped() {
        let plan = Plan::built_in("ring").unwrap();
        let truth = TrueMap::of(&plan).unwrap();
        let mut drawing = Drawing::of_truth(&truth, "a < b & c".to_owned());
        drawing.edges.push((0, 0));
        drawing.edges.push((0, 99));
        let picture = draw(&plan, &truth, &drawing);
        assert_eq!(picture.matches("<polyline").count(), truth.edges.len());
        assert_eq!(picture.matches("<line").count(), truth.edges.len());
        assert_eq!(picture.matches("<circle").count(), 2 * truth.nodes.len() + 1);
        assert!(picture.contains("a &lt; b &amp; c"));
    }
}
