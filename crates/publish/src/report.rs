use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// What became of the connection, for whoever asks from elsewhere; what is new is also said in the log, once.
#[derive(Debug)]
pub(crate) struct Report {
    broker: String,
    connections: AtomicU64,
    failed_attempts: AtomicU64,
    /// Whether the present absence has been told of.
    told: AtomicBool,
    refusal: OnceLock<String>,
}

impl Report {
    pub fn new(broker: String) -> Self {
        Self {
            broker,
            connections: AtomicU64::new(0),
            failed_attempts: AtomicU64::new(0),
            told: AtomicBool::new(false),
            refusal: OnceLock::new(),
        }
    }

    pub fn connected(&self) {
        self.connections.fetch_add(1, Ordering::Relaxed);
        if self.told.swap(false, Ordering::Relaxed) {
            tracing::warn!("{}: connected again; what waited is sent", self.broker);
        } else {
            tracing::info!("{}: connected", self.broker);
        }
    }

    /// A connection broke off.
    pub fn broke(&self, reason: &str) {
        self.tell(reason);
    }

    /// No connection came about; whether it is of no use to go on trying.
    pub fn failed(&self, reason: &str, for_good: bool) -> bool {
        self.failed_attempts.fetch_add(1, Ordering::Relaxed);
        if for_good && self.connections() == 0 {
            let _ = self.refusal.set(reason.to_owned());
            return true;
        }
        self.tell(reason);
        false
    }

    fn tell(&self, reason: &str) {
        if !self.told.swap(true, Ordering::Relaxed) {
            tracing::warn!("{}: {reason}; messages wait, and the oldest are dropped when too many do", self.broker);
        }
    }

    pub fn broker(&self) -> &str {
        &self.broker
    }

    pub fn connections(&self) -> u64 {
        self.connections.load(Ordering::Relaxed)
    }

    pub fn failed_attempts(&self) -> u64 {
        self.failed_attempts.load(Ordering::Relaxed)
    }

    pub fn refusal(&self) -> Option<&str> {
        self.refusal.get().map(String::as_str)
    }
}
