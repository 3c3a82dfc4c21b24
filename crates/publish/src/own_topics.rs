use std::fmt;
use std::sync::Arc;

/// Says of a payload whether it is left over.
type IsLeft = dyn Fn(&[u8]) -> bool + Send + Sync;

/// Topics that are a publisher's alone. What one before it left retained there is made forgotten at the first connection.
#[derive(Clone)]
pub struct OwnTopics {
    filter: String,
    is_left: Arc<IsLeft>,
}

impl OwnTopics {
    /// Everything under topics that this filter of MQTT means (`yard/targets/+/state`).
    pub fn all(filter: impl Into<String>) -> Self {
        Self::those(filter, |_| true)
    }

    /// Under such topics the messages whose payload is said to be left over.
    pub fn those(filter: impl Into<String>, is_left: impl Fn(&[u8]) -> bool + Send + Sync + 'static) -> Self {
        Self { filter: filter.into(), is_left: Arc::new(is_left) }
    }

    /// What to subscribe to.
    pub(crate) fn filter(&self) -> &str {
        &self.filter
    }

    /// Whether that retained message is left over from a former publisher.
    pub(crate) fn is_left(&self, topic: &str, payload: &[u8]) -> bool {
        is_meant(&self.filter, topic) && (self.is_left)(payload)
    }
}

impl fmt::Debug for OwnTopics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("OwnTopics").field(&self.filter).finish()
    }
}

/// Whether a filter means a topic (MQTT 3.1.1, section 4.7): `+` stands for one level, `#` at the end for all that follow.
fn is_meant(filter: &str, topic: &str) -> bool {
    let mut levels = topic.split('/');
    for wanted in filter.split('/') {
        if wanted == "#" {
            return true;
        }
        if !levels.next().is_some_and(|level| wanted == "+" || wanted == level) {
            return false;
        }
    }
    levels.next().is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_mean_what_mqtt_says() {
        for (filter, topic, is_so) in [
            ("a/+/c", "a/b/c", true),
            ("a/+/c", "a/b/d", false),
            ("a/+/c", "a/b/c/d", false),
            ("a/+/c", "a/b", false),
            ("a/#", "a/b/c", true),
            ("a/#", "b/b/c", false),
            ("a", "a", true),
            ("+", "", true),
        ] {
            assert_eq!(is_meant(filter, topic), is_so, "{filter} {topic}");
        }
    }

    #[test]
    fn only_what_is_said_to_be_left_over_is() {
        let own = OwnTopics::those("a/+", |payload| payload == b"old");
        assert!(own.is_left("a/b", b"old") && !own.is_left("a/b", b"new") && !own.is_left("b/b", b"old"));
        assert_eq!(format!("{own:?}"), "OwnTopics(\"a/+\")");
    }
}
