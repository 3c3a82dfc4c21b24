use crate::geometry::{FieldsOfView, Lens};
use pursuit_geometry::BBox;

pursuit_parameters::parameters! {
    /// How the zoom is driven: by the target's size, and by how uncertain its place will be.
    #[derive(Copy)]
    pub struct ZoomParams {
        /// How much of the picture the target shall fill, its height or its width, whichever fills more.
        pub target_fraction: f64 = 0.4, in above(0.0).at_most(1.0);
        /// How many standard deviations of the predicted place must stay in view, or of how far heads were off the target of late
        /// where that is more: a target that surprises is seen wider until it no longer does.
        pub sigmas: f64 = 3.0, in 0.0..=100.0;
        /// Which part of half the picture may be used for that.
        pub margin: f64 = 0.6, in above(0.0).at_most(1.0);
        /// How far the angle of view may be off before the zoom moves, as a fraction.
        pub tolerance: f64 = 0.15, in 0.0..=10.0;
    }
}

impl ZoomParams {
    /// The tangent of half the horizontal angle of view that suits a box seen through `lens`, whose predicted place has a
    /// standard deviation of `sigma_deg`.
    fn wanted_tangent(&self, bbox: &BBox, lens: &Lens, sigma_deg: f64) -> f64 {
        let (half_x, _) = lens.half_fov_deg();
        let tangent = half_x.to_radians().tan();
        let size = lens.size();
        let fills = (bbox.width() / size.width as f64).max(bbox.height() / size.height as f64);
        let by_size = tangent * fills / self.target_fraction;
        let half_target = tangent * bbox.width() / size.width as f64;
        let by_place = ((self.sigmas * sigma_deg).min(80.0).to_radians().tan() + half_target) / self.margin;
        by_size.max(by_place)
    }

    /// The zoom to make for, or `None` where the present one will do.
    pub(super) fn goal(
        &self,
        views: &FieldsOfView,
        zoom: f64,
        bbox: &BBox,
        lens: &Lens,
        sigma_deg: f64,
    ) -> Option<f64> {
        let wanted = self.wanted_tangent(bbox, lens, sigma_deg);
        let goal = views.zoom_of(wanted.atan().to_degrees());
        let tangent = |zoom: f64| views.half_fov_x_deg(zoom).to_radians().tan();
        let off = (tangent(goal) / tangent(zoom)).ln().abs();
        (off.is_finite() && off > self.tolerance.ln_1p()).then_some(goal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::FieldOfView;
    use pursuit_geometry::{Point, Size};

    fn views() -> FieldsOfView {
        let entry = |zoom, half_fov_x_deg| FieldOfView { zoom, half_fov_x_deg };
        FieldsOfView::new(vec![entry(0.0, 30.0), entry(1.0, 2.0)]).unwrap()
    }

    fn goal(params: &ZoomParams, zoom: f64, width: f64, height: f64, sigma_deg: f64) -> Option<f64> {
        let lens = views().lens(zoom, Size::new(640, 360)).unwrap();
        let bbox = BBox::from_center_size(Point::new(320.0, 180.0), width, height);
        params.goal(&views(), zoom, &bbox, &lens, sigma_deg)
    }

    #[test]
    fn the_target_is_brought_to_its_size() {
        let params = ZoomParams::default();
        // 36 of 360 pixels, wanted 0.4: the tangent shrinks to a quarter.
        let zoom = goal(&params, 0.0, 20.0, 36.0, 0.0).unwrap();
        let expected = views().zoom_of((30f64.to_radians().tan() / 4.0).atan().to_degrees());
        assert!((zoom - expected).abs() < 1e-12, "{zoom} {expected}");
        // A wide target is judged by its width.
        let zoom = goal(&params, 0.0, 128.0, 36.0, 0.0).unwrap();
        let expected = views().zoom_of((30f64.to_radians().tan() / 2.0).atan().to_degrees());
        assert!((zoom - expected).abs() < 1e-12, "{zoom} {expected}");
    }

    #[test]
    fn near_enough_is_left_alone() {
        let params = ZoomParams::default();
        assert_eq!(goal(&params, 0.5, 20.0, 144.0, 0.0), None);
        assert_eq!(goal(&params, 0.5, 20.0, 160.0, 0.0), None);
        assert!(goal(&params, 0.5, 20.0, 170.0, 0.0).unwrap() < 0.5);
        assert!(goal(&params, 0.5, 20.0, 120.0, 0.0).unwrap() > 0.5);
    }

    #[test]
    fn an_uncertain_place_keeps_the_view_wide() {
        let params = ZoomParams::default();
        let sure = goal(&params, 0.0, 10.0, 36.0, 0.1).unwrap();
        let unsure = goal(&params, 0.0, 10.0, 36.0, 2.0).unwrap();
        assert!(unsure < sure);
        let half = views().half_fov_x_deg(unsure);
        let expected = (6f64.to_radians().tan() + 30f64.to_radians().tan() * 10.0 / 640.0) / 0.6;
        assert!((half.to_radians().tan() - expected).abs() < 1e-9);
        assert_eq!(goal(&params, 0.0, 10.0, 36.0, 1e9), None, "at the wide end already");
    }
}
