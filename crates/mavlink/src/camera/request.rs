use super::{Place, Shared};
use crate::command::Order;
use mavlink::dialects::common::MavResult;
use std::sync::Arc;
use std::time::{Duration, Instant};

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

/// What a ground station asks of a camera, and waits to be answered. Who drops it unanswered says "not now".
pub struct Request {
    /// What is asked.
    pub ask: Ask,
    asked: Option<Asked>,
    shared: Arc<Shared>,
}

impl Request {
    pub(super) const fn new(asked: Asked, shared: Arc<Shared>) -> Self {
        Self { ask: asked.ask, asked: Some(asked), shared }
    }

    /// Who asks: system and component.
    pub fn from(&self) -> (u8, u8) {
        self.asked.as_ref().map_or((0, 0), |asked| (asked.order.system, asked.order.component))
    }

    /// Answers.
    pub fn answer(mut self, verdict: Verdict) {
        self.say(verdict);
    }

    fn say(&mut self, verdict: Verdict) {
        if let Some(asked) = self.asked.take() {
            self.shared.answer(&asked, verdict);
        }
    }
}

impl Drop for Request {
    fn drop(&mut self) {
        self.say(Verdict::NotNow);
    }
}

/// What was asked, by which command, and when.
#[derive(Debug, Clone)]
pub(crate) struct Asked {
    pub ask: Ask,
    pub order: Order,
    pub at: Instant,
}

/// What ground stations ask, from the command to its answer.
#[derive(Debug, Default)]
pub(crate) struct Requests {
    /// What nobody has taken yet.
    waiting: Option<Asked>,
    /// What was taken last, until it is answered.
    in_hand: Option<Order>,
    /// What was answered last, for a ground station that asks again because the answer got lost.
    answered: Option<(Order, Verdict)>,
    /// Whether what is tracked was asked for by a point.
    pub by_point: bool,
}

/// What is to be said at once of a command.
#[derive(Debug)]
pub(crate) enum Receipt {
    /// The same was answered before.
    Again(Verdict),
    /// The same is under way.
    Patience,
    /// It waits; what waited before has to go.
    Instead(Option<Asked>),
}

impl Requests {
    /// Who asks has given up by then.
    const PATIENCE: Duration = Duration::from_secs(1);

    pub fn put(&mut self, asked: Asked) -> Receipt {
        let order = &asked.order;
        let under_way = [self.waiting.as_ref().map(|waiting| &waiting.order), self.in_hand.as_ref()];
        if under_way.into_iter().flatten().any(|other| order.repeats(other)) {
            return Receipt::Patience;
        }
        match &self.answered {
            Some((before, verdict)) if order.repeats(before) => Receipt::Again(*verdict),
            _ => Receipt::Instead(self.waiting.replace(asked)),
        }
    }

    pub fn take(&mut self) -> Option<Asked> {
        let asked = self.waiting.take()?;
        self.in_hand = Some(asked.order.clone());
        Some(asked)
    }

    /// What has waited for too long.
    pub fn expired(&mut self, now: Instant) -> Option<Asked> {
        self.waiting.take_if(|asked| now.saturating_duration_since(asked.at) >= Self::PATIENCE)
    }

    pub fn answered(&mut self, asked: &Asked, verdict: Verdict) {
        if let Verdict::Done(_) = verdict {
            self.by_point = matches!(asked.ask, Ask::Point { .. });
        }
        self.in_hand.take_if(|order| *order == asked.order);
        self.answered = Some((asked.order.clone(), verdict));
    }
}
