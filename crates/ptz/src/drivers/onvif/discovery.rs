//! What a camera is asked when it is reached first.

use super::client::Client;
use super::messages::Service;
use super::spaces::Spaces;
use super::{clock, xml::Element};
use crate::{PtzError, Result};

/// What is known of a camera.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Facts {
    pub profile: String,
    pub spaces: Spaces,
    pub presets: bool,
    pub home: bool,
}

/// Asks a camera for its clock, its services, its profiles and its PTZ node.
pub(super) fn discover(client: &mut Client) -> Result<Facts> {
    // Cameras refuse messages that are dated far from their own time, so this is asked first, openly. A camera that
    // refuses even that is asked for the rest by the clock of its HTTP server, else by ours.
    match client.ask_openly(Service::Device, "GetSystemDateAndTime") {
        Ok(answer) => {
            if let Some(camera_s) = clock::read(&answer) {
                client.set_clock(camera_s);
            }
        }
        Err(PtzError::Unauthorised { .. } | PtzError::Refused { .. }) => client.set_clock_by_http(),
        Err(error) => return Err(error),
    }
    let media = services(client)?;
    let profiles = client.ask(media.service(), "GetProfiles", media.wanted())?;
    let mut found = Vec::new();
    profiles.find_all("Profiles", &mut found);
    let with_ptz = found.iter().find_map(|profile| Some((profile, profile.find(media.configuration())?)));
    let profile = with_ptz.map(|(profile, _)| profile).or_else(|| found.first());
    let Some(profile) = profile.and_then(|profile| profile.attribute("token")).map(str::to_owned) else {
        let reason = "it has no media profile".to_owned();
        return Err(PtzError::Reply { head: client.name.clone(), doing: "GetProfiles", reason });
    };
    let node = with_ptz.and_then(|(_, configuration)| configuration.text_of("NodeToken")).map(str::to_owned);
    let nodes = client.ask(Service::Ptz, "GetNodes", "")?;
    let node = of_token(&nodes, node.as_deref()).unwrap_or(&nodes);
    Ok(Facts {
        profile,
        spaces: Spaces::read(node),
        presets: node.text_of("MaximumNumberOfPresets").and_then(|n| n.parse().ok()).is_some_and(|n: u32| n > 0),
        home: node.text_of("HomeSupported") == Some("true"),
    })
}

fn of_token<'a>(nodes: &'a Element, token: Option<&str>) -> Option<&'a Element> {
    let mut found = Vec::new();
    nodes.find_all("PTZNode", &mut found);
    found.into_iter().find(|node| token.is_some() && node.attribute("token") == token)
}

/// Which of the two media services tells the profiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Media {
    First,
    Second,
}

impl Media {
    const fn service(self) -> Service {
        match self {
            Self::First => Service::Media,
            Self::Second => Service::Media2,
        }
    }

    /// What a request for the profiles asks for: the second service leaves out what is not asked for.
    const fn wanted(self) -> &'static str {
        match self {
            Self::First => "",
            Self::Second => "<n:Type>PTZ</n:Type>",
        }
    }

    /// What a profile calls the configuration of its head.
    const fn configuration(self) -> &'static str {
        match self {
            Self::First => "PTZConfiguration",
            Self::Second => "PTZ",
        }
    }
}

/// Takes note of where the services are. Cameras of Profile T tell them by `GetServices`, and need not know the older
/// `GetCapabilities`; many of Profile S know that only.
fn services(client: &mut Client) -> Result<Media> {
    let told = match client.ask(Service::Device, "GetCapabilities", "<n:Category>All</n:Category>") {
        Ok(answer) => {
            let address =
                |name: &str| answer.find(name).and_then(|service| service.text_of("XAddr")).map(str::to_owned);
            (address("Media"), address("PTZ"))
        }
        Err(PtzError::Refused { .. }) => (None, None),
        Err(error) => return Err(error),
    };
    if let (Some(media), Some(ptz)) = &told {
        client.set_service(Service::Media, media);
        client.set_service(Service::Ptz, ptz);
        return Ok(Media::First);
    }
    let found = newer_services(client)?;
    let of = |service: Service| {
        found.iter().find(|(namespace, _)| namespace == service.namespace()).map(|(_, address)| address.clone())
    };
    let (media, ptz) = (told.0.or_else(|| of(Service::Media)), told.1.or_else(|| of(Service::Ptz)));
    let Some(ptz) = ptz else {
        let head = client.name.clone();
        return Err(PtzError::Unsupported { head, what: "pan, tilt or zoom: it offers no PTZ service" });
    };
    client.set_service(Service::Ptz, &ptz);
    match (media, of(Service::Media2)) {
        (None, Some(media2)) => {
            client.set_service(Service::Media2, &media2);
            Ok(Media::Second)
        }
        (media, _) => {
            media.iter().for_each(|media| client.set_service(Service::Media, media));
            Ok(Media::First)
        }
    }
}

/// The namespaces and addresses that `GetServices` tells; none where the camera does not know it.
fn newer_services(client: &mut Client) -> Result<Vec<(String, String)>> {
    let answer = match client.ask(Service::Device, "GetServices", "<n:IncludeCapability>false</n:IncludeCapability>") {
        Ok(answer) => answer,
        Err(PtzError::Refused { .. }) => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    let mut found = Vec::new();
    answer.find_all("Service", &mut found);
    let named =
        |service: &&Element| Some((service.text_of("Namespace")?.to_owned(), service.text_of("XAddr")?.to_owned()));
    Ok(found.iter().filter_map(named).collect())
}
