//! Drawings of a map over its floor plan, as SVG.

mod animation;

pub use animation::{Step, animate};

use std::cmp::Reverse;

use svg::Document;
use svg::node::element::{Circle, Group, Path, Polyline, Rectangle, Title, path::Data};
use toposlam::Map;

use toposlam_link::export::marks::{self, MAP_COLOUR, Mark, words};
use toposlam_sim::world::{Detection, Plan, Point, TrueMap};

/// A vertex of the map to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Vertex {
    /// True position; vertices at the same position are drawn side by side.
    pub position: Point,
    /// Radius of its fingerprint, in millimetres.
    pub radius_mm: f64,
    /// Text of the label.
    pub name: String,
}

/// A map to draw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// The edges, as indices of vertices; an edge from a vertex to itself is a self-loop.
    pub edges: Vec<(usize, usize)>,
    /// The caption.
    pub caption: String,
}

impl Drawing {
    /// A map with each vertex at the true node of the majority of its visits.
    pub fn of_map<const V: usize>(
        map: &Map<V>,
        path: &[Option<usize>],
        detections: &[Detection],
        caption: String,
    ) -> Self {
        let vertices = map.vertices().zip(map.labels()).map(|(vertex, label)| {
            let visits = path.iter().zip(detections).filter(|&(&visited, _)| visited == Some(vertex.index()));
            Vertex {
                position: mostly_at(&visits.map(|(_, detection)| *detection).collect::<Vec<_>>()),
                radius_mm: label.radius_mm().into(),
                name: vertex.to_string(),
            }
        });
        let edges = map.edges().map(|(a, b)| (usize::from(a), usize::from(b))).collect();
        Self { vertices: vertices.collect(), edges, caption }
    }

    /// The ground truth, with nodes labelled by number and radius.
    pub fn of_truth(map: &TrueMap, caption: String) -> Self {
        let vertices = map.nodes.iter().enumerate().map(|(index, node)| Vertex {
            position: node.position,
            radius_mm: node.radius_mm,
            name: index.to_string(),
        });
        let edges = map.edges.iter().map(|edge| (edge.nodes[0], edge.nodes[1])).collect();
        Self { vertices: vertices.collect(), edges, caption }
    }
}

/// Mean position of the visits at the node with most of them.
fn mostly_at(visits: &[Detection]) -> Point {
    let at = |node: Option<usize>| visits.iter().filter(move |visit| visit.node == node);
    let node = visits.iter().map(|visit| visit.node).max_by_key(|node| (at(*node).count(), Reverse(*node)));
    let count = node.map_or(1, |node| at(node).count()) as f64;
    let positions = node.into_iter().flat_map(|node| at(node).map(|visit| visit.position));
    let (x_mm, y_mm) = positions.fold((0.0, 0.0), |(x_mm, y_mm), at| (x_mm + at.x_mm, y_mm + at.y_mm));
    Point::new(x_mm / count, y_mm / count)
}

const MARGIN_MM: f64 = 600.0;
/// Minimum distance between two drawn vertices.
const SIDE_BY_SIDE_MM: f64 = 1100.0;

/// Position of each drawn vertex: those at one position are in a row, so that none hides another.
fn spread(vertices: &[Vertex]) -> Vec<Point> {
    let mut spots: Vec<(Point, Vec<usize>)> = Vec::new();
    for (index, vertex) in vertices.iter().enumerate() {
        match spots.iter_mut().find(|(spot, _)| spot.distance_mm(vertex.position) < SIDE_BY_SIDE_MM) {
            Some((_, members)) => members.push(index),
            None => spots.push((vertex.position, vec![index])),
        }
    }
    let mut points: Vec<Point> = vertices.iter().map(|vertex| vertex.position).collect();
    for (spot, members) in &spots {
        let middle = (members.len() - 1) as f64 / 2.0;
        for (place, member) in members.iter().enumerate() {
            points[*member] = Point::new(spot.x_mm + (place as f64 - middle) * SIDE_BY_SIDE_MM, spot.y_mm);
        }
    }
    points
}

/// Draws a map over its floor plan: walls grey, the true Voronoi graph blue, and each vertex with its label, its radius
/// and the disc of that radius.
///
/// One unit of the drawing is 1 mm of the building. Edges to unknown vertices are omitted.
pub fn draw(plan: &Plan, truth: &TrueMap, drawing: &Drawing) -> String {
    let (width_mm, height_mm) = (plan.width_mm(), plan.height_mm());
    // The y axis of the building points up, that of SVG down.
    let at = |point: Point| (point.x_mm, height_mm - point.y_mm);
    let document = Document::new()
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
    let document = document.add(ways);
    let points = spread(&drawing.vertices);
    let marks: Vec<Mark> = points
        .into_iter()
        .zip(&drawing.vertices)
        .map(|(point, vertex)| Mark {
            at: at(point),
            radius_mm: vertex.radius_mm,
            number: vertex.name.clone(),
            name: String::new(),
            is_here: false,
        })
        .collect();
    let mut discs = Group::new().set("fill", MAP_COLOUR).set("fill-opacity", 0.08).set("stroke", MAP_COLOUR);
    for vertex in &drawing.vertices {
        let (x, y) = at(vertex.position);
        discs = discs.add(Circle::new().set("cx", x).set("cy", y).set("r", vertex.radius_mm));
    }
    document
        .add(discs.set("stroke-width", 25))
        .add(marks::edges(&marks, &drawing.edges))
        .add(marks::dots(&marks))
        .add(words(&drawing.caption, 300.0, height_mm + 1.3 * MARGIN_MM, 520.0))
        .add(Title::new(&*drawing.caption))
        .to_string()
}

/// The walls: everything but free space.
fn walls(plan: &Plan) -> Path {
    let (width_mm, height_mm) = (plan.width_mm(), plan.height_mm());
    let data = Data::new().move_to((0, 0)).horizontal_line_to(width_mm).vertical_line_to(height_mm);
    let data = plan.outlines().iter().fold(data.horizontal_line_to(0).close(), |data, ring| {
        let corners = ring.iter().map(|corner| (corner.x_mm, height_mm - corner.y_mm));
        let line = corners.enumerate().fold(
            data,
            |data, (index, corner)| {
                if index == 0 { data.move_to(corner) } else { data.line_to(corner) }
            },
        );
        line.close()
    });
    Path::new().set("d", data).set("fill", "#c9c9c9").set("fill-rule", "evenodd")
}

#[cfg(test)]
mod tests {
    use super::*;
    use toposlam::{Fingerprint, place::Place};
    use toposlam_sim::world::Limits;

    #[test]
    fn a_drawing_has_every_vertex_and_edge_and_escaped_text() {
        let plan = Plan::built_in("ring").unwrap();
        let truth = plan.true_map(&Limits::default()).unwrap();
        let mut drawing = Drawing::of_truth(&truth, "a < b & c".to_owned());
        drawing.edges.push((0, 0));
        drawing.edges.push((0, 99));
        let picture = draw(&plan, &truth, &drawing);
        assert_eq!(picture.matches("<polyline").count(), truth.edges.len());
        assert_eq!(picture.matches("<line").count(), truth.edges.len());
        assert_eq!(picture.matches("<circle").count(), 2 * truth.nodes.len() + 1);
        assert!(picture.contains("a &lt; b &amp; c"));
    }

    #[test]
    fn vertices_at_one_position_are_drawn_side_by_side() {
        let vertex = |x_mm| Vertex { position: Point::new(x_mm, 0.0), radius_mm: 1.0, name: String::new() };
        let points = spread(&[vertex(0.0), vertex(9000.0), vertex(10.0), vertex(20.0)]);
        let xs_mm: Vec<f64> = points.iter().map(|point| point.x_mm).collect();
        assert_eq!(xs_mm, [-SIDE_BY_SIDE_MM, 9000.0, 0.0, SIDE_BY_SIDE_MM]);
    }

    #[test]
    fn a_vertex_is_drawn_at_the_node_of_most_of_its_visits() {
        let fingerprint = Fingerprint::from_radius_mm(1000).unwrap();
        let place = Place {
            fingerprint,
            frame_index: 0,
            degree: None,
            ways: toposlam::place::Openings::NONE,
            behind_mrad: 0,
            spread_mm: 0,
        };
        let visit = |x_mm, node| Detection { place, position: Point::new(x_mm, 0.0), node };
        let visits = [visit(100.0, Some(3)), visit(9000.0, Some(1)), visit(300.0, Some(3)), visit(5000.0, None)];
        assert_eq!(mostly_at(&visits), Point::new(200.0, 0.0));
        assert_eq!(mostly_at(&[]), Point::new(0.0, 0.0));
    }
}
