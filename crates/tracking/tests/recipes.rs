//! Recipes as values, registry entries, and saved trackers.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod scripted;

use pursuit_geometry::BBox;
use pursuit_parameters::{Kind, template};
use pursuit_tracking::registry::unknown;
use pursuit_tracking::{TrackingError, check_box};
use scripted::{ENTRY, at, frame, recipe, show, start, table};

fn error(changes: &str) -> String {
    ENTRY.recipe(&table(changes)).err().unwrap().to_string()
}

#[test]
fn a_recipe_has_the_localizers_parameters_and_the_three_groups() {
    let recipe = ENTRY.default_recipe();
    assert_eq!((recipe.name(), recipe.needs().color), ("scripted", false));
    let schema = recipe.schema();
    let names: Vec<_> = schema.iter().map(|p| p.name).collect();
    assert_eq!(names, ["growth", "motion", "policy", "search"]);
    let Kind::Group { parameters } = &schema[1].kind else { unreachable!() };
    assert!(parameters.iter().any(|p| p.name == "model") && parameters.iter().any(|p| p.name == "bounce"));
    let table = recipe.parameters().unwrap();
    assert_eq!(table["growth"].as_float(), Some(1.0));
    assert_eq!(table["motion"]["model"].as_str(), Some("constant-velocity"));
    assert_eq!(table["policy"]["lost_after_s"].as_float(), Some(1.0));
    assert_eq!(table["search"]["wide_windows"].as_integer(), Some(8));
    let read = ENTRY.recipe(&template(&schema).parse().unwrap()).unwrap();
    assert_eq!(read.parameters().unwrap(), table);
}

#[test]
fn changes_are_merged_into_groups() {
    let changed = recipe("growth = 1.5\nmotion.model = 'imm'\n[motion.imm]\nturn_rate = 0.5\n");
    let table = changed.parameters().unwrap();
    assert_eq!(table["growth"].as_float(), Some(1.5));
    assert_eq!(table["motion"]["model"].as_str(), Some("imm"));
    assert_eq!(table["motion"]["acceleration"].as_float(), Some(100.0));
    assert_eq!(table["motion"]["imm"]["turn_rate"].as_float(), Some(0.5));
    assert!(table["motion"].get("bounce").is_none(), "what only other models have is left out");
    let again = changed.with(&"policy.model = 'always'".parse().unwrap()).unwrap();
    assert_eq!(again.parameters().unwrap()["motion"]["model"].as_str(), Some("imm"));
    let copy = again.boxed_clone();
    assert_eq!(copy.parameters().unwrap(), again.parameters().unwrap());
}

#[test]
fn what_is_wrong_is_named() {
    let message = error("speed = 1");
    assert!(message.contains("`speed` of `scripted`: there is no such parameter"), "{message}");
    assert!(message.contains("growth, motion.…, policy.…, search.…"), "{message}");
    assert!(error("growth = 3").contains("`growth` of `scripted`: must be between 0.5 and 2"));
    assert!(error("motion.model = 'warp'").contains("`motion.model` of `scripted`: unknown variant"));
    assert!(error("policy.seen_from = 2").contains("`policy.seen_from` of `scripted`: must be between 0 and 1"));
    assert!(error("motion.bounce.in_step = 7").contains("`motion.bounce.in_step`"));
    let message = error("motion.model = 'singer'\nmotion.imm.turn_rate = 2");
    assert!(message.contains("belongs to `motion.model = \"imm\"`, and the model is `singer`"), "{message}");
    assert!(error("policy.paper.psr_from = 7").contains("belongs to `policy.model = \"paper\"`"));
    assert!(error("search.gate.slack = 0.1").contains("belongs to `search.model = \"gate\"`"));
}

#[test]
fn former_names_still_load() {
    let now = recipe("motion.model = 'imm'\nmotion.imm.turn_rate = 0.5\n[policy.calibrated]\nlost_below = 0.1\n");
    let before = recipe("motion.model = 'imm'\nmotion.turn_rate = 0.5\npolicy.lost_below = 0.1");
    assert_eq!(before.parameters().unwrap(), now.parameters().unwrap());
    // A file that names the parameters of every model, as templates did.
    let all =
        recipe("[motion]\nmodel = 'none'\nturn_rate = 0.5\n[motion.sampling]\nthree_points = true\nsample_s = 0.1");
    assert_eq!(all.parameters().unwrap()["motion"]["model"].as_str(), Some("none"));
    let samples = all.with(&table("motion.model = 'qu2010-simplified'")).unwrap().parameters().unwrap();
    assert_eq!(samples["motion"]["qu2010"]["sample_s"].as_float(), Some(0.1));
    assert_eq!(samples["motion"]["qu2010-simplified"]["three_points"].as_bool(), Some(true));
}

#[test]
fn boxes_to_start_from_are_checked() {
    let recipe = recipe("");
    for (bbox, words) in [
        (BBox::from_ltwh(f64::NAN, 0.0, 5.0, 5.0), "not a finite number"),
        (BBox::from_ltwh(5.0, 5.0, 0.0, 5.0), "is empty"),
        (BBox::from_ltwh(500.0, 5.0, 5.0, 5.0), "lies outside the frame"),
    ] {
        let error = recipe.init(&frame(0), bbox).err().unwrap();
        assert!(matches!(error, TrackingError::StartBox { .. }), "{error}");
        assert!(error.to_string().contains(words), "{error}");
        assert!(check_box(&frame(0), bbox).is_err());
    }
    assert!(recipe.init(&frame(0), BBox::from_ltwh(-5.0, -5.0, 9.0, 9.0)).is_ok());
    assert!(check_box(&frame(0), at(0.0, 0.0)).is_ok());
}

#[test]
fn saved_trackers_are_told_from_anything_else() {
    show(None, None);
    let saved = start("").save().unwrap();
    let problem = |bytes: &[u8]| match recipe("").restore(bytes) {
        Err(TrackingError::Snapshot { tracker, problem }) => {
            assert_eq!(tracker, "scripted");
            problem
        }
        _ => unreachable!(),
    };
    assert!(problem(b"RIFF").contains("not a saved tracker"));
    assert!(problem(&saved[..20]).contains("end of data") || !problem(&saved[..20]).is_empty());
    assert!(problem(&[&saved[..], &[0]].concat()).contains("1 bytes too many"));
    let mut other = saved.clone();
    let at = other.windows(8).position(|w| w == b"scripted").unwrap();
    other[at] = b'S';
    assert!(problem(&other).contains("saved by tracker `Scripted`"));
    let version = env!("CARGO_PKG_VERSION").as_bytes();
    let mut older = saved.clone();
    let at = older.windows(version.len()).position(|w| w == version).unwrap();
    older[at] = b'9';
    assert!(problem(&older).contains("saved by version 9"));
    assert!(recipe("").restore(&saved).is_ok());
}

#[test]
fn unknown_names_come_with_the_names_there_are() {
    let error = unknown("tracker", "x", ["a", "b"].into_iter());
    assert_eq!(error.to_string(), "there is no tracker called `x`; there are: a, b");
    assert_eq!(format!("{ENTRY:?}"), "TrackerEntry { name: \"scripted\", .. }");
}
