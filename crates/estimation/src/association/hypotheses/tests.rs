use super::*;

fn number(counter: &mut u64) -> f64 {
    *counter += 1;
    pursuit_testkit::SplitMix::after(*counter).unit()
}

type Tracks = Vec<Vec<(f64, Vec<usize>)>>;

/// Tracks with up to `most` branches of detections that several want; the last branch of each has none.
fn problem(counter: &mut u64, tracks: usize, most: usize, detections: usize) -> Tracks {
    let one = |counter: &mut u64| {
        let branches = 1 + (number(counter) * most as f64) as usize;
        let mut own: Vec<_> = (1..branches)
            .map(|_| {
                let taken = (0..3).filter_map(|frame| {
                    let which = (number(counter) * (detections / 3) as f64) as usize;
                    (number(counter) < 0.7).then_some(frame * (detections / 3) + which)
                });
                let taken = taken.collect();
                // Many are equal.
                ((number(counter) * 20.0).floor() - 4.0, taken)
            })
            .collect();
        own.push((0.0, vec![]));
        own
    };
    (0..tracks).map(|_| one(counter)).collect()
}

fn tell(best: &mut GlobalHypothesis, tracks: &Tracks, detections: usize) -> Vec<usize> {
    best.clear(detections);
    for own in tracks {
        best.track();
        own.iter().for_each(|(score, taken)| best.branch(*score, taken.iter().copied()));
    }
    tracks.iter().map(|own| own.len() - 1).collect()
}

/// By trying everything.
fn tried(tracks: &Tracks, at: usize, taken: &mut Vec<usize>) -> f64 {
    let Some(own) = tracks.get(at) else { return 0.0 };
    let mut best = f64::NEG_INFINITY;
    for (score, wanted) in own {
        if wanted.iter().all(|d| !taken.contains(d)) {
            let before = taken.len();
            taken.extend(wanted);
            best = best.max(score + tried(tracks, at + 1, taken));
            taken.truncate(before);
        }
    }
    best
}

/// What a hypothesis scores, after a look at whether it can be.
fn scored(tracks: &Tracks, chosen: &[usize]) -> f64 {
    let mut taken = Vec::new();
    let mut sum = 0.0;
    for (own, branch) in tracks.iter().zip(chosen) {
        sum += own[*branch].0;
        let mut own = own[*branch].1.clone();
        own.dedup();
        assert!(own.iter().all(|d| !taken.contains(d)), "{chosen:?}");
        taken.extend(own);
    }
    sum
}

#[test]
fn no_other_hypothesis_scores_more() {
    let (mut best, mut counter) = (GlobalHypothesis::new(), 0);
    for trial in 0..400 {
        let (tracks, detections) = (trial % 7, 3 + 3 * (trial % 5));
        let tracks = problem(&mut counter, tracks, 6, detections);
        let first = tell(&mut best, &tracks, detections);
        let chosen = best.solve(&first, 1_000_000).unwrap().to_vec();
        let (score, expected) = (scored(&tracks, &chosen), tried(&tracks, 0, &mut vec![]));
        assert!((score - expected).abs() < 1e-9, "trial {trial}: {score}, not {expected}: {tracks:?}");
        assert!((best.score() - score).abs() < 1e-9);
    }
}

#[test]
fn without_a_search_steps_come_near() {
    let (mut best, mut counter, mut all, mut near) = (GlobalHypothesis::new(), 1_000_000, 0.0, 0.0);
    for trial in 0..200 {
        let detections = 3 + 3 * (trial % 5);
        let tracks = problem(&mut counter, 7, 6, detections);
        let first = tell(&mut best, &tracks, detections);
        let chosen = best.solve(&first, 0).unwrap().to_vec();
        let score = scored(&tracks, &chosen);
        assert!(score >= scored(&tracks, &first) && (best.score() - score).abs() < 1e-9);
        near += score;
        all += tried(&tracks, 0, &mut vec![]);
    }
    assert!(near > 0.97 * all && near <= all, "{near} of {all}");
}

#[test]
fn a_crowd_ends_and_can_be() {
    let (mut best, mut counter) = (GlobalHypothesis::new(), 2_000_000);
    for tracks in [60, 600] {
        let tracks = problem(&mut counter, tracks, 12, 300);
        let first = tell(&mut best, &tracks, 300);
        let chosen = best.solve(&first, 10_000).unwrap().to_vec();
        assert!(scored(&tracks, &chosen) > scored(&tracks, &first));
        let again = best.solve(&first, 10_000).unwrap();
        assert_ne!(again.len(), 0);
        tell(&mut best, &tracks, 300);
        assert_eq!(best.solve(&first, 10_000).unwrap(), chosen, "the same again");
    }
}

#[test]
fn what_cannot_be_is_refused() {
    let mut best = GlobalHypothesis::new();
    let mut told = |scores: [f64; 2], taken: [usize; 2], first: &[usize]| {
        best.clear(2);
        for (score, taken) in scores.into_iter().zip(taken) {
            best.track();
            best.branch(score, [taken]);
        }
        best.solve(first, 10).map(<[usize]>::to_vec)
    };
    assert_eq!(told([1.0, 2.0], [0, 1], &[0, 0]).unwrap(), [0, 0]);
    assert!(matches!(told([1.0, 2.0], [0, 0], &[0, 0]), Err(EstimationError::Incompatible { .. })));
    assert!(matches!(told([1.0, 2.0], [0, 2], &[0, 0]), Err(EstimationError::Index { .. })));
    assert!(matches!(told([1.0, 2.0], [0, 1], &[0, 1]), Err(EstimationError::Index { .. })));
    assert!(matches!(told([1.0, 2.0], [0, 1], &[0]), Err(EstimationError::Length { .. })));
    assert!(matches!(told([1.0, f64::NAN], [0, 1], &[0, 0]), Err(EstimationError::NotFinite { .. })));
    best.clear(0);
    assert_eq!(best.solve(&[], 10).unwrap(), []);
    best.track();
    assert!(best.solve(&[0], 10).is_err(), "it has no branch");
}
