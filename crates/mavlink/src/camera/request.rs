use crate::Endpoint;
use crate::camera::Place;
use crate::command::Order;
use mavlink::dialects::common::MavResult;
use std::sync::{Arc, Mutex, PoisonError};

/// What a ground station asks of a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ask {
    /// Track what is at a point, in parts of the picture's width and height.
    Point {
        /// From the left.
        x: f64,
        /// From the top.
        y: f64,
        /// In parts of the picture's width; 0 where nothing is said.
        radius: f64,
    },
    /// Track what is in a rectangle.
    Rectangle(Place),
    /// Stop tracking.
    Stop,
}

/// What became of what was asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It is done. The number says how, for whoever can read it: it is the answer's second parameter.
    Done(i32),
    /// It makes no sense.
    Denied,
    /// It cannot be done now.
    NotNow,
    /// It was tried and failed.
    Failed,
}

impl Verdict {
    pub(crate) const fn result(self) -> (MavResult, i32) {
        match self {
            Self::Done(how) => (MavResult::MAV_RESULT_ACCEPTED, how),
            Self::Denied => (MavResult::MAV_RESULT_DENIED, 0),
            Self::NotNow => (MavResult::MAV_RESULT_TEMPORARILY_REJECTED, 0),
            Self::Failed => (MavResult::MAV_RESULT_FAILED, 0),
        }
    }
}

/// What was answered last, for a ground station that asks again because the answer got lost.
pub(crate) type Answered = Arc<Mutex<Option<(Order, Verdict)>>>;

/// What a ground station asks of a camera, and waits to be answered. Who drops it unanswered says "not now".
pub struct Request {
    /// What is asked.
    pub ask: Ask,
    pub(crate) order: Order,
    pub(crate) endpoint: Endpoint,
    pub(crate) answered: Answered,
    pub(crate) open: bool,
}

impl Request {
    /// Who asks: system and component.
    pub const fn from(&self) -> (u8, u8) {
        (self.order.system, self.order.component)
    }

    /// Answers.
    pub fn answer(mut self, verdict: Verdict) {
        self.say(verdict);
    }

    fn say(&mut self, verdict: Verdict) {
        self.open = false;
        let (result, detail) = verdict.result();
        self.order.answer(&self.endpoint, result, detail);
        *self.answered.lock().unwrap_or_else(PoisonError::into_inner) = Some((self.order.clone(), verdict));
    }
}

impl Drop for Request {
    fn drop(&mut self) {
        if self.open {
            self.say(Verdict::NotNow);
        }
    }
}
