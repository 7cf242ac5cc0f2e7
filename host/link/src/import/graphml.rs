//! Maps from the GraphML of `export`, also after another program has written it again.

use std::collections::{BTreeMap, HashMap};

use roxmltree::{Document, Node};
use toposlam::wire::WayId;

use super::{Draft, ImportError};
use crate::topology::{TopologicalMap, Vertex};

/// Reads the GraphML of [`export::graphml`](crate::export::graphml). The drawing in it is ignored.
///
/// # Errors
/// [`ImportError::Xml`], or [`ImportError::NoMap`] when an attribute is missing or contradicts another one.
pub fn graphml(text: &str) -> Result<TopologicalMap, ImportError> {
    let document = Document::parse(text).map_err(ImportError::Xml)?;
    let root = document.root_element();
    if root.tag_name().name() != "graphml" {
        return Err(ImportError::no_map("the root element is not graphml"));
    }
    // Other programs number the keys.
    let keys: HashMap<&str, &str> =
        elements(root, "key").filter_map(|key| Some((key.attribute("id")?, key.attribute("attr.name")?))).collect();
    let data = |of: Node<'_, '_>| -> BTreeMap<String, String> {
        let value = |data: Node<'_, '_>| {
            let name = data.attribute("key").and_then(|key| keys.get(key).copied().or(Some(key)))?.to_owned();
            Some((name, data.text().unwrap_or_default().trim().to_owned()))
        };
        elements(of, "data").filter_map(value).collect()
    };
    let graph = elements(root, "graph").next().ok_or_else(|| ImportError::no_map("there is no graph"))?;
    let mut draft = Draft::default();
    for node in elements(graph, "node") {
        let (id, data) = (node.attribute("id").unwrap_or_default(), data(node));
        let vertex = vertex(id, &data, &mut draft);
        vertex.ok_or_else(|| {
            ImportError::NoMap(format!("node {id}: the id, radius_mm, visits or bearings_mrad is no number"))
        })?;
    }
    for edge in elements(graph, "edge") {
        let ends = [edge.attribute("source"), edge.attribute("target")].map(Option::unwrap_or_default);
        edge_of(ends, &data(edge), &mut draft)
            .ok_or_else(|| ImportError::NoMap(format!("edge {} to {}: a number is missing", ends[0], ends[1])))?;
    }
    draft.finish()
}

fn elements<'a, 'input: 'a>(of: Node<'a, 'input>, name: &'static str) -> impl Iterator<Item = Node<'a, 'input>> {
    of.children().filter(move |node| node.is_element() && node.tag_name().name() == name)
}

fn vertex(id: &str, data: &BTreeMap<String, String>, draft: &mut Draft) -> Option<()> {
    let id: u8 = id.parse().ok()?;
    let label = Vertex { radius_mm: data.get("radius_mm")?.parse().ok()?, visits: data.get("visits")?.parse().ok()? };
    let numbers = |text: &String| text.split_whitespace().map(|mrad| mrad.parse().ok()).collect::<Option<Vec<u16>>>();
    let bearings = match data.get("bearings_mrad") {
        Some(text) => Some(numbers(text)?),
        None => None,
    };
    draft.add_vertex(id, label, bearings, data.get("name").cloned());
    Some(())
}

fn edge_of(ends: [&str; 2], data: &BTreeMap<String, String>, draft: &mut Draft) -> Option<()> {
    let [source, target]: [Option<u8>; 2] = ends.map(|end| end.parse().ok());
    let (source, target) = (source?, target?);
    let number = |name: &str| data.get(name).map(|text| text.parse::<u16>().ok());
    match (number("source_way"), number("target_way")) {
        (Some(a), Some(b)) => {
            let end = |vertex, way: u16| Some(WayId { vertex, way: u8::try_from(way).ok()? });
            let frames = match number("travel_frames") {
                Some(frames) => Some(frames?),
                None => None,
            };
            draft.join([end(source, a?)?, end(target, b?)?], frames);
        }
        _ => draft.add_edge(source, target),
    }
    Some(())
}
