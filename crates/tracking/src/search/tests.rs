use super::*;

const FRAME: Size = Size::new(200, 100);

fn prior() -> Prior {
    Prior {
        bbox: BBox::from_center_size(Point::new(60.0, 40.0), 20.0, 20.0),
        innovation_covariance: Some(BoxCovariance::from_diagonal(&nalgebra::Vector4::new(9.0, 4.0, 1.0, 1.0))),
        dt_s: 0.04,
    }
}

fn situation(prior: &Prior, state: TrackState) -> Situation<'_> {
    Situation {
        frame: FRAME,
        prior,
        state,
        view: Some(ViewSize { width: 100.0, height: 50.0 }),
        sure_from: 0.8,
        elsewhere: false,
    }
}

fn proposer(params: SearchParams) -> Proposer {
    Proposer::new(params, &BBox::from_center_size(Point::new(50.0, 40.0), 20.0, 20.0))
}

/// A look, and the centre of where it looked.
type LookAt = (Look, f64, f64);

/// Goes through all rounds; `answer` says the confidence of what a search finds at its centre.
fn run(
    proposer: &mut Proposer,
    situation: &Situation<'_>,
    answer: impl Fn(&Search) -> Option<f64>,
) -> (Vec<LookAt>, Option<Observation<()>>) {
    run_with(proposer, situation, &[], answer)
}

/// The same with places that the localizer suggests.
fn run_with(
    proposer: &mut Proposer,
    situation: &Situation<'_>,
    places: &[BBox],
    answer: impl Fn(&Search) -> Option<f64>,
) -> (Vec<LookAt>, Option<Observation<()>>) {
    let (mut searches, mut looks) = (Vec::new(), Vec::new());
    let mut progress = Progress::default();
    loop {
        proposer.propose(situation, places, &mut progress, &mut searches);
        if searches.is_empty() {
            return (looks, proposer.finish(situation, progress));
        }
        looks.extend(searches.iter().map(|s| (s.look, s.expected.center().x, s.expected.center().y)));
        let found = searches.iter().filter_map(|s| Some((s, answer(s)?)));
        let best = found.max_by(|a, b| a.1.total_cmp(&b.1));
        progress.take(best.map(|(search, confidence)| Observation {
            search: search.clone(),
            measurement: Measurement::new(search.expected, confidence),
            finding: (),
        }));
    }
}

#[test]
fn the_prediction_moves_the_search_by_its_gain() {
    let prior = prior();
    for (gain, x) in [(1.0, 60.0), (0.0, 50.0), (0.3, 53.0)] {
        let mut proposer = proposer(SearchParams { prediction_gain: gain, ..SearchParams::default() });
        let (looks, found) = run(&mut proposer, &situation(&prior, TrackState::Tracking), |_| Some(0.9));
        assert_eq!(looks, [(Look::Near, x, 40.0)]);
        let search = found.unwrap().search;
        assert_eq!(search.expected.width(), 20.0);
        assert_eq!(search.region, prior.bbox.scaled(2.5));
        assert_eq!(search.gate.unwrap().covariance, prior.innovation_covariance.unwrap());
    }
}

#[test]
fn where_it_was_is_where_it_was_seen_last_or_settled() {
    let prior = prior();
    let mut proposer = proposer(SearchParams { prediction_gain: 0.0, ..SearchParams::default() });
    let near = |proposer: &mut Proposer, seen: bool| {
        run(proposer, &situation(&prior, TrackState::Tracking), |_| seen.then_some(0.9)).0[0].1
    };
    proposer.settle(&BBox::from_center_size(Point::new(70.0, 40.0), 4.0, 4.0));
    assert_eq!(near(&mut proposer, true), 70.0);
    assert_eq!(near(&mut proposer, false), 70.0);
    proposer.restart(&BBox::from_center_size(Point::new(20.0, 40.0), 4.0, 4.0));
    assert_eq!(near(&mut proposer, false), 20.0);
}

#[test]
fn a_lost_target_is_swept_for_window_by_window() {
    let prior = prior();
    let mut proposer = proposer(SearchParams { wide_windows: 3, ..SearchParams::default() });
    let lost = situation(&prior, TrackState::Lost);
    // Four columns and four rows, half windows apart; the sweep starts at its second window.
    let (looks, found) = run(&mut proposer, &lost, |s| Some(s.expected.center().x / 1000.0));
    let at = |i: f64, j: f64| (25.0 + 50.0 * i, 12.5 + 25.0 * j);
    let sweep = |i, j| (Look::Sweep, at(i, j).0, at(i, j).1);
    let centred = (Look::Centred, at(3.0, 0.0).0, at(3.0, 0.0).1);
    assert_eq!(looks, [sweep(1.0, 0.0), sweep(2.0, 0.0), sweep(3.0, 0.0), centred]);
    assert_eq!(found.unwrap().search.look, Look::Centred);
    let (looks, found) = run(&mut proposer, &lost, |_| None);
    assert_eq!(looks, [sweep(0.0, 1.0), sweep(1.0, 1.0), sweep(2.0, 1.0)]);
    assert_eq!(found, None);
    // All sixteen come once in as many looks.
    let mut seen: Vec<_> = (0..16).flat_map(|_| run(&mut proposer, &lost, |_| None).0).map(|l| (l.1, l.2)).collect();
    seen.sort_by(|a, b| a.partial_cmp(b).unwrap());
    seen.dedup();
    assert_eq!(seen.len(), 16);
}

#[test]
fn near_never_sweeps_and_whole_regions_are_searched_at_once() {
    let prior = prior();
    let mut near = proposer(SearchParams { model: SearchModel::Near, ..SearchParams::default() });
    let lost = situation(&prior, TrackState::Lost);
    assert_eq!(run(&mut near, &lost, |_| Some(0.9)).0, [(Look::Near, 60.0, 40.0)]);
    let mut wide = proposer(SearchParams::default());
    let at_once = Situation { view: None, ..lost };
    let (looks, found) = run(&mut wide, &at_once, |_| Some(0.9));
    assert_eq!(looks, [(Look::Sweep, 60.0, 40.0)]);
    let search = found.unwrap().search;
    assert_eq!((search.region, search.gate), (FRAME.bounds(), None));
}

#[test]
fn doubt_twice_in_a_row_makes_it_look_elsewhere() {
    let prior = prior();
    let seen = situation(&prior, TrackState::Tracking);
    let mut proposer = proposer(SearchParams { side_windows: 1, ..SearchParams::default() });
    let elsewhere = |far: f64| move |s: &Search| Some(if s.look == Look::Near { 0.5 } else { far });
    let count = |looks: &[(Look, f64, f64)]| looks.len();
    assert_eq!(count(&run(&mut proposer, &seen, elsewhere(0.9)).0), 1, "the frame before left no doubt");
    let (looks, found) = run(&mut proposer, &seen, elsewhere(0.7));
    assert_eq!(looks.iter().map(|l| l.0).collect::<Vec<_>>(), [Look::Near, Look::Sweep, Look::Centred]);
    assert_eq!(found.unwrap().search.look, Look::Near, "what is seen elsewhere is doubtful too");
    let (_, found) = run(&mut proposer, &seen, elsewhere(0.8));
    assert_eq!(found.unwrap().search.look, Look::Centred);
    assert_eq!(count(&run(&mut proposer, &seen, elsewhere(0.9)).0), 1, "that left no doubt");
    assert_eq!(count(&run(&mut proposer, &seen, |_| None).0), 1, "nothing near is the policy's business");
    let never = Situation { sure_from: 0.0, ..seen };
    assert_eq!(count(&run(&mut proposer, &never, elsewhere(0.9)).0), 1);
}

#[test]
fn more_may_be_asked_of_what_is_seen_elsewhere() {
    let prior = prior();
    let seen = situation(&prior, TrackState::Tracking);
    let mut proposer = proposer(SearchParams { side_windows: 1, side_from: 0.95, ..SearchParams::default() });
    let elsewhere = |far: f64| move |s: &Search| Some(if s.look == Look::Near { 0.5 } else { far });
    run(&mut proposer, &seen, elsewhere(0.9));
    let look = |found: Option<Observation<()>>| found.map(|f| f.search.look);
    assert_eq!(look(run(&mut proposer, &seen, elsewhere(0.94)).1), Some(Look::Near));
    assert_eq!(look(run(&mut proposer, &seen, elsewhere(0.95)).1), Some(Look::Centred));
}

#[test]
fn the_gate_reaches_as_far_as_the_covariance_says() {
    let prior = prior();
    let params = SearchParams { model: SearchModel::Gate, gate_chi2: 4.0, ..SearchParams::default() };
    let proposer = proposer(params);
    let region = proposer.neighbourhood(&situation(&prior, TrackState::Tracking));
    // Slack of 7 px, margin of 20 px.
    assert!((region.width() - (20.0 + 2.0 * (2.0 * 58.0_f64.sqrt() + 20.0))).abs() < 1e-9);
    assert!((region.height() - (20.0 + 2.0 * (2.0 * 53.0_f64.sqrt() + 20.0))).abs() < 1e-9);
    let unseen = proposer.neighbourhood(&situation(&prior, TrackState::Occluded));
    assert!((unseen.width() - (20.0 + 2.0 * (2.0 * 53.5_f64.sqrt() + 20.0))).abs() < 1e-9);
    let mut proposer = proposer;
    let (_, found) = run(&mut proposer, &situation(&prior, TrackState::Tracking), |_| Some(0.9));
    let gate = found.unwrap().search.gate.unwrap();
    assert!((gate.covariance[(0, 0)] - 58.0).abs() < 1e-9 && gate.chi2 == 4.0);
    let (looks, found) = run(&mut proposer, &situation(&prior, TrackState::Lost), |_| Some(0.9));
    assert_eq!(looks[0].0, Look::Sweep);
    assert_eq!(found.unwrap().search.gate, None);
}

#[test]
fn places_suggested_are_looked_at_while_the_target_is_out_of_sight() {
    let prior = prior();
    let place = BBox::from_center_size(Point::new(140.0, 30.0), 22.0, 24.0);
    let far = |s: &Search| Some(s.expected.center().x / 1000.0);
    let mut proposer = proposer(SearchParams::default());
    let (looks, found) = run_with(&mut proposer, &situation(&prior, TrackState::Tracking), &[place], far);
    assert_eq!(looks, [(Look::Near, 60.0, 40.0)], "in sight it is where it is seen");
    assert_eq!(found.unwrap().search.expected.width(), 20.0);
    let (looks, found) = run_with(&mut proposer, &situation(&prior, TrackState::Occluded), &[place], far);
    assert_eq!(looks, [(Look::Near, 140.0, 30.0), (Look::Near, 60.0, 40.0)]);
    let search = found.unwrap().search;
    assert_eq!((search.expected, search.region, search.gate), (place, place.scaled(2.5), None));
    let (looks, _) = run_with(&mut proposer, &situation(&prior, TrackState::Lost), &[place], far);
    assert_eq!(looks[0], (Look::Near, 140.0, 30.0));
    assert_eq!(looks[1].0, Look::Sweep);
}

#[test]
fn a_region_widens_while_the_target_is_unseen() {
    let prior = prior();
    let params = SearchParams {
        model: SearchModel::Widening,
        reach: 2.0,
        gate_chi2: 4.0,
        widening: WideningParams { growth_per_s: 10.0 },
        ..SearchParams::default()
    };
    let mut proposer = proposer(params);
    let whole = |state| Situation { view: None, ..situation(&prior, state) };
    let seen = run(&mut proposer, &whole(TrackState::Tracking), |_| Some(0.1));
    assert_eq!(seen.0, [(Look::Near, 60.0, 40.0)], "doubt does not lead to a second look");
    assert_eq!(seen.1.unwrap().search.region, prior.bbox.scaled(2.0));
    // Seen last at (50, 40) and expected at (60, 40): 50 x 40 px, and two deviations more.
    let first = run(&mut proposer, &whole(TrackState::Occluded), |_| Some(0.1)).1.unwrap().search.region;
    assert_eq!(first, BBox::from_ltwh(30.0 - 6.0, 20.0 - 4.0, 50.0 + 12.0, 40.0 + 8.0));
    // After 0.04 s ten sizes of 20 px a second are more than these.
    let second = run(&mut proposer, &whole(TrackState::Occluded), |_| Some(0.1)).1.unwrap().search.region;
    assert_eq!(second, BBox::from_ltwh(30.0 - 8.0, 20.0 - 8.0, 50.0 + 16.0, 40.0 + 16.0));
    // Once lost, all over.
    let lost = run(&mut proposer, &whole(TrackState::Lost), |_| Some(0.1));
    assert_eq!((lost.0[0].0, lost.1.unwrap().search.region), (Look::Sweep, FRAME.bounds()));
    // Seen again: as at first.
    run(&mut proposer, &whole(TrackState::Tracking), |_| Some(0.9));
    assert_eq!(run(&mut proposer, &whole(TrackState::Occluded), |_| Some(0.1)).1.unwrap().search.region, first);
}

#[test]
fn everywhere_is_one_look_at_the_frame_for_those_that_take_it_in() {
    let prior = prior();
    let mut proposer = proposer(SearchParams { model: SearchModel::Everywhere, ..SearchParams::default() });
    let all = Situation { view: None, ..situation(&prior, TrackState::Tracking) };
    for _ in 0..3 {
        let (looks, found) = run(&mut proposer, &all, |_| Some(0.1));
        assert_eq!((looks, found.unwrap().search.region), (vec![(Look::Near, 60.0, 40.0)], FRAME.bounds()));
    }
    let near = run(&mut proposer, &situation(&prior, TrackState::Tracking), |_| Some(0.9)).1;
    assert_eq!(near.unwrap().search.region, prior.bbox.scaled(2.5));
}

#[test]
fn a_find_must_hold_over_several_looks() {
    let prior = prior();
    let params = SearchParams { tentative: 2, news: 1.0, believe_at: 4.0, neutral: 0.0, ..SearchParams::default() };
    let mut proposer = proposer(params);
    let lost = situation(&prior, TrackState::Lost);
    // ln of 0.88 / 0.12 is 2: three looks make more than 4, and one or two do not.
    let confidences = [(); 3].map(|()| run(&mut proposer, &lost, |_| Some(0.88)).1.map(|f| f.measurement.confidence));
    assert!(confidences[0].unwrap() < 0.5 && confidences[2].unwrap() > 0.98, "{confidences:?}");
    // A second look at once, of a place of its own.
    let (looks, _) = run(&mut proposer, &lost, |_| Some(0.5));
    assert_eq!(looks[0].0, Look::Centred);
    assert!(looks.iter().any(|l| l.0 == Look::Sweep));
}

#[test]
fn a_place_that_shows_nothing_is_dropped() {
    let prior = prior();
    let params = SearchParams { tentative: 1, news: 1.0, believe_at: 4.0, ..SearchParams::default() };
    let mut proposer = proposer(params);
    let lost = situation(&prior, TrackState::Lost);
    run(&mut proposer, &lost, |_| Some(0.7));
    assert_eq!(run(&mut proposer, &lost, |_| Some(0.05)).0[0].0, Look::Centred);
    assert_eq!(run(&mut proposer, &lost, |_| None).0[0].0, Look::Sweep, "the place was dropped");
}

#[test]
fn doubt_that_lasts_looks_elsewhere_beside_following() {
    let prior = prior();
    let params = SearchParams { tentative: 1, news: 1.0, believe_at: 3.0, ..SearchParams::default() };
    let mut proposer = proposer(params);
    let doubted = Situation { elsewhere: true, ..situation(&prior, TrackState::Occluded) };
    let answer = |s: &Search| Some(if s.look == Look::Near { 0.4 } else { 0.9 });
    let (looks, found) = run(&mut proposer, &doubted, answer);
    assert_eq!((looks[0].0, found.unwrap().search.look), (Look::Near, Look::Near), "one look elsewhere is not enough");
    assert_eq!(run(&mut proposer, &doubted, answer).1.unwrap().search.look, Look::Centred);
}

#[test]
fn it_is_looked_for_as_large_as_it_was_whole() {
    let prior = prior();
    let mut proposer =
        proposer(SearchParams { whole_size: true, sizes: 3, wide_windows: 100, ..SearchParams::default() });
    for _ in 0..100 {
        proposer.sure(&BBox::from_ltwh(80.0, 30.0, 40.0, 20.0), FRAME);
        // Cut by the border: no size to remember.
        proposer.sure(&BBox::from_ltwh(0.0, 30.0, 10.0, 20.0), FRAME);
    }
    let lost = situation(&prior, TrackState::Lost);
    let mut widths = Vec::new();
    for _ in 0..4 {
        let (mut searches, mut progress) = (Vec::new(), Progress::<()>::default());
        proposer.propose(&lost, &[], &mut progress, &mut searches);
        widths.push(searches[searches.len() / 2].expected.width().round());
    }
    widths.dedup();
    assert!(widths.contains(&40.0) && widths.contains(&80.0) && widths.contains(&20.0), "{widths:?}");
}

#[test]
fn a_hurried_pass_starts_where_it_was_last() {
    let prior = prior();
    let params = SearchParams { whole_size: true, wide_windows: 1, pass_frames: 4, ..SearchParams::default() };
    let mut proposer = proposer(params);
    proposer.settle(&BBox::from_center_size(Point::new(190.0, 10.0), 20.0, 20.0));
    let lost = situation(&prior, TrackState::Lost);
    let mut looks = Vec::new();
    (0..4).for_each(|_| looks.extend(run(&mut proposer, &lost, |_| None).0));
    let distance = |l: &LookAt| Point::new(l.1, l.2).distance(Point::new(190.0, 10.0));
    assert!(looks.len() >= 16 && distance(&looks[0]) < 60.0, "{looks:?}");
}
