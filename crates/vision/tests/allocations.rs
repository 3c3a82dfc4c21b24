//! After warm-up the kernels allocate nothing.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use pursuit_geometry::{BBox, Point};
use pursuit_imaging::Image;
use pursuit_vision::background::{BackgroundModel, Learning, Mog2, Mog2Params, TemporalMedian, TemporalMedianParams};
use pursuit_vision::flow::dense::{DenseFlow, DenseFlowParams, FlowField, RefinementParams};
use pursuit_vision::flow::{
    GoodFeatures, GoodFeaturesParams, LucasKanade, LucasKanadeParams, MedianFlow, MedianFlowParams, Pyramid,
};
use pursuit_vision::global_motion::{PhaseCorrelation, SparseMotion, SparseMotionParams};
use pursuit_vision::integral::IntegralImage;

fn picture(n: usize) -> Image<u8> {
    Image::from_fn(160, 120, |x, y| ((x + n) * (x + n) / 7 + y * 5 + ((x + n) * y) / 11) as u8).unwrap()
}

/// Two rounds to warm up, one in which nothing may be allocated.
fn allocates_nothing(name: &str, mut work: impl FnMut(usize)) {
    work(0);
    work(1);
    let count = allocation_counter::measure(|| work(2)).count_total;
    assert_eq!(count, 0, "{name}");
}

#[test]
fn nothing_is_allocated_from_frame_to_frame() {
    let pictures = [0, 1, 2, 3].map(picture);
    let mut pyramids = [Pyramid::of(pictures[0].view(), 4).unwrap(), Pyramid::of(pictures[1].view(), 4).unwrap()];
    let mut lk = LucasKanade::new(LucasKanadeParams::default()).unwrap();
    let mut median = MedianFlow::new(MedianFlowParams::default()).unwrap();
    let mut sparse = SparseMotion::new(SparseMotionParams::default()).unwrap();
    let mut phase = PhaseCorrelation::new(160);
    let (points, mut tracks) = ([Point::new(30.0, 40.0), Point::new(2.0, 3.0)], Vec::new());
    allocates_nothing("flow", |n| {
        pyramids[0].build(pictures[n].view(), 4).unwrap();
        pyramids[1].build(pictures[n + 1].view(), 4).unwrap();
        let [from, to] = &pyramids;
        lk.track(from, to, &points, &mut tracks).unwrap();
        median.estimate(from, to, &BBox::from_ltwh(50.0, 40.0, 40.0, 30.0)).unwrap().ok();
        sparse.estimate(from, to, &[]).unwrap();
        phase.estimate(from, to).unwrap();
    });
    let refinement = RefinementParams { rounds: 1, ..RefinementParams::default() };
    let mut dense = DenseFlow::new(DenseFlowParams { refinement, ..DenseFlowParams::default() }).unwrap();
    let mut field = FlowField::zero(pictures[0].size()).unwrap();
    allocates_nothing("dense flow", |n| {
        let [from, to] = &mut pyramids;
        from.build(pictures[n].view(), 4).unwrap();
        to.build(pictures[n + 1].view(), 4).unwrap();
        dense.estimate(from, to, &mut field).unwrap();
    });
    let mut corners = GoodFeatures::new(GoodFeaturesParams::default()).unwrap();
    // The same picture: how many candidates there are in one differs.
    allocates_nothing("corners", |_| assert!(!corners.find(pictures[0].view(), &[]).is_empty()));
    let mut integral = IntegralImage::new();
    allocates_nothing("integral", |n| integral.build(pictures[n].view()));
    let params = TemporalMedianParams { samples: 2, every: 1, threshold: 20 };
    let models: [Box<dyn BackgroundModel<u8>>; 2] =
        [Box::new(Mog2::new(Mog2Params::default()).unwrap()), Box::new(TemporalMedian::new(params).unwrap())];
    for mut model in models {
        let mut mask = Image::filled(160, 120, 0).unwrap();
        allocates_nothing("a background model", |n| {
            model.apply(pictures[n].view(), &Learning::default(), &mut mask).unwrap();
        });
    }
}
