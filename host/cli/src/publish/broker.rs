//! Address of the broker or router, and name of the robot.

use std::fmt;
use std::str::FromStr;

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
    /// If this build has no client for the protocol, or the name is not a valid topic level: empty, or with `/`, `+`, `#`, `*`, `$`, `?` or
    /// NUL.
    pub fn new(broker: Broker, robot: &str) -> Result<Self, OptionError> {
        if !broker.protocol.is_built() {
            return Err(OptionError::Missing(broker.protocol));
        }
        if robot.is_empty() || robot.contains(['/', '+', '#', '*', '$', '?', '\0']) {
            return Err(OptionError::Name);
        }
        Ok(Self { broker, robot: robot.to_owned(), frames: false })
    }
}

/// A protocol of publishing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// MQTT 3.1.1, through a broker.
    Mqtt,
    /// Zenoh, through a router.
    Zenoh,
}

impl Protocol {
    const fn scheme(self) -> &'static str {
        match self {
            Self::Mqtt => "mqtt",
            Self::Zenoh => "zenoh",
        }
    }

    /// The port without encryption.
    const fn default_port(self) -> u16 {
        match self {
            Self::Mqtt => 1883,
            Self::Zenoh => 7447,
        }
    }

    const fn is_built(self) -> bool {
        match self {
            Self::Mqtt => cfg!(feature = "mqtt"),
            Self::Zenoh => cfg!(feature = "zenoh"),
        }
    }
}

/// Address of a broker or router without encryption: `mqtt://HOST`, `mqtt://HOST:PORT`, `mqtt://USER:PASSWORD@HOST:PORT`, `zenoh://HOST` or
/// `zenoh://HOST:PORT`.
#[derive(Clone, PartialEq, Eq)]
pub struct Broker {
    pub(super) protocol: Protocol,
    pub(super) host: String,
    pub(super) port: u16,
    pub(super) login: Option<(String, String)>,
}

/// Omits the password.
impl fmt::Debug for Broker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}://{}:{}", self.protocol.scheme(), self.host, self.port)
    }
}

impl FromStr for Broker {
    type Err = OptionError;

    fn from_str(text: &str) -> Result<Self, OptionError> {
        let (scheme, rest) = text.split_once("://").ok_or(OptionError::Broker)?;
        let protocols = [Protocol::Mqtt, Protocol::Zenoh];
        let protocol = protocols.into_iter().find(|protocol| protocol.scheme() == scheme).ok_or(OptionError::Broker)?;
        let rest = rest.trim_end_matches('/');
        let (login, place) = match rest.rsplit_once('@') {
            Some((login, place)) => (Some(login.split_once(':').unwrap_or((login, ""))), place),
            None => (None, rest),
        };
        let (host, port) = match place.rsplit_once(':') {
            // The colons of an IPv6 address in brackets do not separate a port.
            Some((host, port)) if !port.ends_with(']') => (host, port.parse().map_err(|_| OptionError::Broker)?),
            _ => (place, protocol.default_port()),
        };
        let has_unknown_login = protocol == Protocol::Zenoh && login.is_some();
        if host.is_empty() || host.contains('/') || has_unknown_login {
            return Err(OptionError::Broker);
        }
        let login = login.map(|(user, password)| (user.to_owned(), password.to_owned()));
        Ok(Self { protocol, host: host.to_owned(), port, login })
    }
}

/// Why the options are invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OptionError {
    /// The broker's address has another format.
    Broker,
    /// The robot's name cannot be a level of a topic.
    Name,
    /// This build has no client for the protocol.
    Missing(Protocol),
}

impl fmt::Display for OptionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Broker => {
                f.write_str("a broker is mqtt://HOST:PORT, mqtt://USER:PASSWORD@HOST:PORT or zenoh://HOST:PORT")
            }
            Self::Name => f.write_str("the name of a robot must not be empty and must not hold any of / + # * $ ?"),
            Self::Missing(protocol) => {
                let feature = protocol.scheme();
                write!(f, "this build leaves out {feature}://; add --features {feature} to `cargo run --release`")
            }
        }
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
        let zenoh: Broker = "zenoh://hall".parse().unwrap();
        assert_eq!((zenoh.protocol, zenoh.port), (Protocol::Zenoh, 7447));
        for wrong in
            ["hall:1883", "mqtts://hall", "mqtt://", "mqtt://hall:door", "mqtt://hall/topic", "zenoh://a:b@hall"]
        {
            assert_eq!(parse(wrong), Err(OptionError::Broker), "{wrong}");
        }
    }

    #[test]
    fn a_protocol_that_is_not_built_and_a_name_that_is_not_one_topic_level_are_refused() {
        for protocol in [Protocol::Mqtt, Protocol::Zenoh] {
            let broker: Broker = format!("{}://hall", protocol.scheme()).parse().unwrap();
            if !protocol.is_built() {
                assert_eq!(Options::new(broker, "robot 7"), Err(OptionError::Missing(protocol)));
                continue;
            }
            assert!(Options::new(broker.clone(), "robot 7").is_ok());
            for wrong in ["", "a/b", "+", "a#", "*", "$*", "a?"] {
                assert_eq!(Options::new(broker.clone(), wrong), Err(OptionError::Name));
            }
        }
    }
}
