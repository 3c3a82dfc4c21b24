use super::sink::CameraSink;
use crate::{Run, RunError};
use pursuit_mavlink::{
    AttitudeWatch, Camera, CameraFacts, Endpoint, Identity, LinkAddress, LinkCounts, MavlinkError, SigningKey, Stream,
};
use pursuit_media::{Locator, SourceInfo};
use pursuit_trackers::at_point::AtPointParams;

/// How a run is a camera of a drone.
#[derive(Debug, Clone, Default)]
pub struct MavlinkOptions {
    /// Which component of which vehicle it is.
    pub identity: Identity,
    /// Where ground stations and the autopilot are.
    pub links: Vec<LinkAddress>,
    /// By which key messages are signed, where they are.
    pub key: Option<SigningKey>,
    /// How wide the camera sees, from the left to the right edge, degrees, where known.
    pub field_of_view_deg: Option<f64>,
    /// How far the camera looks above the vehicle's nose, degrees.
    pub pitch_deg: f64,
    /// Where ground stations can see the pictures; without, at the input where that is a stream.
    pub stream: Option<String>,
    /// Whether landing targets are told.
    pub landing_target: bool,
    /// The true width of the target, metres, where known.
    pub target_width_m: Option<f64>,
    /// How a point becomes a box.
    pub at_point: AtPointParams,
}

/// An endpoint that is open, and the camera that a run becomes on it.
pub struct Mavlink {
    endpoint: Endpoint,
    options: MavlinkOptions,
}

impl Mavlink {
    /// Opens the links.
    ///
    /// # Errors
    /// [`RunError::Usage`] for options that make no sense, [`RunError::Output`] for a link that cannot be opened.
    pub fn open(options: MavlinkOptions) -> Result<Self, RunError> {
        if let Some(deg) = options.field_of_view_deg.filter(|deg| !(1.0..=170.0).contains(deg)) {
            return Err(RunError::usage(format!(
                "a field of view of {deg}° makes no sense; it is between 1° and 170°"
            )));
        }
        if options.landing_target && options.field_of_view_deg.is_none() {
            return Err(RunError::usage(
                "a landing target is told by angles; say how wide the camera sees, `--field-of-view DEGREES`",
            ));
        }
        if let Some(metres) = options.target_width_m.filter(|metres| !(metres.is_finite() && *metres > 0.0)) {
            return Err(RunError::usage(format!("a target {metres} m wide makes no sense; it is wider than 0")));
        }
        if !(-180.0..=180.0).contains(&options.pitch_deg) {
            return Err(RunError::usage(format!("a camera does not look {}° above the nose", options.pitch_deg)));
        }
        let endpoint = Endpoint::start(options.identity, &options.links, options.key.as_ref()).map_err(failed)?;
        Ok(Self { endpoint, options })
    }

    /// The endpoint, for whoever else speaks on it.
    pub const fn endpoint(&self) -> &Endpoint {
        &self.endpoint
    }

    /// What has become of the links.
    pub fn counts(&self) -> Vec<LinkCounts> {
        self.endpoint.counts()
    }

    /// The run, as a camera on these links: what it is asked to track is tracked from the next frame on. `gimbal` says how the
    /// camera is turned, where it sits on one.
    ///
    /// # Errors
    /// [`RunError::Output`] where the system gives no thread.
    pub fn serve(&self, run: Run, gimbal: Option<AttitudeWatch>) -> Result<Run, RunError> {
        let gimbal_device = gimbal.as_ref().map_or(0, |gimbal| gimbal.id().device);
        let facts = CameraFacts { gimbal_device, ..self.facts(run.input()) };
        let camera = Camera::start(self.endpoint.clone(), facts).map_err(failed)?;
        let sink = CameraSink::new(camera, run.remote(), run.input(), run.follows(), self.options.at_point)?;
        Ok(run.with_sink(Box::new(sink.turned_by(gimbal))))
    }

    fn facts(&self, input: &SourceInfo) -> CameraFacts {
        let size = input.input_size();
        let side = |length: usize| u16::try_from(length).unwrap_or(u16::MAX);
        let of_input = || {
            let locator = Locator::new(&input.name);
            // What asks for a password is of no use to who does not have it.
            (input.live && input.name.starts_with("rtsp") && locator.login().is_none()).then(|| input.name.clone())
        };
        CameraFacts {
            vendor: "pursuit".to_owned(),
            model: "tracking camera".to_owned(),
            size: (side(size.width), side(size.height)),
            field_of_view_deg: self.options.field_of_view_deg,
            fps: input.fps,
            stream: self.options.stream.clone().or_else(of_input).map(|uri| Stream { uri }),
            pitch_deg: self.options.pitch_deg,
            landing_target: self.options.landing_target,
            target_width_m: self.options.target_width_m,
            gimbal_device: 0,
        }
    }
}

/// What went wrong with a link.
pub(super) fn failed(error: MavlinkError) -> RunError {
    match error {
        MavlinkError::Io { .. } => RunError::output("MAVLink")(std::io::Error::other(error)),
        other => RunError::usage(other.to_string()),
    }
}
