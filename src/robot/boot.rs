//! The start of a robot with a flash.

use embedded_storage::nor_flash::NorFlash;

use super::{Robot, RobotConfig};
use crate::config_error::ConfigError;
use crate::filter::Filter;
use crate::persist::Persist;
use crate::persist::store::{BootPolicy, BootReport, Store, resume};
use crate::wire::{FilterSettings, Staging};

impl<'buffer, const SONARS: usize, const V: usize, F> Robot<'buffer, SONARS, V, F>
where
    F: Filter<V, Config: FilterSettings> + Persist,
{
    /// Starts the robot and restores the newest snapshot of a store, if the policy allows it.
    ///
    /// The start is that of [`Robot::start`]. Without a valid snapshot the map stays empty. A snapshot includes the settings of
    /// the filter.
    ///
    /// # Errors
    /// As [`Robot::start`].
    pub fn boot<FLASH: NorFlash>(
        &mut self,
        config: &RobotConfig<SONARS, F::Config>,
        buffer: &'buffer mut [u8],
        store: &mut Store<FLASH>,
        policy: BootPolicy,
    ) -> Result<BootReport, ConfigError> {
        self.start(config, &mut [])?;
        let report = resume(store, buffer, policy, |bytes, place| self.restore(bytes, place));
        self.staging = Staging::new(buffer);
        Ok(report)
    }
}
