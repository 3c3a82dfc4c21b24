//! Messages to a broker, from a loop that must never wait for it.
//!
//! A [`Publisher`] takes messages into a bounded queue, whose oldest are dropped and counted when the broker cannot be
//! reached or does not keep up. A thread of its own encodes and sends them, connects again after a break and then says first
//! what is retained. Asynchronous code stays inside that thread.
//!
//! Brokers speak MQTT (feature `mqtt`), which retains messages and leaves a last will, or NATS (feature `nats`), which does
//! neither: what is retained is said again and again there. Feature `tls` is for both.
#![cfg_attr(
    not(any(feature = "mqtt", feature = "nats")),
    allow(
        dead_code,
        unused_imports,
        unused_variables,
        reason = "without any kind of broker all that is left is to say so"
    )
)]

mod address;
mod back_off;
mod error;
#[cfg(feature = "mqtt")]
mod greeting;
mod link;
mod message;
#[cfg(feature = "mqtt")]
mod mqtt;
#[cfg(feature = "nats")]
mod nats;
mod outbox;
mod own_topics;
mod publisher;
mod report;
#[cfg(feature = "tls")]
mod tls;

pub use address::{Broker, Login, Scheme};
pub use error::PublishError;
pub use message::{Message, Qos};
pub use own_topics::OwnTopics;
pub use publisher::{Counts, Options, Publisher};

type Result<T> = std::result::Result<T, PublishError>;
