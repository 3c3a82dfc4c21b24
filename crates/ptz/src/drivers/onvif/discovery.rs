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
    services(client)?;
    let profiles = client.ask(Service::Media, "GetProfiles", "")?;
    let mut found = Vec::new();
    profiles.find_all("Profiles", &mut found);
    let with_ptz = found.iter().find(|profile| profile.find("PTZConfiguration").is_some());
    let profile = with_ptz.or_else(|| found.first()).and_then(|profile| profile.attribute("token"));
    let Some(profile) = profile.map(str::to_owned) else {
        let reason = "it has no media profile".to_owned();
        return Err(PtzError::Reply { head: client.name.clone(), doing: "GetProfiles", reason });
    };
    let node = with_ptz.and_then(|profile| profile.text_of("NodeToken")).map(str::to_owned);
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

fn services(client: &mut Client) -> Result<()> {
    let answer = client.ask(Service::Device, "GetCapabilities", "<n:Category>All</n:Category>")?;
    let address = |name: &str| answer.find(name).and_then(|service| service.text_of("XAddr"));
    if let Some(address) = address("Media") {
        client.set_service(Service::Media, address);
    }
    match address("PTZ") {
        Some(address) => {
            client.set_service(Service::Ptz, address);
            Ok(())
        }
        None => Err(PtzError::Unsupported {
            head: client.name.clone(),
            what: "pan, tilt or zoom: it offers no PTZ service",
        }),
    }
}
