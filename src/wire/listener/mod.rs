//! The listener's side of the line: a replica of the robot's map.

mod map_replica;

pub use map_replica::MapReplica;
