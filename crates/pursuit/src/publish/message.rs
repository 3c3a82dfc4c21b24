use crate::Record;
use pursuit_geometry::BBox;
use pursuit_tracking::{BoxCovariance, Class, Doubt, TrackState};
use serde::Serialize;
use serde::ser::{SerializeSeq, Serializer};

/// Name and version of the JSON below: a field that changes its meaning or goes changes the number, one that is added
/// does not.
pub(super) const TARGET_SCHEMA: &str = "pursuit.target/1";
pub(super) const PRESENT_SCHEMA: &str = "pursuit.present/1";
pub(super) const RUN_SCHEMA: &str = "pursuit.run/1";

/// What is told of one target in one frame: small, so that it is quickly handed to the thread that sends it.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    pub frame: u64,
    pub time_s: f64,
    /// When the frame was looked at, seconds since 1970.
    pub unix_time_s: f64,
    pub target: u64,
    /// None once there is no such target any more.
    pub state: Option<TrackState>,
    class: Option<Class>,
    doubt: Option<Doubt>,
    bbox: Option<BBox>,
    score: Option<f64>,
    prediction: Option<BBox>,
    measurement: Option<BBox>,
    covariance: Option<BoxCovariance>,
    update_ms: Option<f64>,
}

impl Sample {
    pub fn of(record: &Record, unix_time_s: f64) -> Self {
        let estimate = record.estimate.as_ref();
        Self {
            frame: record.frame,
            time_s: record.time_s,
            unix_time_s,
            target: record.target.0,
            state: Some(estimate.map_or(TrackState::Lost, |e| e.state)),
            class: record.class.clone(),
            doubt: estimate.and_then(|e| e.doubt),
            bbox: estimate.map(|e| e.bbox),
            score: estimate.map(|e| e.score),
            prediction: estimate.and_then(|e| e.prediction),
            measurement: estimate.and_then(|e| e.measurement),
            covariance: estimate.and_then(|e| e.covariance),
            update_ms: record.update_ms,
        }
    }

    /// That there is no such target any more.
    pub fn gone(target: u64, frame: u64, time_s: f64, unix_time_s: f64) -> Self {
        Self {
            frame,
            time_s,
            unix_time_s,
            target,
            state: None,
            class: None,
            doubt: None,
            bbox: None,
            score: None,
            prediction: None,
            measurement: None,
            covariance: None,
            update_ms: None,
        }
    }

    /// Whether the target is taken to be there: measured, followed in doubt, or hidden for the moment.
    pub fn is_present(&self) -> bool {
        match self.state {
            Some(TrackState::Tracking | TrackState::Unsure | TrackState::Occluded) => true,
            Some(TrackState::Lost) | None => false,
        }
    }

    /// The JSON of a frame.
    pub fn json(&self) -> Vec<u8> {
        to_json(&self.object(None))
    }

    /// The JSON of a change from the state `previous`; none where the target is new.
    pub fn change_json(&self, previous: Option<TrackState>) -> Vec<u8> {
        to_json(&self.object(Some(previous.map(TrackState::as_str))))
    }

    fn object(&self, previous: Option<Option<&'static str>>) -> Object<'_> {
        Object {
            schema: TARGET_SCHEMA,
            frame: self.frame,
            time_s: self.time_s,
            unix_time_s: self.unix_time_s,
            target: self.target,
            state: self.state.map_or("gone", TrackState::as_str),
            class: self.class.as_ref().map(Class::as_str),
            doubt: self.doubt.map(Doubt::as_str),
            previous,
            present: self.is_present(),
            r#box: self.bbox.map(ltwh),
            score: self.score,
            prediction: self.prediction.map(ltwh),
            measurement: self.measurement.map(ltwh),
            covariance: self.covariance.as_ref().map(Rows),
            update_ms: self.update_ms,
        }
    }
}

/// Names that `trajectory.jsonl` has mean the same here.
#[derive(Serialize)]
struct Object<'a> {
    schema: &'static str,
    frame: u64,
    time_s: f64,
    unix_time_s: f64,
    target: u64,
    state: &'static str,
    class: Option<&'a str>,
    doubt: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    previous: Option<Option<&'static str>>,
    present: bool,
    r#box: Option<[f64; 4]>,
    score: Option<f64>,
    prediction: Option<[f64; 4]>,
    measurement: Option<[f64; 4]>,
    covariance: Option<Rows<'a>>,
    update_ms: Option<f64>,
}

/// The covariance row by row.
struct Rows<'a>(&'a BoxCovariance);

impl Serialize for Rows<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut rows = serializer.serialize_seq(Some(4))?;
        for row in 0..4 {
            rows.serialize_element(&[0, 1, 2, 3].map(|column| self.0[(row, column)]))?;
        }
        rows.end()
    }
}

/// Which targets are there.
#[derive(Serialize)]
pub(super) struct Present {
    pub schema: &'static str,
    pub frame: u64,
    pub time_s: f64,
    pub unix_time_s: f64,
    pub present: usize,
    pub targets: Vec<u64>,
}

/// What is run.
#[derive(Serialize)]
pub(super) struct RunMessage<'a> {
    pub schema: &'static str,
    pub version: &'static str,
    pub input: &'a str,
    pub width: usize,
    pub height: usize,
    pub tracker: &'a str,
    pub detector: Option<&'a str>,
    pub every: String,
}

/// As JSON; numbers that are none are `null`.
pub(super) fn to_json(value: &impl Serialize) -> Vec<u8> {
    // What is serialised here has nothing that can fail.
    serde_json::to_vec(value).unwrap_or_default()
}

fn ltwh(b: BBox) -> [f64; 4] {
    [b.left(), b.top(), b.width(), b.height()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use pursuit_tracking::{Estimate, TargetId};
    use serde_json::Value;

    fn record(estimate: Option<Estimate>) -> Record {
        Record { frame: 7, time_s: 0.28, target: TargetId(3), class: None, estimate, update_ms: Some(1.5) }
    }

    fn estimate() -> Estimate {
        let bbox = BBox::from_ltwh(1.5, 2.0, 30.0, 40.0);
        let covariance = Some(BoxCovariance::from_fn(|row, column| (10 * row + column) as f64));
        Estimate { prediction: Some(bbox), covariance, ..Estimate::started(0.28, bbox, 0.75) }
    }

    #[test]
    fn names_shared_with_the_json_lines_mean_the_same() {
        for estimate in [None, Some(estimate())] {
            let record = Record { class: Some("person".into()), ..record(estimate) };
            let line = crate::sinks::jsonl_object(&record);
            let message: Value = serde_json::from_slice(&Sample::of(&record, 1.0e9).json()).unwrap();
            let own = ["schema", "unix_time_s", "present"];
            for (name, value) in message.as_object().unwrap().iter().filter(|(name, _)| !own.contains(&name.as_str())) {
                assert_eq!(line.get(name), Some(value), "{name}");
            }
            let left_out = line.as_object().unwrap().keys().filter(|name| message.get(name).is_none());
            assert_eq!(left_out.collect::<Vec<_>>(), ["diagnostics", "next"]);
        }
    }

    #[test]
    fn a_change_says_what_was_before() {
        let sample = Sample::of(&record(Some(estimate())), 1.0e9);
        let value = |json: Vec<u8>| serde_json::from_slice::<Value>(&json).unwrap();
        assert!(value(sample.json()).get("previous").is_none());
        assert_eq!(value(sample.change_json(None))["previous"], Value::Null);
        let found_again = value(sample.change_json(Some(TrackState::Lost)));
        assert_eq!((&found_again["previous"], &found_again["state"]), (&"lost".into(), &"tracking".into()));
        assert_eq!(found_again["present"], true);
        let unsure = Sample::of(&record(Some(Estimate { state: TrackState::Unsure, ..estimate() })), 1.0e9);
        let unsure = value(unsure.change_json(Some(TrackState::Occluded)));
        assert_eq!((&unsure["previous"], &unsure["state"]), (&"occluded".into(), &"unsure".into()));
        assert_eq!(unsure["present"], true);
        let gone = value(Sample::gone(3, 8, 0.32, 1.0e9).change_json(Some(TrackState::Occluded)));
        assert_eq!((&gone["state"], &gone["present"], &gone["box"]), (&"gone".into(), &false.into(), &Value::Null));
    }

    #[test]
    fn numbers_that_are_none_are_null() {
        let sample = Sample::of(&record(Some(Estimate { score: f64::NAN, ..estimate() })), 1.0e9);
        assert_eq!(serde_json::from_slice::<Value>(&sample.json()).unwrap()["score"], Value::Null);
    }
}
