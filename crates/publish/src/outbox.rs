use crate::Message;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use tokio::sync::{Notify, watch};

/// What waits to be sent, as the connection sees it.
pub(crate) trait Outbox: Send + Sync {
    /// The oldest message.
    fn take(&self) -> Option<Message>;

    /// What is retained now and does not wait to be sent anyway: a broker that lost its memory is told anew.
    fn documents(&self) -> Vec<Message>;

    /// Whether something is retained under this topic now.
    fn holds(&self, topic: &str) -> bool;

    /// Messages that a broken connection did not take, the oldest first; they wait again before all others.
    fn put_back(&self, messages: Vec<Message>);

    /// That many messages are lost.
    fn lose(&self, messages: u64);

    /// Told when there is something new.
    fn news(&self) -> &Notify;

    /// When the last message came in, once it has.
    fn ended(&self) -> watch::Receiver<Option<Instant>>;
}

/// A bounded queue: of more than its capacity the oldest are dropped and counted. Nobody waits for it.
pub(crate) struct Queue<T> {
    waiting: Mutex<Waiting<T>>,
    capacity: usize,
    encode: Box<dyn Fn(T) -> Message + Send + Sync>,
    news: Notify,
    ended: watch::Sender<Option<Instant>>,
}

struct Waiting<T> {
    items: VecDeque<Item<T>>,
    documents: BTreeMap<String, Message>,
    taken_in: u64,
    dropped: u64,
}

enum Item<T> {
    /// Not encoded yet.
    Raw(T),
    Ready(Message),
}

impl<T> Queue<T> {
    pub fn new(capacity: usize, encode: Box<dyn Fn(T) -> Message + Send + Sync>) -> Self {
        let waiting = Waiting { items: VecDeque::new(), documents: BTreeMap::new(), taken_in: 0, dropped: 0 };
        let ended = watch::Sender::new(None);
        Self { waiting: Mutex::new(waiting), capacity: capacity.max(1), encode, news: Notify::new(), ended }
    }

    fn lock(&self) -> MutexGuard<'_, Waiting<T>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes items in, to be encoded when it is their turn.
    pub fn extend(&self, items: impl IntoIterator<Item = T>) {
        let mut waiting = self.lock();
        for item in items {
            waiting.add(Item::Raw(item), self.capacity);
        }
        drop(waiting);
        self.news.notify_one();
    }

    /// Takes a message in.
    pub fn push(&self, message: Message) {
        let mut waiting = self.lock();
        if message.retain {
            match message.payload.is_empty() {
                true => waiting.documents.remove(&message.topic),
                false => waiting.documents.insert(message.topic.clone(), message.clone()),
            };
        }
        waiting.add(Item::Ready(message), self.capacity);
        drop(waiting);
        self.news.notify_one();
    }

    /// Takes a message in, in place of those under its topic that still wait: of a picture the newest is enough.
    pub fn replace(&self, message: Message) {
        let mut waiting = self.lock();
        let before = waiting.items.len();
        waiting.items.retain(|item| !matches!(item, Item::Ready(old) if old.topic == message.topic));
        // What was replaced is not missing to anybody.
        waiting.taken_in -= (before - waiting.items.len()) as u64;
        drop(waiting);
        self.push(message);
    }

    /// Nothing more comes.
    pub fn end(&self) {
        self.ended.send_replace(Some(Instant::now()));
        self.news.notify_one();
    }

    /// Messages that came in, and those that are lost.
    pub fn counts(&self) -> (u64, u64) {
        let waiting = self.lock();
        // What is said again may be lost as often, and never came in.
        (waiting.taken_in, waiting.dropped.min(waiting.taken_in))
    }

    /// Gives up what still waits.
    pub fn abandon(&self) {
        let mut waiting = self.lock();
        waiting.dropped += waiting.items.len() as u64;
        waiting.items.clear();
    }
}

impl<T> Waiting<T> {
    fn add(&mut self, item: Item<T>, capacity: usize) {
        self.taken_in += 1;
        if self.items.len() >= capacity {
            self.items.pop_front();
            self.dropped += 1;
        }
        self.items.push_back(item);
    }
}

impl<T: Send> Outbox for Queue<T> {
    fn take(&self) -> Option<Message> {
        let item = self.lock().items.pop_front()?;
        Some(match item {
            Item::Raw(item) => (self.encode)(item),
            Item::Ready(message) => message,
        })
    }

    fn documents(&self) -> Vec<Message> {
        let waiting = self.lock();
        let coming: BTreeSet<&str> = waiting
            .items
            .iter()
            .filter_map(|item| match item {
                Item::Ready(message) if message.retain => Some(message.topic.as_str()),
                _ => None,
            })
            .collect();
        waiting.documents.values().filter(|d| !coming.contains(d.topic.as_str())).cloned().collect()
    }

    fn holds(&self, topic: &str) -> bool {
        self.lock().documents.contains_key(topic)
    }

    fn put_back(&self, messages: Vec<Message>) {
        let mut waiting = self.lock();
        for message in messages.into_iter().rev() {
            if waiting.documents.get(&message.topic).is_some_and(|d| d.payload == message.payload) {
                // Said anew by the next connection.
                continue;
            }
            if waiting.items.len() < self.capacity {
                waiting.items.push_front(Item::Ready(message));
            } else {
                waiting.dropped += 1;
            }
        }
    }

    fn lose(&self, messages: u64) {
        self.lock().dropped += messages;
    }

    fn news(&self) -> &Notify {
        &self.news
    }

    fn ended(&self) -> watch::Receiver<Option<Instant>> {
        self.ended.subscribe()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Qos;

    fn message(topic: &str, payload: &str) -> Message {
        Message { topic: topic.into(), payload: payload.into(), qos: Qos::AtMostOnce, retain: false }
    }

    fn queue(capacity: usize) -> Queue<u32> {
        Queue::new(capacity, Box::new(|n| message("n", &n.to_string())))
    }

    fn all(queue: &Queue<u32>) -> Vec<String> {
        std::iter::from_fn(|| queue.take()).map(|m| String::from_utf8(m.payload).unwrap()).collect()
    }

    #[test]
    fn the_oldest_are_dropped_and_counted() {
        let queue = queue(3);
        queue.extend(0..5);
        queue.push(message("m", "ready"));
        assert_eq!(queue.counts(), (6, 3));
        assert_eq!(all(&queue), ["3", "4", "ready"]);
        queue.extend(5..7);
        queue.abandon();
        assert_eq!((queue.counts(), all(&queue).len()), ((8, 5), 0));
    }

    #[test]
    fn of_a_topic_that_is_replaced_the_newest_waits() {
        let queue = queue(9);
        queue.push(message("m", "first"));
        queue.replace(Message::retained("picture", "old"));
        queue.push(message("m", "second"));
        queue.replace(Message::retained("picture", "new"));
        assert_eq!(queue.counts(), (3, 0));
        assert_eq!(all(&queue), ["first", "second", "new"]);
        assert_eq!(queue.documents(), [Message::retained("picture", "new")]);
    }

    #[test]
    fn undelivered_messages_come_first() {
        let queue = queue(3);
        queue.extend(2..4);
        queue.put_back(vec![message("n", "0"), message("n", "1")]);
        assert_eq!(queue.counts(), (2, 1));
        assert_eq!(all(&queue), ["1", "2", "3"]);
    }

    #[test]
    fn retained_messages_are_remembered_until_they_are_forgotten() {
        let queue = queue(2);
        queue.push(Message::retained("a", "1"));
        queue.push(Message::retained("b", "1"));
        assert!(queue.documents().is_empty(), "they wait to be sent anyway");
        assert_eq!(all(&queue).len(), 2);
        queue.push(Message::retained("a", "2"));
        let topics = |d: Vec<Message>| d.into_iter().map(|m| m.topic + &String::from_utf8(m.payload).unwrap());
        assert_eq!(topics(queue.documents()).collect::<Vec<_>>(), ["b1"]);
        assert_eq!(all(&queue), ["2"]);
        queue.put_back(vec![Message::retained("a", "2"), Message::retained("a", "1")]);
        assert_eq!(all(&queue), ["1"], "the newest is said anew anyway");
        queue.push(Message::retained("b", ""));
        assert_eq!(all(&queue), [""]);
        assert_eq!(topics(queue.documents()).collect::<Vec<_>>(), ["a2"]);
    }
}
