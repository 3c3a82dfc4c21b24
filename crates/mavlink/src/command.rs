use crate::{Endpoint, Incoming};
use mavlink::dialects::common::{COMMAND_ACK_DATA, MavCmd, MavMessage, MavResult};

/// A command, however it was sent.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Order {
    pub command: MavCmd,
    /// The first four parameters and the last; the two between are integers in one of the two messages.
    pub params: [f32; 4],
    /// The sender.
    pub system: u8,
    pub component: u8,
    /// Whether every component is asked.
    pub for_all: bool,
    /// How often it was sent before.
    pub confirmation: u8,
}

impl Order {
    pub fn of(incoming: &Incoming) -> Option<Self> {
        let Incoming { system, component, ref message } = *incoming;
        let (command, params, target, confirmation) = match &**message {
            MavMessage::COMMAND_LONG(c) => {
                (c.command, [c.param1, c.param2, c.param3, c.param4], c.target_component, c.confirmation)
            }
            MavMessage::COMMAND_INT(c) => (c.command, [c.param1, c.param2, c.param3, c.param4], c.target_component, 0),
            _ => return None,
        };
        Some(Self { command, params, system, component, for_all: target == 0, confirmation })
    }

    /// A parameter that is a whole number, 0 where it is none.
    pub fn whole(&self, index: usize) -> u32 {
        let value = self.params.get(index).copied().unwrap_or(0.0);
        // Negative and unbounded numbers become the nearest there is, and no number 0.
        value.round() as u32
    }

    /// The parameters of index 0 to 3 as numbers.
    pub fn numbers(&self) -> [f64; 4] {
        self.params.map(f64::from)
    }

    /// Whether it is the same command once more, because its answer got lost.
    pub fn repeats(&self, before: &Self) -> bool {
        let same = |a: f32, b: f32| a.to_bits() == b.to_bits();
        self.confirmation > 0
            && (self.command, self.system, self.component) == (before.command, before.system, before.component)
            && self.params.iter().zip(before.params).all(|(a, b)| same(*a, b))
    }

    /// Answers it.
    pub fn answer(&self, endpoint: &Endpoint, result: MavResult, detail: i32) {
        endpoint.send(&MavMessage::COMMAND_ACK(COMMAND_ACK_DATA {
            command: self.command,
            result,
            progress: 0,
            result_param2: detail,
            target_system: self.system,
            target_component: self.component,
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mavlink::dialects::common::COMMAND_LONG_DATA;
    use std::sync::Arc;

    fn order(param1: f32, confirmation: u8) -> Order {
        let command = MavCmd::MAV_CMD_CAMERA_TRACK_POINT;
        let data = COMMAND_LONG_DATA { command, param1, confirmation, target_component: 100, ..Default::default() };
        let message = Arc::new(MavMessage::COMMAND_LONG(data));
        Order::of(&Incoming { system: 255, component: 190, message }).unwrap()
    }

    #[test]
    fn a_repeated_command_is_known() {
        assert!(order(0.5, 1).repeats(&order(0.5, 0)));
        assert!(!order(0.5, 0).repeats(&order(0.5, 0)), "it is meant again");
        assert!(!order(0.6, 1).repeats(&order(0.5, 0)));
        assert!(!order(0.5, 1).for_all);
    }

    #[test]
    fn any_number_becomes_a_whole_one() {
        for (value, whole) in [(275.0, 275), (-1.0, 0), (f32::NAN, 0), (f32::INFINITY, u32::MAX)] {
            assert_eq!(order(value, 0).whole(0), whole);
        }
    }
}
