use crate::detectors::motion::MotionDetectorParams;
use crate::detectors::objects::ObjectsParams;

pursuit_parameters::parameters! {
    /// Parameters of the detector of objects that move.
    pub struct MovingObjectsParams {
        /// The network is asked in one of so many frames, and only where something stands out or is followed.
        pub every: usize = 10, in 1..=100_000, unit "frames", source "ours";
        /// Overlap (IoU) from which on a region, an object and a target are the same.
        pub agree: f64 = 0.3, in above(0.0).at_most(1.0), source "ours";
        /// An object of which a lesser share stands out of the background does not move: it is none of ours unless it is followed.
        pub out: f64 = 0.2, in 0.0..=1.0, source "ours";
        /// A region in which this share of each of several objects lies is divided among them where the network was asked.
        pub inside: f64 = 0.7, in above(0.0).at_most(1.0), source "ours";
        /// What the network confirmed holds for so many further answers in which it is missed.
        pub patience: usize = 2, in 0..=1000, unit "answers", source "ours";
        /// What the confidence in a region that the network has not confirmed is worth, unless it is followed.
        pub unconfirmed: f64 = 0.49, in 0.0..=1.0, source "ours";
        /// What proposes.
        pub motion: MotionDetectorParams = MotionDetectorParams::default();
        /// What confirms and names.
        pub objects: ObjectsParams = ObjectsParams::default();
    }
}
