use super::steering::{Doing, Steering};
use crate::sinks::{Moment, Sink};
use crate::{Record, Remote, RunError};
use pursuit_geometry::{BBox, Point, Size};
use pursuit_mavlink::{Ask, AttitudeWatch, Camera, Place, Request, Tracking, Verdict};
use pursuit_media::{SourceInfo, View};
use pursuit_trackers::at_point::{AtPoint, AtPointParams, Because};
use pursuit_tracking::TrackState;

/// Where the results of a run become what a camera of a drone says, and what ground stations ask becomes commands to the run.
pub struct CameraSink {
    camera: Option<Camera>,
    steering: Steering,
    /// Whether anything was followed yet.
    has_followed: bool,
    at_point: AtPoint,
    size: Size,
    view: Option<View>,
    /// How the gimbal is turned, where there is one.
    gimbal: Option<AttitudeWatch>,
}

impl CameraSink {
    /// `remote` commands the run whose results come here; `starts` says whether that begins with something to follow.
    ///
    /// # Errors
    /// [`RunError::Usage`] for parameters out of their ranges.
    pub fn new(
        camera: Camera,
        remote: Remote,
        input: &SourceInfo,
        starts: bool,
        at_point: AtPointParams,
    ) -> Result<Self, RunError> {
        let at_point = AtPoint::new(at_point).map_err(|e| RunError::usage(e.to_string()))?;
        let (size, view) = (input.input_size(), input.view);
        Ok(Self {
            camera: Some(camera),
            steering: Steering::new(remote, starts),
            has_followed: false,
            at_point,
            size,
            view,
            gimbal: None,
        })
    }

    /// On a gimbal, which says how the camera is turned.
    #[must_use]
    pub fn turned_by(self, gimbal: Option<AttitudeWatch>) -> Self {
        Self { gimbal, ..self }
    }

    /// Begins what a ground station asks.
    fn begin(&mut self, request: Request) {
        let (system, component) = request.from();
        let who = format!("ground station {system}/{component}");
        match request.ask {
            Ask::Stop => {
                tracing::info!("{who}: stop tracking");
                self.steering.stop(request);
            }
            Ask::Rectangle(place) => {
                let bbox = self.bbox(&place);
                tracing::info!("{who}: track {bbox}");
                self.steering.start(request, bbox, 0);
            }
            Ask::Point { x, y, radius } => {
                let Some((bbox, because)) = self.at(x, y, radius) else { return request.answer(Verdict::NotNow) };
                tracing::info!("{who}: track the point {x:.3}, {y:.3}: {bbox}, as {}", because.as_str());
                self.steering.start(request, bbox, code(because));
            }
        }
    }

    /// What is at a point, as a box of the input.
    fn at(&self, x: f64, y: f64, radius: f64) -> Option<(BBox, Because)> {
        let (width, height) = (self.size.width as f64, self.size.height as f64);
        let of_input = BBox::from_center_size(Point::new(x * width, y * height), 1.0, 1.0);
        let of_frame = self.view.map_or(of_input, |view| view.of_input(of_input));
        // A pixel of the input may be less than one of the frame.
        let radius_px = (radius > 0.0).then(|| radius * width * of_frame.width());
        let (bbox, because) = self.at_point.find(of_frame.center(), radius_px)?;
        Some((self.view.map_or(bbox, |view| view.in_input(bbox)), because))
    }

    fn bbox(&self, place: &Place) -> BBox {
        let (width, height) = (self.size.width as f64, self.size.height as f64);
        BBox::from_ltrb(place.left * width, place.top * height, place.right * width, place.bottom * height)
    }

    /// What is said of a target.
    fn tracking(&mut self, records: &[Record]) -> Tracking {
        let followed = match self.steering.doing() {
            Doing::Nothing => return Tracking::Idle,
            Doing::AsStarted => records.first(),
            Doing::Following(id) => records.iter().find(|record| record.target == id),
        };
        let Some(estimate) = followed.and_then(|record| record.estimate.as_ref()) else {
            // What was never found cannot be lost.
            return if self.has_followed { Tracking::Lost } else { Tracking::Idle };
        };
        self.has_followed = true;
        let (width, height) = (self.size.width as f64, self.size.height as f64);
        let place = Place {
            left: (estimate.bbox.left() / width).clamp(0.0, 1.0),
            top: (estimate.bbox.top() / height).clamp(0.0, 1.0),
            right: (estimate.bbox.right() / width).clamp(0.0, 1.0),
            bottom: (estimate.bbox.bottom() / height).clamp(0.0, 1.0),
        };
        let is_outside = place.left >= place.right || place.top >= place.bottom;
        match estimate.state {
            TrackState::Lost => Tracking::Lost,
            // Expected outside of the picture, it has no place in it.
            _ if is_outside => Tracking::Lost,
            TrackState::Tracking => Tracking::Seen(place),
            // Nobody shall steer or land by what is not certain.
            TrackState::Unsure | TrackState::Occluded => Tracking::Coasting(place),
        }
    }
}

/// How a box was found, as the answer's second parameter says it.
const fn code(because: Because) -> i32 {
    match because {
        Because::Moves => 1,
        Because::StandsOut => 2,
        Because::Radius => 3,
    }
}

impl Sink for CameraSink {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        self.at_point.see(moment.frame);
        self.steering.settle();
        let tracking = self.tracking(moment.records);
        let Some(camera) = &self.camera else { return Ok(()) };
        if let Some(gimbal) = &self.gimbal {
            camera.turn(gimbal.attitude());
        }
        camera.tell(tracking);
        if let Some(request) = camera.asked() {
            self.begin(request);
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RunError> {
        self.steering.settle();
        // It says that nothing is tracked any more.
        self.camera = None;
        Ok(())
    }
}
