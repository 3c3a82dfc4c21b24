//! The floors of the house: a crate imports only from floors below its own.

use crate::metadata::{self, Package};
use anyhow::{Result, bail};

/// Package and floor; the plan stands in ARCHITECTURE.md.
const FLOORS: &[(&str, u8)] = &[
    ("pursuit-address", 0),
    ("pursuit-charts", 0),
    ("pursuit-containers", 0),
    ("pursuit-geometry", 0),
    ("pursuit-parameters", 0),
    // A development dependency of any floor; `ONLY_IN` keeps it out of all else.
    ("pursuit-testkit", 0),
    ("pursuit-mavlink", 1),
    ("pursuit-measuring", 1),
    ("pursuit-publish", 1),
    ("pursuit-estimation", 0),
    ("pursuit-imaging", 1),
    ("pursuit-vision", 2),
    ("pursuit-media", 2),
    ("pursuit-inference", 2),
    ("pursuit-tracking", 3),
    ("pursuit-scenes", 3),
    ("pursuit-trackers", 4),
    ("pursuit-evaluation", 4),
    ("pursuit-ptz", 4),
    ("pursuit", 5),
    ("pursuit-experiments", 5),
    ("pursuit-studio", 6),
    ("pursuit-python", 6),
    ("pursuit-cli", 7),
    // It draws the chart of the README.
    ("xtask", 1),
];

/// What only the crates named may use, whatever their floor.
const ONLY_IN: &[(&str, &[&str])] = &[
    ("pursuit-testkit", &[]),
    ("clap", &["pursuit-cli", "xtask"]),
    ("clap_complete", &["pursuit-cli"]),
    ("clap_mangen", &["pursuit-cli"]),
    ("indicatif", &["pursuit-cli"]),
    ("anyhow", &["pursuit-cli", "xtask"]),
    ("openh264", &["pursuit-media"]),
    ("rusty_h264-decoder", &["pursuit-media"]),
    ("png", &["pursuit-media"]),
    ("zune-jpeg", &["pursuit-media"]),
    // Evaluation's report shows small pictures of frames.
    ("jpeg-encoder", &["pursuit-media", "pursuit-evaluation"]),
    ("axum", &["pursuit-studio"]),
    ("hyper", &["pursuit-studio"]),
    ("mavlink", &["pursuit-mavlink"]),
    ("mcap", &["pursuit", "pursuit-media"]),
    ("parquet", &["pursuit"]),
    ("rusqlite", &["pursuit-media"]),
    ("async-nats", &["pursuit-publish"]),
    ("rumqttc", &["pursuit-publish"]),
    ("pyo3", &["pursuit-python"]),
    ("numpy", &["pursuit-python"]),
    (
        "serde_json",
        &[
            "pursuit",
            "pursuit-ptz",
            "pursuit-evaluation",
            "pursuit-experiments",
            // OpenCV writes cameras as JSON too.
            "pursuit-measuring",
            "pursuit-cli",
            "pursuit-studio",
            "pursuit-python",
            "xtask",
        ],
    ),
    ("ort", &["pursuit-inference"]),
    ("rten", &["pursuit-inference"]),
];

pub fn check() -> Result<()> {
    let packages = metadata::packages()?;
    let ours: Vec<&Package> = packages.iter().filter(|p| p.ours).collect();
    let wrongs: Vec<String> = ours.iter().flat_map(|p| wrongs_of(p, &ours)).collect();
    if !wrongs.is_empty() {
        bail!("the floors are not kept:\n  {}", wrongs.join("\n  "));
    }
    println!("layers: {} crates keep to their floors", ours.len());
    Ok(())
}

fn wrongs_of(package: &Package, ours: &[&Package]) -> Vec<String> {
    let Some(own) = floor(&package.name) else {
        return vec![format!("`{}` has no floor yet; give it one in xtask/src/layers.rs", package.name)];
    };
    let upward =
        package.dependencies.iter().filter(|d| ours.iter().any(|p| p.name == **d)).filter_map(|d| match floor(d) {
            Some(below) if below < own => None,
            Some(above) => Some(format!("`{}` (floor {own}) imports `{d}` (floor {above})", package.name)),
            None => None,
        });
    let foreign = package.dependencies.iter().filter_map(|d| {
        let (_, allowed) = ONLY_IN.iter().find(|(name, _)| name == d)?;
        (!allowed.contains(&package.name.as_str()))
            .then(|| format!("`{}` imports `{d}`, which belongs in {}", package.name, allowed.join(", ")))
    });
    upward.chain(foreign).collect()
}

fn floor(name: &str) -> Option<u8> {
    FLOORS.iter().find(|(n, _)| *n == name).map(|(_, f)| *f)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(name: &str, dependencies: &[&str]) -> Package {
        Package {
            name: name.into(),
            license: None,
            ours: true,
            dependencies: dependencies.iter().map(|d| (*d).to_owned()).collect(),
        }
    }

    #[test]
    fn imports_upward_sideways_and_of_foreign_goods_are_found() {
        let geometry = package("pursuit-geometry", &["pursuit-estimation"]);
        let tracking = package("pursuit-tracking", &["pursuit-vision", "clap", "serde"]);
        let (vision, estimation) = (package("pursuit-vision", &[]), package("pursuit-estimation", &[]));
        let all = [&geometry, &tracking, &vision, &estimation];
        assert_eq!(wrongs_of(&geometry, &all).len(), 1);
        assert_eq!(wrongs_of(&tracking, &all).len(), 1);
        assert!(wrongs_of(&vision, &all).is_empty());
        assert_eq!(wrongs_of(&package("pursuit-new", &[]), &all).len(), 1);
    }
}
