//! The bodies of messages.

/// Text as XML writes it.
pub(super) fn escaped(text: &str) -> String {
    quick_xml::escape::escape(text).into_owned()
}

/// Whether XML can say all this: it has no control characters but tabs and line ends, escaped or not.
pub(super) fn is_writable(text: &str) -> bool {
    text.chars().all(|c| matches!(c, '\t' | '\n' | '\r') || (c >= ' ' && !matches!(c, '\u{fffe}' | '\u{ffff}')))
}

/// A whole message.
pub(super) fn envelope(header: &str, body: &str) -> String {
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><s:Envelope xmlns:s=\"http://www.w3.org/2003/05/soap-envelope\" \
         xmlns:tt=\"http://www.onvif.org/ver10/schema\">{header}<s:Body>{body}</s:Body></s:Envelope>"
    )
}

/// A service of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Service {
    Device,
    Media,
    /// The second media service, which cameras of Profile T may have in place of the first.
    Media2,
    Ptz,
}

impl Service {
    pub const fn namespace(self) -> &'static str {
        match self {
            Self::Device => "http://www.onvif.org/ver10/device/wsdl",
            Self::Media => "http://www.onvif.org/ver10/media/wsdl",
            Self::Media2 => "http://www.onvif.org/ver20/media/wsdl",
            Self::Ptz => "http://www.onvif.org/ver20/ptz/wsdl",
        }
    }
}

/// A request of this name with these contents.
pub(super) fn request(service: Service, name: &str, contents: &str) -> String {
    format!("<n:{name} xmlns:n=\"{}\">{contents}</n:{name}>", service.namespace())
}

/// A profile's token, which all messages of the PTZ service begin with.
pub(super) fn profile(token: &str) -> String {
    format!("<n:ProfileToken>{}</n:ProfileToken>", escaped(token))
}

/// Pan and tilt, and zoom, in spaces; a part that is `None` is left out.
pub(super) fn vector(name: &str, pan_tilt: Option<(f64, f64, &str)>, zoom: Option<(f64, &str)>) -> String {
    let pan_tilt = pan_tilt
        .map(|(x, y, space)| format!("<tt:PanTilt x=\"{x:.6}\" y=\"{y:.6}\" space=\"{}\"/>", escaped(space)))
        .unwrap_or_default();
    let zoom =
        zoom.map(|(x, space)| format!("<tt:Zoom x=\"{x:.6}\" space=\"{}\"/>", escaped(space))).unwrap_or_default();
    format!("<n:{name}>{pan_tilt}{zoom}</n:{name}>")
}
