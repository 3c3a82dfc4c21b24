use pursuit_media::MediaError;

/// Frames of the input that could not be had.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Damage {
    /// How often something could not be read; frames that needed it may be missing besides.
    pub count: u64,
    /// What and why, of the first of them.
    pub messages: Vec<String>,
    first: Option<MediaError>,
}

impl Damage {
    /// More messages than this help nobody.
    const MOST_MESSAGES: usize = 20;

    pub(super) fn add(&mut self, error: MediaError) {
        self.count += 1;
        if self.messages.len() < Self::MOST_MESSAGES {
            self.messages.push(error.to_string());
        }
        self.first.get_or_insert(error);
    }

    /// The first.
    pub fn first(&self) -> Option<&MediaError> {
        self.first.as_ref()
    }
}
