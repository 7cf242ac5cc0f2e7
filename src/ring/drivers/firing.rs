//! Which sensors of a ring fire at the same time.

/// The firing groups of a ring. Sensors of one group fire at the same time; the groups fire one after the other.
///
/// Sonars that fire together receive each other's sound (crosstalk), so neighbours belong in different groups. A frame takes
/// the time of one measurement for each group. Memory: one byte for each sensor.
///
/// ```
/// use toposlam::ring::drivers::FiringPlan;
///
/// assert_eq!(FiringPlan::<6>::interleaved(3).group_of, [0, 1, 2, 0, 1, 2]);
/// // Any table is possible.
/// let own = FiringPlan { group_of: [0, 1, 0, 1, 2] };
/// assert_eq!(own.group_count(), 3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FiringPlan<const SONARS: usize> {
    /// Group of each sensor. Groups fire in ascending order; an unused number takes no time.
    pub group_of: [u8; SONARS],
}

impl<const SONARS: usize> FiringPlan<SONARS> {
    /// All sensors at once: the fastest plan, for sensors without crosstalk.
    pub const fn together() -> Self {
        Self { group_of: [0; SONARS] }
    }

    /// Sensor *i* in group *i* modulo `groups`. With 2 or more groups no two neighbours fire together.
    ///
    /// The last and the first sensor are neighbours too: where they would share a group, as in a ring of 3 with 2 groups,
    /// the last sensor is in another group. 0 and 1 mean [`together`](Self::together). At most `SONARS` groups are used.
    pub const fn interleaved(groups: u8) -> Self {
        const { assert!(SONARS > 0 && SONARS <= crate::ring::MAX_SONARS, "a ring has 1 to 128 sensors") };
        let mut plan = Self::together();
        if groups < 2 {
            return plan;
        }
        let mut sensor = 0;
        while sensor < SONARS {
            plan.group_of[sensor] = (sensor % groups as usize) as u8;
            sensor += 1;
        }
        if SONARS > 1 && SONARS % groups as usize == 1 {
            plan.group_of[SONARS - 1] = if groups == 2 { 2 } else { 1 };
        }
        plan
    }

    /// Number of groups, at least 1.
    pub fn group_count(&self) -> usize {
        self.groups().count()
    }

    /// The group numbers in use, ascending.
    pub(super) fn groups(&self) -> impl Iterator<Item = u8> + use<SONARS> {
        let group_of = self.group_of;
        (0..=u8::MAX).filter(move |group| group_of.contains(group))
    }

    /// Whether all sensors are in one group.
    pub(super) fn is_together(&self) -> bool {
        self.group_of.windows(2).all(|pair| pair.first() == pair.last())
    }
}

impl<const SONARS: usize> Default for FiringPlan<SONARS> {
    /// Two groups: sensors with even and with odd index.
    fn default() -> Self {
        Self::interleaved(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_neighbours<const SONARS: usize>() {
        for groups in 2..=u8::MAX {
            let group_of = FiringPlan::<SONARS>::interleaved(groups).group_of;
            for sensor in 0..SONARS {
                let next = (sensor + 1) % SONARS;
                assert!(SONARS == 1 || group_of[sensor] != group_of[next], "{SONARS} in {groups}: {sensor} and {next}");
            }
        }
    }

    #[test]
    fn neighbours_never_fire_together() {
        check_neighbours::<1>();
        check_neighbours::<2>();
        check_neighbours::<3>();
        check_neighbours::<5>();
        check_neighbours::<7>();
        check_neighbours::<16>();
        check_neighbours::<24>();
        check_neighbours::<127>();
        check_neighbours::<128>();
    }

    #[test]
    fn groups_fire_in_ascending_order_without_the_unused_numbers() {
        assert!(FiringPlan { group_of: [9, 2, 255, 2] }.groups().eq([2, 9, 255]));
        assert!(FiringPlan::<4>::interleaved(0).is_together());
        assert!(FiringPlan::<4>::interleaved(1).is_together());
        assert_eq!(FiringPlan::<16>::interleaved(4).group_count(), 4);
        assert_eq!(FiringPlan::<16>::interleaved(200).group_count(), 16);
    }
}
