//! Collects costs and prints their statistics.

use cortex_m_semihosting::hprintln;

/// The costs of one kind, in the order of measurement.
pub(crate) struct Costs<const LENGTH: usize> {
    values: [u32; LENGTH],
    held: usize,
}

impl<const LENGTH: usize> Costs<LENGTH> {
    pub(crate) const fn new() -> Self {
        Self { values: [0; LENGTH], held: 0 }
    }

    /// Appends a cost; a full list drops it.
    pub(crate) fn push(&mut self, value: u64) {
        if let Some(slot) = self.values.get_mut(self.held) {
            *slot = u32::try_from(value).unwrap_or(u32::MAX);
            self.held += 1;
        }
    }

    /// Prints mean, median, 90th percentile and maximum, and clears the list.
    pub(crate) fn print(&mut self, name: &str) {
        let total: u64 = self.values.iter().map(|&value| u64::from(value)).sum();
        hprintln!("{}_mean: {}", name, total / LENGTH as u64);
        self.values.sort_unstable();
        for (quantile, percent) in [("median", 50), ("p90", 90), ("worst", 100)] {
            let rank = (LENGTH * percent / 100).min(LENGTH.saturating_sub(1));
            hprintln!("{}_{}: {}", name, quantile, self.values.get(rank).copied().unwrap_or(0));
        }
        self.held = 0;
    }
}
