//! What all requests share: the options, the trials, the uploads.

use crate::error::Refusal;
use crate::guard::Guard;
use crate::metrics::Metrics;
use crate::options::Picked;
use crate::root::Root;
use crate::trial::{Job, Setup, Trial, read_only};
use crate::uploads::Uploads;
use pursuit::media::{Locator, OpenOptions};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Trials that are open at most.
const MOST_TRIALS: usize = 8;
/// A trial that nobody looks at is not closed for another one before it has been so for this long: its page may be loading.
const GRACE: Duration = Duration::from_secs(2);

pub(crate) struct Studio {
    pub guard: Guard,
    /// The folder that files may come from; none where a job is only watched.
    pub root: Option<Root>,
    pub uploads: Uploads,
    pub metrics: Metrics,
    /// The input of the command line: the only one that need not lie below the root.
    pub given: Option<Locator>,
    pub options: OpenOptions,
    /// Whether somebody waits for a box.
    pub picking: bool,
    /// The first box drawn.
    pub picked: OnceLock<Picked>,
    /// Held while an answer to a wrong token is delayed.
    pub wrong_tokens: tokio::sync::Mutex<()>,
    /// Held while a video is made.
    pub filming: tokio::sync::Mutex<()>,
    /// How long a trial stays open that nobody looks at.
    pub patience: Duration,
    pub trials: Mutex<Trials>,
}

pub(crate) struct Trials {
    open: BTreeMap<u64, Open>,
    /// Being opened.
    opening: usize,
    last: u64,
}

struct Open {
    trial: Arc<Trial>,
    /// Its input, as a source names it.
    source: String,
    /// When somebody looked at it last, or asked it something.
    seen: Instant,
}

impl Open {
    /// How long nobody has looked at it. One that runs is at work, and not forgotten.
    fn forgotten_for(&mut self) -> Duration {
        if self.trial.screen.viewers() > 0 || self.trial.is_running() {
            self.seen = Instant::now();
        }
        self.seen.elapsed()
    }
}

impl Trials {
    /// The first number is a matter of chance: a page that was left open by an earlier studio does not meet its own again.
    pub fn new(chance: u32) -> Self {
        Self { open: BTreeMap::new(), opening: 0, last: u64::from(chance) }
    }

    /// A job to be watched, and nothing else.
    pub fn watching(mut self, job: Arc<Job>) -> Self {
        let trial = Arc::new(Trial::watching(job));
        self.open.insert(self.last, Open { trial, source: String::new(), seen: Instant::now() });
        self
    }

    /// Takes out those that nobody has looked at for this long.
    fn take_forgotten(&mut self, limit: Duration) -> Vec<Arc<Trial>> {
        let old = self.open.extract_if(.., |_, open| open.forgotten_for() >= limit);
        old.map(|(_, open)| open.trial).collect()
    }
}

impl Studio {
    /// # Errors
    /// Where a job is only watched.
    pub fn root(&self) -> Result<&Root, Refusal> {
        self.root.as_ref().ok_or_else(read_only)
    }

    fn trials(&self) -> MutexGuard<'_, Trials> {
        self.trials.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Opens a trial of what is called `source`.
    ///
    /// # Errors
    /// Too many trials, or whatever keeps this one from being opened.
    pub async fn open(&self, setup: Setup, source: String) -> Result<(u64, Arc<Trial>), Refusal> {
        let _place = Place::take(self).await?;
        let trial = Arc::new(Trial::open(setup).await.map_err(|refusal| self.uploads.named(refusal))?);
        let mut trials = self.trials();
        trials.last += 1;
        let number = trials.last;
        trials.open.insert(number, Open { trial: trial.clone(), source, seen: Instant::now() });
        self.metrics.opened();
        Ok((number, trial))
    }

    pub fn trial(&self, number: u64) -> Result<Arc<Trial>, Refusal> {
        let missing = || Refusal::missing("there is no such trial; it was closed, or the studio was started again");
        let mut trials = self.trials();
        let open = trials.open.get_mut(&number).ok_or_else(missing)?;
        open.seen = Instant::now();
        Ok(open.trial.clone())
    }

    /// Notes that somebody looked at this trial until now.
    pub fn left(&self, number: u64) {
        if let Some(open) = self.trials().open.get_mut(&number) {
            open.seen = Instant::now();
        }
    }

    /// Closes a trial; what it knows is kept when this returns.
    pub async fn close(&self, number: u64) -> Result<(), Refusal> {
        let closed = self.trials().open.remove(&number);
        let closed = closed.ok_or_else(|| Refusal::missing("there is no such trial"))?;
        end(vec![closed.trial]).await;
        Ok(())
    }

    /// Closes those that nobody has looked at for a while, so that tabs that were closed leave nothing behind.
    pub async fn close_forgotten(&self) {
        if self.root.is_some() {
            let forgotten = self.trials().take_forgotten(self.patience);
            end(forgotten).await;
        }
    }

    /// Closes all of them.
    pub async fn close_all(&self) {
        let all = std::mem::take(&mut self.trials().open);
        end(all.into_values().map(|open| open.trial).collect()).await;
    }

    /// All trials with their numbers and sources.
    pub fn all(&self) -> Vec<(u64, String, Arc<Trial>)> {
        self.trials().open.iter().map(|(n, open)| (*n, open.source.clone(), open.trial.clone())).collect()
    }

    pub fn numbers(&self) -> Vec<u64> {
        self.trials().open.keys().copied().collect()
    }

    /// How many trials are open, and how many look at them.
    pub fn count(&self) -> (usize, usize) {
        let trials = self.trials();
        (trials.open.len(), trials.open.values().map(|open| open.trial.screen.viewers()).sum())
    }
}

/// A place for a trial that is being opened, given back when dropped.
struct Place<'a>(&'a Studio);

impl<'a> Place<'a> {
    /// Where all are taken, one that nobody looks at is closed for it.
    async fn take(studio: &'a Studio) -> Result<Self, Refusal> {
        let forgotten = {
            let mut trials = studio.trials();
            let mut forgotten = None;
            if trials.open.len() + trials.opening >= MOST_TRIALS {
                let waited = trials.open.iter_mut().map(|(number, open)| (open.forgotten_for(), *number));
                let oldest = waited.max().filter(|(waited, _)| *waited >= GRACE).map(|(_, number)| number);
                let message = format!("{MOST_TRIALS} trials are open and looked at; close one under Runs");
                let oldest = oldest.ok_or_else(|| Refusal::too_many(message))?;
                forgotten = trials.open.remove(&oldest).map(|open| open.trial);
            }
            trials.opening += 1;
            forgotten
        };
        let place = Self(studio);
        end(forgotten.into_iter().collect()).await;
        Ok(place)
    }
}

/// Ends trials on a thread that may wait for their files.
async fn end(trials: Vec<Arc<Trial>>) {
    if !trials.is_empty() {
        // A thread that panicked has said so.
        let _ = tokio::task::spawn_blocking(move || trials.iter().for_each(|trial| trial.end())).await;
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.0.trials().opening -= 1;
    }
}
