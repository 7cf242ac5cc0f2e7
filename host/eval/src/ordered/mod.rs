//! Evaluation of maps with ways: environments whose corridors have an order at each place, walks along them, what the robot
//! reports of them, and whether a map is the part that was driven.

mod building;
mod exact;
mod report;
mod walk;

pub use building::{Bearings, Building, BuildingError};
pub use exact::{is_exact, truth};
pub use report::WayHints;
pub use walk::WalkKind;
