//! A connection that has come about.

use super::PATIENCE;
use super::notices::Notices;
use crate::link::{Connection, Failure, Link, PATIENCE_S};
use crate::{Message, Qos};
use async_nats::{Client, Subscriber};
use futures_util::StreamExt;
use std::collections::VecDeque;
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep_until};

/// Messages after which the server is asked whether it has them.
const STRETCH: usize = 64;
/// Messages on their way that it has not confirmed: enough for 20 000 a second and 50 ms there and back.
const UNCONFIRMED: usize = 1024;
/// More than is ever handed to the library at once, so that it takes everything without waiting: each message may be followed by a
/// question.
pub(super) const CAPACITY: usize = 2 * UNCONFIRMED + 16;

/// What is to become of a message that was not confirmed when the connection breaks.
enum Held {
    /// Nothing: every connection begins with it.
    Repeated,
    /// It is lost, or it may be.
    Once,
    /// It is sent again.
    Again(Message),
}

pub(crate) struct Session {
    client: Client,
    /// Where the server is asked; none where it does not allow that.
    inbox: Option<String>,
    echo: Subscriber,
    notices: watch::Receiver<Notices>,
    /// Messages handed over that are not confirmed, the oldest first.
    held: VecDeque<Held>,
    /// How many of them each question without an answer is about, and how many came after the last.
    questions: VecDeque<usize>,
    unasked: usize,
    /// Since when an answer is waited for.
    waits_since: Option<Instant>,
    denials: u64,
}

impl Session {
    /// Says that the publisher is there, and waits until the server has taken that.
    pub async fn begin(client: Client, notices: watch::Receiver<Notices>, link: &Link<'_>) -> Result<Self, Failure> {
        let lost = |reason: String| Failure { reason, for_good: false };
        let inbox = client.new_inbox();
        let echo = client.subscribe(inbox.clone()).await.map_err(|e| lost(e.to_string()))?;
        let (held, questions) = (VecDeque::new(), VecDeque::new());
        let (unasked, waits_since, denials) = (0, None, 0);
        let inbox = Some(inbox);
        let mut session = Self { client, inbox, echo, notices, held, questions, unasked, waits_since, denials };
        session.give(link, link.status("online"), true).await;
        // What the server objects to comes on another way than the answer, and is there at the second one.
        for _ in 0..2 {
            session.ask().await;
            while !session.questions.is_empty() {
                session.listen(link).await.map_err(lost)?;
            }
        }
        session.flush_unasked().await.map_err(lost)?;
        let denied = session.notices.borrow().denied.clone();
        match denied {
            Some(subject) => {
                let reason = format!("the broker does not allow publishing under `{subject}`");
                Err(Failure { reason, for_good: true })
            }
            None => Ok(session),
        }
    }

    /// Hands a message over.
    async fn give(&mut self, link: &Link<'_>, message: Message, is_repeated: bool) {
        if message.retain && message.payload.is_empty() {
            // Nothing is retained that could be forgotten.
            return;
        }
        let subject = message.topic.replace('/', ".");
        let (payload, held) = match message.qos {
            _ if is_repeated => (message.payload, Held::Repeated),
            Qos::AtMostOnce => (message.payload, Held::Once),
            _ => (message.payload.clone(), Held::Again(message)),
        };
        match self.client.publish(subject, payload.into()).await {
            Ok(()) => {
                self.held.push_back(held);
                self.unasked += 1;
            }
            // It is longer than what the server takes.
            Err(_) => link.outbox.lose(u64::from(!is_repeated)),
        }
    }

    /// Asks the server whether it has what was handed over.
    async fn ask(&mut self) {
        let Some(inbox) = &self.inbox else { return };
        // There is room for that: it does not fail.
        if self.client.publish(inbox.clone(), Vec::new().into()).await.is_ok() {
            self.questions.push_back(std::mem::take(&mut self.unasked));
            self.waits_since.get_or_insert_with(Instant::now);
        }
    }

    /// Where the server is not asked, what has been written is taken to have arrived; whether something was.
    async fn flush_unasked(&mut self) -> Result<bool, String> {
        if self.inbox.is_some() || self.held.is_empty() {
            return Ok(false);
        }
        tokio::select! {
            flushed = self.client.flush() => flushed.map_err(|e| e.to_string())?,
            end = ended(&mut self.notices) => return Err(end),
            () = tokio::time::sleep(PATIENCE) => return Err(no_answer()),
        }
        self.held.clear();
        self.unasked = 0;
        Ok(true)
    }

    /// Waits until the server says something.
    ///
    /// # Errors
    /// When the connection is over, or no answer came in time.
    async fn listen(&mut self, link: &Link<'_>) -> Result<(), String> {
        let late = match self.waits_since {
            Some(since) => since + PATIENCE,
            None => Instant::now() + PATIENCE,
        };
        tokio::select! {
            changed = self.notices.changed() => match changed {
                Ok(()) => self.heed(link),
                Err(_) => Err("the library gave it up".to_owned()),
            },
            Some(_) = self.echo.next() => {
                self.confirm();
                Ok(())
            }
            () = sleep_until(late), if self.waits_since.is_some() => Err(no_answer()),
        }
    }

    /// The oldest question is answered.
    fn confirm(&mut self) {
        if let Some(about) = self.questions.pop_front() {
            self.held.drain(..about.min(self.held.len()));
        }
        self.waits_since = (!self.questions.is_empty()).then(Instant::now);
    }

    fn heed(&mut self, link: &Link<'_>) -> Result<(), String> {
        let notices = self.notices.borrow_and_update().clone();
        if let Some(end) = notices.end() {
            return Err(end);
        }
        if notices.denies_inbox && self.inbox.take().is_some() {
            tracing::warn!(
                "{}: it does not allow `_INBOX.>`, where it would confirm messages; what breaks with a connection is lost",
                link.report.broker()
            );
            self.questions.clear();
            self.waits_since = None;
        }
        Ok(())
    }

    /// Says that something may not be published, once, and counts what was lost by that.
    fn count_denials(&mut self, link: &Link<'_>) {
        let notices = self.notices.borrow();
        if let (Some(subject), 0) = (&notices.denied, self.denials) {
            tracing::warn!("{}: it does not allow publishing under `{subject}`; that is lost", link.report.broker());
        }
        link.outbox.lose(notices.denials - self.denials);
        self.denials = notices.denials;
    }
}

/// Why the connection is over, once it is.
async fn ended(notices: &mut watch::Receiver<Notices>) -> String {
    let end = notices.wait_for(|notices| notices.is_over).await.ok().and_then(|notices| notices.end());
    end.unwrap_or_else(|| "the library gave it up".to_owned())
}

fn no_answer() -> String {
    format!("no answer within {PATIENCE_S} s")
}

impl Connection for Session {
    async fn transfer(&mut self, link: &Link<'_>) -> Result<(), String> {
        let period = link.options.keep_alive.max(Duration::from_secs(1));
        let mut signs = interval_at(Instant::now() + period, period);
        signs.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut again = VecDeque::from(link.outbox.documents());
        let mut has_said_all = false;
        loop {
            let has_ended = link.has_ended();
            while self.held.len() < UNCONFIRMED && !has_said_all {
                if let Some(document) = again.pop_front() {
                    self.give(link, document, true).await;
                } else if let Some(message) = link.outbox.take() {
                    self.give(link, message, false).await;
                } else if has_ended {
                    self.give(link, link.status("offline"), true).await;
                    has_said_all = true;
                } else {
                    break;
                }
                if self.unasked >= STRETCH {
                    self.ask().await;
                }
            }
            if self.unasked > 0 && self.questions.is_empty() {
                self.ask().await;
            }
            let has_written = self.flush_unasked().await?;
            if has_said_all && self.held.is_empty() {
                self.count_denials(link);
                return Ok(());
            }
            if has_written {
                // More may wait.
                continue;
            }
            let has_room = self.held.len() < UNCONFIRMED;
            tokio::select! {
                heard = self.listen(link) => {
                    heard?;
                    self.count_denials(link);
                }
                _ = signs.tick(), if again.is_empty() => {
                    again.push_back(link.status("online"));
                    again.extend(link.outbox.documents());
                }
                () = link.outbox.news().notified(), if has_room => {}
            }
        }
    }

    fn take_back(self, link: &Link<'_>) {
        let (mut lost, mut again) = (0, Vec::new());
        for held in self.held {
            match held {
                Held::Repeated => {}
                Held::Once => lost += 1,
                Held::Again(message) => again.push(message),
            }
        }
        link.outbox.put_back(again);
        link.outbox.lose(lost);
    }
}
