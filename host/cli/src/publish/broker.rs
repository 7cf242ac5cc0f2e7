//! Which broker, and under which name.

use std::fmt;
use std::str::FromStr;

/// The port of MQTT without encryption.
const DEFAULT_PORT: u16 = 1883;

/// What is published, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    pub(super) broker: Broker,
    pub(super) robot: String,
    /// Whether the frames are published as well, for another machine with a decoder.
    pub frames: bool,
}

impl Options {
    /// Publishes a robot's messages under its name, without its frames.
    ///
    /// # Errors
    /// When the name is no level of a topic: when it is empty or holds `/`, `+`, `#` or NUL.
    pub fn new(broker: Broker, robot: &str) -> Result<Self, OptionError> {
        if robot.is_empty() || robot.contains(['/', '+', '#', '\0']) {
            return Err(OptionError::Name);
        }
        Ok(Self { broker, robot: robot.to_owned(), frames: false })
    }
}

/// Where a broker is: `mqtt://HOST`, `mqtt://HOST:PORT` or `mqtt://USER:PASSWORD@HOST:PORT`, without encryption.
#[derive(Clone, PartialEq, Eq)]
pub struct Broker {
    pub(super) host: String,
    pub(super) port: u16,
    pub(super) login: Option<(String, String)>,
}

/// Without the password.
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
            // The colons of an address in brackets are its own.
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

/// Why there is nothing to publish to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OptionError {
    /// The broker is not written as one.
    Broker,
    /// The robot's name cannot be part of a topic.
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
    fn a_broker_is_written_with_or_without_a_port_and_a_login() {
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
    fn a_name_that_would_be_more_than_one_level_of_a_topic_is_refused() {
        let broker: Broker = "mqtt://hall".parse().unwrap();
        assert!(Options::new(broker.clone(), "robot 7").is_ok());
        for wrong in ["", "a/b", "+", "a#"] {
            assert_eq!(Options::new(broker.clone(), wrong), Err(OptionError::Name));
        }
    }
}
