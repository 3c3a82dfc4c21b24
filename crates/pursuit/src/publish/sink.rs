use super::home_assistant::HomeAssistant;
use super::message::{PRESENT_SCHEMA, Present, RUN_SCHEMA, RunMessage, Sample, to_json};
use super::picture::{is_shown, picture_of};
use super::{Every, PublishFacts, PublishOptions};
use crate::RunError;
use crate::events::{EventMessage, Occupancy, Watched, Zone, counts};
use crate::run::{InputFacts, RecipeFacts};
use crate::sinks::{Moment, Sink};
use pursuit_address::Locator;
use pursuit_geometry::BBox;
use pursuit_imaging::Frame;
use pursuit_publish::{Broker, Message, Options, OwnTopics, PublishError, Publisher, Qos};
use pursuit_tracking::{TargetId, TrackState};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

/// Frames this much before their time, in seconds, are told of: clocks round.
const EARLY_S: f64 = 1e-3;

/// Publishes what becomes of the targets. It never waits for the broker: when that does not keep up, or is not there, the
/// oldest messages are dropped and counted.
pub struct PublishSink {
    publisher: Publisher<Sample>,
    every: Every,
    prefix: String,
    home: Option<HomeAssistant>,
    /// The last state of every target that there is, and when a frame of it was last told of.
    targets: BTreeMap<TargetId, Known>,
    /// The targets told to be there; none before the first frame.
    present: Option<Vec<u64>>,
    /// Who was told to be where: the whole picture, then each zone.
    occupancies: Vec<Occupancy>,
    /// Number and time of the last frame, and when it was looked at.
    last: (u64, f64, f64),
    facts: Arc<Mutex<PublishFacts>>,
    is_finished: bool,
}

#[derive(Clone, Copy)]
struct Known {
    state: TrackState,
    told_s: f64,
}

/// A broker and how it is told, checked, not connected to yet.
#[derive(Debug, Clone)]
pub(crate) struct Publication {
    broker: Broker,
    prefix: String,
    options: PublishOptions,
}

impl Publication {
    /// Reads the address. `name` takes the place of a prefix that it does not give.
    ///
    /// # Errors
    /// [`RunError::Usage`] for an address or an option that makes no sense.
    pub fn new(address: &Locator, options: &PublishOptions, name: &str) -> Result<Self, RunError> {
        let wrong = |error: PublishError| RunError::usage(error.to_string());
        let broker = Broker::parse(address.clone()).map_err(wrong)?;
        broker.scheme.check().map_err(wrong)?;
        if options.qos.is_some_and(|qos| Qos::of(qos).is_none()) {
            return Err(RunError::usage("the quality of service of messages is 0, 1 or 2"));
        }
        if !broker.scheme.is_mqtt() {
            check_for_nats(options)?;
        }
        if options.buffer.is_some_and(|buffer| !(1..=10_000_000).contains(&buffer)) {
            return Err(RunError::usage("1 to 10000000 messages can wait for the broker"));
        }
        let broker = Broker { ca_file: options.ca_file.clone(), ..broker };
        // Dots separate the levels of NATS.
        let name = if broker.scheme.is_mqtt() { name.to_owned() } else { name.replace('.', "-") };
        let prefix = broker.prefix.clone().unwrap_or_else(|| format!("pursuit/{name}"));
        Ok(Self { broker, prefix, options: options.clone() })
    }

    /// Begins to connect. `zones` are those that are watched.
    ///
    /// # Errors
    /// What this build cannot reach, and certificates that are of no use.
    pub fn start(&self, input: &InputFacts, recipe: &RecipeFacts, zones: &[Zone]) -> Result<PublishSink, RunError> {
        let mut options = Options::new(format!("{}/status", self.prefix));
        options.capacity = self.options.buffer.unwrap_or(options.capacity);
        let home = self.options.discovery.map(|_| HomeAssistant::new(&self.prefix));
        let own = ["targets/+/state", "zones/+", "counts"].map(|own| OwnTopics::all(format!("{}/{own}", self.prefix)));
        options.own_topics = own.into_iter().chain(home.iter().map(|home| home.leftovers(zones))).collect();
        let qos = self.options.qos.and_then(Qos::of).unwrap_or(Qos::AtMostOnce);
        let (every, prefix) = (self.options.every(), self.prefix.clone());
        let encode = move |sample: Sample| Message {
            topic: format!("{prefix}/targets/{}/frame", sample.target),
            payload: sample.json(),
            qos,
            retain: false,
        };
        let facts = PublishFacts {
            broker: self.broker.to_string(),
            prefix: self.prefix.clone(),
            every,
            messages: 0,
            dropped: 0,
            connections: 0,
            failed_attempts: 0,
        };
        let publisher =
            Publisher::start(self.broker.clone(), options, encode).map_err(|e| RunError::usage(e.to_string()))?;
        let run = RunMessage {
            schema: RUN_SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            input: &input.name,
            width: input.width,
            height: input.height,
            tracker: &recipe.tracker,
            detector: recipe.detector.as_deref(),
            every: every.to_string(),
        };
        publisher.push(Message::retained(format!("{}/run", self.prefix), to_json(&run)));
        home.iter().flat_map(HomeAssistant::begin).for_each(|message| publisher.push(message));
        let sink = PublishSink {
            publisher,
            every,
            prefix: self.prefix.clone(),
            home,
            targets: BTreeMap::new(),
            present: None,
            occupancies: Vec::new(),
            last: (0, 0.0, 0.0),
            facts: Arc::new(Mutex::new(facts)),
            is_finished: false,
        };
        Ok(sink)
    }
}

/// # Errors
/// What NATS has not.
fn check_for_nats(options: &PublishOptions) -> Result<(), RunError> {
    if options.qos == Some(2) {
        return Err(RunError::usage(
            "NATS delivers at most once (0) or at least once (1); MQTT alone has a quality of 2",
        ));
    }
    if options.discovery.is_some() {
        return Err(RunError::usage("Home Assistant listens to MQTT; publish to mqtt://… for it to discover anything"));
    }
    Ok(())
}

impl PublishSink {
    /// What has become of the messages, brought up to date at the end.
    pub(crate) fn facts(&self) -> Arc<Mutex<PublishFacts>> {
        self.facts.clone()
    }

    fn check(&self) -> Result<(), RunError> {
        self.publisher.check().map_err(|error| match error {
            PublishError::Refused { broker, reason } => {
                RunError::output(Path::new(&broker))(std::io::Error::other(reason))
            }
            other => RunError::usage(other.to_string()),
        })
    }

    fn change(&self, sample: &Sample, previous: Option<TrackState>) {
        let topic = format!("{}/targets/{}/state", self.prefix, sample.target);
        self.publisher.push(Message::retained(topic, sample.change_json(previous)));
    }

    /// Tells that a target is no more, and makes the broker forget it.
    fn end(&self, sample: &Sample, previous: TrackState) {
        let topic = format!("{}/targets/{}/state", self.prefix, sample.target);
        let last = Message::retained(topic.clone(), sample.change_json(Some(previous)));
        self.publisher.push(Message { retain: false, ..last });
        self.publisher.push(Message::retained(topic, Vec::new()));
    }

    /// Tells what happened, and who is where, where that is news.
    fn tell_watched(&mut self, frame: &Frame, watched: &Watched) {
        self.tell_home(frame, watched);
        for event in &watched.events {
            let (topic, payload) = (format!("{}/events", self.prefix), EventMessage::of(event, watched).json());
            self.publisher.push(Message { retain: false, ..Message::retained(topic, payload) });
        }
        for (index, now) in watched.occupancies.iter().enumerate() {
            if self.occupancies.get(index) != Some(now) {
                self.publisher.push(Message::retained(topic_of(&self.prefix, now), counts(now, self.last)));
            }
        }
        self.occupancies.clone_from(&watched.occupancies);
    }

    /// Tells Home Assistant of places and classes that are new, and shows what happened.
    fn tell_home(&mut self, frame: &Frame, watched: &Watched) {
        let Some(home) = &mut self.home else { return };
        // Who is where changes now and then, and with it alone what there is to be told of.
        let has_news = self.occupancies != watched.occupancies;
        let classes = || watched.occupancies.iter().flat_map(|o| &o.present).filter_map(|(_, class)| class.as_ref());
        for occupancy in watched.occupancies.iter().filter(|_| has_news) {
            let (zone, topic) = (occupancy.zone.as_deref(), topic_of(&self.prefix, occupancy));
            let of_all = home.place(zone, None, &topic);
            let of_classes = classes().flat_map(|class| home.place(zone, Some(class), &topic)).collect::<Vec<_>>();
            of_all.into_iter().chain(of_classes).for_each(|message| self.publisher.push(message));
        }
        let shown: Vec<BBox> = watched.events.iter().filter(|e| is_shown(e.kind)).filter_map(|e| e.bbox).collect();
        if let (false, Some(bytes)) = (shown.is_empty(), picture_of(frame, &shown)) {
            self.publisher.replace(Message::retained(home.picture_topic(), bytes));
        }
    }

    /// Tells which targets are there, where that is news.
    fn tell_present(&mut self) {
        let there = self.targets.iter().filter(|(_, known)| known.state != TrackState::Lost);
        let targets: Vec<u64> = there.map(|(id, _)| id.0).collect();
        if self.present.as_ref() == Some(&targets) {
            return;
        }
        self.present = Some(targets.clone());
        let ((frame, time_s, unix_time_s), present) = (self.last, targets.len());
        let message = Present { schema: PRESENT_SCHEMA, frame, time_s, unix_time_s, present, targets };
        self.publisher.push(Message::retained(format!("{}/present", self.prefix), to_json(&message)));
    }
}

/// Where it is told who is in a zone, or in the whole picture.
fn topic_of(prefix: &str, occupancy: &Occupancy) -> String {
    match &occupancy.zone {
        Some(zone) => format!("{prefix}/zones/{zone}"),
        None => format!("{prefix}/counts"),
    }
}

impl Sink for PublishSink {
    fn write(&mut self, moment: &Moment<'_>) -> Result<(), RunError> {
        let Moment { frame, records, .. } = *moment;
        self.check()?;
        let unix_time_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
        self.last = (frame.index(), frame.time_s(), unix_time_s);
        let (mut has_changed, mut due) = (self.present.is_none(), Vec::with_capacity(records.len()));
        for record in records {
            let state = record.estimate.as_ref().map_or(TrackState::Lost, |e| e.state);
            let known = self.targets.get(&record.target).copied();
            let mut told_s = known.map_or(f64::NEG_INFINITY, |k| k.told_s);
            let is_due = match self.every {
                Every::Frame => true,
                Every::State => false,
                // A clock that was set back tells anew.
                Every::Seconds(s) => !(0.0..s - EARLY_S).contains(&(record.time_s - told_s)),
            };
            if is_due {
                told_s = record.time_s;
                due.push(Sample::of(record, unix_time_s));
            }
            if known.is_none_or(|k| k.state != state) {
                has_changed = true;
                self.change(&Sample::of(record, unix_time_s), known.map(|k| k.state));
            }
            self.targets.insert(record.target, Known { state, told_s });
        }
        if self.targets.len() > records.len() {
            let gone = |id: &TargetId| !records.iter().any(|r| r.target == *id);
            let ended: Vec<(TargetId, Known)> =
                self.targets.iter().filter(|(id, _)| gone(id)).map(|(id, known)| (*id, *known)).collect();
            for (id, known) in ended {
                self.targets.remove(&id);
                self.end(&Sample::gone(id.0, frame.index(), frame.time_s(), unix_time_s), known.state);
                has_changed = true;
            }
        }
        if has_changed {
            self.tell_present();
        }
        if let Some(watched) = moment.watched() {
            self.tell_watched(frame, watched);
        }
        self.publisher.extend(due);
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RunError> {
        if std::mem::replace(&mut self.is_finished, true) {
            return Ok(());
        }
        // Nobody watches any more: what was there is told to be gone, and nothing of it stays with the broker.
        let (frame, time_s, unix_time_s) = self.last;
        for (id, known) in std::mem::take(&mut self.targets) {
            self.end(&Sample::gone(id.0, frame, time_s, unix_time_s), known.state);
        }
        if self.present.is_some() {
            self.tell_present();
        }
        for occupancy in std::mem::take(&mut self.occupancies) {
            self.publisher.push(Message::retained(topic_of(&self.prefix, &occupancy), Vec::new()));
        }
        let counts = self.publisher.finish();
        if counts.dropped > 0 {
            let (all, dropped) = (counts.messages, counts.dropped);
            tracing::warn!("{dropped} of {all} messages were dropped: the broker did not take them in time");
        }
        let mut facts = self.facts.lock().unwrap_or_else(PoisonError::into_inner);
        facts.messages = counts.messages;
        facts.dropped = counts.dropped;
        facts.connections = counts.connections;
        facts.failed_attempts = counts.failed_attempts;
        drop(facts);
        self.check()
    }
}
