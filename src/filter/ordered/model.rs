//! The model: ln P of exits, ways, travel times and closures.

use super::config::OrderedConfig;
use super::logarithm;
use crate::filter::robust::model::Model as LabelModel;
use crate::filter::robust::special_functions::HALF_LN_2_PI;
use crate::map::LN_TRAVEL_UNIT;
use crate::place::Fingerprint;

/// Counts from here on are taken as this.
const COUNTS: usize = 16;

/// A binary angle of one radian.
const RADIAN: f32 = 65536.0 / (2.0 * core::f32::consts::PI);

/// A way seen this far from a way of the vertex is another one: 0.55 rad.
pub(super) const SAME_WAY: u16 = 5736;

/// The price of a unit of genus, in nats: on one floor corridors cross only at ramps and bridges.
const GENUS: f32 = 7.0;

/// ln of the share of places that are none: after a place; on an edge on which one was none before; and after the drive was lost.
pub(super) const LN_SPURIOUS: f32 = -6.0;
pub(super) const LN_SPURIOUS_AGAIN: f32 = -14.0;
pub(super) const LN_SPURIOUS_START: f32 = -2.0;

/// ln of the density of the label of a place that is none: uniform over 1000 steps, as for a vertex that was not visited before.
pub(super) const LN_ANY_LABEL: f32 = -6.907_755;

/// ln of the prior of another part of the map that no edge connects with the others: a building is one part.
pub(super) const LN_PART: f32 = -10.0;

/// ln of the share of visits that the detector misses.
pub(super) const LN_MISSED_PLACE: f32 = -8.0;

/// How many looks the configured share of missed ways stands for, for a way that was seen more than once.
const WAY_LOOKS: f32 = 20.0;

/// The same for a way that was seen once: it may be no way.
const NEW_WAY_LOOKS: f32 = 2.0;

/// ln of the density of one more value of a mean with a known deviation, by how many values there are: constant and factor of
/// the squared distance.
#[derive(Clone, Copy, Debug)]
struct Predictive {
    constants: [f32; COUNTS],
    factors: [f32; COUNTS],
}

impl Predictive {
    const fn new() -> Self {
        Self { constants: [0.0; COUNTS], factors: [0.0; COUNTS] }
    }

    fn set(&mut self, deviation: f32) {
        for (count, (constant, factor)) in self.constants.iter_mut().zip(&mut self.factors).enumerate() {
            let variance = deviation * deviation * (1.0 + 1.0 / count.max(1) as f32);
            *constant = -0.5 * libm::logf(2.0 * core::f32::consts::PI * variance);
            *factor = -0.5 / variance;
        }
    }

    /// ln of the density of one value at a known mean.
    fn ln_peak(&self) -> f32 {
        self.constants.first().copied().unwrap_or(0.0) + 0.5 * core::f32::consts::LN_2
    }

    fn ln(&self, count: u8, off: f32) -> f32 {
        let count = usize::from(count).min(COUNTS - 1);
        match (self.constants.get(count), self.factors.get(count)) {
            (Some(constant), Some(factor)) => constant + factor * off * off,
            _ => 0.0,
        }
    }
}

/// The logarithms of all probabilities, computed once for a configuration and a scale of the noise.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) labels: LabelModel,
    bearing_rad: f32,
    missed_share: f32,
    bearings: Predictive,
    travels: Predictive,
    /// ln P of a right report of the exit, and of a wrong one of one other way, two others and so on.
    pub(super) right_exit: f32,
    wrong_exit: [f32; 8],
    missed: f32,
    false_way: f32,
    /// The typical gain of a visit that is explained correctly, by the number of ways seen.
    typical: [f32; 8],
}

/// −ln of the density of a bearing of a way that was not seen before: uniform over the circle.
const LN_CIRCLE: f32 = 1.837_877;

/// −ln of the density of ln(travel time) of an edge that was not driven before: uniform over a range of 2.5.
const LN_TRAVEL_RANGE: f32 = 0.916_29;

/// −ln of the share of vertices with one number of ways: uniform over 1 to 7.
pub(super) const LN_WAYS: f32 = 1.945_91;

impl Model {
    pub(super) const fn new() -> Self {
        Self {
            bearing_rad: 0.0,
            missed_share: 0.0,
            labels: LabelModel::new(),
            bearings: Predictive::new(),
            travels: Predictive::new(),
            right_exit: 0.0,
            wrong_exit: [0.0; 8],
            missed: 0.0,
            false_way: 0.0,
            typical: [0.0; 8],
        }
    }

    /// Takes the parameters of a configuration.
    pub(crate) fn configure(&mut self, config: &OrderedConfig) {
        let share = |permille: u16| f32::from(permille) / 1000.0;
        self.bearing_rad = share(config.bearing_noise_mrad);
        self.missed_share = share(config.missed_way_permille);
        self.bearings.set(self.bearing_rad);
        self.travels.set(share(config.travel_noise_permille));
        let wrong_exit = share(config.wrong_exit_permille);
        self.right_exit = libm::logf(1.0 - wrong_exit);
        for (others, slot) in self.wrong_exit.iter_mut().enumerate() {
            *slot = libm::logf(wrong_exit / others.max(1) as f32);
        }
        self.missed = libm::logf(self.missed_share);
        self.false_way = libm::logf(share(config.false_way_permille));
        self.set_noise(f32::from(config.noise_mm) / f32::from(Fingerprint::STEP_MM));
    }

    /// The evidence of the labels of a vertex: [`LabelModel::evidence_of_labels`], with tables.
    pub(super) fn evidence_of_labels(&self, visits: u16, scatter: f32) -> f32 {
        if visits == 0 {
            return 0.0;
        }
        let shape = 1.5 + 0.5 * f32::from(visits);
        self.labels.label_constant - f32::from(visits) * HALF_LN_2_PI - 0.5 * logarithm::ln(visits.into())
            + logarithm::ln_gamma_of_labels(visits)
            - shape * logarithm::ln(self.labels.scale + 0.5 * scatter)
    }

    /// Sets the standard deviation of the labels, in steps.
    pub(crate) fn set_noise(&mut self, noise_steps: f32) {
        self.labels.set_noise(noise_steps);
        let label = -0.5 * libm::logf(2.0 * core::f32::consts::PI * 1.3 * noise_steps * noise_steps) - 0.5;
        let way = self.bearings.ln(3, 0.0) - 0.5 - self.missed_share * 3.0 - 0.1;
        for (ways, typical) in self.typical.iter_mut().enumerate() {
            *typical = label + way * ways.saturating_sub(1) as f32 + self.right_exit;
        }
    }

    /// ln P of a wrong report of the exit that names one of `others` other ways.
    pub(super) fn ln_wrong_exit(&self, others: usize) -> f32 {
        self.wrong_exit.get(others).copied().unwrap_or(-9.0)
    }

    /// ln P that an edge joins a given frontier to one of the frontiers of the map.
    pub(super) fn closure(&self, frontiers: usize, keeps_genus: bool) -> f32 {
        -self.ln_of(frontiers) - if keeps_genus { 0.0 } else { GENUS }
    }

    /// The log prior of one more vertex: a map of K vertices stands for the K! ways to number them.
    pub(super) fn vertex(&self, vertices: u8) -> f32 {
        self.ln_of(usize::from(vertices) + 1)
    }

    pub(super) fn ln_of(&self, count: usize) -> f32 {
        logarithm::ln_of(count)
    }

    /// ln P of seeing a way that was seen at `seen` of `looks` visits, `off` from its mean bearing.
    pub(super) fn way_seen(&self, seen: u8, looks: u8, off: f32) -> f32 {
        if seen == 0 {
            return self.way_new(looks);
        }
        let weight = self.way_weight(seen);
        let real = weight * (1.0 - self.missed_share);
        let hit = self.ln_ratio(f32::from(seen.min(looks)) + real, f32::from(looks.max(seen)) + weight);
        hit + self.bearings.ln(seen, off / RADIAN)
    }

    /// ln of the share of the way that the robot came by, which was seen at `seen` of `looks` visits: it was missed at the
    /// others, and its offset from its mean bearing is integrated out, `weight` being the precision of the offsets of the
    /// other ways in units of the variance of one bearing.
    pub(super) fn reference(&self, off: f32, seen: u8, looks: u8, weight: f32) -> f32 {
        if seen == 0 {
            // Any bearing is possible.
            let missed = f32::from(looks) * self.missed;
            if looks == 0 || weight == 0.0 {
                return missed;
            }
            return missed - LN_CIRCLE - self.bearings.ln_peak() - 0.5 * logarithm::ln(weight);
        }
        if weight == 0.0 {
            return 0.0;
        }
        let off = off / RADIAN / self.bearing_rad;
        let seen = f32::from(seen);
        -0.5 * off * off * seen + 0.5 * self.ln_ratio(seen, seen + weight)
    }

    /// What the difference between the mean bearings of a way costs.
    pub(super) fn bearing_off(&self, off: i16) -> f32 {
        let off = f32::from(off) / RADIAN / self.bearing_rad;
        -0.25 * off * off
    }

    /// ln P of missing a way that was seen at `seen` of `looks` visits.
    pub(super) fn way_missed(&self, seen: u8, looks: u8) -> f32 {
        if seen == 0 {
            return 0.0;
        }
        let weight = self.way_weight(seen);
        let missed = f32::from(looks.saturating_sub(seen)) + weight * self.missed_share;
        self.ln_ratio(missed, f32::from(looks.max(seen)) + weight)
    }

    /// How many looks the prior share of missed ways stands for. What was seen once may be no way.
    fn way_weight(&self, seen: u8) -> f32 {
        if seen <= 1 { NEW_WAY_LOOKS } else { WAY_LOOKS }
    }

    fn ln_ratio(&self, part: f32, whole: f32) -> f32 {
        logarithm::ln(part / whole)
    }

    /// ln P that none of `looks` visits has shown a way.
    pub(super) fn way_unseen(&self, looks: u8) -> f32 {
        (f32::from(looks) * self.missed).max(self.false_way)
    }

    /// ln of the density of seeing a way that none of `looks` visits has shown.
    pub(super) fn way_new(&self, looks: u8) -> f32 {
        self.way_unseen(looks) - LN_CIRCLE
    }

    /// ln of the density of a travel time on an edge that was driven `timed` times.
    pub(super) fn travel(&self, (timed, mean): (u8, u16), ln_travel: u16) -> f32 {
        match (ln_travel, timed) {
            (0, _) => 0.0,
            (_, 0) => -LN_TRAVEL_RANGE,
            _ => self.travels.ln(timed, (f32::from(ln_travel) - f32::from(mean)) / LN_TRAVEL_UNIT),
        }
    }

    /// The typical gain of a visit that is explained correctly.
    pub(super) fn typical_gain(&self, ways: u8, has_travel: bool) -> f32 {
        let travel = if has_travel { self.travels.ln(2, 0.0) - 0.5 } else { 0.0 };
        self.typical.get(usize::from(ways)).copied().unwrap_or(0.0) + travel
    }
}
