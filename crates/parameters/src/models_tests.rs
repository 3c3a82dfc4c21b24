//! Parameters that only some models have, and names of former versions.

use crate::{Parameters, Table, template};

crate::choices! {
    /// How it goes.
    pub enum Gait {
        /// On foot.
        Walk = "walk",
        /// Faster.
        Run = "run",
        /// Up.
        LongJump = "long-jump",
    }
}

crate::parameters! {
    /// Running.
    pub struct RunParams {
        /// Strides.
        pub strides: f64 = 2.0, in above(0.0), unit "1/s";
    }
}

crate::parameters! {
    /// Jumping.
    pub struct JumpParams {
        /// How far.
        pub reach: f64 = 5.0, in above(0.0), unit "m";
    }
}

crate::parameters! {
    /// How a thing goes.
    pub struct GaitParams {
        /// The model.
        pub model: Gait = Gait::Run;
        /// How tall.
        pub height: f64 = 1.8, unit "m";
        /// How fast on the ground.
        pub speed: f64 = 3.0, unit "m/s", of [Gait::Walk, Gait::Run];
        /// Running.
        pub run: RunParams = RunParams::default(), of [Gait::Run];
        /// Jumping.
        pub long_jump as "long-jump": JumpParams = JumpParams::default(), of [Gait::LongJump];
    }
    renamed { "pace" => ["run.strides", "speed"], "jump" => ["long-jump"] }
}

crate::parameters! {
    /// Whoever goes.
    pub struct Walker {
        /// Its gait.
        pub gait: GaitParams = GaitParams::default();
    }
}

fn with(text: &str) -> crate::Result<Walker> {
    Walker::default().with("walker", &text.parse().unwrap())
}

#[test]
fn keys_of_other_models_are_refused() {
    let error = with("gait.long-jump.reach = 5.0").unwrap_err();
    assert_eq!(error.name, "gait.long-jump.reach");
    assert_eq!(error.problem, "belongs to `gait.model = \"long-jump\"`, and the model is `run`");
    let error = with("gait.model = 'long-jump'\ngait.speed = 4.0").unwrap_err();
    assert_eq!(
        error.problem,
        "belongs to `gait.model = \"walk\"` or `gait.model = \"run\"`, and the model is `long-jump`"
    );
    let jumps = with("gait.model = 'long-jump'\ngait.long-jump.reach = 6.0\ngait.speed = 3.0").unwrap();
    assert_eq!((jumps.gait.model, jumps.gait.long_jump.reach), (Gait::LongJump, 6.0));
    // The model that was chosen before counts as well.
    let changed = jumps.with("walker", &"gait.long-jump.reach = 7.0".parse().unwrap()).unwrap();
    assert_eq!(changed.gait.long_jump.reach, 7.0);
}

#[test]
fn tables_and_templates_leave_other_models_out() {
    let keys = |walker: &Walker| {
        let table = walker.to_table("walker").unwrap();
        table["gait"].as_table().unwrap().keys().cloned().collect::<Vec<_>>()
    };
    assert_eq!(keys(&Walker::default()), ["height", "model", "run", "speed"]);
    let jumps = with("gait.model = 'long-jump'").unwrap();
    assert_eq!(keys(&jumps), ["height", "long-jump", "model"]);
    for walker in [Walker::default(), jumps, with("gait.model = 'walk'").unwrap()] {
        let text = template(&walker.schema());
        assert_eq!(with(&text).unwrap(), walker, "{text}");
        assert!(["strides", "reach", "speed"].iter().all(|name| text.contains(name)), "{text}");
        let written: Table = text.parse().unwrap();
        assert_eq!(written, walker.to_table("walker").unwrap(), "{text}");
    }
    let text = template(&Walker::default().schema());
    assert!(text.contains("# # Jumping.\n# # of long-jump\n# [gait.long-jump]\n\n# # How far.\n"), "{text}");
}

#[test]
fn former_names_set_what_they_are_now() {
    let walker = with("gait.pace = 4.0").unwrap();
    assert_eq!((walker.gait.run.strides, walker.gait.speed), (4.0, 4.0));
    // Files of former versions name the parameters of all models.
    let walker = with("gait.jump.reach = 9.0").unwrap();
    assert_eq!((walker.gait.model, walker.gait.long_jump.reach), (Gait::Run, 9.0));
    assert_eq!(with("gait.pace = 4.0\ngait.speed = 5.0").unwrap().gait.speed, 5.0, "the name of today counts more");
    let error = with("gait.pace = -1.0").unwrap_err();
    assert_eq!((error.name.as_str(), error.problem.as_str()), ("gait.run.strides", "must be above 0, not -1"));
    assert_eq!(Walker::default().renamed("gait.speed"), None);
    assert_eq!(Walker::default().renamed("gait.pacer"), None);
}

#[test]
fn the_schema_says_which_models() {
    let schema = serde_json::to_value(Walker::default().schema()).unwrap();
    let group = &schema[0]["parameters"];
    assert_eq!(group[2]["models"], serde_json::json!(["walk", "run"]));
    assert_eq!((&group[4]["name"], &group[4]["models"]), (&"long-jump".into(), &serde_json::json!(["long-jump"])));
    assert!(group[1].get("models").is_none());
}
