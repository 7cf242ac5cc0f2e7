//! Turns the successive states of the mapper into messages: changes at once, and the whole map in turn.

use core::fmt;

use crate::fault::{FaultCounters, FaultKind};
use crate::filter::{Filter, Update};
use crate::map::{Darts, VertexId};
use crate::mapper::Mapper;
use crate::place::Place;
use crate::wire::digest::{map_digest, row_of};
use crate::wire::messages::bit;
use crate::wire::robot::sent_map::SentMap;
use crate::wire::{
    Belief, Capacities, Evidence, Exploration, Hello, List, Location, Message, Name, Names, Refusal, Remapped,
    ResetCause, Row, VertexWays, Worst,
};

/// Decides which messages to send. It remembers what was sent, and passes each message to a callback, which returns
/// whether the transmit queue accepted it. It never waits.
///
/// A change whose message was refused is sent again with the next update or with the repeated map, whichever comes first. The
/// caller sends `Health`, `Ring`, `Velocity` and `Reply` itself. Memory: 42 bytes per vertex and about 170 bytes.
#[derive(Clone, Debug)]
pub struct Reporter<const V: usize> {
    hello: Hello,
    ticks_per_hello: u16,
    ticks_to_hello: u16,
    sent: SentMap<V>,
    /// The number of vertices of the filter's map after the last place.
    vertices_before: u8,
    location: Option<Location>,
    belief: Option<Belief>,
    complete: bool,
    exploration: Option<Exploration>,
    names: Names<V>,
    /// The names that have changed and were not sent yet.
    unsent_names: u64,
    /// Whether a vertex had a name since the start. Until then no message about names is sent.
    had_names: bool,
    faults: [u32; FaultKind::ALL.len()],
    /// The next piece of the repeated map: a vertex, or one of the pieces after the last vertex.
    turn: u8,
    fault_turn: u8,
    /// Whether the present round is sent at the fast pace.
    sends_full: bool,
    refused: u32,
}

impl<const V: usize> Reporter<V> {
    /// How many pieces of the map a tick sends after [`Reporter::send_full`].
    const PIECES_PER_FULL_TICK: u8 = 4;

    /// A reporter that must be started with [`Reporter::start`].
    pub const fn new() -> Self {
        let capacities =
            Capacities { vertices: 0, hypotheses: 0, history: 0, ngram_length: 0, fingerprint_step_mm: 0, sonars: 0 };
        Self {
            hello: Hello {
                protocol_version: 0,
                schema_hash: 0,
                boot: 0,
                reset_cause: ResetCause::Unknown,
                seed: 0,
                capacities,
                session: 0,
            },
            ticks_per_hello: 0,
            ticks_to_hello: 0,
            sent: SentMap::new(),
            vertices_before: 0,
            location: None,
            belief: None,
            complete: false,
            // `None` is not all zero, so a `static` robot would not be in `.bss`.
            exploration: Some(Exploration { frontiers: 0, complete: false }),
            names: Names::new(),
            unsent_names: 0,
            had_names: false,
            faults: [0; FaultKind::ALL.len()],
            turn: 0,
            fault_turn: 0,
            sends_full: false,
            refused: 0,
        }
    }

    /// Starts with nothing sent. The next tick sends the `Hello`, and then every `ticks_per_hello`th; 0 means every tick.
    pub fn start(&mut self, hello: Hello, ticks_per_hello: u16) {
        self.hello = hello;
        self.ticks_per_hello = ticks_per_hello;
        self.ticks_to_hello = 0;
        self.sent.clear();
        self.vertices_before = 0;
        self.location = None;
        self.belief = None;
        self.complete = false;
        self.exploration = None;
        self.names.clear();
        self.unsent_names = 0;
        self.had_names = false;
        self.faults = [0; FaultKind::ALL.len()];
        self.turn = 0;
        self.fault_turn = 0;
        self.sends_full = false;
        self.refused = 0;
    }

    /// Sets the session id of the `Hello`.
    pub fn set_session(&mut self, session: u32) {
        self.hello.session = session;
    }

    /// The names of the vertices.
    pub const fn names(&self) -> &Names<V> {
        &self.names
    }

    /// Names a vertex, or clears its name with [`Name::NONE`]; the next tick sends it.
    ///
    /// # Errors
    /// As [`Names::set`].
    pub fn set_name(&mut self, vertex: u8, name: Name) -> Result<(), Refusal> {
        self.names.set(vertex, name)?;
        self.unsent_names |= bit(vertex);
        self.had_names |= !name.is_none();
        Ok(())
    }

    /// Changes all names, as the restore of a snapshot does, and sends them again.
    pub(crate) fn change_names<R>(&mut self, change: impl FnOnce(&mut Names<V>) -> R) -> R {
        let changed = change(&mut self.names);
        self.send_all_names();
        changed
    }

    fn send_all_names(&mut self) {
        self.unsent_names = self.names.vertices();
        self.had_names |= self.unsent_names != 0;
    }

    /// Starts a new round of the repeated map with a `Hello`, at four pieces per tick; the next round has the usual pace
    /// again. A listener that requests the map has it after a quarter of the ticks, rounded up, without a lost frame.
    pub fn send_full(&mut self) {
        self.ticks_to_hello = 0;
        self.turn = 0;
        self.sends_full = true;
    }

    /// Announces that every vertex is removed, before the map is cleared or replaced. [`Reporter::start`] follows, or
    /// updates and ticks with the new map.
    pub fn forget(&mut self, mut send: impl FnMut(&Message) -> Result<(), QueueFull>) {
        let vertices = self.sent.vertices().max(self.vertices_before);
        if vertices == 0 {
            return;
        }
        let place_index = self.location.map_or(0, |location| location.place_index);
        let removed = List::new((0..vertices).map(|_| Remapped::REMOVED));
        let remapped = Remapped { place_index, vertices: removed };
        if self.send(&Message::Remapped(remapped), &mut send) {
            self.note_remapped(&remapped);
        }
        self.vertices_before = 0;
        self.location = None;
        self.belief = None;
    }

    /// After the map was replaced, as by the restore of a snapshot: the listener clears its map, and the new one is sent as
    /// a whole.
    pub fn resync(&mut self, send: impl FnMut(&Message) -> Result<(), QueueFull>) {
        self.forget(send);
        self.send_full();
    }

    /// Reports one ring frame: the place, what it changed, and the next piece of the repeated map.
    ///
    /// `seen` is the result of [`Mapper::observe`]. `faults` are those of the stages outside the mapper, which are sent as
    /// one sum with the mapper's. `send` receives every message and returns whether the transmit queue accepted it.
    #[inline(never)]
    pub fn report<const SONARS: usize, F: Filter<V>>(
        &mut self,
        mapper: &Mapper<SONARS, V, F>,
        seen: Option<&(Place, Update)>,
        faults: &FaultCounters,
        mut send: impl FnMut(&Message) -> Result<(), QueueFull>,
    ) {
        if let Some((place, update)) = seen {
            // A place is not part of the state: one that the queue refuses is only missing in the listener's log.
            let _ = send(&Message::Place {
                place_index: update.place_index,
                frame_index: place.frame_index,
                radius_mm: place.fingerprint.radius_mm(),
                degree: place.degree,
            });
            self.update(mapper.filter(), update, &mut send);
        }
        let mut faults = *faults;
        faults.add(&mapper.faults());
        self.tick(mapper.filter(), &faults, send);
    }

    /// Takes from the drive whether it reaches no frontier any more; [`Reporter::tick`] sends a change.
    pub fn set_complete(&mut self, complete: bool) {
        self.complete = complete;
    }

    /// How many messages the queue refused since the start; saturates.
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    /// Sends the update of one place: changed vertex ids, changed vertices, edges and ways, the size of the map, location,
    /// belief, evidence and worst n-gram.
    ///
    /// A vertex with several changed edges is sent as one `Row`, so that a change of the best hypothesis does not flood the
    /// line: at most 3 `V` + 6 messages. Cost: linear in the number of vertices and edges.
    pub fn update(
        &mut self,
        filter: &impl Filter<V>,
        update: &Update,
        mut send: impl FnMut(&Message) -> Result<(), QueueFull>,
    ) {
        let map = filter.map();
        let remapped = Remapped::of(filter, self.vertices_before, update.place_index);
        let is_first = self.vertices_before == 0;
        self.vertices_before = map.vertices().len() as u8;
        let mut changed = false;
        self.names.remap(|before| filter.remapped(VertexId::new(before)?).map(u8::from));
        self.names.truncate(map.vertices().len());
        // If the queue refuses it, the listener keeps the old ids, and so does the record of what was sent; the messages
        // below send the difference.
        if let Some(remapped) = remapped
            && self.send(&Message::Remapped(remapped), &mut send)
        {
            changed = true;
            self.note_remapped(&remapped);
        } else if remapped.is_some() || is_first || self.unsent_names != 0 {
            self.send_all_names();
        }
        let sent_vertices = self.sent.vertices();
        let vertices = map.vertices().len() as u8;
        if vertices < sent_vertices {
            self.sent.truncate(vertices);
        }
        changed |= vertices != sent_vertices;
        for vertex in map.vertices() {
            let row = row_of(map, vertex);
            if self.sent.flips(&row).count_ones() > 1 {
                changed = true;
                self.send_row(row, &mut send);
            } else if !self.sent.has_label(&row) {
                changed = true;
                let Row { vertex, radius_mm, visits, .. } = row;
                if self.send(&Message::Vertex { vertex, radius_mm, visits }, &mut send) {
                    self.sent.set_label(&row);
                }
            }
        }
        for row in map.vertices().map(|vertex| row_of(map, vertex)) {
            let flips = self.sent.flips(&row);
            changed |= flips != 0;
            // More than one: the queue refused the row, and the repeated map will send it.
            if flips.count_ones() == 1 {
                let (a, b) = (row.vertex, flips.trailing_zeros() as u8);
                let present = row.neighbours & flips != 0;
                if self.send(&Message::Edge { a, b, present }, &mut send) {
                    self.sent.set_edge(a, b, present);
                }
            }
        }
        if let Some(darts) = filter.darts() {
            for vertex in map.vertices() {
                let ways = VertexWays::of(darts, vertex);
                if !self.sent.has_ways(&ways) {
                    changed = true;
                    self.send_ways(&ways, &mut send);
                }
            }
        }
        if changed {
            self.send_size(filter, &mut send);
        }
        let location = Location::from(update);
        if self.location != Some(location) && self.send(&Message::Location(location), &mut send) {
            self.location = Some(location);
        }
        let belief = Belief::of(filter, update.place_index);
        if self.send(&Message::Belief(belief), &mut send) {
            self.belief = Some(belief);
        }
        self.send(&Message::Evidence(Evidence::from(update)), &mut send);
        self.send(&Message::Worst(Worst::of(filter, update.place_index)), &mut send);
    }

    /// Sends the changed fault counts and the next piece of the repeated map. Call it at a steady pace.
    ///
    /// The pieces of a round are each vertex, the ways of each vertex if the filter knows them, the size of the map, the
    /// location, the belief, the exploration, and one fault with a count above 0. A listener that receives the `vertices + 5`
    /// ticks of a round without loss has converged; with ways `2 · vertices + 5`. At most one message per kind of fault, a
    /// `Hello`, an `Exploration`, and one piece (four after [`Reporter::send_full`]).
    pub fn tick(
        &mut self,
        filter: &impl Filter<V>,
        faults: &FaultCounters,
        mut send: impl FnMut(&Message) -> Result<(), QueueFull>,
    ) {
        if self.ticks_to_hello == 0 && self.send(&Message::Hello(self.hello), &mut send) {
            self.ticks_to_hello = self.ticks_per_hello;
        }
        self.ticks_to_hello = self.ticks_to_hello.saturating_sub(1);
        for kind in FaultKind::ALL {
            if self.faults.get(kind as usize) != Some(&faults.count(kind)) {
                self.send_fault(kind, faults.count(kind), &mut send);
            }
        }
        let exploration = filter.darts().map(|darts| self.explored(darts));
        if self.exploration != exploration {
            self.send_exploration(exploration, &mut send);
        }
        self.send_changed_name(&mut send);
        for _ in 0..if self.sends_full { Self::PIECES_PER_FULL_TICK } else { 1 } {
            if !self.send_piece(filter, faults, &mut send) {
                return;
            }
            if self.turn == 0 {
                self.sends_full = false;
                return;
            }
        }
    }

    /// Sends the next piece of the repeated map, if there is anything to send; returns whether the queue accepted it.
    fn send_piece(
        &mut self,
        filter: &impl Filter<V>,
        faults: &FaultCounters,
        send: &mut impl FnMut(&Message) -> Result<(), QueueFull>,
    ) -> bool {
        let (map, darts) = (filter.map(), filter.darts());
        let vertices = map.vertices().len() as u8;
        let of_vertices = if darts.is_some() { 2 * vertices } else { vertices };
        let done = match self.turn.checked_sub(of_vertices) {
            None => match (map.vertices().nth((self.turn % vertices.max(1)).into()), darts) {
                (Some(vertex), Some(darts)) if self.turn >= vertices => {
                    self.send_ways(&VertexWays::of(darts, vertex), send)
                }
                (Some(vertex), _) => self.send_row(row_of(map, vertex), send) && self.send_name(vertex.into(), send),
                (None, _) => true,
            },
            Some(0) => self.send_named(send) && self.send_size(filter, send),
            Some(1) => self.location.is_none_or(|location| self.send(&Message::Location(location), send)),
            Some(2) => self.belief.is_none_or(|belief| self.send(&Message::Belief(belief), send)),
            Some(3) => self.send_exploration(darts.map(|darts| self.explored(darts)), send),
            Some(_) => self.next_fault(faults).is_none_or(|kind| self.send_fault(kind, faults.count(kind), send)),
        };
        if done {
            self.turn = if self.turn >= of_vertices.saturating_add(4) { 0 } else { self.turn.saturating_add(1) };
        }
        done
    }

    fn send(&mut self, message: &Message, send: &mut impl FnMut(&Message) -> Result<(), QueueFull>) -> bool {
        let taken = send(message).is_ok();
        if !taken {
            self.refused = self.refused.saturating_add(1);
        }
        taken
    }

    fn send_row(&mut self, row: Row, send: &mut impl FnMut(&Message) -> Result<(), QueueFull>) -> bool {
        let taken = self.send(&Message::Row(row), send);
        if taken {
            self.sent.set_row(&row);
        }
        taken
    }

    fn send_ways(&mut self, ways: &VertexWays, send: &mut impl FnMut(&Message) -> Result<(), QueueFull>) -> bool {
        let taken = self.send(&Message::Ways(*ways), send);
        if taken {
            self.sent.set_ways(ways);
        }
        taken
    }

    /// Sends one of the changed names.
    fn send_changed_name(&mut self, send: &mut impl FnMut(&Message) -> Result<(), QueueFull>) {
        let vertex = self.unsent_names.trailing_zeros() as u8;
        let is_sent = match self.names.get(vertex).is_none() {
            _ if self.unsent_names == 0 => return,
            true => self.send_named(send),
            false => self.send_name(vertex, send),
        };
        if is_sent {
            self.unsent_names &= !bit(vertex);
        }
    }

    /// Returns whether the vertex has no name or the queue accepted it.
    fn send_name(&mut self, vertex: u8, send: &mut impl FnMut(&Message) -> Result<(), QueueFull>) -> bool {
        let name = self.names.get(vertex);
        name.is_none() || self.send(&Message::Name { vertex, name }, send)
    }

    /// Sends which vertices have a name, so that a listener clears the others. Returns whether the queue accepted it.
    fn send_named(&mut self, send: &mut impl FnMut(&Message) -> Result<(), QueueFull>) -> bool {
        !self.had_names || self.send(&Message::Named { vertices: self.names.vertices() }, send)
    }

    fn explored(&self, darts: Darts<'_>) -> Exploration {
        Exploration { frontiers: darts.frontiers().count() as u8, complete: self.complete }
    }

    /// Returns whether there was nothing to send or the queue accepted it.
    fn send_exploration(
        &mut self,
        exploration: Option<Exploration>,
        send: &mut impl FnMut(&Message) -> Result<(), QueueFull>,
    ) -> bool {
        let Some(explored) = exploration else { return true };
        let taken = self.send(&Message::Exploration(explored), send);
        if taken {
            self.exploration = exploration;
        }
        taken
    }

    fn send_size(&mut self, filter: &impl Filter<V>, send: &mut impl FnMut(&Message) -> Result<(), QueueFull>) -> bool {
        let map = filter.map();
        let (vertices, edges) = (map.vertices().len() as u8, map.edges().count() as u16);
        let taken = self.send(&Message::Map { vertices, edges, digest: map_digest(map, filter.darts()) }, send);
        if taken {
            self.sent.set_vertices(vertices);
        }
        taken
    }

    fn send_fault(
        &mut self,
        kind: FaultKind,
        count: u32,
        send: &mut impl FnMut(&Message) -> Result<(), QueueFull>,
    ) -> bool {
        let taken = self.send(&Message::Fault { kind: kind as u8, count }, send);
        if let (true, Some(sent)) = (taken, self.faults.get_mut(kind as usize)) {
            *sent = count;
        }
        taken
    }

    /// The next kind of fault with a count above 0, in rotation.
    fn next_fault(&mut self, faults: &FaultCounters) -> Option<FaultKind> {
        let seen = |kind: &FaultKind| faults.count(*kind) > 0;
        let after = FaultKind::ALL.into_iter().filter(seen).find(|&kind| kind as u8 >= self.fault_turn);
        let kind = after.or_else(|| FaultKind::ALL.into_iter().find(seen))?;
        self.fault_turn = (kind as u8).saturating_add(1);
        Some(kind)
    }

    fn note_remapped(&mut self, remapped: &Remapped) {
        self.sent.remap(remapped);
        self.location = self.location.and_then(|location| location.remapped(remapped));
        if let Some(belief) = &mut self.belief {
            belief.remap(remapped);
        }
    }
}

impl<const V: usize> Default for Reporter<V> {
    fn default() -> Self {
        Self::new()
    }
}

/// The transmit queue has no room for a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct QueueFull;

impl fmt::Display for QueueFull {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the transmit queue has no room for the message")
    }
}

impl core::error::Error for QueueFull {}
