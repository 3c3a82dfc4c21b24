//! Messages to a broker, from a loop that must never wait for it.
//!
//! A [`Publisher`] takes messages into a bounded queue, whose oldest are dropped and counted when the broker cannot be
//! reached or does not keep up. A thread of its own encodes and sends them, connects again after a break, then says first
//! what is retained, and leaves a last will with the broker. Asynchronous code stays inside that thread.

mod address;
mod back_off;
mod error;
mod message;
mod mqtt;
mod outbox;
mod publisher;
mod report;
#[cfg(feature = "tls")]
mod tls;

pub use address::{Broker, Login, Scheme};
pub use error::PublishError;
pub use message::{Message, Qos};
pub use publisher::{Counts, Options, Publisher};

type Result<T> = std::result::Result<T, PublishError>;
