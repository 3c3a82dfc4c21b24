use super::steering::Shared;
use crate::sinks::{Moment, Sink};
use crate::{Record, RunError};
use pursuit_ptz::control::{Diagnosis, Subject};
use pursuit_ptz::{Aim, PtzError};

/// Where the results of a run become commands to a head: it follows the first target, or all of them together.
pub struct HeadSink {
    steering: Shared,
    /// What the head complained of last: said once.
    complaint: Option<String>,
    tell: Box<dyn FnMut(&Diagnosis) + Send>,
}

impl HeadSink {
    pub(super) fn new(steering: Shared) -> Self {
        Self { steering, complaint: None, tell: Box::new(|_| {}) }
    }

    /// Tells `tell` after every frame what the head is believed to do.
    #[must_use]
    pub fn telling(self, tell: impl FnMut(&Diagnosis) + Send + 'static) -> Self {
        Self { tell: Box::new(tell), ..self }
    }

    /// Says what the head complained of.
    fn listen(&mut self) {
        let (report, departure) = {
            let mut steering = self.steering.lock();
            (steering.pilot.report(), steering.pilot.departure())
        };
        if let Some(departure) = departure {
            tracing::warn!("{departure}");
        }
        for error in report.errors {
            let text = error.to_string();
            if self.complaint.as_ref() != Some(&text) {
                tracing::warn!("{text}");
                self.complaint = Some(text);
            }
        }
    }
}

fn failed(error: PtzError) -> RunError {
    RunError::output("the head")(std::io::Error::other(error))
}

impl Sink for HeadSink {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        let mut steering = self.steering.lock();
        let (now_s, stamp_s) = steering.clocks(moment.frame.time_s());
        let followed = match steering.pilot.subject() {
            Subject::First => moment.records.get(..1).unwrap_or_default(),
            Subject::All => moment.records,
        };
        let one = |record: &Record, time_s: f64| {
            let estimate = record.estimate.as_ref()?;
            Aim::ahead(estimate, time_s - stamp_s, |seconds| moment.forecast(record.target, seconds))
        };
        let forecast = |time_s: f64| Aim::around(followed.iter().filter_map(|record| one(record, time_s)));
        steering.pilot.see(now_s, stamp_s, &forecast).map_err(failed)?;
        let diagnosis = steering.pilot.diagnosis(now_s);
        drop(steering);
        (self.tell)(&diagnosis);
        self.listen();
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RunError> {
        let ended = self.steering.lock().pilot.end();
        self.listen();
        if ended {
            return Ok(());
        }
        let head = "the head".to_owned();
        Err(failed(PtzError::TimedOut { head, doing: "the last stop", after_s: 0.0 }))
    }
}
