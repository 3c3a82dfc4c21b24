//! `pursuit survey` as a user would call it.

use crate::common::{fails, pursuit, rows, stderr, stdout};
use crate::eval::sequence;
use serde_json::Value;

#[test]
fn trackers_are_ranked_by_family_and_what_eval_left_is_used() {
    let root = tempfile::tempdir().unwrap();
    let (data, out) = (root.path().join("data"), root.path().join("out"));
    for k in 0..4 {
        sequence(&data.join(format!("mover{k}")), 8 + k);
    }
    let table = root.path().join("attributes.csv");
    let all = (0..4).map(|k| format!("mover{k},1,1,1\n")).collect::<String>();
    std::fs::write(&table, format!("sequence,small,quick,grey\n{all}")).unwrap();
    let (data, to, table) = (data.to_str().unwrap(), out.to_str().unwrap(), table.to_str().unwrap());
    let evaluated = pursuit(&["eval", data, "--trackers", "mosse", "--out", to, "--no-report"]);
    assert!(evaluated.status.success(), "{}", stderr(&evaluated));
    let kept = std::fs::read_to_string(out.join("boxes/mosse/mover0.json")).unwrap();
    let call = ["survey", data, "--trackers", "mosse,kcf,median-flow", "--attributes", table, "--out", to];
    let output = pursuit(&[&call[..], &["--json"]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let survey: Value = serde_json::from_str(&stdout(&output)).unwrap();
    let names: Vec<&str> =
        survey["trackers"].as_array().unwrap().iter().filter_map(|t| t["tracker"].as_str()).collect();
    assert_eq!(names.len(), 3);
    let family = |name: &str| {
        let found = survey["trackers"].as_array().unwrap().iter().find(|t| t["tracker"] == name);
        found.unwrap()["family"].as_str().unwrap().to_owned()
    };
    assert_eq!([family("mosse"), family("kcf"), family("median-flow")], ["correlation", "correlation", "flow"]);
    assert_eq!(survey["families"].as_array().unwrap().len(), 2);
    assert_eq!(std::fs::read_to_string(out.join("boxes/mosse/mover0.json")).unwrap(), kept, "it was not run again");
    assert_eq!(rows(&out.join("survey.csv")).len(), 3);
    let page = std::fs::read_to_string(out.join("survey.html")).unwrap();
    assert!(page.contains("3 trackers of 2 families on 4 sequences") && page.matches("<svg").count() == 2);
    for file in ["survey.md", "families.csv", "speed-and-accuracy.svg", "attributes.svg", "report.html", "results.json"]
    {
        assert!(out.join(file).is_file(), "{file}");
    }
    let words = stdout(&pursuit(&call));
    assert!(words.contains("correlation") && words.contains("survey.html"), "{words}");
}

#[test]
fn a_familys_name_stands_for_its_trackers() {
    let root = tempfile::tempdir().unwrap();
    let data = root.path().join("data");
    sequence(&data.join("mover"), 4);
    let out = root.path().join("out");
    let output = pursuit(&[
        "survey",
        data.to_str().unwrap(),
        "--trackers",
        "flow,mosse,tld",
        "--json",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{}", stderr(&output));
    let survey: Value = serde_json::from_str(&stdout(&output)).unwrap();
    let mut names: Vec<&str> =
        survey["trackers"].as_array().unwrap().iter().filter_map(|t| t["tracker"].as_str()).collect();
    names.sort_unstable();
    assert_eq!(names, ["kalman-tld", "median-flow", "mosse", "point", "tld"]);
    fails(&pursuit(&["survey", data.to_str().unwrap(), "--trackers", "nobody"]), 2, &["nobody", "there are"]);
}
