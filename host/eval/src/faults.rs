//! Fault counts as lines of text.

use toposlam::{FaultCounters, FaultKind};

/// One line for each kind of fault that was seen.
pub fn fault_lines(faults: &FaultCounters) -> Vec<String> {
    let seen = FaultKind::ALL.into_iter().filter(|kind| faults.count(*kind) > 0);
    seen.map(|kind| format!("{kind:?}: {}", faults.count(kind))).collect()
}
