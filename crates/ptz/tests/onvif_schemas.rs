//! Every request that the ONVIF driver can make, held to the schemas and service descriptions that ONVIF has published.
//!
//! `tests/onvif_schemas.py` holds them to those; the variable `PURSUIT_ONVIF_PYTHON` names a Python that has what it needs
//! (`cargo xtask peers onvif`). Without it only the list of the requests is looked at, and `skipped:` is said.
#![allow(clippy::type_complexity, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::disallowed_methods, reason = "a variable names the Python that has the schemas")]
#![cfg(feature = "onvif")]

mod common;

use common::{Does, Heard, camera, fault, usual};
use pursuit_ptz::drivers::onvif::{Login, Onvif, OnvifParams};
use pursuit_ptz::drivers::{Head, Password, Timeouts};
use pursuit_ptz::{Command, Direction, Velocity};
use std::collections::BTreeSet;
use std::io::Write;
use std::process::Stdio;

/// All that the driver can ask, as the services name it.
const ACTIONS: [&str; 15] = [
    "ver10/device/wsdl/GetCapabilities",
    "ver10/device/wsdl/GetServices",
    "ver10/device/wsdl/GetSystemDateAndTime",
    "ver10/media/wsdl/GetProfiles",
    "ver20/media/wsdl/GetProfiles",
    "ver20/ptz/wsdl/AbsoluteMove",
    "ver20/ptz/wsdl/ContinuousMove",
    "ver20/ptz/wsdl/GetNodes",
    "ver20/ptz/wsdl/GetPresets",
    "ver20/ptz/wsdl/GetStatus",
    "ver20/ptz/wsdl/GotoHomePosition",
    "ver20/ptz/wsdl/GotoPreset",
    "ver20/ptz/wsdl/RelativeMove",
    "ver20/ptz/wsdl/SetPreset",
    "ver20/ptz/wsdl/Stop",
];

/// A camera that knows the second media service only, in degrees, with a zoom that can be sent nowhere.
fn newer(action: &str, body: &str) -> Does {
    let space = |kind: &str, name: &str| {
        format!(
            "<t:{kind}><t:URI>http://www.onvif.org/ver10/tptz/PanTiltSpaces/{name}</t:URI><t:XRange><t:Min>-180</t:Min><t:Max>180\
             </t:Max></t:XRange><t:YRange><t:Min>-90</t:Min><t:Max>90</t:Max></t:YRange></t:{kind}>"
        )
    };
    let service = |namespace: &str| {
        format!(
            "<d:Service><d:Namespace>http://www.onvif.org/{namespace}/wsdl</d:Namespace><d:XAddr>http://x/o</d:XAddr></d:Service>"
        )
    };
    match action {
        "getcapabilities" => Does::Status(400, "", fault("ter:ActionNotSupported")),
        "getservices" => Does::Answers(format!("<r>{}{}</r>", service("ver20/media"), service("ver20/ptz"))),
        "getprofiles" if body.contains("ver20/media/wsdl") => Does::Answers(
            "<r><m:Profiles token='b'><m:Configurations><m:PTZ><t:NodeToken>n</t:NodeToken></m:PTZ></m:Configurations></m:Profiles></r>"
                .into(),
        ),
        "getnodes" => Does::Answers(format!(
            "<r><p:PTZNode token='n'><t:SupportedPTZSpaces>{}{}{}</t:SupportedPTZSpaces><t:MaximumNumberOfPresets>8\
             </t:MaximumNumberOfPresets><t:HomeSupported>true</t:HomeSupported></p:PTZNode></r>",
            space("AbsolutePanTiltPositionSpace", "SphericalPositionSpaceDegrees"),
            space("RelativePanTiltTranslationSpace", "SphericalTranslationSpaceDegrees"),
            space("ContinuousPanTiltVelocitySpace", "VelocitySpaceDegrees"),
        )),
        _ => usual(action),
    }
}

/// Asks everything of a camera, in as many ways as there are.
fn ask_everything(url: &str, login: Option<Login>) {
    let mut head =
        Onvif::connect(url, login, None, OnvifParams::default(), Timeouts::from_secs(5.0, 5.0).unwrap()).unwrap();
    let to = |pan, tilt, zoom| Command::GoTo { direction: Direction::new(pan, tilt), zoom };
    let at = |pan_deg_s, tilt_deg_s, zoom_per_s| Command::Move(Velocity { pan_deg_s, tilt_deg_s, zoom_per_s });
    let commands = [
        at(30.0, -15.0, 0.0),
        at(-1e-9, 1e9, -0.2),
        to(90.0, 45.0, None),
        to(-1e-12, -1e12, Some(0.75)),
        Command::TurnBy { by: Direction::new(-15.0, 1e-7) },
        Command::Preset { number: 2 },
        Command::Preset { number: 255 },
        Command::Home,
        Command::Stop,
    ];
    for command in commands {
        head.send(&command).unwrap();
    }
    head.status().unwrap();
    head.presets().unwrap();
    head.set_preset("a<b> & \"c\" 'd' é 門").unwrap();
    head.goto_preset("<&>").unwrap();
}

fn requests() -> Vec<Heard> {
    let login = || Some(Login { user: "Zoë <&> \"'".into(), password: Password::new("sesame") });
    let mut all = Vec::new();
    for (is_newer, login) in [(false, login()), (false, None), (true, login())] {
        let (url, heard) = camera(move |action, _, body| if is_newer { newer(action, body) } else { usual(action) });
        ask_everything(&url, login);
        all.extend(heard.try_iter());
    }
    all
}

/// What is wrong with requests, a list for each.
fn complaints(python: &std::ffi::OsStr, requests: &[Heard]) -> Vec<Vec<String>> {
    let list: Vec<_> =
        requests.iter().map(|(_, head, body)| serde_json::json!({ "head": head, "body": body })).collect();
    let mut script = std::process::Command::new(python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/onvif_schemas.py"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    script.stdin.take().unwrap().write_all(&serde_json::to_vec(&list).unwrap()).unwrap();
    let done = script.wait_with_output().unwrap();
    assert!(done.status.success(), "onvif_schemas.py: {}", done.status);
    let all: Vec<Vec<String>> = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(all.len(), requests.len());
    all
}

/// A request that is like one that was made but for a piece of its header, or of its body.
fn spoilt(requests: &[Heard], action: &str, from: &str, to: &str) -> Heard {
    let with = |(_, head, body): &&Heard| {
        head.to_lowercase().contains(&format!("/{action}\"")) && (head.contains(from) || body.contains(from))
    };
    let (action, head, body) = requests.iter().find(with).unwrap_or_else(|| panic!("no {action} with {from}"));
    (action.clone(), head.replace(from, to), body.replace(from, to))
}

#[test]
fn every_request_is_valid_by_the_published_schemas() {
    let requests = requests();
    let asked: BTreeSet<&str> = requests
        .iter()
        .map(|(_, head, _)| head.split("http://www.onvif.org/").nth(1).unwrap().split('"').next().unwrap())
        .collect();
    assert_eq!(asked, BTreeSet::from(ACTIONS));

    let Some(python) = std::env::var_os("PURSUIT_ONVIF_PYTHON") else {
        println!("skipped: PURSUIT_ONVIF_PYTHON names no Python with the schemas (`cargo xtask peers onvif`)");
        return;
    };
    for ((action, _, body), wrong) in requests.iter().zip(complaints(&python, &requests)) {
        assert!(wrong.is_empty(), "{action}: {wrong:#?}\n{body}");
    }
    println!("{} requests of {} kinds are valid", requests.len(), asked.len());
    // The same with a mistake is not: the order of elements, a type, an unknown element, an attribute, an action.
    let mistakes = [
        spoilt(
            &requests,
            "stop",
            "<n:PanTilt>true</n:PanTilt><n:Zoom>true</n:Zoom>",
            "<n:Zoom>true</n:Zoom><n:PanTilt>true</n:PanTilt>",
        ),
        spoilt(&requests, "continuousmove", "PT2S", "2 s"),
        spoilt(&requests, "continuousmove", "n:Velocity>", "n:Speed>"),
        spoilt(&requests, "absolutemove", " x=\"", " pan=\""),
        spoilt(&requests, "getnodes", ":GetNodes", ":GetHeads"),
        spoilt(&requests, "getstatus", "wsdl/GetStatus", "wsdl/GetNodes"),
        spoilt(&requests, "getprofiles", "<n:Type>PTZ</n:Type>", "<n:Kind>PTZ</n:Kind>"),
        spoilt(&requests, "getcapabilities", ">All<", ">Some<"),
        spoilt(&requests, "getpresets", "s:Body>", "s:Torso>"),
    ];
    for ((action, _, body), wrong) in mistakes.iter().zip(complaints(&python, &mistakes)) {
        assert!(!wrong.is_empty(), "{action} passes though it is wrong: {body}");
    }
}
