//! Discovery messages of Home Assistant (its integration `mqtt`): what there is, and how its messages are read.
//!
//! What there is does not change with the targets: how many are in the picture and in each zone, and whether anybody is, of all and of
//! each class that was ever seen, and a picture of the last thing that happened. They are called `count` and `present`, of people
//! `person_count` and `person_present`, of a zone `door_count`, of people in it `door_person_count`.

use crate::events::Zone;
use pursuit_publish::{Message, OwnTopics};
use pursuit_tracking::Class;
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Where Home Assistant listens unless it is told otherwise.
const DISCOVERY: &str = "homeassistant";

/// Makes the messages of one publisher.
pub(super) struct HomeAssistant {
    /// The prefix of topics as a name.
    node: String,
    prefix: String,
    device: Value,
    /// Places and classes that were told of.
    told: BTreeSet<(Option<String>, Option<String>)>,
}

impl HomeAssistant {
    pub fn new(prefix: &str) -> Self {
        let node = plain(prefix);
        let device = json!({
            "identifiers": [node],
            "name": prefix,
            "manufacturer": "pursuit",
            "sw_version": env!("CARGO_PKG_VERSION"),
        });
        Self { node, prefix: prefix.to_owned(), device, told: BTreeSet::new() }
    }

    /// What there is from the beginning besides places: a picture of what happened last. And that the sensor of former versions is
    /// no more, which counted what is hidden too.
    pub fn begin(&self) -> [Message; 2] {
        let picture = json!({
            "name": "What happened last",
            "image_topic": self.picture_topic(),
            "content_type": "image/jpeg",
        });
        let former = Message { payload: Vec::new(), ..self.config("sensor", "present", json!({})) };
        [self.config("image", "last_event", picture), former]
    }

    /// What is no more of what was told before: former versions told of every target, and zones come and go. What is told of classes
    /// stays, for they may be seen again.
    pub fn leftovers(&self, zones: &[Zone]) -> OwnTopics {
        let (prefix, zones) =
            (self.prefix.clone(), zones.iter().map(|zone| zone.name.clone()).collect::<BTreeSet<_>>());
        OwnTopics::those(format!("{DISCOVERY}/+/{}/+/config", self.node), move |config| {
            let Ok(config) = serde_json::from_slice::<Value>(config) else { return false };
            // Another prefix may have the same name inside Home Assistant: the topics that are listened to tell them apart.
            let topic =
                config["state_topic"].as_str().and_then(|topic| topic.strip_prefix(&*prefix)?.strip_prefix('/'));
            let Some(topic) = topic else { return false };
            topic.starts_with("targets/") || topic.strip_prefix("zones/").is_some_and(|zone| !zones.contains(zone))
        })
    }

    /// Where the picture of what happened last is.
    pub fn picture_topic(&self) -> String {
        format!("{}/picture", self.prefix)
    }

    /// How many are at a place – the picture or a zone – whose counts are told under `topic`, and whether anybody is; of all, or
    /// of a class. Nothing, where that was told already.
    pub fn place(&mut self, zone: Option<&str>, class: Option<&Class>, topic: &str) -> Vec<Message> {
        if !self.told.insert((zone.map(str::to_owned), class.map(|c| c.as_str().to_owned()))) {
            return Vec::new();
        }
        let words: Vec<&str> = zone.into_iter().chain(class.map(Class::as_str)).collect();
        let (id, name) = (words.iter().map(|word| plain(word) + "_").collect::<String>(), words.join(" "));
        let name = |what: &str| {
            let text = format!("{name} {what}");
            let text = text.trim();
            let mut letters = text.chars();
            letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
        };
        let many = match class {
            // A word in JSON is one in the language of templates.
            Some(class) => format!("value_json.classes.get({}, 0)", json!(class.as_str())),
            None => "value_json.count".to_owned(),
        };
        let count = json!({
            "name": name("count"),
            "state_topic": topic,
            "value_template": format!("{{{{ {many} }}}}"),
            "state_class": "measurement",
            "json_attributes_topic": topic,
        });
        let present = json!({
            "name": name("present"),
            "device_class": "occupancy",
            "state_topic": topic,
            "value_template": format!("{{{{ 'ON' if {many} > 0 else 'OFF' }}}}"),
        });
        vec![
            self.config("sensor", &format!("{id}count"), count),
            self.config("binary_sensor", &format!("{id}present"), present),
        ]
    }

    fn config(&self, kind: &str, what: &str, mut own: Value) -> Message {
        own["unique_id"] = json!(format!("{}_{what}", self.node));
        own["availability_topic"] = json!(format!("{}/status", self.prefix));
        own["device"] = self.device.clone();
        own["origin"] = json!({ "name": "pursuit", "sw_version": env!("CARGO_PKG_VERSION") });
        Message::retained(format!("{DISCOVERY}/{kind}/{}/{what}/config", self.node), own.to_string())
    }
}

/// A text as a part of topics and names inside Home Assistant: letters, digits, `-` and `_`.
fn plain(text: &str) -> String {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-';
    text.chars().map(|c| if fits(c) { c } else { '_' }).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn topics_and_names_are_what_home_assistant_takes() {
        let mut home = HomeAssistant::new("watch/front yard");
        let phone: Class = "cell phone".into();
        let mut messages = home.begin().to_vec();
        assert!(messages[1].payload.is_empty(), "the former sensor is forgotten");
        messages.pop();
        for (zone, class) in [(None, None), (None, Some(&phone)), (Some("door"), None), (Some("door"), Some(&phone))] {
            messages.extend(home.place(zone, class, "p/counts"));
            assert!(home.place(zone, class, "p/counts").is_empty(), "told once");
        }
        let mut names = Vec::new();
        for message in &messages {
            let levels: Vec<&str> = message.topic.split('/').collect();
            let [DISCOVERY, "sensor" | "binary_sensor" | "image", node, object, "config"] = levels[..] else {
                panic!("{}", message.topic)
            };
            let fits = |text: &str| text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
            assert!(fits(node) && fits(object) && message.retain, "{}", message.topic);
            let config: Value = serde_json::from_slice(&message.payload).unwrap();
            assert_eq!(config["availability_topic"], "watch/front yard/status");
            names.push((object.to_owned(), config["name"].as_str().unwrap().to_owned()));
        }
        let objects: BTreeSet<&str> = names.iter().map(|n| &*n.0).collect();
        assert_eq!(objects.len(), messages.len());
        for (object, name) in [
            ("count", "Count"),
            ("cell_phone_count", "Cell phone count"),
            ("door_present", "Door present"),
            ("door_cell_phone_present", "Door cell phone present"),
        ] {
            assert!(names.contains(&(object.to_owned(), name.to_owned())), "{names:?}");
        }
    }

    #[test]
    fn a_class_is_quoted_in_templates() {
        let mut home = HomeAssistant::new("p");
        let odd: Class = "a\"}}b".into();
        let config: Value = serde_json::from_slice(&home.place(None, Some(&odd), "p/counts")[0].payload).unwrap();
        assert_eq!(config["value_template"], "{{ value_json.classes.get(\"a\\\"}}b\", 0) }}");
    }
}
