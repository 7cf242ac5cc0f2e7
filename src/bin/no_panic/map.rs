//! Calls of the map and its types.

use core::hint::black_box;

use static_cell::ConstStaticCell;
use toposlam::{Map, PerVertex, VertexSet, VerticesFull};

use super::any::{any_fingerprint, any_vertex, show};

const VERTICES: usize = 16;

pub(crate) fn map() {
    static MAP: ConstStaticCell<Map<VERTICES>> = ConstStaticCell::new(Map::new());
    let Some(map) = MAP.try_take() else { return };
    for _ in 0..black_box(3) {
        if let Err(error) = map.add_vertex(any_fingerprint()) {
            show::<VerticesFull>(error);
        }
    }
    map.observe(any_vertex(), any_fingerprint());
    map.add_edge(any_vertex(), any_vertex());
    black_box((map.vertices().len(), map.contains(any_vertex()), map.label(any_vertex()), map.visits(any_vertex())));
    let mut set = map.neighbours(any_vertex());
    set.insert(any_vertex());
    set.remove(any_vertex());
    black_box((set.contains(any_vertex()), set.len(), set.is_empty(), set.bits(), set.pop_first()));
    black_box(
        set | (VertexSet::from(any_vertex()) & (VertexSet::first(black_box(3)) - VertexSet::from_bits(black_box(7)))),
    );
    for vertex in set.iter() {
        black_box(vertex);
    }
    let mut per_vertex = PerVertex::<u32, 10>::filled(0);
    per_vertex[any_vertex()] = black_box(1);
    black_box((per_vertex[any_vertex()], per_vertex.get(any_vertex())));
    black_box(map.labels());
    for edge in map.edges() {
        black_box(edge);
    }
    map.clear();
}
