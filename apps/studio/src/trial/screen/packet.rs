use serde_json::Value;

/// One message to viewers: four bytes with the length of the JSON (little endian), the JSON, the picture (may be empty).
pub(crate) struct Packet {
    bytes: Vec<u8>,
    pub(super) kind: Kind,
}

/// What it takes to make sense of a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// Nothing, and it is of no use for what comes after: a still picture.
    Still,
    /// Nothing, and it is the beginning of what comes after: a key frame.
    Key,
    /// The packet before, and what that one takes.
    Delta,
}

impl Packet {
    /// The facts with what is said of the picture, and the picture.
    pub(super) fn new(mut facts: Value, about: Value, picture: &[u8], kind: Kind) -> Self {
        facts["picture"] = about;
        let facts = facts.to_string();
        let length = u32::try_from(facts.len()).unwrap_or(u32::MAX).to_le_bytes();
        Self { bytes: [&length, facts.as_bytes(), picture].concat(), kind }
    }
}

impl AsRef<[u8]> for Packet {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}
