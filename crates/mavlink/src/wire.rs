//! Bytes to messages and back.

use crate::{MavlinkError, Result};
use mavlink::bytes_mut::BytesMut;
use mavlink::dialects::common::{MavMessage, MavResult};
use mavlink::error::{MessageReadError, ParserError};
use mavlink::{
    MAVLinkMessageRaw, MAVLinkV2MessageRaw, MavHeader, MavlinkReader, MavlinkVersion, Message, MessageData,
    SigningConfig, SigningData,
};
use sha2::{Digest, Sha256};
use std::fmt;
use std::io::Read;

/// The key by which the messages of a network are signed. It is shown to nobody.
#[derive(Clone)]
pub struct SigningKey([u8; 32]);

impl SigningKey {
    /// The key that a text stands for: 64 hexadecimal digits, or the SHA-256 of a passphrase, as ground stations make it.
    ///
    /// # Errors
    /// [`MavlinkError::Key`] for a text that is neither.
    pub fn from_text(text: &str) -> Result<Self> {
        let text = text.trim_end_matches(['\r', '\n']);
        if text.len() == 64 && text.bytes().all(|b| b.is_ascii_hexdigit()) {
            let mut key = [0; 32];
            for (byte, pair) in key.iter_mut().zip(text.as_bytes().chunks_exact(2)) {
                let digits = pair.iter().filter_map(|digit| char::from(*digit).to_digit(16));
                *byte = digits.fold(0, |all, digit| all * 16 + digit) as u8;
            }
            return Ok(Self(key));
        }
        if text.chars().count() < 8 {
            return Err(MavlinkError::Key { problem: "it is too short".to_owned() });
        }
        Ok(Self(Sha256::digest(text.as_bytes()).into()))
    }

    /// What signs and checks; what is not signed is not accepted.
    pub(crate) fn data(&self) -> SigningData {
        SigningData::from_config(SigningConfig::new(self.0, 0, true, false))
    }
}

impl fmt::Debug for SigningKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SigningKey")
    }
}

/// What a valid frame holds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Content {
    Message(Box<MavMessage>),
    /// A command that the message set does not have.
    UnknownCommand {
        command: u16,
        target_system: u8,
        target_component: u8,
    },
}

/// One valid frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parcel {
    pub system: u8,
    pub component: u8,
    pub content: Content,
}

/// The next frame that can be understood: everything else, wrong checksums and wrong signatures included, is passed over.
///
/// # Errors
/// As the reader's source says, its time-outs too; what came in part is kept.
pub(crate) fn next<R: Read>(reader: &mut MavlinkReader<R>, signing: Option<&SigningData>) -> std::io::Result<Parcel> {
    loop {
        let raw = match reader.read_any_raw_message_signed::<MavMessage>(signing) {
            Ok(raw) => raw,
            Err(MessageReadError::Io(error)) => return Err(error),
            Err(MessageReadError::Parse(_)) => continue,
        };
        if let Some(parcel) = understood(&raw) {
            return Ok(parcel);
        }
    }
}

fn understood(raw: &MAVLinkMessageRaw) -> Option<Parcel> {
    let system = u8::try_from(raw.system_id()).ok()?;
    let component = raw.component_id();
    let content = match MavMessage::parse(raw.version(), raw.message_id(), raw.payload()) {
        Ok(message) => Content::Message(Box::new(message)),
        Err(ParserError::InvalidEnum { .. }) => unknown_command(raw.message_id(), raw.payload())?,
        Err(_) => return None,
    };
    Some(Parcel { system, component, content })
}

/// The numbers of `COMMAND_LONG` and `COMMAND_INT`, whose seven parameters are followed by command and target.
const COMMANDS: [u32; 2] = [76, 75];

fn unknown_command(id: u32, payload: &[u8]) -> Option<Content> {
    if !COMMANDS.contains(&id) {
        return None;
    }
    // Zeros at the end of a payload are not sent.
    let byte = |at: usize| payload.get(at).copied().unwrap_or(0);
    let command = u16::from_le_bytes([byte(28), byte(29)]);
    Some(Content::UnknownCommand { command, target_system: byte(30), target_component: byte(31) })
}

/// A message as it is sent.
pub(crate) fn encoded(message: &MavMessage, header: MavHeader, signing: Option<&SigningData>) -> Vec<u8> {
    let mut raw = MAVLinkV2MessageRaw::new();
    match signing {
        Some(signing) => {
            raw.serialize_message_for_signing(header, message);
            signing.sign_message(&mut raw);
        }
        None => raw.serialize_message(header, message),
    }
    raw.raw_bytes().to_vec()
}

/// The answer to a command of any number, which the message set's own type cannot hold.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unsupported {
    pub command: u16,
    pub target_system: u8,
    pub target_component: u8,
}

impl MessageData for Unsupported {
    type Message = MavMessage;
    const ID: u32 = 77;
    const NAME: &'static str = "COMMAND_ACK";
    const EXTRA_CRC: u8 = 143;
    const ENCODED_LEN: usize = 10;

    fn ser(&self, _: MavlinkVersion, payload: &mut [u8]) -> usize {
        let mut bytes = BytesMut::new(payload);
        bytes.put_u16_le(self.command);
        bytes.put_u8(MavResult::MAV_RESULT_UNSUPPORTED as u8);
        bytes.put_u8(0);
        bytes.put_i32_le(0);
        bytes.put_u8(self.target_system);
        bytes.put_u8(self.target_component);
        bytes.len()
    }

    fn deser(_: MavlinkVersion, _: &[u8]) -> std::result::Result<Self, ParserError> {
        Err(ParserError::UnknownMessage { id: Self::ID })
    }
}

/// That answer as it is sent.
pub(crate) fn encoded_unsupported(answer: &Unsupported, header: MavHeader, signing: Option<&SigningData>) -> Vec<u8> {
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message_data(header, answer);
    let Some(signing) = signing else { return raw.raw_bytes().to_vec() };
    // The library signs messages of its own sets only: the frame is made anew with the flag, and its checksum with it.
    let mut bytes = raw.raw_bytes().to_vec();
    let signed = (|| {
        *bytes.get_mut(2)? |= 1;
        let end = bytes.len().checked_sub(2)?;
        let sum = mavlink::calculate_crc(bytes.get(1..end)?, Unsupported::EXTRA_CRC).to_le_bytes();
        bytes.get_mut(end..)?.copy_from_slice(&sum);
        let mut whole = MAVLinkV2MessageRaw::new();
        whole.as_mut_slice().get_mut(..bytes.len())?.copy_from_slice(&bytes);
        signing.sign_message(&mut whole);
        Some(whole.raw_bytes().to_vec())
    })();
    signed.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mavlink::dialects::common::{COMMAND_LONG_DATA, HEARTBEAT_DATA, MavCmd};
    use proptest::prelude::*;

    const HEADER: MavHeader = MavHeader { system_id: 7, component_id: 100, sequence: 3 };

    fn all(bytes: &[u8], signing: Option<&SigningData>) -> Vec<Parcel> {
        let mut reader = MavlinkReader::new(bytes);
        std::iter::from_fn(|| next(&mut reader, signing).ok()).collect()
    }

    fn heartbeat() -> MavMessage {
        MavMessage::HEARTBEAT(HEARTBEAT_DATA::default())
    }

    #[test]
    fn messages_are_found_among_rubbish() {
        let good = encoded(&heartbeat(), HEADER, None);
        let mut wrong = good.clone();
        *wrong.last_mut().unwrap() ^= 1;
        // What looks like the beginning of a long message is known for none once as much has come.
        let bytes = [&[0xFD, 3, 9][..], &good, &wrong, &[0xFE; 40], &good[..5], &good, &[0; 600]].concat();
        let found = all(&bytes, None);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].system, found[0].component), (7, 100));
    }

    #[test]
    fn signed_messages_alone_pass_with_a_key() {
        let key = SigningKey::from_text("a long passphrase").unwrap();
        let (ours, theirs) = (key.data(), key.data());
        let other = SigningKey::from_text(&"ab".repeat(32)).unwrap().data();
        let signed = encoded(&heartbeat(), HEADER, Some(&ours));
        assert_eq!(all(&signed, Some(&theirs)).len(), 1);
        assert_eq!(all(&signed, Some(&theirs)).len(), 0, "the same again is a replay");
        assert_eq!(all(&encoded(&heartbeat(), HEADER, Some(&ours)), Some(&other)).len(), 0);
        assert_eq!(all(&encoded(&heartbeat(), HEADER, None), Some(&theirs)).len(), 0);
        let answer = Unsupported { command: 60_000, target_system: 255, target_component: 190 };
        let mut reader = MavlinkReader::new(&*encoded_unsupported(&answer, HEADER, Some(&ours)).leak());
        let raw = reader.read_any_raw_message_signed::<MavMessage>(Some(&theirs)).unwrap();
        assert_eq!((raw.message_id(), &raw.payload()[..2]), (77, &60_000_u16.to_le_bytes()[..]));
    }

    #[test]
    fn keys_are_digits_or_passphrases() {
        assert_eq!(SigningKey::from_text(&"0f".repeat(32)).unwrap().0, [15; 32]);
        let said = SigningKey::from_text("correct horse\n").unwrap().0;
        assert_eq!(said, SigningKey::from_text("correct horse").unwrap().0);
        assert!(SigningKey::from_text("short").is_err());
        assert_eq!(format!("{:?}", SigningKey([1; 32])), "SigningKey");
    }

    #[test]
    fn unknown_commands_are_told_by_their_numbers() {
        let data = COMMAND_LONG_DATA { target_system: 9, target_component: 8, ..COMMAND_LONG_DATA::default() };
        let data = COMMAND_LONG_DATA { command: MavCmd::MAV_CMD_CAMERA_STOP_TRACKING, ..data };
        let mut bytes = encoded(&MavMessage::COMMAND_LONG(data), HEADER, None);
        bytes[10 + 28..10 + 30].copy_from_slice(&65_000_u16.to_le_bytes());
        let end = bytes.len() - 2;
        let sum = mavlink::calculate_crc(&bytes[1..end], 152).to_le_bytes();
        bytes[end..].copy_from_slice(&sum);
        let found = all(&bytes, None);
        let expected = Content::UnknownCommand { command: 65_000, target_system: 9, target_component: 8 };
        assert_eq!(found[0].content, expected);
    }

    proptest! {
        #[test]
        fn any_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
            all(&bytes, None);
        }

        #[test]
        fn damaged_messages_do_no_harm(at in 0_usize..60, value in any::<u8>()) {
            let mut bytes = encoded(&MavMessage::COMMAND_LONG(COMMAND_LONG_DATA::default()), HEADER, None);
            if let Some(byte) = bytes.get_mut(at) {
                *byte = value;
            }
            all(&bytes, None);
        }
    }
}
