//! Answers ground stations.

use super::request::{Asked, Receipt};
use super::{Ask, Place, Shared, Verdict, messages};
use crate::command::Order;
use crate::{Endpoint, Incoming};
use mavlink::dialects::common::{MESSAGE_INTERVAL_DATA, MavCmd, MavMessage, MavResult};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// `MAV_CMD_GET_MESSAGE_INTERVAL`.
const GET_MESSAGE_INTERVAL: u32 = 510;
/// The commands that asked for one message each before `MAV_CMD_REQUEST_MESSAGE`, and the messages' numbers.
const OLDER_REQUESTS: [(u32, u32); 6] = [(521, 259), (522, 260), (525, 261), (527, 262), (2504, 269), (2505, 270)];

/// What the camera's thread works with.
pub(super) struct Server {
    shared: Arc<Shared>,
}

impl Server {
    /// How often it is looked whether a message is due.
    const GLANCE: Duration = Duration::from_millis(20);
    /// A tracker that says nothing for that long is not there.
    const SILENT: Duration = Duration::from_secs(1);

    pub const fn new(shared: Arc<Shared>) -> Self {
        Self { shared }
    }

    pub fn run(&self, incoming: &Receiver<Incoming>) {
        loop {
            match incoming.recv_timeout(Self::GLANCE) {
                Ok(incoming) => self.take(&incoming),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            let now = Instant::now();
            let mut state = self.shared.lock();
            if state.ended {
                return;
            }
            for id in state.schedule.others_due(now) {
                if let Some(message) = messages::message(&self.shared, &state, id, now) {
                    self.shared.endpoint.send(&message);
                }
            }
            // While pictures come, each brings its own word.
            if state.told.is_none_or(|told| now.saturating_duration_since(told) >= Self::SILENT) {
                messages::send_tracking(&self.shared, &mut state, now);
            }
            let expired = state.requests.expired(now);
            drop(state);
            if let Some(asked) = expired {
                self.shared.answer(&asked, Verdict::NotNow);
            }
        }
    }

    fn endpoint(&self) -> &Endpoint {
        &self.shared.endpoint
    }

    fn take(&self, incoming: &Incoming) {
        let identity = self.endpoint().identity();
        self.shared.lock().vehicle.take(identity, incoming, Instant::now());
        if let Some(order) = Order::of(incoming) {
            self.obey(order);
        }
    }

    fn obey(&self, order: Order) {
        match order.command {
            MavCmd::MAV_CMD_CAMERA_TRACK_POINT => self.ask(order, point),
            MavCmd::MAV_CMD_CAMERA_TRACK_RECTANGLE => self.ask(order, rectangle),
            MavCmd::MAV_CMD_CAMERA_STOP_TRACKING => self.ask(order, |_| Some(Ask::Stop)),
            MavCmd::MAV_CMD_REQUEST_MESSAGE => self.say(&order, order.whole(0)),
            MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL => {
                let id = order.whole(0);
                let interval = order.numbers()[1];
                let is_set = self.shared.lock().schedule.set(id, interval);
                // What another component may send is its own affair.
                if is_set || !order.for_all {
                    order.answer(self.endpoint(), verdict(is_set), 0);
                }
            }
            other => self.obey_older(&order, other as u32),
        }
    }

    /// Commands that are superseded, and that ground stations in use still send.
    fn obey_older(&self, order: &Order, command: u32) {
        if let Some((_, message)) = OLDER_REQUESTS.iter().find(|(older, _)| *older == command) {
            return self.say(order, *message);
        }
        match command {
            GET_MESSAGE_INTERVAL => {
                let id = order.whole(0);
                let interval_us = self.shared.lock().schedule.interval_us(id);
                if let Some(interval_us) = interval_us {
                    let message_id = u16::try_from(id).unwrap_or(u16::MAX);
                    self.endpoint()
                        .send(&MavMessage::MESSAGE_INTERVAL(MESSAGE_INTERVAL_DATA { interval_us, message_id }));
                }
                if interval_us.is_some() || !order.for_all {
                    order.answer(self.endpoint(), verdict(interval_us.is_some()), 0);
                }
            }
            _ if order.for_all => {}
            _ => order.answer(self.endpoint(), MavResult::MAV_RESULT_UNSUPPORTED, 0),
        }
    }

    /// Sends a message that was asked for.
    fn say(&self, order: &Order, id: u32) {
        let message = messages::message(&self.shared, &self.shared.lock(), id, Instant::now());
        match message {
            Some(message) => {
                order.answer(self.endpoint(), MavResult::MAV_RESULT_ACCEPTED, 0);
                self.endpoint().send(&message);
            }
            // Others may have what this camera has not.
            None if order.for_all => {}
            None => order.answer(self.endpoint(), MavResult::MAV_RESULT_UNSUPPORTED, 0),
        }
    }

    /// Keeps what is to be tracked until the tracker asks for it and answers.
    fn ask(&self, order: Order, read: fn(&Order) -> Option<Ask>) {
        let Some(ask) = read(&order).filter(|_| self.is_own_camera(&order)) else {
            if !order.for_all {
                order.answer(self.endpoint(), MavResult::MAV_RESULT_DENIED, 0);
            }
            return;
        };
        let asked = Asked { ask, order: order.clone(), at: Instant::now() };
        let receipt = self.shared.lock().requests.put(asked);
        match receipt {
            Receipt::Again(verdict) => {
                let (result, detail) = verdict.result();
                order.answer(self.endpoint(), result, detail);
            }
            Receipt::Instead(Some(before)) => self.shared.answer(&before, Verdict::NotNow),
            Receipt::Instead(None) | Receipt::Patience => {}
        }
    }

    /// Whether the camera that a command names is this one.
    fn is_own_camera(&self, order: &Order) -> bool {
        let index = match order.command {
            MavCmd::MAV_CMD_CAMERA_TRACK_POINT => 3,
            MavCmd::MAV_CMD_CAMERA_STOP_TRACKING => 0,
            // Its fifth parameter, which the two kinds of messages hold differently.
            _ => return true,
        };
        let named = order.whole(index);
        named == 0 || named == u32::from(self.endpoint().identity().component)
    }
}

const fn verdict(done: bool) -> MavResult {
    if done { MavResult::MAV_RESULT_ACCEPTED } else { MavResult::MAV_RESULT_UNSUPPORTED }
}

fn is_part(value: f64) -> bool {
    (0.0..=1.0).contains(&value)
}

fn point(order: &Order) -> Option<Ask> {
    let [x, y, radius, _] = order.numbers();
    let radius = if radius.is_nan() { 0.0 } else { radius };
    (is_part(x) && is_part(y) && is_part(radius)).then_some(Ask::Point { x, y, radius })
}

fn rectangle(order: &Order) -> Option<Ask> {
    let [a, b, c, d] = order.numbers();
    // Whoever drags from the lower right means the same.
    let place = Place { left: a.min(c), top: b.min(d), right: a.max(c), bottom: b.max(d) };
    let is_sound = [a, b, c, d].into_iter().all(is_part) && place.left < place.right && place.top < place.bottom;
    is_sound.then_some(Ask::Rectangle(place))
}
