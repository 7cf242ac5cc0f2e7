//! Address of the broker, and name of the robot.

use std::fmt;
use std::str::FromStr;

/// The port of MQTT without encryption.
const DEFAULT_PORT: u16 = 1883;

/// What to publish, and to which broker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    pub(super) broker: Broker,
    pub(super) robot: String,
    /// Whether to publish the frames as well, for another machine with a decoder.
    pub frames: bool,
}

impl Options {
    /// Publishes a robot's messages under its name, without its frames.
    ///
    /// # Errors
    /// If the name is not a valid topic level: empty, or with `/`, `+`, `#` or NUL.
    pub fn new(broker: Broker, robot: &str) -> Result<Self, OptionError> {
        if robot.is_empty() || robot.contains(['/', '+', '#', '\0']) {
            return Err(OptionError::Name);
        }
        Ok(Self { broker, robot: robot.to_owned(), frames: false })
    }
}

/// Address of a broker without encryption: `mqtt://HOST`, `mqtt://HOST:PORT` or `mqtt://USER:PASSWORD@HOST:PORT`.
#[derive(Clone, PartialEq, Eq)]
pub struct Broker {
    pub(super) host: String,
    pub(super) port: u16,
    pub(super) login: Option<(String, String)>,
}

/// Omits the password.
impl fmt::Debug for Broker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "mqtt://{}:{}", self.host, self.port)
    }
}

impl FromStr for Broker {
    type Err = OptionError;

    fn from_str(text: &str) -> Result<Self, OptionError> {
        let rest = text.strip_prefix("mqtt://").ok_or(OptionError::Broker)?.trim_end_matches('/');
        let (login, place) = match rest.rsplit_once('@') {
            Some((login, place)) => (Some(login.split_once(':').unwrap_or((login, ""))), place),
            None => (None, rest),
        };
        let (host, port) = match place.rsplit_once(':') {
            // The colons of an IPv6 address in brackets do not separate a port.
            Some((host, port)) if !port.ends_with(']') => (host, port.parse().map_err(|_| OptionError::Broker)?),
            _ => (place, DEFAULT_PORT),
        };
        if host.is_empty() || host.contains('/') {
            return Err(OptionError::Broker);
        }
        let login = login.map(|(user, password)| (user.to_owned(), password.to_owned()));
        Ok(Self { host: host.to_owned(), port, login })
    }
}

/// Why the options are invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OptionError {
    /// The broker's address has another format.
    Broker,
    /// The robot's name cannot be a level of a topic.
    Name,
}

impl fmt::Display for OptionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Broker => "a broker is mqtt://HOST:PORT or mqtt://USER:PASSWORD@HOST:PORT",
            Self::Name => "the name of a robot must not be empty and must not hold / + or #",
        })
    }
}

impl std::error::Error for OptionError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broker_address_may_have_a_port_and_a_login() {
        let parse = |text: &str| text.parse::<Broker>().map(|broker| (broker.host, broker.port, broker.login));
        assert_eq!(parse("mqtt://hall"), Ok(("hall".to_owned(), 1883, None)));
        let login = Some(("a".to_owned(), "b:c@d".to_owned()));
        assert_eq!(parse("mqtt://a:b:c@d@10.0.0.1:1884/"), Ok(("10.0.0.1".to_owned(), 1884, login)));
        assert_eq!(parse("mqtt://[::1]"), Ok(("[::1]".to_owned(), 1883, None)));
        for wrong in ["hall:1883", "mqtts://hall", "mqtt://", "mqtt://hall:door", "mqtt://hall/topic"] {
            assert_eq!(parse(wrong), Err(OptionError::Broker), "{wrong}");
        }
    }

    #[test]
    fn a_name_that_is_not_one_topic_level_is_refused() {
        let broker: Broker = "mqtt://hall".parse().unwrap();
        assert!(Options::new(broker.clone(), "robot 7").is_ok());
        for wrong in ["", "a/b", "+", "a#"] {
            assert_eq!(Options::new(broker.clone(), wrong), Err(OptionError::Name));
        }
    }
}
