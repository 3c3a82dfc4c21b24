use super::*;
use crate::results::SequenceScore;

/// Trackers whose AUC on sequence i is `base` plus a ripple, and their speed.
fn results(trackers: &[(&str, f64, f64)]) -> Results {
    let mut results = Results::default();
    for (k, (name, base, fps)) in trackers.iter().enumerate() {
        let tracker = results.trackers.entry((*name).to_owned()).or_default();
        let aucs: Vec<f64> = (0..8).map(|i| base + 0.004 * ((i * (k + 2)) % 5) as f64).collect();
        for (i, auc) in aucs.iter().enumerate() {
            tracker.sequences.insert(format!("s{i}"), SequenceScore { auc: *auc, ..SequenceScore::default() });
        }
        let mean = aucs.iter().sum::<f64>() / 8.0;
        let fps = Some(*fps).filter(|f| *f > 0.0);
        tracker.mean = MeanScore { auc: mean, fps, sequences: 8, ..MeanScore::default() };
        for (j, attribute) in ["blur", "occlusion", "scale", "rare"].iter().enumerate() {
            let sequences = if *attribute == "rare" { 2 } else { 4 };
            let score = MeanScore { auc: mean - 0.05 * j as f64, sequences, ..MeanScore::default() };
            tracker.attributes.insert((*attribute).to_owned(), score);
        }
    }
    crate::comparison::compare(&mut results, &BTreeMap::new());
    results
}

fn families() -> Vec<Family> {
    let family = |name: &str, members: &[&str]| Family {
        name: name.to_owned(),
        sentence: format!("All <{name}>."),
        members: members.iter().map(|m| (*m).to_owned()).collect(),
    };
    vec![family("filters", &["a", "b", "absent"]), family("nets", &["c"])]
}

#[test]
fn families_are_ranked_by_their_best_and_share_ranks_that_cannot_be_told() {
    let results = results(&[("a", 0.6, 900.0), ("b", 0.3, 4000.0), ("c", 0.601, 80.0), ("d", 0.2, 0.0)]);
    let survey = Survey::new(&results, &families());
    let order: Vec<(&str, &str)> = survey.trackers.iter().map(|l| (l.tracker.as_str(), l.family.as_str())).collect();
    assert_eq!(order.len(), 4);
    assert!(order.contains(&("d", "others")) && order.contains(&("b", "filters")), "{order:?}");
    let of = |name: &str| survey.families.iter().find(|l| l.family == name).unwrap();
    let (filters, nets, others) = (of("filters"), of("nets"), of("others"));
    assert_eq!(filters.members, ["a", "b"]);
    // a and c differ by a thousandth, d by far.
    assert_eq!((filters.rank, nets.rank, others.rank), (Some([1, 2]), Some([1, 2]), Some([3, 3])));
    assert_eq!(filters.fastest, Some(("b".to_owned(), 4000.0)));
    let mean = (results.trackers["a"].mean.auc + results.trackers["b"].mean.auc) / 2.0;
    assert!((filters.mean_auc - mean).abs() < 1e-12 && (filters.auc - results.trackers["a"].mean.auc).abs() < 1e-12);
    assert_eq!((others.fps, &others.fastest), (None, &None));
    assert_eq!(survey.between.len(), 3);
    assert_eq!(survey.between.iter().filter(|c| c.judgement == Judgement::CannotTell).count(), 1);
}

#[test]
fn files_say_what_the_survey_says() {
    let results = results(&[("a", 0.6, 900.0), ("b|<x>", 0.3, 4000.0), ("c", 0.5, 80.0)]);
    let survey = Survey::new(&results, &families());
    let folder = tempfile::tempdir().unwrap();
    let written = survey.write(&results, folder.path()).unwrap();
    let names: Vec<&str> = written.iter().filter_map(|p| p.file_name()?.to_str()).collect();
    let all = ["survey.html", "survey.md", "survey.csv", "families.csv", "speed-and-accuracy.svg", "attributes.svg"];
    assert_eq!(names, all);
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let csv = read("survey.csv");
    assert!(csv.starts_with("tracker,family,rank_low,rank_high,auc,"), "{csv}");
    assert_eq!(csv.lines().count(), 4);
    assert!(csv.lines().nth(1).unwrap().starts_with("a,filters,1,1,0.6"), "{csv}");
    assert_eq!(read("families.csv").lines().count(), 4);
    let markdown = read("survey.md");
    assert!(markdown.contains("| a | filters | 1 | **0.6") && markdown.contains("b\\|<x>"), "{markdown}");
    assert!(markdown.contains("- filters: All <filters>."), "{markdown}");
    let page = read("survey.html");
    assert!(page.contains("3 trackers of 3 families on 8 sequences") && page.contains("b|&lt;x&gt;"));
    assert!(page.contains("All &lt;filters&gt;.") && !page.contains("<x>"));
    // The speed and the radar are in it; an attribute of two sequences has no spoke.
    assert_eq!(page.matches("<svg").count(), 2);
    assert!(page.contains(">occlusion<") && !page.contains(">rare<"));
    let text = survey.to_text();
    assert!(text.lines().next().unwrap().starts_with("tracker") && text.contains("family"), "{text}");
}

#[test]
fn without_times_and_attributes_there_are_no_charts() {
    let mut results = results(&[("a", 0.6, 0.0), ("c", 0.5, 0.0)]);
    results.trackers.values_mut().for_each(|t| t.attributes.clear());
    let survey = Survey::new(&results, &families());
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("attributes.svg"), "of another survey").unwrap();
    let written = survey.write(&results, folder.path()).unwrap();
    assert_eq!(written.len(), 4);
    assert!(!folder.path().join("attributes.svg").exists());
    assert_eq!(std::fs::read_to_string(folder.path().join("survey.html")).unwrap().matches("<svg").count(), 0);
}
