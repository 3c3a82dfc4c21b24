use clap::Args;
use pursuit::RunError;
use pursuit::address::Locator;
use pursuit::publish::{Discovery, Every, PublishOptions};
use std::path::PathBuf;

/// Results as messages.
#[derive(Debug, Args)]
#[command(next_help_heading = "Messages")]
pub struct Publish {
    /// Publish results to a broker: mqtt://[USER@]HOST[:PORT][/PREFIX] or nats://…, with TLS mqtts:// or tls:// (NATS);
    /// topics begin with PREFIX [default: pursuit/INPUT]
    #[arg(id = "publish", long = "publish", value_name = "ADDRESS")]
    pub address: Option<String>,
    /// When a target's message is sent: every `frame`, when its `state` changes, or every so many seconds; changes of state
    /// are told in any case [default: frame; with --publish-discovery 1]
    #[arg(long = "publish-every", value_name = "WHEN", value_parser = every)]
    pub every: Option<Every>,
    /// How surely messages arrive: 0 at most once, 1 at least once, 2 exactly once (MQTT) [default: 0; changes of state 1]
    #[arg(long = "publish-qos", value_name = "QOS", value_parser = clap::value_parser!(u8).range(0..=2))]
    pub qos: Option<u8>,
    /// How many messages wait while the broker is away; then the oldest are dropped, and counted [default: 10000]
    #[arg(long = "publish-buffer", value_name = "N")]
    pub buffer: Option<usize>,
    /// Tell who listens there what there is to listen to: `homeassistant`
    #[arg(long = "publish-discovery", value_name = "WHOM", value_parser = ["homeassistant"])]
    pub discovery: Option<String>,
    /// Trust the certificates of this PEM file, not the system's
    #[arg(long = "publish-ca", value_name = "FILE")]
    pub ca_file: Option<PathBuf>,
    /// Variable of the environment that holds the password of the broker's USER
    #[arg(
        id = "publish_password_env",
        long = "publish-password-env",
        value_name = "NAME",
        default_value = "PURSUIT_PUBLISH_PASSWORD"
    )]
    pub password_env: String,
    /// File whose first line is the password of the broker's USER
    #[arg(
        id = "publish_password_file",
        long = "publish-password-file",
        value_name = "FILE",
        conflicts_with = "publish_password_env"
    )]
    pub password_file: Option<PathBuf>,
}

/// Takes when messages are sent.
fn every(text: &str) -> Result<Every, String> {
    text.parse().map_err(|e: RunError| e.to_string())
}

impl Publish {
    /// What is said of how to publish.
    pub fn options(&self) -> PublishOptions {
        PublishOptions {
            every: self.every,
            qos: self.qos,
            buffer: self.buffer,
            ca_file: self.ca_file.clone(),
            discovery: self.discovery.as_ref().map(|_| Discovery::HomeAssistant),
        }
    }

    /// The broker's address with the password that is kept elsewhere, where it names a user and no password.
    #[allow(clippy::disallowed_methods, reason = "the variable that the user names")]
    pub fn with_password(&self, address: Locator) -> Result<Locator, RunError> {
        let Some((user, None)) = address.login() else { return Ok(address) };
        let password = match &self.password_file {
            None => std::env::var(&self.password_env).ok(),
            Some(path) => {
                let text = std::fs::read_to_string(path)
                    .map_err(|e| RunError::usage(format!("no password in the file {}: {e}", path.display())))?;
                Some(text.lines().next().unwrap_or_default().to_owned())
            }
        };
        Ok(password.map_or(address.clone(), |password| address.with_credentials(&user, &password)))
    }
}
