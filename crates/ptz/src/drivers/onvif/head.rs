use super::client::{Client, Login};
use super::discovery::{Facts, discover};
use super::messages::{Service, profile, vector};
use super::spaces::{Range, Space, Spaces};
use crate::drivers::{Capabilities, Head, Timeouts};
use crate::error::require;
use crate::{Command, Direction, Position, PtzError, Result, Status, Velocity};
use std::path::Path;

/// What the numbers of a camera mean that only offers generic spaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnvifParams {
    /// The speeds of pan and of tilt at the end of the velocity range, degrees per second. Measured by the calibration.
    pub max_speed_deg_s: (f64, f64),
    /// The pans at the two ends of the position range, degrees.
    pub pan_deg: (f64, f64),
    /// The tilts at the two ends of the position range, degrees.
    pub tilt_deg: (f64, f64),
    /// Half the angles of view at the widest zoom, degrees, for turns in units of the view.
    pub half_fov_deg: (f64, f64),
    /// How much of its range the zoom travels in a second at the end of its velocity range.
    pub zoom_per_s: f64,
    /// For how long the camera goes on moving when it hears nothing more, seconds: it stops by itself when this program is
    /// killed.
    pub move_timeout_s: u32,
}

impl Default for OnvifParams {
    fn default() -> Self {
        Self {
            max_speed_deg_s: (60.0, 60.0),
            pan_deg: (-180.0, 180.0),
            tilt_deg: (-90.0, 90.0),
            half_fov_deg: (30.0, 18.0),
            zoom_per_s: 0.3,
            move_timeout_s: 2,
        }
    }
}

impl OnvifParams {
    fn check(&self) -> Result<()> {
        let (pan, tilt) = self.max_speed_deg_s;
        require("max_speed_deg_s of pan", pan, pan > 0.0, "above 0")?;
        require("max_speed_deg_s of tilt", tilt, tilt > 0.0, "above 0")?;
        require("pan_deg", self.pan_deg.1, self.pan_deg.0.is_finite() && self.pan_deg.1 > self.pan_deg.0, "growing")?;
        require(
            "tilt_deg",
            self.tilt_deg.1,
            self.tilt_deg.0.is_finite() && self.tilt_deg.1 > self.tilt_deg.0,
            "growing",
        )?;
        require("half_fov_deg", self.half_fov_deg.0, self.half_fov_deg.0 > 0.0, "above 0")?;
        require("half_fov_deg", self.half_fov_deg.1, self.half_fov_deg.1 > 0.0, "above 0")?;
        require("zoom_per_s", self.zoom_per_s, self.zoom_per_s > 0.0, "above 0")
    }
}

/// An ONVIF camera.
pub struct Onvif {
    client: Client,
    facts: Facts,
    params: OnvifParams,
    moving: bool,
}

impl Onvif {
    /// Reaches the camera whose device service is at `url` (`http://HOST[:PORT]/onvif/device_service`, `https://` with the
    /// feature `onvif-tls`) and asks what it can. `certificates` is a PEM file of what is trusted at an `https://` address in
    /// place of the system's authorities; the camera's own certificate may stand in it.
    ///
    /// # Errors
    /// Where it cannot be reached, is not trusted, does not accept the login, or offers no PTZ service.
    pub fn connect(
        url: &str,
        login: Option<Login>,
        certificates: Option<&Path>,
        params: OnvifParams,
        timeouts: Timeouts,
    ) -> Result<Self> {
        params.check()?;
        let mut client = Client::new(url, login, certificates, timeouts)?;
        let facts = discover(&mut client)?;
        Ok(Self { client, facts, params, moving: false })
    }

    /// The coordinate spaces that the camera offers.
    pub const fn spaces(&self) -> &Spaces {
        &self.facts.spaces
    }

    /// The stored positions: tokens and names.
    ///
    /// # Errors
    /// Where the camera does not answer or refuses.
    pub fn presets(&mut self) -> Result<Vec<(String, String)>> {
        let answer = self.client.ask(Service::Ptz, "GetPresets", &profile(&self.facts.profile))?;
        let mut found = Vec::new();
        answer.find_all("Preset", &mut found);
        let named = |preset: &&super::Element| {
            Some((preset.attribute("token")?.to_owned(), preset.text_of("Name").unwrap_or_default().to_owned()))
        };
        Ok(found.iter().filter_map(named).collect())
    }

    /// Stores where the camera looks under a name; gives the position's token.
    ///
    /// # Errors
    /// Where the camera does not answer or refuses.
    pub fn set_preset(&mut self, name: &str) -> Result<String> {
        let name = super::messages::escaped(name);
        let contents = format!("{}<n:PresetName>{name}</n:PresetName>", profile(&self.facts.profile));
        let answer = self.client.ask(Service::Ptz, "SetPreset", &contents)?;
        let token = answer.text_of("PresetToken").map(str::to_owned);
        let head = || self.client.name.clone();
        token.ok_or_else(|| PtzError::Reply { head: head(), doing: "SetPreset", reason: "it has no token".into() })
    }

    /// Goes to a stored position.
    ///
    /// # Errors
    /// Where the camera does not answer or refuses.
    pub fn goto_preset(&mut self, token: &str) -> Result<()> {
        self.moving = true;
        let token = super::messages::escaped(token);
        self.act("GotoPreset", &format!("<n:PresetToken>{token}</n:PresetToken>"))
    }

    fn act(&mut self, action: &'static str, contents: &str) -> Result<()> {
        let contents = profile(&self.facts.profile) + contents;
        self.client.ask(Service::Ptz, action, &contents).map(drop)
    }

    fn offered<'a>(&self, space: &'a Option<Space>, what: &'static str) -> Result<&'a Space> {
        space.as_ref().ok_or_else(|| PtzError::Unsupported { head: self.client.name.clone(), what })
    }

    fn velocity(&mut self, velocity: &Velocity) -> Result<()> {
        let spaces = self.facts.spaces.clone();
        let space = self.offered(&spaces.velocity, "move at a velocity")?;
        let (top_pan, top_tilt) = self.params.max_speed_deg_s;
        let component = |value: f64, top: f64, range: &Range| {
            if space.name == "VelocitySpaceDegrees" { range.clamp(value) } else { range.scaled(value, (-top, top)) }
        };
        let y = space.y.unwrap_or(space.x);
        let pan_tilt = (
            component(velocity.pan_deg_s, top_pan, &space.x),
            component(velocity.tilt_deg_s, top_tilt, &y),
            &*space.uri,
        );
        let top = self.params.zoom_per_s;
        let zoom =
            spaces.zoom_velocity.as_ref().map(|space| (space.x.scaled(velocity.zoom_per_s, (-top, top)), &*space.uri));
        let timeout = format!("<n:Timeout>PT{}S</n:Timeout>", self.params.move_timeout_s);
        self.act("ContinuousMove", &(vector("Velocity", Some(pan_tilt), zoom) + &timeout))
    }

    fn go_to(&mut self, direction: Direction, zoom: Option<f64>) -> Result<()> {
        let spaces = self.facts.spaces.clone();
        let space = self.offered(&spaces.position, "go to a position")?;
        let y = space.y.unwrap_or(space.x);
        let Direction { pan_deg, tilt_deg } = direction;
        let (pan, tilt) = if space.name == "SphericalPositionSpaceDegrees" {
            (space.x.clamp(pan_deg), y.clamp(tilt_deg))
        } else {
            (space.x.scaled(pan_deg, self.params.pan_deg), y.scaled(tilt_deg, self.params.tilt_deg))
        };
        let zoom = zoom.zip(spaces.zoom_position.as_ref()).map(|(zoom, s)| (s.x.scaled(zoom, (0.0, 1.0)), &*s.uri));
        self.act("AbsoluteMove", &vector("Position", Some((pan, tilt, &*space.uri)), zoom))
    }

    /// Turns by an angle: in degrees, in units of the view (at the widest zoom), or in units of the whole range.
    fn turn_by(&mut self, by: Direction) -> Result<()> {
        let spaces = self.facts.spaces.clone();
        let space = self.offered(&spaces.translation, "turn by an angle")?;
        let y = space.y.unwrap_or(space.x);
        let (span_pan, span_tilt) = match space.name.as_str() {
            "SphericalTranslationSpaceDegrees" => (space.x.max, y.max),
            "TranslationSpaceFov" => self.params.half_fov_deg,
            _ => (self.params.pan_deg.1 - self.params.pan_deg.0, self.params.tilt_deg.1 - self.params.tilt_deg.0),
        };
        // A generic turn of 1 is one unit of the position range, which spans 2 such units.
        let unit = if space.name == "TranslationGenericSpace" { 0.5 } else { 1.0 };
        let pan = space.x.clamp(by.pan_deg / (span_pan * unit) * space.x.max);
        let tilt = y.clamp(by.tilt_deg / (span_tilt * unit) * y.max);
        self.act("RelativeMove", &vector("Translation", Some((pan, tilt, &*space.uri)), None))
    }

    fn stop(&mut self) -> Result<()> {
        self.act("Stop", "<n:PanTilt>true</n:PanTilt><n:Zoom>true</n:Zoom>")
    }

    /// The direction that a position answer means.
    fn direction(&self, x: f64, y: f64, space: Option<&str>) -> Direction {
        let degrees = space.is_some_and(|uri| uri.ends_with("SphericalPositionSpaceDegrees"));
        if degrees {
            return Direction::new(x, y);
        }
        let offered = self.facts.spaces.position.as_ref().filter(|space| space.name == "PositionGenericSpace");
        let usual = Range { min: -1.0, max: 1.0 };
        let (range_x, range_y) = offered.map_or((usual, usual), |space| (space.x, space.y.unwrap_or(space.x)));
        Direction::new(range_x.unscaled(x, self.params.pan_deg), range_y.unscaled(y, self.params.tilt_deg))
    }
}

/// The token of the stored position of a number, of those that a camera lists with their names. Many makers' tokens are the numbers; of
/// others they end in them (`PRESET_3`). Where no token ends in a number the positions count in the order of the list; where some do, a
/// number that none has is no position, and the camera is left to say so.
fn token_of(number: u8, stored: &[(String, String)]) -> String {
    let text = number.to_string();
    let number_in = |token: &str| {
        let word = token.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        token[word..].parse::<u64>().ok()
    };
    let is_numbered = stored.iter().any(|(token, _)| number_in(token).is_some());
    let find = |is_it: &dyn Fn(&(String, String)) -> bool| stored.iter().find(|one| is_it(one));
    let found = find(&|(token, _)| *token == text)
        .or_else(|| find(&|(_, name)| *name == text))
        .or_else(|| find(&|(token, _)| number_in(token) == Some(u64::from(number))))
        .or_else(|| stored.get(usize::from(number).checked_sub(1)?).filter(|_| !is_numbered));
    found.map_or(text, |(token, _)| token.clone())
}

impl Head for Onvif {
    fn name(&self) -> &str {
        &self.client.name
    }

    fn capabilities(&self) -> Capabilities {
        let spaces = &self.facts.spaces;
        Capabilities {
            velocity: spaces.velocity.is_some(),
            absolute: spaces.position.is_some(),
            relative: spaces.translation.is_some(),
            zoom: spaces.zoom_velocity.is_some() || spaces.zoom_position.is_some(),
            presets: self.facts.presets,
            status: true,
            travel: None,
            max_speed_deg_s: match &spaces.velocity {
                Some(space) if space.name == "VelocitySpaceDegrees" => {
                    Some((space.x.max, space.y.unwrap_or(space.x).max))
                }
                _ => None,
            },
        }
    }

    fn send(&mut self, command: &Command) -> Result<()> {
        // From here on it may move, whatever happens to the answer.
        self.moving |= command.moves();
        match *command {
            Command::Move(velocity) => self.velocity(&velocity)?,
            Command::GoTo { direction, zoom } => self.go_to(direction, zoom)?,
            Command::TurnBy { by } => self.turn_by(by)?,
            Command::Preset { number } => {
                // Where the camera lists nothing, the number is all there is to go by.
                let stored = self.presets().unwrap_or_default();
                self.goto_preset(&token_of(number, &stored))?;
            }
            Command::Home if self.facts.home => self.act("GotoHomePosition", "")?,
            Command::Home => {
                return Err(PtzError::Unsupported { head: self.client.name.clone(), what: "go home" });
            }
            Command::Stop => self.stop()?,
        }
        self.moving = command.moves();
        Ok(())
    }

    fn leave(&mut self) {
        self.moving = false;
    }

    fn status(&mut self) -> Result<Option<Status>> {
        let answer = self.client.ask(Service::Ptz, "GetStatus", &profile(&self.facts.profile))?;
        let pan_tilt = answer.find("PanTilt").filter(|element| element.attribute("x").is_some());
        let zoom = answer.find("Zoom").and_then(|element| element.number("x")).unwrap_or(0.0).clamp(0.0, 1.0);
        let position = pan_tilt.and_then(|element| {
            let direction = self.direction(element.number("x")?, element.number("y")?, element.attribute("space"));
            Some(Position { direction, zoom })
        });
        let moving =
            answer.find("MoveStatus").and_then(|status| status.text_of("PanTilt")).and_then(|word| match word {
                "IDLE" => Some(false),
                "MOVING" => Some(true),
                _ => None,
            });
        Ok(Some(Status { position, moving }))
    }
}

impl Drop for Onvif {
    fn drop(&mut self) {
        if self.moving {
            self.stop().ok();
        }
    }
}
