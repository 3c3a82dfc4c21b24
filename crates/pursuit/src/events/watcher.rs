use super::clips::ClipPlan;
use super::options::EventRules;
use super::switch::Switch;
use super::{Event, Kind, Occupancy, Reason, Watched};
use crate::{Record, RunError};
use pursuit_geometry::BBox;
use pursuit_tracking::{Class, TargetId, TrackState};
use std::collections::BTreeMap;
use std::time::{SystemTime, UNIX_EPOCH};

/// Says of each frame what happened in it and who is where.
pub(crate) struct Watcher {
    rules: EventRules,
    targets: BTreeMap<TargetId, Known>,
    plan: Option<ClipPlan>,
    watched: Watched,
}

/// What is known of a target.
#[derive(Debug)]
struct Known {
    class: Option<Class>,
    /// Whether it is seen, or was a moment ago.
    in_sight: Switch,
    /// Whether it was told of.
    has_appeared: bool,
    /// Where it was seen last.
    bbox: Option<BBox>,
    zones: Vec<Place>,
}

/// A target and a zone.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    inside: Switch,
    /// Whether its dwelling was told of.
    has_dwelt: bool,
}

/// What all events of a frame have in common.
#[derive(Clone, Copy)]
struct Now {
    frame: u64,
    time_s: f64,
    unix_time_s: f64,
}

impl Watcher {
    /// By these rules; `plan` says which clips are made.
    pub fn new(rules: EventRules, plan: Option<ClipPlan>) -> Self {
        let zones = rules.zones.iter().map(|zone| Occupancy { zone: Some(zone.name.clone()), ..Occupancy::default() });
        let occupancies = std::iter::once(Occupancy::default()).chain(zones).collect();
        Self { targets: BTreeMap::new(), plan, watched: Watched { occupancies, ..Watched::default() }, rules }
    }

    /// What is known of the frame looked at last.
    pub const fn watched(&self) -> &Watched {
        &self.watched
    }

    /// Looks at a frame.
    ///
    /// # Errors
    /// [`RunError::Output`] when a clip cannot be written down.
    pub fn look(&mut self, frame: u64, time_s: f64, records: &[Record]) -> Result<(), RunError> {
        let unix_time_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
        let now = Now { frame, time_s, unix_time_s };
        self.watched.events.clear();
        for record in records {
            let zones = self.rules.zones.len();
            let known = self.targets.entry(record.target).or_insert_with(|| Known::new(zones));
            known.look(record, &self.rules, now, &mut self.watched.events);
        }
        if self.targets.len() > records.len() {
            let gone = self.targets.extract_if(.., |id, _| !records.iter().any(|r| r.target == *id));
            for (id, mut known) in gone {
                known.end(id, &self.rules, now, &mut self.watched.events);
            }
        }
        self.count();
        if let Some(plan) = &mut self.plan {
            plan.go_on(time_s, &mut self.watched)?;
        }
        Ok(())
    }

    /// Who is where.
    fn count(&mut self) {
        for (number, occupancy) in self.watched.occupancies.iter_mut().enumerate() {
            occupancy.present.clear();
            occupancy.unseen.clear();
            for (id, known) in self.targets.iter().filter(|(_, known)| known.has_appeared) {
                // The first is the whole picture.
                let place = number.checked_sub(1).and_then(|zone| known.zones.get(zone));
                let is_seen = known.in_sight.is_on();
                if is_seen && place.is_none_or(|place| place.inside.is_on()) {
                    occupancy.present.push((*id, known.class.clone()));
                }
                let was_there =
                    || number == 0 || self.rules.zones.get(number - 1).is_some_and(|z| known.was_in(z, &self.rules));
                if !is_seen && was_there() {
                    occupancy.unseen.push(*id);
                }
            }
        }
    }
}

impl Known {
    fn new(zones: usize) -> Self {
        Self {
            class: None,
            in_sight: Switch::default(),
            has_appeared: false,
            bbox: None,
            zones: vec![Place::default(); zones],
        }
    }

    fn look(&mut self, record: &Record, rules: &EventRules, now: Now, events: &mut Vec<Event>) {
        let seen = record.estimate.as_ref().filter(|e| match e.state {
            TrackState::Tracking | TrackState::Unsure => true,
            TrackState::Occluded | TrackState::Lost => false,
        });
        if record.class.is_some() {
            self.class.clone_from(&record.class);
        }
        if let Some(estimate) = seen {
            self.bbox = Some(estimate.bbox);
        }
        let seen_s = self.in_sight.held_s();
        let turned = self.in_sight.turn(seen.is_some(), now.time_s, rules.in_sight_s);
        if turned && self.in_sight.is_on() {
            let again = std::mem::replace(&mut self.has_appeared, true);
            let kind = if again { Kind::Found } else { Kind::Appear };
            events.push(self.event(kind, record.target, now));
        }
        if turned && !self.in_sight.is_on() {
            self.leave_all(record.target, Reason::Unseen, rules, now, events);
            let event = self.event(Kind::Lost, record.target, now);
            events.push(Event { lasted_s: Some(seen_s), ..event });
        }
        // Where a target is that is not seen nobody knows: its places stay what they were until it is given up or seen.
        if let (Some(estimate), true) = (seen, self.in_sight.is_on()) {
            self.place(estimate.bbox, record.target, rules, now, events);
        }
    }

    /// It is seen, here.
    fn place(&mut self, bbox: BBox, id: TargetId, rules: &EventRules, now: Now, events: &mut Vec<Event>) {
        for (number, zone) in rules.zones.iter().enumerate() {
            let Some(mut place) = self.zones.get(number).copied() else { continue };
            let margin = if place.inside.is_on() { rules.margin * bbox.width().min(bbox.height()) } else { 0.0 };
            let is_inside = zone.outside_by(rules.anchor.of(bbox)) <= margin;
            let (lasted_s, held_s) = (place.inside.lasted_s(now.time_s), place.inside.held_s());
            let turned = place.inside.turn(is_inside, now.time_s, rules.in_zone_s);
            let event = |kind| Event { zone: Some(zone.name.clone()), ..self.event(kind, id, now) };
            match (turned, place.inside.is_on()) {
                (true, true) => events.push(event(Kind::Enter)),
                (true, false) => {
                    place.has_dwelt = false;
                    events.push(Event { reason: Some(Reason::Left), lasted_s: Some(held_s), ..event(Kind::Leave) });
                }
                (false, true) if lasted_s >= rules.dwell_s && !place.has_dwelt => {
                    place.has_dwelt = true;
                    events.push(Event { lasted_s: Some(lasted_s), ..event(Kind::Dwell) });
                }
                (false, _) => {}
            }
            self.zones[number] = place;
        }
    }

    /// It is taken to be in no zone any more.
    fn leave_all(&mut self, id: TargetId, reason: Reason, rules: &EventRules, now: Now, events: &mut Vec<Event>) {
        let mut left = Vec::new();
        for (place, zone) in self.zones.iter_mut().zip(&rules.zones) {
            if place.inside.is_on() {
                left.push((zone.name.clone(), place.inside.held_s()));
            }
            place.inside.turn_off(now.time_s);
            place.has_dwelt = false;
        }
        for (zone, lasted_s) in left {
            let event = self.event(Kind::Leave, id, now);
            events.push(Event { zone: Some(zone), reason: Some(reason), lasted_s: Some(lasted_s), ..event });
        }
    }

    /// There is no such target any more.
    fn end(&mut self, id: TargetId, rules: &EventRules, now: Now, events: &mut Vec<Event>) {
        self.leave_all(id, Reason::Gone, rules, now, events);
        if self.has_appeared {
            events.push(self.event(Kind::Gone, id, now));
        }
    }

    /// Whether it was in the zone when it was seen last.
    fn was_in(&self, zone: &super::Zone, rules: &EventRules) -> bool {
        self.bbox.is_some_and(|bbox| zone.outside_by(rules.anchor.of(bbox)) <= 0.0)
    }

    fn event(&self, kind: Kind, target: TargetId, now: Now) -> Event {
        Event {
            kind,
            frame: now.frame,
            time_s: now.time_s,
            unix_time_s: now.unix_time_s,
            target,
            class: self.class.clone(),
            zone: None,
            reason: None,
            lasted_s: None,
            bbox: self.bbox,
        }
    }
}

#[cfg(test)]
#[path = "watcher_tests.rs"]
mod tests;
