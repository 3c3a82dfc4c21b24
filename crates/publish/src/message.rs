/// How surely a message arrives (MQTT 3.1.1, section 4.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Qos {
    /// Sent once; lost where the connection breaks.
    AtMostOnce,
    /// Sent until it is acknowledged; may come twice.
    AtLeastOnce,
    /// As before, and comes twice only where the connection breaks meanwhile.
    ExactlyOnce,
}

impl Qos {
    /// That of the number 0, 1 or 2.
    pub const fn of(number: u8) -> Option<Self> {
        match number {
            0 => Some(Self::AtMostOnce),
            1 => Some(Self::AtLeastOnce),
            2 => Some(Self::ExactlyOnce),
            _ => None,
        }
    }
}

/// What is sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// Where to, levels separated by `/`.
    pub topic: String,
    /// What.
    pub payload: Vec<u8>,
    /// How surely.
    pub qos: Qos,
    /// Whether the broker keeps it for whoever comes later. An empty payload makes it forget what it kept.
    pub retain: bool,
}

impl Message {
    /// One that the broker keeps, sent until it is acknowledged.
    pub fn retained(topic: impl Into<String>, payload: impl Into<Vec<u8>>) -> Self {
        Self { topic: topic.into(), payload: payload.into(), qos: Qos::AtLeastOnce, retain: true }
    }
}
