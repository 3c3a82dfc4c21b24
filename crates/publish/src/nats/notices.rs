use async_nats::{Event, ServerError};

/// What the server says beside messages.
#[derive(Debug, Clone, Default)]
pub(crate) struct Notices {
    /// Whether the connection is over.
    pub is_over: bool,
    /// What it last objected to.
    pub objection: Option<String>,
    /// How many messages it did not let through, and the subject of the first.
    pub denials: u64,
    pub denied: Option<String>,
    /// Whether it allows no inbox.
    pub denies_inbox: bool,
}

impl Notices {
    pub fn note(&mut self, event: Event) {
        match event {
            Event::Disconnected | Event::Closed => self.is_over = true,
            Event::ServerError(ServerError::Other(text)) => self.object(text),
            Event::ServerError(error) => self.objection = Some(error.to_string()),
            _ => {}
        }
    }

    /// `Permissions Violation for Publish to "a.b"`, among others.
    fn object(&mut self, text: String) {
        let low = text.to_ascii_lowercase();
        match low.strip_prefix("permissions violation for ") {
            Some(what) if what.contains("\"_inbox.") => self.denies_inbox = true,
            Some(what) if what.starts_with("publish") => {
                self.denials += 1;
                let subject = text.split('"').nth(1).unwrap_or("what is sent");
                self.denied.get_or_insert_with(|| subject.to_owned());
            }
            _ => self.objection = Some(text),
        }
    }

    /// Why it is over, where it is.
    pub fn end(&self) -> Option<String> {
        let reason = || match &self.objection {
            Some(objection) => format!("the broker says: {objection}"),
            None => "it closed the connection".to_owned(),
        };
        self.is_over.then(reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn permission_errors_are_told_apart() {
        let mut notices = Notices::default();
        let mut say = |text: &str| {
            notices.note(Event::ServerError(ServerError::Other(text.to_owned())));
            notices.clone()
        };
        let said = say("Permissions Violation for Publish to \"Yard.status\"");
        assert_eq!((said.denials, said.denied.as_deref(), said.denies_inbox), (1, Some("Yard.status"), false));
        assert!(say("Permissions Violation for Subscription to \"_INBOX.x\"").denies_inbox);
        let said = say("Permissions Violation for Publish to \"_INBOX.x\"");
        assert_eq!((said.denials, said.objection.as_deref()), (1, None));
        assert_eq!(say("Stale Connection").end(), None);
        notices.note(Event::Disconnected);
        assert_eq!(notices.end().as_deref(), Some("the broker says: Stale Connection"));
    }
}
