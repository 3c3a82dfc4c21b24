//! A fake camera.
#![allow(dead_code, clippy::type_complexity, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// What the camera does about an action: an answer's body, or something worse.
pub enum Does {
    Answers(String),
    Status(u16, &'static str, String),
    Raw(Vec<u8>),
    Trickles,
    HangsUp,
}

pub type Heard = (String, String, String);

/// A camera that hears actions, with headers and bodies, until it is left alone.
pub fn camera(does: impl Fn(&str, &str, &str) -> Does + Send + 'static) -> (String, Receiver<Heard>) {
    let (port, hears) = camera_through(Some, does);
    (format!("http://127.0.0.1:{port}/onvif/device_service"), hears)
}

/// The same through what `wrap` makes of each connection, if anything; gives the port.
pub fn camera_through<S: Read + Write>(
    wrap: impl Fn(TcpStream) -> Option<S> + Send + 'static,
    does: impl Fn(&str, &str, &str) -> Does + Send + 'static,
) -> (u16, Receiver<Heard>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let (heard, hears) = channel();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let stream = stream.unwrap();
            stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
            let Some(mut stream) = wrap(stream) else { continue };
            while let Some((action, head, body)) = request(&mut stream) {
                let answer = does(&action, &head, &body);
                heard.send((action, head, body)).ok();
                let (status, headers, text) = match answer {
                    Does::Answers(body) => (200, "", envelope(&body)),
                    Does::Status(status, headers, body) => (status, headers, body),
                    Does::Raw(bytes) => {
                        stream.write_all(&bytes).ok();
                        break;
                    }
                    Does::Trickles => {
                        stream.write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n").ok();
                        while stream.write_all(b" ").is_ok() {
                            std::thread::sleep(Duration::from_millis(30));
                        }
                        break;
                    }
                    Does::HangsUp => break,
                };
                let head = format!("HTTP/1.1 {status} X\r\nContent-Length: {}\r\n{headers}\r\n", text.len());
                stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(text.as_bytes())).ok();
            }
        }
    });
    (port, hears)
}

fn request(stream: &mut impl Read) -> Option<Heard> {
    let mut reader = BufReader::new(stream);
    let mut head = String::new();
    while !head.ends_with("\r\n\r\n") {
        if reader.read_line(&mut head).ok()? == 0 {
            return None;
        }
    }
    let lower = head.to_lowercase();
    let length = lower.split("content-length: ").nth(1)?.lines().next()?.trim().parse().ok()?;
    let mut body = vec![0; length];
    reader.read_exact(&mut body).ok()?;
    let action = lower.split("soapaction: ").nth(1)?.lines().next()?.trim_matches('"').rsplit('/').next()?.to_owned();
    Some((action, head, String::from_utf8(body).ok()?))
}

pub fn envelope(body: &str) -> String {
    format!("<?xml version='1.0'?><e:Envelope xmlns:e='x'><e:Body>{body}</e:Body></e:Envelope>")
}

pub fn fault(text: &str) -> String {
    envelope(&format!(
        "<e:Fault><e:Code><e:Value>e:Sender</e:Value></e:Code><e:Reason><e:Text>{text}</e:Text></e:Reason></e:Fault>"
    ))
}

/// A camera of two years ago by its own clock, behind a router, with generic spaces.
pub fn usual(action: &str) -> Does {
    let space = |kind: &str, name: &str| {
        format!(
            "<t:{kind}><t:URI>http://www.onvif.org/ver10/tptz/{name}</t:URI><t:XRange><t:Min>-1</t:Min><t:Max>1</t:Max></t:XRange>\
             <t:YRange><t:Min>-1</t:Min><t:Max>1</t:Max></t:YRange></t:{kind}>"
        )
    };
    Does::Answers(match action {
        "getsystemdateandtime" => "<r><UTCDateTime><Time><Hour>10</Hour><Minute>0</Minute><Second>0</Second></Time>\
            <Date><Year>2024</Year><Month>5</Month><Day>6</Day></Date></UTCDateTime></r>"
            .into(),
        "getcapabilities" => "<r><t:Media><t:XAddr>http://192.168.9.9/onvif/media</t:XAddr></t:Media>\
            <t:PTZ><t:XAddr>http://192.168.9.9/onvif/ptz</t:XAddr></t:PTZ></r>"
            .into(),
        "getprofiles" => {
            "<r><m:Profiles token='still'/><m:Profiles token='p&amp;1'><t:PTZConfiguration><t:NodeToken>n2\
            </t:NodeToken></t:PTZConfiguration></m:Profiles></r>"
                .into()
        }
        "getnodes" => format!(
            "<r><p:PTZNode token='n1'/><p:PTZNode token='n2'><t:SupportedPTZSpaces>{}{}{}{}{}</t:SupportedPTZSpaces>\
             <t:MaximumNumberOfPresets>8</t:MaximumNumberOfPresets><t:HomeSupported>true</t:HomeSupported></p:PTZNode></r>",
            space("AbsolutePanTiltPositionSpace", "PanTiltSpaces/PositionGenericSpace"),
            space("AbsoluteZoomPositionSpace", "ZoomSpaces/PositionGenericSpace"),
            space("RelativePanTiltTranslationSpace", "PanTiltSpaces/TranslationSpaceFov"),
            space("ContinuousPanTiltVelocitySpace", "PanTiltSpaces/VelocityGenericSpace"),
            space("ContinuousZoomVelocitySpace", "ZoomSpaces/VelocityGenericSpace"),
        ),
        "getstatus" => "<r><t:Position><t:PanTilt x='0.5' y='-0.5'/><t:Zoom x='0.25'/></t:Position>\
            <t:MoveStatus><t:PanTilt>IDLE</t:PanTilt></t:MoveStatus></r>"
            .into(),
        "getpresets" => "<r><p:Preset token='1'><t:Name>door</t:Name></p:Preset><p:Preset token='2'/></r>".into(),
        "setpreset" => "<r><p:PresetToken>9</p:PresetToken></r>".into(),
        _ => "<r/>".into(),
    })
}
