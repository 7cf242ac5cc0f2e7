//! Differential drive: velocity command to wheel speeds, wheel speeds to PWM duty cycle and direction.

use crate::setters::setters;
use core::fmt;

use embedded_hal::{digital::OutputPin, pwm::SetDutyCycle};

use super::VelocityCommand;
use crate::config_error::ConfigError;

/// Settings of a robot with two driven wheels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct WheelsConfig {
    /// Heading above which the robot turns in place, in milliradians, 1 to 3142. Default 600.
    pub spin_from_mrad: i16,
    /// Maximum speed of each wheel while the robot turns in place, in thousandths of full speed, 1 to 1000. Default 500.
    pub spin_permille: u16,
    /// Steering gain: the speed added to one wheel and subtracted from the other per radian of heading, in thousandths of full
    /// speed, 1 to 2000. Default 800.
    pub steer_permille_per_rad: u16,
    /// Minimum duty cycle at which the motors turn, in thousandths, below 1000. Default 0.
    pub dead_zone_permille: u16,
}

impl WheelsConfig {
    setters! {
        with_spin_from_mrad, spin_from_mrad: i16;
        with_spin_permille, spin_permille: u16;
        with_steer_permille_per_rad, steer_permille_per_rad: u16;
        with_dead_zone_permille, dead_zone_permille: u16;
    }

    /// The documented defaults.
    pub const DEFAULT: Self =
        Self { spin_from_mrad: 600, spin_permille: 500, steer_permille_per_rad: 800, dead_zone_permille: 0 };

    /// Whether every field is in its range.
    ///
    /// # Errors
    /// The first field that is not.
    pub fn check(&self) -> Result<(), ConfigError> {
        ConfigError::check("spin_from_mrad", self.spin_from_mrad.into(), 1, 3142)?;
        ConfigError::check("spin_permille", self.spin_permille.into(), 1, 1000)?;
        ConfigError::check("steer_permille_per_rad", self.steer_permille_per_rad.into(), 1, 2000)?;
        ConfigError::check("dead_zone_permille", self.dead_zone_permille.into(), 0, 999)
    }
}

impl Default for WheelsConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// The speeds of the two wheels, in thousandths of full speed, −1000 to 1000, forward positive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WheelSpeeds {
    /// The left wheel.
    pub left_permille: i16,
    /// The right wheel.
    pub right_permille: i16,
}

impl WheelSpeeds {
    /// Computes the wheel speeds for a velocity command. Neither exceeds ±1000.
    pub fn from_velocity(velocity: VelocityCommand, config: &WheelsConfig) -> Self {
        let heading_mrad = i32::from(velocity.heading_mrad);
        let is_in_place = velocity.speed_permille == 0 || heading_mrad.abs() > i32::from(config.spin_from_mrad);
        let steer = heading_mrad * i32::from(config.steer_permille_per_rad) / 1000;
        let (forward, aside) = if is_in_place {
            let spin = i32::from(config.spin_permille);
            (0, steer.clamp(-spin, spin))
        } else {
            let aside = steer.clamp(-1000, 1000);
            // Slows down so that the faster wheel is at most at full speed.
            (i32::from(velocity.speed_permille).min(1000 - aside.abs()), aside)
        };
        Self { left_permille: (forward - aside) as i16, right_permille: (forward + aside) as i16 }
    }
}

/// Two motors, each with a PWM channel for its speed and a pin for its direction (high is forward).
#[derive(Debug)]
pub struct DifferentialDrive<PWM, DIRECTION> {
    left: (PWM, DIRECTION),
    right: (PWM, DIRECTION),
    config: WheelsConfig,
}

impl<PWM: SetDutyCycle, DIRECTION: OutputPin> DifferentialDrive<PWM, DIRECTION> {
    /// Creates the drive. The motors do not move before the first command.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn new(left: (PWM, DIRECTION), right: (PWM, DIRECTION), config: WheelsConfig) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self { left, right, config })
    }

    /// Sets both motors to a velocity command.
    ///
    /// # Errors
    /// [`MotorError`] with the wheel whose PWM channel or pin failed; the other one is set all the same.
    pub fn follow(&mut self, velocity: VelocityCommand) -> Result<(), MotorError> {
        let WheelSpeeds { left_permille, right_permille } = WheelSpeeds::from_velocity(velocity, &self.config);
        let dead_zone_permille = self.config.dead_zone_permille;
        let left = set(&mut self.left, left_permille, dead_zone_permille).map_err(|()| MotorError(Wheel::Left));
        let right = set(&mut self.right, right_permille, dead_zone_permille).map_err(|()| MotorError(Wheel::Right));
        left.and(right)
    }

    /// Stops both motors.
    ///
    /// # Errors
    /// As [`DifferentialDrive::follow`].
    pub fn stop(&mut self) -> Result<(), MotorError> {
        self.follow(VelocityCommand::STOP)
    }

    /// Returns the motors, left and right.
    pub fn release(self) -> [(PWM, DIRECTION); 2] {
        [self.left, self.right]
    }
}

fn set<PWM: SetDutyCycle, DIRECTION: OutputPin>(
    (pwm, direction): &mut (PWM, DIRECTION),
    speed_permille: i16,
    dead_zone_permille: u16,
) -> Result<(), ()> {
    let size = speed_permille.unsigned_abs().min(1000);
    let duty_permille = match size {
        0 => 0,
        _ => u32::from(dead_zone_permille) + u32::from(size) * u32::from(1000 - dead_zone_permille.min(1000)) / 1000,
    };
    let turned = if speed_permille < 0 { direction.set_low() } else { direction.set_high() };
    let duty = u32::from(pwm.max_duty_cycle()) * duty_permille.min(1000) / 1000;
    pwm.set_duty_cycle(duty as u16).map_err(|_| ())?;
    turned.map_err(|_| ())
}

/// One of the two wheels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wheel {
    /// The left one.
    Left,
    /// The right one.
    Right,
}

/// The PWM channel or the direction pin of a wheel failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MotorError(pub Wheel);

impl fmt::Display for MotorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            Wheel::Left => "the left motor cannot be set",
            Wheel::Right => "the right motor cannot be set",
        })
    }
}

impl core::error::Error for MotorError {}

#[cfg(test)]
mod tests {
    use super::*;

    fn speeds(heading_mrad: i16, speed_permille: u16) -> (i16, i16) {
        let velocity = VelocityCommand { heading_mrad, speed_permille };
        let WheelSpeeds { left_permille, right_permille } =
            WheelSpeeds::from_velocity(velocity, &WheelsConfig::DEFAULT);
        (left_permille, right_permille)
    }

    #[test]
    fn straight_ahead_both_wheels_are_equal_and_aside_the_robot_drives_an_arc_within_full_speed() {
        assert_eq!(speeds(0, 1000), (1000, 1000));
        assert_eq!(speeds(0, 300), (300, 300));
        assert_eq!(speeds(250, 500), (300, 700));
        assert_eq!(speeds(-250, 1000), (1000, 600));
    }

    #[test]
    fn far_aside_or_without_speed_the_robot_turns_in_place() {
        assert_eq!(speeds(2000, 1000), (-500, 500));
        assert_eq!(speeds(-2000, 0), (500, -500));
        assert_eq!(speeds(100, 0), (-80, 80));
        assert_eq!(speeds(0, 0), (0, 0));
    }

    #[test]
    fn no_command_exceeds_full_speed() {
        for heading_mrad in (i16::MIN..=i16::MAX).step_by(97) {
            for speed_permille in [0, 1, 500, 1000, u16::MAX] {
                let (left, right) = speeds(heading_mrad, speed_permille);
                assert!(left.abs() <= 1000 && right.abs() <= 1000, "{heading_mrad} {speed_permille}: {left} {right}");
            }
        }
    }
}
