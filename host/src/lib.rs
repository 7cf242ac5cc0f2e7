//! Laptop side of toposlam: the simulated world, recordings, the emulated robot, what is at the other end of a robot's line,
//! and how right maps are.
//!
//! Frames come from a building. [`world`] stands in for one and a robot with a ring of sonars, [`recording`] for a real ring; both
//! yield the ring frames that [`mapping`] turns into a map on this computer. [`nearness`] says how near to the Voronoi graph a
//! recorded robot drove, and [`laps`] compares the laps of a round. [`exploration`] is a whole robot that drives through such a
//! building by its own code, [`injector`] makes the faults that it meets, and [`soak`] lets it live with them for a day. [`emulator`]
//! runs the firmware with such frames, and [`chip`] answers for the chips on its sensor bus.
//!
//! Messages come from a robot. [`mod@line`] is the way to one and [`broadcast`] its end of it; [`listener`] understands what it says,
//! [`client`] tells it what to do, [`topology`] is its map as plain data and [`layout`] where to draw that. [`export`] writes the map
//! for other programs, and [`log`] records all. [`link`] keeps a line open from a thread of its own and [`watch`] what came of it, which
//! [`monitor`] shows in a terminal and [`serve`] in browsers, with [`wording`], [`mod@setting`] and [`mod@json`] for what is said and
//! set. [`fleet`] listens to a thousand robots at once, and `publish` (feature `mqtt`) tells a broker.
//!
//! Maps are right or wrong: [`picture`] draws one over its floor plan, and [`evaluation`] measures how often they are right.

pub mod broadcast;
pub mod chip;
pub mod client;
pub mod emulator;
pub mod evaluation;
pub mod exploration;
pub mod export;
pub mod fleet;
pub mod injector;
pub mod json;
pub mod laps;
pub mod layout;
pub mod line;
pub mod link;
pub mod listener;
pub mod log;
pub mod mapping;
pub mod monitor;
pub mod nearness;
pub mod picture;
#[cfg(feature = "mqtt")]
pub mod publish;
pub mod recording;
pub mod serve;
pub mod setting;
pub mod soak;
pub mod topology;
pub mod watch;
pub mod wording;
pub mod world;

/// The code in the guide to the stream is compiled as a test.
#[cfg(doctest)]
#[doc = include_str!("../../docs/stream.md")]
struct Stream;
