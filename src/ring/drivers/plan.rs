//! Which sonars of a ring fire together.

/// The firing groups of a ring. Sensors of one group fire at the same time; the groups fire one after the other.
///
/// Sonars that fire together hear each other's sound, so those that look in nearly the same direction belong in different
/// groups. A frame takes as long as one ranging for each group. 1 byte for each sensor.
///
/// ```
/// use toposlam::ring::drivers::FiringPlan;
///
/// assert_eq!(FiringPlan::<6>::interleaved(3).group_of, [0, 1, 2, 0, 1, 2]);
/// // Two sensors that look to the same side, at each end of a half ring: any table will do.
/// let own = FiringPlan { group_of: [0, 1, 0, 1, 2] };
/// assert_eq!(own.group_count(), 3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FiringPlan<const SONARS: usize> {
    /// The group of each sensor. Groups fire in the order of their numbers; a number that no sensor has takes no time.
    pub group_of: [u8; SONARS],
}

impl<const SONARS: usize> FiringPlan<SONARS> {
    /// All sensors at once: the fastest plan, for a ring whose sensors do not hear each other.
    pub const fn together() -> Self {
        Self { group_of: [0; SONARS] }
    }

    /// Sensor *i* in group *i* modulo `groups`, for a ring that closes: with 2 or more groups no two neighbours fire
    /// together, the last and the first sensor included. Where they would, as in a ring of 3 in 2 groups, the last sensor
    /// goes into another group. 0 and 1 are [`together`](Self::together); no more than `SONARS` groups are used.
    pub const fn interleaved(groups: u8) -> Self {
        const { assert!(SONARS > 0 && SONARS <= 128, "a ring has 1 to 128 sensors") };
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

    /// How many groups fire in turn, at least 1 unless the ring is empty.
    pub fn group_count(&self) -> usize {
        self.groups().count()
    }

    /// The numbers of the groups, in the order in which they fire.
    pub(super) fn groups(&self) -> impl Iterator<Item = u8> + use<SONARS> {
        let group_of = self.group_of;
        (0..=u8::MAX).filter(move |group| group_of.contains(group))
    }

    /// Whether all sensors fire at once.
    pub(super) fn is_together(&self) -> bool {
        self.group_of.windows(2).all(|pair| pair.first() == pair.last())
    }
}

impl<const SONARS: usize> Default for FiringPlan<SONARS> {
    /// Two groups, even and odd.
    fn default() -> Self {
        Self::interleaved(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keeps_neighbours_apart<const SONARS: usize>() {
        for groups in 2..=u8::MAX {
            let group_of = FiringPlan::<SONARS>::interleaved(groups).group_of;
            for sensor in 0..SONARS {
                let next = (sensor + 1) % SONARS;
                assert!(SONARS == 1 || group_of[sensor] != group_of[next], "{SONARS} in {groups}: {sensor} and {next}");
            }
        }
    }

    #[test]
    fn neighbours_of_a_closed_ring_never_fire_together() {
        keeps_neighbours_apart::<1>();
        keeps_neighbours_apart::<2>();
        keeps_neighbours_apart::<3>();
        keeps_neighbours_apart::<5>();
        keeps_neighbours_apart::<7>();
        keeps_neighbours_apart::<16>();
        keeps_neighbours_apart::<24>();
        keeps_neighbours_apart::<127>();
        keeps_neighbours_apart::<128>();
    }

    #[test]
    fn groups_fire_in_the_order_of_their_numbers_and_gaps_take_no_time() {
        assert!(FiringPlan { group_of: [9, 2, 255, 2] }.groups().eq([2, 9, 255]));
        assert!(FiringPlan::<4>::interleaved(0).is_together());
        assert!(FiringPlan::<4>::interleaved(1).is_together());
        assert_eq!(FiringPlan::<16>::interleaved(4).group_count(), 4);
        assert_eq!(FiringPlan::<16>::interleaved(200).group_count(), 16);
    }
}
