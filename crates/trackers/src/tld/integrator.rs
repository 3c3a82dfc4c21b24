//! How what was followed and what was detected become one answer (kalal2012, section 5.6).

use super::cascade::{Candidate, Cascade, Knowledge};
use super::clusters::{Cluster, Clusters, mean};
use super::params::TldParams;
use super::trust::Trust;
use crate::appearance::Similarity;
use pursuit_geometry::{BBox, Size};
use pursuit_imaging::ImageView;

/// Where points went, and how well they agree on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Followed {
    /// A window, which may be larger than the target.
    pub window: BBox,
    /// Median correlation of the points' patches.
    pub correlation: f64,
    /// Median forward-backward error, in window sizes.
    pub error: f64,
}

/// What follower and detector agreed on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Joined {
    /// A window, which may be larger than the target.
    pub window: BBox,
    pub similarity: Similarity,
    /// Conservative similarity once the window was put right, where that was looked at.
    pub aligned: Option<f64>,
    /// Whether the trajectory goes on being trusted.
    pub valid: bool,
    /// How it was followed there; none: it was detected.
    pub followed: Option<Followed>,
    /// Whether follower and detector agree.
    pub agreed: bool,
}

/// What the integrator goes by.
#[derive(Debug)]
pub(super) struct Integrator<'a> {
    pub known: Knowledge<'a>,
    pub trust: &'a Trust,
    /// Whether the similarity of what was followed is kept to compare others with.
    pub compares: bool,
}

impl Integrator<'_> {
    /// Joins where the points went, if they agree, and what the scan done last found in `gray`.
    pub fn join(
        &self,
        gray: ImageView<'_, u8>,
        followed: Option<Followed>,
        cascade: &mut Cascade,
        clusters: &mut Clusters,
    ) -> Option<Joined> {
        let (params, known) = (self.known.params, &self.known);
        let (form, integrator) = (params.neighbor.similarity, &params.integrator);
        cascade.judge(gray, known);
        let followed = followed.and_then(|f| {
            let (window, similarity) = cascade.refine(gray, known, &params.refine, &f.window);
            self.is_plausible(&window, &similarity, gray.size()).then_some((Followed { window, ..f }, similarity))
        });
        let detections = detections(cascade.candidates(), params);
        let clusters = clusters.of(detections, form, integrator.same_from);
        let detected = |cascade: &mut Cascade, cluster: &Cluster| {
            let (window, similarity) = cascade.refine(gray, known, &params.refine, &cluster.bbox);
            let like = self.aligned(gray, cascade, &window);
            let aligned = Some(like);
            let joined = Joined { window, similarity, aligned, valid: false, followed: None, agreed: false };
            self.trust.is_as_before(like, &params.neighbor).then_some(joined)
        };
        let Some((followed, similarity)) = followed else {
            return detected(cascade, outstanding(clusters, params)?);
        };
        let window = followed.window;
        let sure = similarity.conservative(form);
        let better = |c: &Cluster| {
            c.bbox.iou(&window) < integrator.elsewhere && c.similarity.conservative(form) > sure + integrator.better
        };
        if let Some(other) = outstanding(clusters, params).filter(|c| better(c)) {
            return detected(cascade, other);
        }
        let near = || detections.iter().map(|d| d.window).filter(|w| w.iou(&window) > integrator.near);
        let agreed = near().next().is_some();
        if !agreed && self.trust.unseen_s > params.neighbor.patience_s {
            return None;
        }
        let all = near().map(|w| (w, 1.0)).chain([(window, integrator.followed_weight)]);
        let window = mean(all).unwrap_or(window);
        let valid = (self.trust.valid || sure > params.neighbor.valid) && sure >= params.neighbor.invalid;
        let aligned = self.compares.then(|| self.aligned(gray, cascade, &window));
        Some(Joined { window, similarity, aligned, valid, followed: Some(followed), agreed })
    }

    /// Conservative similarity of what is at `window`, once that was put right.
    fn aligned(&self, gray: ImageView<'_, u8>, cascade: &mut Cascade, window: &BBox) -> f64 {
        let params = self.known.params;
        let (_, similarity) = cascade.refine(gray, &self.known, &params.align, window);
        similarity.conservative(params.neighbor.similarity)
    }

    /// Whether the target may be at `window`, where the points went: enough of that is in the frame, the detector has windows
    /// of about that size, and it resembles the target at all.
    fn is_plausible(&self, window: &BBox, similarity: &Similarity, frame: Size) -> bool {
        let (params, grid) = (self.known.params, self.known.grid);
        let inside = window.clipped_to(frame).map_or(0.0, |b| b.area() / window.area());
        let beyond = params.neighbor.beyond;
        let of_a_size = match (grid.scales().first(), grid.scales().last()) {
            (Some(least), Some(most)) => {
                window.width() * beyond >= least.width as f64 && window.width() <= beyond * most.width as f64
            }
            _ => true,
        };
        let sure = similarity.conservative(params.neighbor.similarity);
        inside >= params.neighbor.inside && of_a_size && sure >= params.neighbor.followed
    }
}

/// The group that resembles the object most, unless another resembles it nearly as much: places that look alike are none.
fn outstanding<'a>(clusters: &'a [Cluster], params: &TldParams) -> Option<&'a Cluster> {
    let sure = |c: &Cluster| c.similarity.conservative(params.neighbor.similarity);
    let best = clusters.iter().max_by(|a, b| sure(a).total_cmp(&sure(b)))?;
    let rivals = clusters.iter().filter(|c| sure(c) >= sure(best) - params.neighbor.margin).count();
    (rivals == 1).then_some(best)
}

/// The candidates that the classifier takes for the object; they come first.
fn detections<'a>(candidates: &'a [Candidate], params: &TldParams) -> &'a [Candidate] {
    let (form, threshold) = (params.neighbor.similarity, params.neighbor.threshold);
    let count = candidates.iter().take_while(|c| c.similarity.relative(form) > threshold).count();
    candidates.get(..count).unwrap_or_default()
}
