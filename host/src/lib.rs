//! Laptop side of toposlam: the simulated world, recordings, the emulated robot, a client of a real one, pictures of maps,
//! and their evaluation.
//!
//! [`world`] stands in for a building and a robot with a ring of sonars, [`recording`] for a real one; both yield the
//! ring frames that [`mapping`] turns into a map on this computer; [`nearness`] says how near to the Voronoi graph a recorded robot
//! drove, and [`laps`] compares the laps of a round. [`exploration`] is a whole robot that drives through such a building by its
//! own code, [`injector`] makes the faults that it meets, and [`soak`] lets it live with them for a day. [`emulator`] runs the
//! firmware with such frames, and
//! [`chip`] answers for the chips on its sensor bus; [`listener`] understands what a robot says, [`client`] tells one on a [`mod@line`] what to do, and [`topology`] is its map as
//! plain data; [`broadcast`] is the robot's end of such a line, and [`log`] records one. [`monitor`] shows all that live in a
//! terminal, with [`wording`], [`mod@setting`] and [`mod@json`] for what is said and set; [`fleet`] listens to a thousand robots at once,
//! and `publish` (feature `mqtt`) tells a broker. [`picture`] draws a map over its floor plan, and [`evaluation`]
//! measures how often maps are right.

pub mod broadcast;
pub mod chip;
pub mod client;
pub mod emulator;
pub mod evaluation;
pub mod exploration;
pub mod fleet;
pub mod injector;
pub mod json;
pub mod laps;
pub mod layout;
pub mod line;
pub mod listener;
pub mod log;
pub mod mapping;
pub mod monitor;
pub mod nearness;
pub mod picture;
#[cfg(feature = "mqtt")]
pub mod publish;
pub mod recording;
pub mod setting;
pub mod soak;
pub mod topology;
pub mod wording;
pub mod world;
