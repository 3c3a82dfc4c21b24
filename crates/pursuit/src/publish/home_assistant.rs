//! Discovery messages of Home Assistant (its integration `mqtt`): what there is, and how its messages are read.

use pursuit_publish::Message;
use serde_json::{Value, json};

/// Where Home Assistant listens unless it is told otherwise.
const DISCOVERY: &str = "homeassistant";

/// Makes the messages of one publisher.
pub(super) struct HomeAssistant {
    /// The prefix of topics as a name.
    node: String,
    prefix: String,
    device: Value,
    /// Whether there are messages between changes of state.
    has_frames: bool,
}

impl HomeAssistant {
    pub fn new(prefix: &str, has_frames: bool) -> Self {
        let fits = |c: char| c.is_ascii_alphanumeric() || c == '-';
        let node: String = prefix.chars().map(|c| if fits(c) { c } else { '_' }).collect();
        let device = json!({
            "identifiers": [node],
            "name": prefix,
            "manufacturer": "pursuit",
            "sw_version": env!("CARGO_PKG_VERSION"),
        });
        Self { node, prefix: prefix.to_owned(), device, has_frames }
    }

    /// How many targets are there.
    pub fn count(&self) -> Message {
        let own = json!({
            "name": "Targets present",
            "state_topic": format!("{}/present", self.prefix),
            "value_template": "{{ value_json.present }}",
            "state_class": "measurement",
        });
        self.config("sensor", "present", own)
    }

    /// Whether a target is there, where, and how sure that is.
    pub fn target(&self, target: u64) -> [Message; 4] {
        let state = format!("{}/targets/{target}/state", self.prefix);
        let newest = if self.has_frames { format!("{}/targets/{target}/frame", self.prefix) } else { state.clone() };
        let sensor = |what: &str, name: &str, unit: &str, template: String| {
            let own = json!({
                "name": format!("Target {target} {name}"),
                "state_topic": newest,
                "value_template": template,
                "unit_of_measurement": unit,
                "state_class": "measurement",
            });
            self.config("sensor", &format!("target_{target}_{what}"), own)
        };
        let middle = |from: usize, size: usize| {
            format!(
                "{{{{ (value_json.box[{from}] + value_json.box[{size}] / 2) | round(1) if value_json.box else none }}}}"
            )
        };
        let score = "{{ (100 * value_json.score) | round(1) if value_json.score is not none else none }}".to_owned();
        let present = json!({
            "name": format!("Target {target}"),
            "device_class": "occupancy",
            "state_topic": state,
            "value_template": "{{ 'ON' if value_json.present else 'OFF' }}",
            "json_attributes_topic": state,
        });
        [
            self.config("binary_sensor", &format!("target_{target}"), present),
            sensor("x", "x", "px", middle(0, 2)),
            sensor("y", "y", "px", middle(1, 3)),
            sensor("score", "score", "%", score),
        ]
    }

    /// Home Assistant forgets a target.
    pub fn forget(&self, target: u64) -> [Message; 4] {
        self.target(target).map(|config| Message { payload: Vec::new(), ..config })
    }

    fn config(&self, kind: &str, what: &str, mut own: Value) -> Message {
        own["unique_id"] = json!(format!("{}_{what}", self.node));
        own["availability_topic"] = json!(format!("{}/status", self.prefix));
        own["device"] = self.device.clone();
        own["origin"] = json!({ "name": "pursuit", "sw_version": env!("CARGO_PKG_VERSION") });
        Message::retained(format!("{DISCOVERY}/{kind}/{}/{what}/config", self.node), own.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_and_names_are_what_home_assistant_takes() {
        let home = HomeAssistant::new("watch/front yard", true);
        let messages: Vec<Message> = home.target(3).into_iter().chain([home.count()]).collect();
        let mut names = Vec::new();
        for message in &messages {
            let levels: Vec<&str> = message.topic.split('/').collect();
            let [DISCOVERY, "sensor" | "binary_sensor", node, object, "config"] = levels[..] else {
                panic!("{}", message.topic)
            };
            let fits = |text: &str| text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
            assert!(fits(node) && fits(object) && message.retain, "{}", message.topic);
            let config: Value = serde_json::from_slice(&message.payload).unwrap();
            assert_eq!(config["availability_topic"], "watch/front yard/status");
            names.push(config["unique_id"].to_string());
        }
        assert_eq!(messages[0].topic, "homeassistant/binary_sensor/watch_front_yard/target_3/config");
        names.sort();
        names.dedup();
        assert_eq!(names.len(), messages.len());
        assert!(home.forget(3).iter().zip(&messages).all(|(f, m)| f.topic == m.topic && f.payload.is_empty()));
    }

    #[test]
    fn places_come_from_the_newest_message_there_is() {
        let x = |has_frames| HomeAssistant::new("p", has_frames).target(1)[1].payload.clone();
        assert_eq!(serde_json::from_slice::<Value>(&x(true)).unwrap()["state_topic"], "p/targets/1/frame");
        assert_eq!(serde_json::from_slice::<Value>(&x(false)).unwrap()["state_topic"], "p/targets/1/state");
    }
}
