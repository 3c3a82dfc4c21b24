//! ONVIF against a fake camera: what it is asked, and how its failures are borne.
#![allow(clippy::type_complexity, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![cfg(feature = "onvif")]

mod common;

use common::{Does, Heard, camera, fault, usual};
use pursuit_ptz::drivers::onvif::{Login, Onvif, OnvifParams};
use pursuit_ptz::drivers::{Head, Password, Timeouts};
use pursuit_ptz::{Command, Direction, PtzError, Result, Velocity};
use std::net::TcpListener;
use std::time::{Duration, Instant};

fn quick() -> Timeouts {
    Timeouts::from_secs(1.0, 1.0).unwrap()
}

fn login() -> Option<Login> {
    Some(Login { user: "admin".into(), password: Password::new("sesame") })
}

fn connect(url: &str) -> Result<Onvif> {
    Onvif::connect(url, login(), None, OnvifParams::default(), quick())
}

const RIGHT: Command = Command::Move(Velocity { pan_deg_s: 30.0, tilt_deg_s: -15.0, zoom_per_s: 0.0 });

#[test]
fn moves_presets_status_and_stop_go_out_as_the_service_has_them() {
    let (url, heard) = camera(|action, _, _| usual(action));
    let mut head = connect(&url).unwrap();
    let next = || heard.recv_timeout(Duration::from_secs(10)).unwrap();
    let (_, _, body) = next();
    assert!(!body.contains("Security"), "the clock is asked for openly");
    for action in ["getcapabilities", "getprofiles", "getnodes"] {
        let (got, head, body) = next();
        assert_eq!(got, action);
        assert!(body.contains("<wsse:Username>admin<") && !body.contains("sesame") && !head.contains("sesame"));
        assert!(body.contains("<wsu:Created>2024-05-06T10:0"), "dated by the camera's clock: {body}");
    }
    let can = head.capabilities();
    assert!(can.velocity && can.absolute && can.relative && can.zoom && can.presets && can.status);
    head.send(&RIGHT).unwrap();
    let (action, header, body) = next();
    assert_eq!(action, "continuousmove");
    assert!(header.starts_with("POST /onvif/ptz "), "the camera's path on the host that was given: {header}");
    assert!(body.contains("<n:ProfileToken>p&amp;1<") && body.contains("<n:Timeout>PT2S<"), "{body}");
    assert!(body.contains(r#"<tt:PanTilt x="0.500000" y="-0.250000""#), "{body}");
    head.send(&Command::GoTo { direction: Direction::new(90.0, 45.0), zoom: Some(0.75) }).unwrap();
    let (action, _, body) = next();
    assert_eq!(action, "absolutemove");
    assert!(body.contains(r#"x="0.500000" y="0.500000""#) && body.contains(r#"<tt:Zoom x="0.500000""#), "{body}");
    head.send(&Command::TurnBy { by: Direction::new(-15.0, 9.0) }).unwrap();
    let (action, _, body) = next();
    assert_eq!(action, "relativemove");
    assert!(body.contains(r#"x="-0.500000" y="0.500000""#) && body.contains("TranslationSpaceFov"), "{body}");
    assert_eq!(head.presets().unwrap(), [("1".into(), "door".into()), ("2".into(), String::new())]);
    assert_eq!(head.set_preset("a<b").unwrap(), "9");
    head.send(&Command::Preset { number: 2 }).unwrap();
    head.send(&Command::Home).unwrap();
    let got: Vec<Heard> = (0..5).map(|_| next()).collect();
    assert_eq!(
        got.iter().map(|g| g.0.as_str()).collect::<Vec<_>>(),
        ["getpresets", "setpreset", "getpresets", "gotopreset", "gotohomeposition"]
    );
    assert!(got[1].2.contains("a&lt;b") && got[3].2.contains("<n:PresetToken>2<"));
    let status = head.status().unwrap().unwrap();
    let position = status.position.unwrap();
    assert_eq!((position.direction, position.zoom, status.moving), (Direction::new(90.0, -45.0), 0.25, Some(false)));
    next();
    drop(head);
    assert_eq!(next().0, "stop", "it was on its way home");
}

#[test]
fn what_xml_cannot_say_is_not_sent() {
    let (url, heard) = camera(|action, _, _| usual(action));
    let mut head = connect(&url).unwrap();
    let asked = heard.try_iter().count();
    for name in ["a\u{1}b", "\u{0}", "\u{ffff}"] {
        let error = head.set_preset(name).unwrap_err().to_string();
        assert!(error.contains("control character"), "{error}");
    }
    assert_eq!((heard.try_iter().count(), asked), (0, 4));
    head.set_preset("two\nlines\tand a tab").unwrap();
    drop(head);
    let login = Some(Login { user: "ad\u{7}min".into(), password: Password::new("sesame") });
    let error = Onvif::connect(&url, login, None, OnvifParams::default(), quick()).err().unwrap();
    assert!(error.to_string().contains("control character"), "{error}");
}

#[test]
fn stored_positions_are_found_by_their_numbers_whatever_their_tokens_are() {
    let goes_to = |list: &'static str, number: u8| {
        let (url, heard) = camera(move |action, _, _| match action {
            "getpresets" if list.is_empty() => Does::Status(400, "", fault("ter:ActionNotSupported")),
            "getpresets" => Does::Answers(format!("<r>{list}</r>")),
            _ => usual(action),
        });
        connect(&url).unwrap().send(&Command::Preset { number }).unwrap();
        let (_, _, body) = heard.try_iter().find(|(action, _, _)| action == "gotopreset").unwrap();
        let token = body.split_once("PresetToken>").unwrap().1.split_once('<').unwrap().0;
        token.to_owned()
    };
    let numbers = "<t:Preset token='7'><tt:Name>2</tt:Name></t:Preset><t:Preset token='2'/>";
    assert_eq!(goes_to(numbers, 2), "2");
    let words = "<t:Preset token='PRESET_12'/><t:Preset token='PRESET_2'/><t:Preset token='PRESET_03'/>";
    assert_eq!(["PRESET_2", "PRESET_03"], [goes_to(words, 2), goes_to(words, 3)].each_ref().map(String::as_str));
    let names =
        "<t:Preset token='aa'><tt:Name>2</tt:Name></t:Preset><t:Preset token='bb'><tt:Name>1</tt:Name></t:Preset>";
    assert_eq!(goes_to(names, 1), "bb");
    let nothing = "<t:Preset token='door'/><t:Preset token='gate'/>";
    assert_eq!((goes_to(nothing, 2), goes_to(nothing, 9)), ("gate".to_owned(), "9".to_owned()));
    assert_eq!(goes_to("", 4), "4");
    let gap = "<t:Preset token='1'/><t:Preset token='3'/>";
    assert_eq!(goes_to(gap, 2), "2", "what is not stored is no other position");
}

#[test]
fn http_digest_is_answered_and_basic_is_not() {
    let (url, _heard) = camera(|action, head, _| {
        if action == "getsystemdateandtime" || head.to_lowercase().contains("authorization: digest username=\"admin\"")
        {
            return usual(action);
        }
        let challenge = "WWW-Authenticate: Digest realm=\"cam\", nonce=\"abc\", qop=\"auth\", algorithm=MD5\r\n";
        Does::Status(401, challenge, String::new())
    });
    connect(&url).unwrap().send(&Command::Stop).unwrap();
    let (url, heard) = camera(|action, _, _| match action {
        "getsystemdateandtime" => usual(action),
        _ => Does::Status(401, "WWW-Authenticate: Basic realm=\"cam\"\r\n", String::new()),
    });
    assert!(matches!(connect(&url), Err(PtzError::Unauthorised { .. })));
    assert!(heard.try_iter().all(|(_, head, _)| !head.to_lowercase().contains("authorization")));
}

#[test]
fn the_strongest_digest_that_is_offered_is_answered() {
    let offers = [
        "WWW-Authenticate: Digest realm=\"cam\", nonce=\"abc\", qop=\"auth\", algorithm=SHA-256\r\n\
         WWW-Authenticate: Digest realm=\"cam\", nonce=\"abc\", qop=\"auth\", algorithm=MD5\r\n",
        "WWW-Authenticate: Basic realm=\"cam\", Digest realm=\"cam\", nonce=\"abc\", qop=\"auth\", algorithm=SHA-256\r\n",
        "WWW-Authenticate: Digest realm=\"cam\", nonce=\"abc\", algorithm=SHAKE-9, qop=\"auth\"\r\n\
         WWW-Authenticate: Digest realm=\"cam\", nonce=\"abc\", qop=\"auth\", algorithm=SHA-256\r\n",
    ];
    for offer in offers {
        let (url, heard) = camera(move |action, head, _| {
            if action == "getsystemdateandtime" || head.to_lowercase().contains("authorization: digest") {
                return usual(action);
            }
            Does::Status(401, offer, String::new())
        });
        connect(&url).unwrap();
        let proofs: Vec<Heard> = heard.try_iter().filter(|(_, head, _)| head.contains("SHA-256")).collect();
        assert!(proofs.len() >= 3, "{offer}");
    }
}

#[test]
fn a_camera_of_profile_t_is_asked_by_its_second_media_service() {
    let (url, heard) = camera(|action, _, body| {
        match action {
        "getcapabilities" => Does::Status(400, "", fault("ter:ActionNotSupported")),
        "getservices" => Does::Answers(
            "<r><d:Service><d:Namespace>http://www.onvif.org/ver20/media/wsdl</d:Namespace><d:XAddr>http://x/onvif/media2\
             </d:XAddr></d:Service><d:Service><d:Namespace>http://www.onvif.org/ver20/ptz/wsdl</d:Namespace><d:XAddr>\
             http://x/onvif/ptz</d:XAddr></d:Service></r>"
                .into(),
        ),
        "getprofiles" if body.contains("ver20/media/wsdl") && body.contains("<n:Type>PTZ<") => Does::Answers(
            "<r><m:Profiles token='a'><m:Configurations/></m:Profiles><m:Profiles token='b'><m:Configurations><m:PTZ token='z'>\
             <t:NodeToken>n2</t:NodeToken></m:PTZ></m:Configurations></m:Profiles></r>"
                .into(),
        ),
        "getprofiles" => Does::Status(400, "", fault("no such service")),
        _ => usual(action),
    }
    });
    let mut head = connect(&url).unwrap();
    assert!(head.capabilities().velocity && head.capabilities().presets);
    head.send(&RIGHT).unwrap();
    let all: Vec<Heard> = heard.try_iter().collect();
    let of = |name: &str| all.iter().find(|(action, _, _)| action == name).unwrap();
    assert!(of("getprofiles").1.starts_with("POST /onvif/media2 "), "{}", of("getprofiles").1);
    assert!(
        of("continuousmove").2.contains("<n:ProfileToken>b<") && of("continuousmove").1.starts_with("POST /onvif/ptz ")
    );
}

#[test]
fn a_camera_that_tells_its_time_to_nobody_is_dated_by_its_http_server() {
    let (url, heard) = camera(|action, _, body| match action {
        "getsystemdateandtime" => Does::Status(401, "Date: Tue, 15 Nov 2022 08:12:31 GMT\r\n", String::new()),
        _ if body.contains(">2022-11-15T08:12:") => usual(action),
        _ => Does::Status(401, "", String::new()),
    });
    connect(&url).unwrap().send(&Command::Stop).unwrap();
    assert!(heard.try_iter().any(|(action, _, _)| action == "stop"));
}

#[test]
fn a_wrong_password_is_said_and_never_shown() {
    for answer in [401, 400, 200] {
        let (url, _heard) = camera(move |action, _, _| match action {
            "getsystemdateandtime" => usual(action),
            _ => Does::Status(answer, "", fault("Sender not authorized sesame").replace(" sesame", "")),
        });
        let error = connect(&url).err().unwrap();
        assert!(matches!(error, PtzError::Unauthorised { .. }), "{answer}: {error}");
        assert!(!format!("{error} {error:?}").contains("sesame"));
    }
    for words in [
        "Authentication failed",
        "wsse:FailedAuthentication The security token could not be authenticated or authorized",
    ] {
        let (url, _heard) = camera(move |action, _, _| match action {
            "getsystemdateandtime" => usual(action),
            _ => Does::Status(400, "", fault(words)),
        });
        let error = connect(&url).err().unwrap();
        assert!(matches!(error, PtzError::Unauthorised { .. }), "{words}: {error}");
    }
    let (url, _heard) = camera(|action, _, _| match action {
        "getsystemdateandtime" => usual(action),
        _ => Does::Status(401, "", String::new()),
    });
    let error = Onvif::connect(&url, None, None, OnvifParams::default(), quick()).err().unwrap();
    assert!(error.to_string().contains("wants a user"), "{error}");
}

#[test]
fn answers_that_make_no_sense_are_errors_in_time() {
    let huge =
        || format!("HTTP/1.1 200 OK\r\nContent-Length: 10000000\r\n\r\n<a>{}", "x".repeat(10_000_000)).into_bytes();
    let answers: [(&str, fn() -> Does); 8] = [
        ("no XML", || Does::Status(200, "", "<a><b></a>".into())),
        ("a document type", || Does::Status(200, "", "<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>".into())),
        ("no body", || Does::Status(200, "", "<a/>".into())),
        ("no HTTP", || Does::Raw(b"garbage garbage garbage\r\n\r\n".to_vec())),
        ("an error", || Does::Status(500, "", fault("out of order"))),
        ("elsewhere", || Does::Status(302, "Location: http://127.0.0.1:1/\r\n", String::new())),
        ("nothing", || Does::HangsUp),
        ("a trickle", || Does::Trickles),
    ];
    for (what, answer) in answers {
        let (url, _heard) =
            camera(move |action, _, _| if action == "continuousmove" { answer() } else { usual(action) });
        let mut head = connect(&url).unwrap();
        let start = Instant::now();
        let error = head.send(&RIGHT).err().unwrap_or_else(|| panic!("{what}"));
        assert!(start.elapsed() < Duration::from_secs(10), "{what}: {error}");
    }
    let (url, heard) =
        camera(move |action, _, _| if action == "continuousmove" { Does::Raw(huge()) } else { usual(action) });
    let mut head = connect(&url).unwrap();
    assert!(head.send(&RIGHT).unwrap_err().to_string().contains("longer than"));
    drop(head);
    assert!(heard.iter().take(6).any(|(action, _, _)| action == "stop"), "it may be moving all the same");
}

#[test]
fn a_camera_without_a_head_or_without_profiles_says_so() {
    let (url, _heard) = camera(|action, _, _| match action {
        "getcapabilities" => Does::Answers("<r><Media><XAddr>http://x/m</XAddr></Media></r>".into()),
        _ => usual(action),
    });
    assert!(matches!(connect(&url), Err(PtzError::Unsupported { .. })));
    let (url, _heard) = camera(|action, _, _| match action {
        "getprofiles" => Does::Answers("<r/>".into()),
        _ => usual(action),
    });
    assert!(connect(&url).err().unwrap().to_string().contains("no media profile"));
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    assert!(connect(&format!("http://{nobody}/onvif/device_service")).is_err());
}
