//! A running job of the command line, shown to whoever looks.

use crate::error::StudioError;
use crate::trial::Job;
use crate::{Options, Server};
use pursuit::RunError;
use pursuit::media::SourceInfo;
use pursuit::sinks::{Moment, Sink};
use pursuit::toml::Table;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// The studio's page, read-only, of a run that goes on elsewhere in this program: what its [`sink`](Self::sink) is handed is
/// shown. It listens at the loopback, and until it is dropped.
pub struct Watch {
    job: Arc<Job>,
    url: String,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Listens at a free port of the loopback. The run follows what is known as `input`, by the tracker called `tracker`.
    ///
    /// # Errors
    /// An address that cannot be listened at, a system that gives no thread.
    pub fn open(input: SourceInfo, tracker: &str, parameters: Table) -> Result<Self, StudioError> {
        let system = |e: std::io::Error| StudioError::System(e.to_string());
        let job = Job::new(input, tracker.to_owned(), parameters).map_err(system)?;
        let server = Server::watching(Options::default(), job.clone())?;
        let (url, over) = (server.url(), Arc::new(AtomicBool::new(false)));
        let stopped = over.clone();
        let run = move || {
            if let Err(error) = server.run(|| stopped.load(Ordering::Relaxed)) {
                tracing::warn!("nobody can watch: {error}");
            }
        };
        let thread = std::thread::Builder::new().name("watch".to_owned()).spawn(run).map_err(system)?;
        Ok(Self { job, url, over, thread: Some(thread) })
    }

    /// What to open in a browser.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Takes what is to be shown, never waits, and never fails.
    pub fn sink(&self) -> Box<dyn Sink> {
        Box::new(Shown(self.job.clone()))
    }

    /// Says something that is shown with the newest frame from now on, such as what a pan-tilt head does.
    pub fn remarks(&self) -> impl Fn(String) + Send + 'static {
        let job = self.job.clone();
        move |remark| job.remark(remark)
    }

    /// The run is over, with what went wrong; whoever watches is told.
    pub fn end(self, message: Option<String>) {
        self.job.end(message);
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.job.end(None);
        std::thread::sleep(self.job.farewell());
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so.
            let _ = thread.join();
        }
    }
}

struct Shown(Arc<Job>);

impl Sink for Shown {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        self.0.saw(moment.frame, moment.records);
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RunError> {
        Ok(())
    }
}
