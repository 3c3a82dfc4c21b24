//! Real footage, where it is there: the figures of a scripted tracker equal those of the yardstick's own scoring.

mod common;
use common::Scripted;
use pursuit_evaluation::{EvalOptions, evaluate};
use std::path::Path;
use std::sync::atomic::AtomicBool;

#[test]
fn every_sequence_can_be_evaluated() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/sot");
    if !data.is_dir() {
        println!("skipped: no footage in {}", data.display());
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let mut options = EvalOptions::new(vec![data], vec![Scripted::still().entry()], out.path().to_owned());
    options.sequences = Some("TLD_05*,OTB_Deer,OTB_Jogging*".to_owned());
    options.thumbnails = false;
    options.jobs = 2;
    let results = evaluate(&options, &|_| (), &AtomicBool::new(false)).unwrap();
    assert_eq!(results.problems, Vec::<String>::new());
    let still = &results.trackers["still"];
    assert_eq!(still.sequences.len(), 3);
    // A box that stays where it was: figures from shared/tools/peers.py `score` on the same boxes.
    println!("{:?}", still.sequences);
    let long_term = still.sequences["TLD_05_pedestrian3"].long_term.as_ref().unwrap();
    assert_eq!((long_term.false_alive, still.sequences["OTB_Deer"].long_term.as_ref()), (Some(1.0), None));
}
