//! What networks by file run on, said once for all who take part.

use super::Settings;
use crate::networks::of_networks;
use pursuit_inference::onnx::Device;
use pursuit_parameters::{Parameter, merge, nested};

/// What names it, in the group of a network.
const KEY: &str = "device";

/// Hands `device` to each of those whose parameters are in `settings` and who run a network by file, unless theirs is said
/// already; `schemas` are those of the trackers, and of the detector. Whether any of them does.
pub(super) fn hand(
    device: Device,
    settings: &mut Settings,
    trackers: &[Vec<Parameter>],
    detector: &[Parameter],
) -> bool {
    let of_trackers = trackers.iter().map(Vec::as_slice).zip(&mut settings.trackers);
    let mut any = false;
    for (schema, table) in of_trackers.chain([(detector, &mut settings.detector)]) {
        let places = of_networks(schema, &nested(table), KEY);
        any |= !places.is_empty();
        let mut all = nested(&places.into_iter().map(|place| (place, device.as_str().into())).collect());
        merge(&mut all, std::mem::take(table));
        *table = all;
    }
    any
}

/// That nobody takes `device`, in a line; nothing, where it is the processor.
pub(super) fn note(device: Device, is_taken: bool) -> Option<String> {
    let word = device.as_str();
    let note = || format!("nobody here runs a network by file, which {word} could do; all runs on the processor");
    (device != Device::Cpu && !is_taken).then(note)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn that_nobody_takes_it_is_said() {
        assert_eq!((note(Device::Cpu, false), note(Device::Cuda, true)), (None, None));
        assert!(note(Device::Cuda, false).unwrap().starts_with("nobody here"));
    }

    #[test]
    fn a_device_is_handed_to_those_who_say_none() {
        let schema = |name: &str| pursuit_trackers::registry::tracker(name).unwrap().default_recipe().schema();
        let mine = "runtime.device = 'coreml'".parse().unwrap();
        let mut settings = Settings { trackers: vec![Default::default(), nested(&mine)], ..Settings::default() };
        assert!(hand(Device::Cuda, &mut settings, &[schema("fear-xs"), schema("fear-xs")], &[]));
        let device = |k: usize| settings.trackers[k]["runtime"]["device"].as_str();
        assert_eq!((device(0), device(1)), (Some("cuda"), Some("coreml")));
        let filters = |own: &str| {
            let trackers = vec![nested(&own.parse().unwrap())];
            let mut settings = Settings { trackers, ..Settings::default() };
            let is_taken = hand(Device::Cuda, &mut settings, &[schema("kcf")], &[]);
            (is_taken, settings.trackers[0].clone())
        };
        assert!(!filters("").0 && !filters("mask.model = 'colors'").0);
        // A mask by a network is one that runs there.
        let (is_taken, own) = filters("mask.model = 'network'");
        assert!(is_taken && own["mask"]["network"]["runtime"]["device"].as_str() == Some("cuda"), "{own}");
    }
}
