use super::image::{JPEG_MAGIC, PNG_MAGIC};
use pursuit_containers::y4m;

/// The first bytes of every MCAP file.
const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// The first bytes of every SQLite database, which older bags of ROS 2 are (twelve of sixteen).
const SQLITE_MAGIC: &[u8] = b"SQLite forma";

/// What mends a bag of SQLite in a build that does not read it.
#[cfg(not(feature = "db3"))]
pub(crate) const WITHOUT_DB3: &str = "build with `--features db3`, or convert the bag to MCAP, for example by `ros2 bag convert` \
    or `rosbags-convert --src BAG --dst NEW --dst-storage mcap`";

/// What a file holds, by its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Empty,
    Y4m,
    Avi,
    Mp4,
    Jpeg,
    Png,
    Mcap,
    Sqlite,
    /// A list of other media, which could be any file of this machine.
    Playlist,
    Other,
}

/// The kind of an input, from its first bytes (twelve suffice).
pub(crate) fn sniff(head: &[u8]) -> Kind {
    match head {
        [] => Kind::Empty,
        _ if head.starts_with(y4m::MAGIC) => Kind::Y4m,
        _ if head.starts_with(JPEG_MAGIC) => Kind::Jpeg,
        _ if head.starts_with(PNG_MAGIC) => Kind::Png,
        _ if head.starts_with(MCAP_MAGIC) => Kind::Mcap,
        _ if head.starts_with(SQLITE_MAGIC) => Kind::Sqlite,
        [b'R', b'I', b'F', b'F', _, _, _, _, b'A', b'V', b'I', b' ', ..] => Kind::Avi,
        [_, _, _, _, kind @ ..] if is_mp4_box(kind) => Kind::Mp4,
        _ if is_playlist(head) => Kind::Playlist,
        _ => Kind::Other,
    }
}

/// Whether it is a text that names other media to whoever plays it: HLS, ffmpeg's `concat`, DASH, Smooth Streaming, SDP.
fn is_playlist(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let text = text.trim_start_matches(|c: char| c == '\u{feff}' || c.is_whitespace());
    let begins = ["#EXTM3U", "ffconcat", "v=0", "[playlist]", "[Reference]", "<ASX", "<asx"];
    let holds = ["<MPD", "<SmoothStreamingMedia", "<smil"];
    begins.iter().any(|word| text.starts_with(word))
        || (text.starts_with('<') && holds.iter().any(|word| text.contains(word)))
}

/// The boxes an MP4 or QuickTime file may begin with.
fn is_mp4_box(bytes: &[u8]) -> bool {
    [b"ftyp", b"moov", b"mdat", b"free", b"skip", b"wide", b"pnot", b"styp", b"moof", b"sidx"]
        .iter()
        .any(|kind| bytes.starts_with(*kind))
}

/// A name for what is not decoded here, for messages.
pub(crate) fn describe(head: &[u8]) -> String {
    const KNOWN: [(&[u8], &str); 10] = [
        (&[0x1A, 0x45, 0xDF, 0xA3], "Matroska or WebM"),
        (b"OggS", "Ogg"),
        (b"FLV", "Flash video"),
        (&[0x30, 0x26, 0xB2, 0x75], "Windows Media"),
        (&[0, 0, 1, 0xBA], "an MPEG programme stream"),
        (&[0, 0, 1], "a bare MPEG or H.264 stream"),
        (b"GIF8", "GIF"),
        (b"BM", "a BMP image"),
        (b"II*\0", "a TIFF image"),
        (b"MM\0*", "a TIFF image"),
    ];
    let known = KNOWN.iter().find(|(magic, _)| head.starts_with(magic)).map(|k| k.1);
    let transport =
        || (head.first() == Some(&0x47) && head.get(188) == Some(&0x47)).then_some("an MPEG transport stream");
    match (known.or_else(transport), matroska_codec(head)) {
        (Some(container), Some(codec)) => format!("the codec {codec} in {container}"),
        (Some(container), None) => container.to_owned(),
        (None, _) => "what is in the file".to_owned(),
    }
}

/// The first video codec of a Matroska head: its codec names stand there in plain text.
fn matroska_codec(head: &[u8]) -> Option<String> {
    let start = head.windows(2).position(|w| w == b"V_").filter(|_| head.starts_with(&[0x1A, 0x45]))?;
    let name = head[start..].iter().take(24).take_while(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'/'));
    Some(name.map(|&b| char::from(b)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides() {
        assert_eq!(sniff(b""), Kind::Empty);
        assert_eq!(sniff(b"RIFF\0\0\0\0AVI LIST"), Kind::Avi);
        assert_eq!(sniff(b"RIFF\0\0\0\0WEBPVP8 "), Kind::Other);
        assert_eq!(sniff(b"\0\0\0\x18ftypisom"), Kind::Mp4);
        assert_eq!(sniff(b"\xFF\xD8\xFF\xE0"), Kind::Jpeg);
        assert_eq!(sniff(b"\x89MCAP0\r\n"), Kind::Mcap);
        assert_eq!(sniff(b"SQLite format 3\0"), Kind::Sqlite);
        assert_eq!(sniff(b"#EXTM3U\n/etc/x.mp4\n"), Kind::Playlist);
        assert_eq!(sniff(b"\xEF\xBB\xBF\n ffconcat version 1.0\nfile '/x'\n"), Kind::Playlist);
        assert_eq!(sniff(b"<?xml version='1.0'?>\n<MPD xmlns='x'>"), Kind::Playlist);
        assert_eq!((sniff(b"<html>v=0"), sniff(b"xv=0")), (Kind::Other, Kind::Other));
        assert_eq!(describe(b"\x1A\x45\xDF\xA3....\x86\x85V_VP9\x83"), "the codec V_VP9 in Matroska or WebM");
        assert_eq!(describe(b"hello"), "what is in the file");
    }
}
