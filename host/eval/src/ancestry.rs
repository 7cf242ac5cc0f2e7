//! The vertex paths of all particles, rebuilt from the parent and the vertex of each particle at each step.

/// The paths of all particles of the current generation.
#[derive(Clone, Debug, Default)]
pub struct Ancestry {
    paths: Vec<Vec<usize>>,
}

impl Ancestry {
    /// An ancestry without steps.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds one step: for every particle of the new generation, in order, the index of its parent in the previous
    /// generation and its vertex. The first step ignores the parents.
    ///
    /// # Panics
    /// When a parent is not among the previous generation.
    pub fn advance(&mut self, particles: impl Iterator<Item = (usize, usize)>) {
        let first = self.paths.is_empty();
        let extended = particles.map(|(parent, vertex)| {
            let mut path = if first { Vec::new() } else { self.paths[parent].clone() };
            path.push(vertex);
            path
        });
        self.paths = extended.collect();
    }

    /// The vertices that a particle of the current generation visited, one for each step.
    ///
    /// # Panics
    /// When there is no such particle.
    pub fn path(&self, particle: usize) -> &[usize] {
        &self.paths[particle]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_follows_parents_through_generations_of_different_size() {
        let mut ancestry = Ancestry::new();
        ancestry.advance([(0, 0)].into_iter());
        ancestry.advance([(0, 0), (0, 1)].into_iter());
        ancestry.advance([(1, 2), (1, 0), (0, 1)].into_iter());
        assert_eq!(ancestry.path(0), [0, 1, 2]);
        assert_eq!(ancestry.path(1), [0, 1, 0]);
        assert_eq!(ancestry.path(2), [0, 0, 1]);
    }
}
