//! What every kind of broker has in common: one connection after the other, until nothing more comes.

use crate::address::{Broker, Scheme};
use crate::back_off::BackOff;
use crate::outbox::Outbox;
use crate::publisher::Options;
use crate::report::Report;
use crate::{Message, PublishError, Result};
use std::io;
use tokio::runtime::{Builder, Runtime};
use tokio::time::Instant;

/// Seconds within which a connection must come about, and the broker must take what it is sent.
pub(crate) const PATIENCE_S: u64 = 5;

/// What the thread works with.
pub(crate) struct Link<'a> {
    pub options: &'a Options,
    pub outbox: &'a dyn Outbox,
    pub report: &'a Report,
}

impl Link<'_> {
    /// What says whether the publisher is there.
    pub fn status(&self, word: &str) -> Message {
        Message::retained(&self.options.status_topic, word)
    }

    /// Whether nothing more comes.
    pub fn has_ended(&self) -> bool {
        self.outbox.ended().borrow().is_some()
    }

    /// Comes when the time after the end is over.
    async fn deadline(&self) {
        let at = match self.outbox.ended().wait_for(Option::is_some).await {
            Ok(at) => at.map(Instant::from_std),
            Err(_) => None,
        };
        tokio::time::sleep_until(at.unwrap_or_else(Instant::now) + self.options.linger).await;
    }
}

/// Why no connection came about.
pub(crate) struct Failure {
    pub reason: String,
    /// Whether trying again is of no use.
    pub for_good: bool,
}

impl From<(String, bool)> for Failure {
    fn from((reason, for_good): (String, bool)) -> Self {
        Self { reason, for_good }
    }
}

/// A way to speak to brokers.
pub(crate) trait Wire {
    type Connection: Connection;

    /// One attempt.
    async fn connect(&self, link: &Link<'_>) -> std::result::Result<Self::Connection, Failure>;
}

/// A connection that has come about.
pub(crate) trait Connection {
    /// Says that the publisher is there and what is retained, then sends what comes into the outbox, until that has ended
    /// and the broker has it all.
    ///
    /// # Errors
    /// Why the connection broke off.
    async fn transfer(&mut self, link: &Link<'_>) -> std::result::Result<(), String>;

    /// Puts back what the broker did not take, and says what is lost.
    fn take_back(self, link: &Link<'_>);
}

/// What ended a connection, or an attempt at one.
enum End {
    /// Everything was sent, and the broker knows that this was all.
    Done,
    /// The time for the end is over.
    Late,
    Failed(Failure),
    Broken(String),
}

/// What the thread does all its life.
pub(crate) type Work = Box<dyn FnOnce(&Link<'_>) + Send>;

/// How the broker is spoken to.
///
/// # Errors
/// [`PublishError::Missing`], [`PublishError::Certificates`], [`PublishError::Thread`].
pub(crate) fn work(broker: &Broker, options: &Options) -> Result<Work> {
    broker.scheme.check()?;
    let waits = runtime().map_err(|source| PublishError::Thread { source })?;
    match broker.scheme {
        #[cfg(feature = "mqtt")]
        Scheme::Mqtt | Scheme::Mqtts => {
            let wire = crate::mqtt::Mqtt::new(broker, options)?;
            Ok(Box::new(move |link| run(link, &waits, &wire)))
        }
        #[cfg(feature = "nats")]
        Scheme::Nats | Scheme::Tls => {
            let wire = crate::nats::Nats::new(broker, options)?;
            Ok(Box::new(move |link| run(link, &waits, &wire)))
        }
        #[cfg(not(all(feature = "mqtt", feature = "nats")))]
        other => Err(other.missing()),
    }
}

fn runtime() -> io::Result<Runtime> {
    Builder::new_current_thread().enable_io().enable_time().build()
}

/// Sends what is in the outbox until that has ended and all is sent, or the time for it is over.
fn run(link: &Link<'_>, waits: &Runtime, wire: &impl Wire) {
    let mut back_off = BackOff::new();
    loop {
        let is_last = link.has_ended();
        let end = match runtime() {
            Ok(own) => {
                let end = own.block_on(connection(link, wire));
                // With the runtime goes whatever the library left behind there; a name that is still being looked up is not
                // waited for.
                own.shutdown_background();
                end
            }
            Err(error) => End::Failed((error.to_string(), false).into()),
        };
        let (reason, goes_on) = match end {
            End::Done | End::Late => return,
            End::Broken(reason) => {
                back_off = BackOff::new();
                link.report.broke(&format!("the connection broke off: {reason}"));
                (reason, true)
            }
            End::Failed(Failure { reason, for_good }) => {
                if link.report.failed(&reason, for_good) {
                    return;
                }
                (reason, !is_last)
            }
        };
        if !goes_on {
            return;
        }
        let wait = back_off.wait();
        tracing::debug!("{}: {reason}; next attempt in {:.1} s", link.report.broker(), wait.as_secs_f64());
        // Once no more comes there is one attempt at once.
        let mut told = link.outbox.ended();
        waits.block_on(async {
            tokio::select! {
                () = tokio::time::sleep(wait) => {}
                _ = told.wait_for(Option::is_some) => {}
            }
        });
    }
}

/// A connection from the attempt to its end.
async fn connection(link: &Link<'_>, wire: &impl Wire) -> End {
    let attempt = tokio::select! {
        attempt = wire.connect(link) => attempt,
        () = link.deadline() => return End::Late,
    };
    let mut connection = match attempt {
        Ok(connection) => connection,
        Err(failure) => return End::Failed(failure),
    };
    link.report.connected();
    let end = tokio::select! {
        biased;
        end = connection.transfer(link) => end.map_or_else(End::Broken, |()| End::Done),
        () = link.deadline() => End::Late,
    };
    if !matches!(end, End::Done) {
        connection.take_back(link);
    }
    end
}
