//! Results as messages to a broker, for whoever watches from elsewhere.
//!
//! The topics and the JSON in them are a contract, written down in `docs/guide/messages.md`.

#[cfg(feature = "publish")]
mod home_assistant;
#[cfg(feature = "publish")]
mod message;
#[cfg(not(feature = "publish"))]
mod nowhere;
#[cfg(feature = "publish")]
mod picture;
#[cfg(feature = "publish")]
mod sink;

#[cfg(not(feature = "publish"))]
pub(crate) use nowhere::Publication;
#[cfg(feature = "publish")]
pub(crate) use sink::Publication;
#[cfg(feature = "publish")]
pub use sink::PublishSink;

use crate::RunError;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// When a target's message is sent; its change of state is told in any case.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Every {
    /// For every frame.
    #[default]
    Frame,
    /// Only when the state changes.
    State,
    /// For the first frame this many seconds, > 0, after the last one told of.
    Seconds(f64),
}

impl FromStr for Every {
    type Err = RunError;

    /// # Errors
    /// [`RunError::Usage`] for anything but `frame`, `state` and seconds above zero.
    fn from_str(text: &str) -> Result<Self, RunError> {
        let seconds = text.parse().ok().filter(|s: &f64| s.is_finite() && *s > 0.0);
        match (text, seconds) {
            ("frame", _) => Ok(Self::Frame),
            ("state", _) => Ok(Self::State),
            (_, Some(seconds)) => Ok(Self::Seconds(seconds)),
            _ => Err(RunError::usage(format!(
                "messages are sent every `frame`, `state` (when it changes), or so many seconds above 0; `{text}` is none of these"
            ))),
        }
    }
}

impl TryFrom<String> for Every {
    type Error = RunError;

    fn try_from(text: String) -> Result<Self, RunError> {
        text.parse()
    }
}

impl From<Every> for String {
    fn from(every: Every) -> Self {
        every.to_string()
    }
}

impl fmt::Display for Every {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame => f.write_str("frame"),
            Self::State => f.write_str("state"),
            Self::Seconds(seconds) => write!(f, "{seconds}"),
        }
    }
}

/// Who is told what there is to listen to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Discovery {
    /// Home Assistant: how many are in the picture and in each zone, whether anybody is, of all and of each class, and a picture
    /// of what happened last.
    HomeAssistant,
}

crate::config::options::options! {
    /// How results are published; what is absent has its default.
    pub struct PublishOptions {
        /// When a target's message is sent: `frame`, `state` or seconds. By default every frame, and every second where
        /// somebody is told what to listen to.
        pub every: Option<Every>,
        /// How surely messages arrive, 0, 1 or 2 (MQTT's quality of service; NATS has no 2). By default 0 for those of frames and
        /// 1 for those of states, which never have less.
        pub qos: Option<u8>,
        /// How many messages wait for the broker at most, ≥ 1, before the oldest are dropped. By default 10 000.
        pub buffer: Option<usize>,
        /// Certificates to trust in place of the system's, a PEM file.
        pub ca_file: Option<PathBuf>,
        /// Who is told what there is to listen to.
        pub discovery: Option<Discovery>,
    }
}

#[cfg(feature = "publish")]
impl PublishOptions {
    fn every(&self) -> Every {
        self.every.unwrap_or(match self.discovery {
            Some(Discovery::HomeAssistant) => Every::Seconds(1.0),
            None => Every::Frame,
        })
    }
}

/// What became of the messages of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PublishFacts {
    /// The broker, without any password.
    pub broker: String,
    /// What its topics begin with.
    pub prefix: String,
    /// When a target's message was sent: `frame`, `state` or seconds.
    pub every: Every,
    /// Messages made.
    pub messages: u64,
    /// Those of them that were never sent: too many waited for the broker, or it was not there at the end.
    pub dropped: u64,
    /// How often a connection came about.
    pub connections: u64,
    /// How often none did.
    pub failed_attempts: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_is_read_back() {
        for (text, every) in [("frame", Every::Frame), ("state", Every::State), ("0.5", Every::Seconds(0.5))] {
            assert_eq!(text.parse::<Every>().unwrap(), every);
            assert_eq!(every.to_string(), text);
        }
        for bad in ["", "0", "-1", "inf", "nan", "frames", "1s"] {
            let error = bad.parse::<Every>().unwrap_err();
            assert!(error.to_string().contains("`state`") && error.exit_code() == 2, "{bad}: {error}");
        }
    }
}
