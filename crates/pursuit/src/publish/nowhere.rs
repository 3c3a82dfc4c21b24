//! Publishing in builds that speak to no kind of broker.

use super::{PublishFacts, PublishOptions};
use crate::RunError;
use crate::events::Zone;
use crate::run::{InputFacts, RecipeFacts};
use crate::sinks::{Moment, Sink};
use pursuit_address::Locator;
use std::sync::{Arc, Mutex};

/// There is none.
#[derive(Debug, Clone)]
pub(crate) enum Publication {}

impl Publication {
    /// # Errors
    /// Always: what this build cannot reach, and what would mend it.
    pub fn new(address: &Locator, _: &PublishOptions, _: &str) -> Result<Self, RunError> {
        let feature = match address.scheme() {
            Some("nats") => "nats",
            Some("tls") => "nats,tls",
            Some("mqtts") => "mqtts",
            _ => "mqtt",
        };
        Err(RunError::usage(format!("this build cannot publish; build with `--features {feature}`")))
    }

    pub fn start(&self, _: &InputFacts, _: &RecipeFacts, _: &[Zone]) -> Result<PublishSink, RunError> {
        match *self {}
    }
}

/// There is none.
pub(crate) enum PublishSink {}

impl PublishSink {
    pub fn facts(&self) -> Arc<Mutex<PublishFacts>> {
        match *self {}
    }
}

impl Sink for PublishSink {
    fn write(&mut self, _: &Moment<'_>) -> Result<(), RunError> {
        match *self {}
    }

    fn finish(&mut self) -> Result<(), RunError> {
        match *self {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_feature_that_mends_it_is_named() {
        for (address, feature) in
            [("mqtt://h", "mqtt`"), ("mqtts://h", "mqtts`"), ("nats://me:pw@h/p", "nats`"), ("tls://h", "nats,tls`")]
        {
            let error = Publication::new(&address.into(), &PublishOptions::default(), "x").unwrap_err();
            assert!(error.to_string().contains(feature) && error.exit_code() == 2, "{error}");
        }
    }
}
