//! The correspondence of two maps of the same places, one of which is built along the path of the other.

use super::hypothesis::Hypothesis;
use super::model::SAME_WAY;
use crate::map::NONE;

/// Which vertex and dart of the map that is built stands for each of another map.
#[derive(Clone, Debug)]
pub(super) struct Translation<const V: usize, const D: usize> {
    vertex: [u8; V],
    dart: [u8; D],
}

impl<const V: usize, const D: usize> Translation<V, D> {
    pub(super) const fn new() -> Self {
        Self { vertex: [0; V], dart: [0; D] }
    }

    /// Starts with the first vertices and darts, which are the same in both maps.
    pub(super) fn start(&mut self, vertices: u8, darts: u8) {
        self.vertex.fill(NONE);
        self.dart.fill(NONE);
        (0..vertices).zip(&mut self.vertex).for_each(|(vertex, image)| *image = vertex);
        (0..darts).zip(&mut self.dart).for_each(|(dart, image)| *image = dart);
    }

    /// A dart with this image.
    pub(super) fn preimage(&self, image: u8) -> Option<u8> {
        self.dart.iter().position(|&dart| dart == image).map(|dart| dart as u8)
    }

    /// Follows a change of the numbers of the images.
    pub(super) fn renumber(&mut self, numbers: &[u8; D]) {
        for slot in &mut self.dart {
            *slot = numbers.get(usize::from(*slot)).copied().unwrap_or(NONE);
        }
    }

    pub(super) fn vertex(&self, vertex: u8) -> Option<u8> {
        self.vertex.get(usize::from(vertex)).copied().filter(|&vertex| vertex != NONE)
    }

    pub(super) fn set_vertex(&mut self, vertex: u8, image: u8) {
        if let Some(slot) = self.vertex.get_mut(usize::from(vertex)) {
            *slot = image;
        }
    }

    pub(super) fn set(&mut self, dart: u8, image: u8) {
        if let Some(slot) = self.dart.get_mut(usize::from(dart)) {
            *slot = image;
        }
    }

    /// The image of a dart whose vertex has one. It is found by its bearing: vertices keep their frames.
    pub(super) fn image<const T: usize>(
        &mut self,
        from: &Hypothesis<V, D, T>,
        to: &mut Hypothesis<V, D, T>,
        dart: u8,
    ) -> Option<u8> {
        let known = self.dart.get(usize::from(dart)).copied()?;
        if known != NONE {
            return Some(known);
        }
        let vertex = self.vertex(from.map.vertex(dart))?;
        let mine = from.map.vertex(dart);
        // The frames drift apart as bearings are averaged: what is known of the other ways says how far.
        let (mut sum, mut count) = (0_i32, 0_i32);
        for &way in from.map.ways(mine) {
            if let Some(&image) = self.dart.get(usize::from(way)).filter(|&&image| image != NONE) {
                sum += i32::from(to.map.bearing(image).wrapping_sub(from.map.bearing(way)) as i16);
                count += 1;
            }
        }
        let drift = (sum / count.max(1)) as i16;
        let bearing = from.map.bearing(dart).wrapping_add_signed(drift);
        let mut best = (None, SAME_WAY + 1);
        for &way in to.map.ways(vertex) {
            let off = |bearing: u16| (bearing.wrapping_sub(to.map.bearing(way)) as i16).unsigned_abs();
            let is_image = |&other: &u8| self.dart.get(usize::from(other)) == Some(&way);
            if off(bearing) >= best.1 || from.map.ways(mine).iter().any(is_image) {
                continue;
            }
            // Another dart without an image may be closer.
            let closer = |&other: &u8| {
                self.dart.get(usize::from(other)) == Some(&NONE)
                    && from.map.vertex(other) == mine
                    && off(from.map.bearing(other).wrapping_add_signed(drift)) < off(bearing)
            };
            if !from.map.ways(mine).iter().any(closer) {
                best = (Some(way), off(bearing));
            }
        }
        let image = best.0.or_else(|| to.map.add_way(vertex, bearing))?;
        self.set(dart, image);
        Some(image)
    }
}
