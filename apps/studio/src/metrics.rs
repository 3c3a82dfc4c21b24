//! Counts for Prometheus.

use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Default)]
pub(crate) struct Metrics {
    requests: AtomicU64,
    refused: AtomicU64,
    turned_away: AtomicU64,
    opened: AtomicU64,
    pictures: AtomicU64,
    bytes: AtomicU64,
}

impl Metrics {
    pub fn requested(&self) {
        self.requests.fetch_add(1, Ordering::Relaxed);
    }

    pub fn refused(&self) {
        self.refused.fetch_add(1, Ordering::Relaxed);
    }

    /// A connection beyond those that can be served or wait.
    pub fn turned_away(&self) {
        self.turned_away.fetch_add(1, Ordering::Relaxed);
    }

    pub fn opened(&self) {
        self.opened.fetch_add(1, Ordering::Relaxed);
    }

    /// A message to a viewer.
    pub fn sent(&self, bytes: usize) {
        self.pictures.fetch_add(1, Ordering::Relaxed);
        self.bytes.fetch_add(bytes as u64, Ordering::Relaxed);
    }

    /// All counts and what is open now, in Prometheus' text format.
    pub fn text(&self, (trials, viewers): (usize, usize)) -> String {
        let mut text = String::new();
        let mut say = |name: &str, kind: &str, help: &str, value: u64| {
            // Writing to a string cannot fail.
            let _ = write!(text, "# HELP pursuit_studio_{name} {help}\n# TYPE pursuit_studio_{name} {kind}\n");
            let _ = writeln!(text, "pursuit_studio_{name} {value}");
        };
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        say("trials", "gauge", "Trials that are open.", trials as u64);
        say("viewers", "gauge", "Connections that are shown a trial.", viewers as u64);
        say("trials_opened_total", "counter", "Trials opened so far.", count(&self.opened));
        say("requests_total", "counter", "Requests that came.", count(&self.requests));
        say("refused_total", "counter", "Requests refused for their host, origin or token.", count(&self.refused));
        let away = count(&self.turned_away);
        say("connections_refused_total", "counter", "Connections refused because there were too many.", away);
        say("pictures_total", "counter", "Messages sent to viewers.", count(&self.pictures));
        say("picture_bytes_total", "counter", "Bytes of those messages.", count(&self.bytes));
        text
    }
}
