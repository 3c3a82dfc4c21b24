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

/// Trials that are open at most.
const MOST_TRIALS: usize = 8;

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
    pub trials: Mutex<Trials>,
}

pub(crate) struct Trials {
    open: BTreeMap<u64, Arc<Trial>>,
    /// Being opened.
    opening: usize,
    last: u64,
}

impl Trials {
    /// The first number is a matter of chance: a page that was left open by an earlier studio does not meet its own again.
    pub fn new(chance: u32) -> Self {
        Self { open: BTreeMap::new(), opening: 0, last: u64::from(chance) }
    }

    /// A job to be watched, and nothing else.
    pub fn watching(self, job: Arc<Job>) -> Self {
        Self { open: BTreeMap::from([(self.last, Arc::new(Trial::watching(job)))]), ..self }
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

    /// # Errors
    /// Too many trials, or whatever keeps this one from being opened.
    pub async fn open(&self, setup: Setup) -> Result<(u64, Arc<Trial>), Refusal> {
        let _place = Place::take(self)?;
        let trial = Arc::new(Trial::open(setup).await?);
        let mut trials = self.trials();
        trials.last += 1;
        let number = trials.last;
        trials.open.insert(number, trial.clone());
        self.metrics.opened();
        Ok((number, trial))
    }

    pub fn trial(&self, number: u64) -> Result<Arc<Trial>, Refusal> {
        let missing = || Refusal::missing("there is no such trial; it was closed, or the studio was started again");
        self.trials().open.get(&number).cloned().ok_or_else(missing)
    }

    pub fn close(&self, number: u64) -> Result<(), Refusal> {
        let closed = self.trials().open.remove(&number);
        closed.map(drop).ok_or_else(|| Refusal::missing("there is no such trial"))
    }

    pub fn numbers(&self) -> Vec<u64> {
        self.trials().open.keys().copied().collect()
    }

    /// How many trials are open, and how many look at them.
    pub fn count(&self) -> (usize, usize) {
        let trials = self.trials();
        (trials.open.len(), trials.open.values().map(|t| t.screen.viewers()).sum())
    }
}

/// A place for a trial that is being opened, given back when dropped.
struct Place<'a>(&'a Studio);

impl<'a> Place<'a> {
    fn take(studio: &'a Studio) -> Result<Self, Refusal> {
        let mut trials = studio.trials();
        if trials.open.len() + trials.opening >= MOST_TRIALS {
            let message = format!("{MOST_TRIALS} trials are open already; close one");
            return Err(Refusal::too_many(message));
        }
        trials.opening += 1;
        Ok(Self(studio))
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.0.trials().opening -= 1;
    }
}
