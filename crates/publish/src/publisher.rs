use crate::address::Broker;
use crate::link::{self, Link};
use crate::outbox::Queue;
use crate::own_topics::OwnTopics;
use crate::report::Report;
use crate::{Message, PublishError, Result};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

/// How a publisher works.
#[derive(Debug, Clone)]
pub struct Options {
    /// How many messages wait at most; of more the oldest are dropped.
    pub capacity: usize,
    /// Where `online` is retained while the publisher is connected, and `offline` otherwise: said by the publisher at its end,
    /// and by the broker, as its last will, when the connection breaks. NATS has neither: `online` is said again and again.
    pub status_topic: String,
    /// How often the broker is asked for a sign of life, in whole seconds, ≥ 1 s, and how often one that retains nothing
    /// (NATS) is told again what is retained.
    pub keep_alive: Duration,
    /// For how long the end waits for what has not been sent yet.
    pub linger: Duration,
    /// Topics that are this publisher's alone. Of no meaning to brokers that retain nothing.
    pub own_topics: Vec<OwnTopics>,
}

impl Options {
    /// 10 000 messages, a sign of life every 10 s, 5 s at the end.
    pub fn new(status_topic: impl Into<String>) -> Self {
        Self {
            capacity: 10_000,
            status_topic: status_topic.into(),
            keep_alive: Duration::from_secs(10),
            linger: Duration::from_secs(5),
            own_topics: Vec::new(),
        }
    }
}

/// What became of the messages.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Messages that came in.
    pub messages: u64,
    /// Those of them that never left: dropped because too many waited, lost with a connection, or left over at the end.
    pub dropped: u64,
    /// How often a connection came about.
    pub connections: u64,
    /// How often none did.
    pub failed_attempts: u64,
}

/// Sends messages to a broker from a thread of its own. Whoever hands in messages never waits for the broker.
pub struct Publisher<T> {
    queue: Arc<Queue<T>>,
    report: Arc<Report>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Send + 'static> Publisher<T> {
    /// Starts the thread, which connects while other things happen. `encode` makes messages there of what is handed in.
    ///
    /// # Errors
    /// [`PublishError::Missing`] for brokers that this build cannot reach, [`PublishError::Certificates`],
    /// [`PublishError::Thread`]. That the broker is not there is no error: messages wait for it.
    pub fn start(
        broker: Broker,
        options: Options,
        encode: impl Fn(T) -> Message + Send + Sync + 'static,
    ) -> Result<Self> {
        let work = link::work(&broker, &options)?;
        let queue = Arc::new(Queue::new(options.capacity, Box::new(encode)));
        let report = Arc::new(Report::new(broker.to_string()));
        let (own_queue, own_report) = (queue.clone(), report.clone());
        let all = move || work(&Link { options: &options, outbox: &*own_queue, report: &own_report });
        let thread = std::thread::Builder::new().name("publish".to_owned()).spawn(all);
        let thread = thread.map_err(|source| PublishError::Thread { source })?;
        Ok(Self { queue, report, thread: Some(thread) })
    }

    /// Hands in what is encoded when it is its turn; none of it is retained.
    pub fn extend(&self, items: impl IntoIterator<Item = T>) {
        self.queue.extend(items);
    }

    /// Hands in a message.
    pub fn push(&self, message: Message) {
        self.queue.push(message);
    }

    /// Hands in a message that takes the place of those under its topic that still wait: large ones, such as pictures, of
    /// which the newest is enough.
    pub fn replace(&self, message: Message) {
        self.queue.replace(message);
    }

    /// What has become of the messages so far.
    pub fn counts(&self) -> Counts {
        let (messages, dropped) = self.queue.counts();
        let (connections, failed_attempts) = (self.report.connections(), self.report.failed_attempts());
        Counts { messages, dropped, connections, failed_attempts }
    }

    /// Whether the broker refused the first contact for a reason that does not go away – a wrong password, a certificate
    /// that is not to be trusted –, so that nothing will ever be sent.
    ///
    /// # Errors
    /// [`PublishError::Refused`] when it did.
    pub fn check(&self) -> Result<()> {
        match self.report.refusal() {
            None => Ok(()),
            Some(reason) => {
                Err(PublishError::Refused { broker: self.report.broker().to_owned(), reason: reason.to_owned() })
            }
        }
    }

    /// Sends what waits, for as long as [`Options::linger`] allows, says `offline` and disconnects. What is left counts as
    /// dropped.
    pub fn finish(&mut self) -> Counts {
        self.queue.end();
        if let Some(thread) = self.thread.take() {
            // The thread does not panic; where it should, what it did not send is counted as dropped.
            let _ = thread.join();
            self.queue.abandon();
        }
        self.counts()
    }
}

impl<T> Drop for Publisher<T> {
    /// Tells the thread to end, and does not wait for it.
    fn drop(&mut self) {
        self.queue.end();
    }
}
