//! The paper's filter in a snapshot: its particles and its history.
//!
//! The draws of a place depend on the seed and the number of the place alone, so a restored filter continues bit for bit. The
//! readings of the history are recomputed.

use crate::fault::FaultCounters;
use crate::filter::{Direction, History, PaperConfig, PaperFactors, PaperFilter, Particle};
use crate::map::{Map, PerVertex, VertexId, VertexSet};
use crate::persist::Persist;
use crate::persist::snapshot::{FILTER_SECTION, FRAME_BYTES, PAPER, Reader, SnapshotError, Writer};
use crate::place::Fingerprint;

/// Kind, capacities, settings, seed, observed, best, number of particles.
const HEAD_BYTES: usize = 4 + 9 + 8 + 4 + 2;
/// Vertices, position, multiplicity, parent, consistency, factors.
const PARTICLE_BYTES: usize = 4 + 2 + 3 * 4;
/// Sum of the labels, visits and neighbours.
const VERTEX_BYTES: usize = 4 + 4 + 8;

impl<const N: usize, const V: usize, const WORDS: usize> PaperFilter<N, V, WORDS> {
    /// The largest snapshot of this filter alone in bytes: `N` particles of `V` vertices and a full history.
    pub const SNAPSHOT_BYTES: usize =
        FRAME_BYTES + HEAD_BYTES + 6 + 64 * WORDS + N * (PARTICLE_BYTES + V * VERTEX_BYTES);
}

/// The fixed fields of the section.
struct Head {
    config: PaperConfig,
    seed: u64,
    observed: u32,
    best: u8,
    particles: u8,
}

impl<const N: usize, const V: usize, const WORDS: usize> Persist for PaperFilter<N, V, WORDS> {
    const SECTION: u8 = FILTER_SECTION;

    /// A buffer of [`PaperFilter::SNAPSHOT_BYTES`] has room for every state.
    ///
    /// # Errors
    /// [`SnapshotError::Full`] if there is no room: without one of its particles the filter would draw other ones.
    #[inline(never)]
    fn save(&mut self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        let head = Head {
            config: self.config,
            seed: self.seed,
            observed: self.observed,
            best: self.particles.best_index(),
            particles: self.particles.distinct(),
        };
        head.save::<V, WORDS>(writer)?;
        writer.u32(self.history.pushed())?;
        writer.u16(self.history.len() as u16)?;
        for fingerprint in self.history.iter() {
            writer.u16(fingerprint.steps())?;
        }
        self.particles.all().iter().try_for_each(|particle| save_particle(writer, particle))?;
        self.consistency.forget();
        Ok(())
    }

    /// # Errors
    /// [`SnapshotError::Capacities`] for another kind of filter or other capacities, [`SnapshotError::TooShort`], or
    /// [`SnapshotError::Contents`]; the filter does not change then.
    fn restore(&mut self, section: Reader<'_>) -> Result<(), SnapshotError> {
        self.check(section)?;
        self.read(section, true)
    }

    fn check(&mut self, section: Reader<'_>) -> Result<(), SnapshotError> {
        self.read(section, false)
    }
}

impl<const N: usize, const V: usize, const WORDS: usize> PaperFilter<N, V, WORDS> {
    /// Reads a section. `kept` replaces the state.
    #[inline(never)]
    fn read(&mut self, mut from: Reader<'_>, kept: bool) -> Result<(), SnapshotError> {
        let head = Head::read::<N, V, WORDS>(&mut from)?;
        let (pushed, places) = (from.u32()?, usize::from(from.u16()?));
        if places != (pushed as usize).min(History::<WORDS>::CAPACITY) {
            return Err(SnapshotError::Contents);
        }
        if kept {
            self.config = head.config;
            self.seed = head.seed;
            self.observed = head.observed;
            self.history.resume(pushed);
            self.consistency.forget();
            self.faults = FaultCounters::new();
        }
        for _ in 0..places {
            let fingerprint = Fingerprint::from_steps(from.u16()?).ok_or(SnapshotError::Contents)?;
            if kept {
                self.history.push(fingerprint);
            }
        }
        if kept {
            self.particles.resume(&head.config, head.particles, head.best);
        }
        let mut draws = 0_u16;
        for index in 0..usize::from(head.particles) {
            let particle = read_particle::<V>(&mut from)?;
            draws += u16::from(particle.multiplicity);
            if kept {
                self.particles.put(index, &particle);
            }
        }
        if head.particles > 0 && draws != u16::from(head.config.particles) {
            return Err(SnapshotError::Contents);
        }
        from.finish()
    }
}

impl Head {
    fn save<const V: usize, const WORDS: usize>(&self, writer: &mut Writer<'_>) -> Result<(), SnapshotError> {
        writer.u8(PAPER)?;
        writer.u8(V as u8)?;
        writer.u16(History::<WORDS>::CAPACITY as u16)?;
        writer.u8(self.config.ngram_length)?;
        writer.u8(self.config.particles)?;
        writer.u16(self.config.penalty_permille)?;
        writer.u16(self.config.sigma_label_mm)?;
        writer.u16(self.config.sigma_consistency_mm)?;
        writer.u8(self.config.direction as u8)?;
        writer.u64(self.seed)?;
        writer.u32(self.observed)?;
        writer.u8(self.best)?;
        writer.u8(self.particles)
    }

    fn read<const N: usize, const V: usize, const WORDS: usize>(from: &mut Reader<'_>) -> Result<Self, SnapshotError> {
        let capacities = (from.u8()?, usize::from(from.u8()?), usize::from(from.u16()?));
        if capacities != (PAPER, V, History::<WORDS>::CAPACITY) {
            return Err(SnapshotError::Capacities);
        }
        let config = PaperConfig {
            ngram_length: from.u8()?,
            particles: from.u8()?,
            penalty_permille: from.u16()?,
            sigma_label_mm: from.u16()?,
            sigma_consistency_mm: from.u16()?,
            direction: match from.u8()? {
                0 => Direction::TwoSided,
                1 => Direction::MapToHistory,
                2 => Direction::HistoryToMap,
                _ => return Err(SnapshotError::Contents),
            },
        };
        if usize::from(config.particles) > N {
            return Err(SnapshotError::Capacities);
        }
        config.check(N).map_err(|_| SnapshotError::Contents)?;
        let head = Self { config, seed: from.u64()?, observed: from.u32()?, best: from.u8()?, particles: from.u8()? };
        let is_valid = if head.particles == 0 {
            head.best == 0 && head.observed == 0
        } else {
            head.best < head.particles && head.particles <= config.particles && head.observed > 0
        };
        if is_valid { Ok(head) } else { Err(SnapshotError::Contents) }
    }
}

fn save_particle<const V: usize>(writer: &mut Writer<'_>, particle: &Particle<V>) -> Result<(), SnapshotError> {
    let map = &particle.map;
    writer.u8(map.vertices().len() as u8)?;
    writer.u8(particle.at.into())?;
    writer.u8(particle.multiplicity)?;
    writer.u8(particle.parent)?;
    writer.u16(particle.consistency_mm)?;
    let PaperFactors { ln_label_q16, ln_consistency_q16, ln_size_q16 } = particle.factors;
    for factor in [ln_label_q16, ln_consistency_q16, ln_size_q16] {
        writer.u32(factor as u32)?;
    }
    for vertex in map.vertices() {
        writer.u32(map.sum_steps(vertex))?;
        writer.u32(map.visits(vertex))?;
        writer.u64(map.neighbours(vertex).bits())?;
    }
    Ok(())
}

#[inline(never)]
fn read_particle<const V: usize>(from: &mut Reader<'_>) -> Result<Particle<V>, SnapshotError> {
    let vertices = from.u8()?;
    let at = VertexId::new(from.u8()?).ok_or(SnapshotError::Contents)?;
    let (multiplicity, parent, consistency_mm) = (from.u8()?, from.u8()?, from.u16()?);
    let factors = PaperFactors {
        ln_label_q16: from.u32()? as i32,
        ln_consistency_q16: from.u32()? as i32,
        ln_size_q16: from.u32()? as i32,
    };
    if at.index() >= usize::from(vertices) || multiplicity == 0 {
        return Err(SnapshotError::Contents);
    }
    let mut map = Map::<V>::new();
    let mut neighbours = PerVertex::<VertexSet, V>::filled(VertexSet::EMPTY);
    for vertex in VertexId::first(vertices.into()) {
        let (sum_steps, visits) = (from.u32()?, from.u32()?);
        map.add_counted_vertex(sum_steps, visits).ok_or(SnapshotError::Contents)?;
        neighbours[vertex] = VertexSet::from_bits(from.u64()?);
        if !(neighbours[vertex] - VertexSet::first(vertices.into())).is_empty() {
            return Err(SnapshotError::Contents);
        }
    }
    for vertex in map.vertices() {
        for neighbour in neighbours[vertex].iter() {
            if !neighbours[neighbour].contains(vertex) {
                return Err(SnapshotError::Contents);
            }
            map.add_edge(vertex, neighbour);
        }
    }
    Ok(Particle { map, at, multiplicity, parent, consistency_mm, factors })
}
