//! A camera by a clip of a board: a chessboard or a ChArUco board, moved about before the camera.

use crate::RunError;
use pursuit_measuring::camera::{BoardView, FoundCamera};
use pursuit_media::Source;
use serde::Serialize;
use std::str::FromStr;

/// What is shown to the camera.
#[derive(Debug, Clone, PartialEq)]
pub enum Board {
    /// A chessboard of any number of squares.
    Chessboard,
    /// A ChArUco board, as OpenCV makes them.
    Charuco {
        /// How many squares it has across.
        columns: u32,
        /// How many it has down.
        rows: u32,
        /// Its dictionary, as OpenCV calls it.
        dictionary: String,
        /// How long the side of a marker is against that of a square, in (0, 1].
        marker: f32,
    },
}

impl FromStr for Board {
    type Err = RunError;

    /// # Errors
    /// [`RunError::Usage`] for anything but `chessboard` and `charuco:COLUMNSxROWS:DICTIONARY:MARKER`.
    fn from_str(text: &str) -> Result<Self, RunError> {
        let wrong = || {
            RunError::usage(format!(
                "`{text}` is no board; give chessboard, or charuco:COLUMNSxROWS:DICTIONARY:MARKER with the marker's side against the square's, for example charuco:7x5:DICT_4X4_50:0.7"
            ))
        };
        if text == "chessboard" {
            return Ok(Self::Chessboard);
        }
        let parts: Vec<&str> = text.strip_prefix("charuco:").ok_or_else(wrong)?.split(':').collect();
        let [size, dictionary, marker] = parts[..] else { return Err(wrong()) };
        let (columns, rows) = size.split_once('x').ok_or_else(wrong)?;
        let number = |text: &str| text.parse().ok().filter(|n| (2..=200).contains(n)).ok_or_else(wrong);
        let marker = marker.parse().ok().filter(|share| *share > 0.0 && *share <= 1.0).ok_or_else(wrong)?;
        Ok(Self::Charuco { columns: number(columns)?, rows: number(rows)?, dictionary: dictionary.to_owned(), marker })
    }
}

/// A camera that was found in a clip.
#[derive(Debug, Clone, Serialize)]
pub struct FoundInClip {
    /// The camera, and how well it is known.
    #[serde(flatten)]
    pub found: FoundCamera,
    /// Frames that were looked at.
    pub frames: usize,
    /// Those of them that show the board.
    pub seen: usize,
    /// The frames that the camera was found by.
    pub used: Vec<u64>,
}

/// Frames of a clip that are looked at, about.
const LOOKED_AT: u64 = 240;
/// Of a clip whose length is not known, each of so many is.
const EVERY: u64 = 5;
/// Views that the camera is found by at most: those that differ most.
const MOST_VIEWS: usize = 30;
/// A view whose points are off by so many times as much as those of others is no good.
const OFF: f64 = 3.0;

/// Finds the camera that took a clip of a board.
///
/// # Errors
/// [`RunError::Usage`] of a build without the feature `board`, for a dictionary that there is not, and where the board is seen in too
/// few frames or always alike; an input that cannot be read.
pub fn camera_of(source: &mut dyn Source, board: &Board) -> Result<FoundInClip, RunError> {
    let size = source.info().input_size();
    let every = source.info().frame_count.map_or(EVERY, |count| count.div_ceil(LOOKED_AT).max(1));
    let detector = detector::Detector::new(board)?;
    let (mut frames, mut views) = (0, Vec::new());
    while let Some(frame) = source.next_frame()? {
        if frame.index() % every == 0 {
            frames += 1;
            views.extend(detector.view(&frame).map(|view| (frame.index(), view)));
        }
    }
    let seen = views.len();
    let chosen = most_different(views, [size.width as f64, size.height as f64]);
    let (mut used, mut chosen): (Vec<u64>, Vec<BoardView>) = chosen.into_iter().unzip();
    let picture = [size.width, size.height];
    let failed = |error: pursuit_measuring::MeasuringError| {
        RunError::usage(format!("{error} ({frames} frames were looked at, the board is seen in {seen})"))
    };
    let mut found = pursuit_measuring::Camera::from_board(&chosen, picture).map_err(failed)?;
    let good = within(&found.views_rms_px);
    if good.contains(&false) && good.iter().filter(|good| **good).count() >= MOST_VIEWS / 3 {
        let mut keep = good.iter();
        used.retain(|_| keep.next() == Some(&true));
        let mut keep = good.iter();
        chosen.retain(|_| keep.next() == Some(&true));
        found = pursuit_measuring::Camera::from_board(&chosen, picture).map_err(failed)?;
    }
    Ok(FoundInClip { found, frames, seen, used })
}

/// Which views are as good as the others.
fn within(rms: &[f64]) -> Vec<bool> {
    let mut sorted = rms.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.get(sorted.len() / 2).copied().unwrap_or_default();
    rms.iter().map(|rms| *rms <= OFF * middle).collect()
}

/// Those views that differ most in where and how the board is seen, in order of their frames.
fn most_different(views: Vec<(u64, BoardView)>, size: [f64; 2]) -> Vec<(u64, BoardView)> {
    let looks: Vec<[f64; 5]> = views.iter().map(|(_, view)| look(view, size)).collect();
    let apart = |a: &[f64; 5], b: &[f64; 5]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let mut far = vec![f64::INFINITY; views.len()];
    let mut chosen = Vec::new();
    while chosen.len() < MOST_VIEWS.min(views.len()) {
        let next = (0..far.len()).max_by(|a, b| far[*a].total_cmp(&far[*b])).unwrap_or_default();
        chosen.push(next);
        for (distance, one) in far.iter_mut().zip(&looks) {
            *distance = distance.min(apart(one, &looks[next]));
        }
        far[next] = f64::NEG_INFINITY;
    }
    chosen.sort_unstable();
    let mut views: Vec<Option<(u64, BoardView)>> = views.into_iter().map(Some).collect();
    chosen.into_iter().filter_map(|i| views[i].take()).collect()
}

/// Where the board is, how large across and down, and how aslant: in shares of the picture.
fn look(view: &BoardView, [width, height]: [f64; 2]) -> [f64; 5] {
    let n = view.points.len() as f64;
    let mean = |of: &dyn Fn(&[f64; 4]) -> f64| view.points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p[0]), mean(&|p| p[1]));
    let (xx, yy) = (mean(&|p| (p[0] - x).powi(2)).sqrt(), mean(&|p| (p[1] - y).powi(2)).sqrt());
    let aslant = mean(&|p| (p[0] - x) * (p[1] - y)) / (xx * yy).max(1e-9);
    [x / width, y / height, 2.0 * xx / width, 2.0 * yy / height, 0.5 * aslant]
}

#[cfg(not(feature = "board"))]
mod detector {
    use super::{Board, BoardView, RunError};
    use pursuit_imaging::Frame;

    /// None is built in.
    pub(super) struct Detector(std::convert::Infallible);

    impl Detector {
        pub fn new(_: &Board) -> Result<Self, RunError> {
            Err(RunError::usage(
                "this build cannot find boards in pictures; build with `--features board`, or calibrate with OpenCV and give its file with --camera",
            ))
        }

        pub fn view(&self, _: &Frame) -> Option<BoardView> {
            match self.0 {}
        }
    }
}

#[cfg(feature = "board")]
mod detector {
    use super::{Board, BoardView, RunError};
    use calib_targets_charuco::{CharucoBoardSpec, CharucoDetector, CharucoParams, resolve_dictionary};
    use calib_targets_chessboard::{
        ChessboardDetector, ChessboardParams, GrayImageView, default_chess_config, detect_corners,
    };
    use pursuit_geometry::Point;
    use pursuit_imaging::{Frame, ImageView};
    use pursuit_vision::corner::{Sharp, sharpened};
    use std::collections::HashMap;

    /// Fewer corners are no view of a board.
    const LEAST: usize = 12;
    /// Around a corner the picture is looked at within this share of the distance to the next, and these bounds in pixels.
    const NEAR: (f64, [f64; 2]) = (0.35, [2.0, 8.0]);
    /// A corner that is found farther away was none, pixels.
    const FAR: f64 = 1.5;

    pub(super) enum Detector {
        Chessboard(ChessboardDetector),
        Charuco(Box<CharucoDetector>),
    }

    /// A corner: where it is seen and which it is.
    type Corner = (Point, [i32; 2]);

    impl Detector {
        pub fn new(board: &Board) -> Result<Self, RunError> {
            match board {
                Board::Chessboard => {
                    let detector = ChessboardDetector::new(ChessboardParams::default());
                    detector.map(Self::Chessboard).map_err(|e| RunError::usage(e.to_string()))
                }
                Board::Charuco { columns, rows, dictionary, marker } => {
                    let known = resolve_dictionary(dictionary).ok_or_else(|| {
                        RunError::usage(format!(
                            "there is no dictionary `{dictionary}`; give one of OpenCV's, for example DICT_4X4_50"
                        ))
                    })?;
                    let spec = CharucoBoardSpec::new(*rows, *columns, 1.0, *marker, known);
                    let detector = CharucoDetector::new(CharucoParams::for_board(spec));
                    detector.map(|d| Self::Charuco(Box::new(d))).map_err(|e| RunError::usage(e.to_string()))
                }
            }
        }

        /// The board in a frame, its corners to a fraction of a pixel.
        pub fn view(&self, frame: &Frame) -> Option<BoardView> {
            let gray = frame.gray();
            let copy;
            let data = match gray.as_contiguous() {
                Some(data) => data,
                None => {
                    copy = gray.to_image();
                    copy.as_slice()
                }
            };
            let image = GrayImageView { width: gray.width(), height: gray.height(), data };
            let corners = self.corners(&image);
            let corners: HashMap<[i32; 2], Point> = corners.into_iter().map(|(at, which)| (which, at)).collect();
            let points = corners.iter().filter_map(|(which, at)| point(gray, &corners, *which, *at));
            let mut points: Vec<[f64; 4]> = points.collect();
            // In one order whatever the order of a map is.
            points.sort_by(|a, b| a[3].total_cmp(&b[3]).then(a[2].total_cmp(&b[2])));
            (points.len() >= LEAST).then_some(BoardView { points })
        }

        /// The library's first pixel has its middle at 0.
        fn corners(&self, image: &GrayImageView<'_>) -> Vec<Corner> {
            let at = |x: f32, y: f32| Point::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            match self {
                Self::Chessboard(detector) => {
                    let found = detector.detect(&detect_corners(image, &default_chess_config()));
                    let corners = found.into_iter().flat_map(|board| board.corners);
                    corners.map(|c| (at(c.position.x, c.position.y), [c.grid.u, c.grid.v])).collect()
                }
                Self::Charuco(detector) => {
                    let corners = detector.detect(image).into_iter().flat_map(|board| board.corners);
                    corners.map(|c| (at(c.position.x, c.position.y), [c.grid.u, c.grid.v])).collect()
                }
            }
        }
    }

    /// A corner where the picture is sharpest, and its place on the board, in squares.
    fn point(
        gray: ImageView<'_, u8>,
        corners: &HashMap<[i32; 2], Point>,
        [u, v]: [i32; 2],
        at: Point,
    ) -> Option<[f64; 4]> {
        let beside = [[u + 1, v], [u - 1, v], [u, v + 1], [u, v - 1]];
        let next = beside.iter().filter_map(|which| corners.get(which)).map(|other| other.distance(at));
        let next = next.fold(f64::INFINITY, f64::min);
        let (share, [least, most]) = NEAR;
        let Some(Sharp::Corner(sharp)) = sharpened(gray, at, (share * next).clamp(least, most)) else { return None };
        (sharp.distance(at) <= FAR).then(|| [sharp.x, sharp.y, f64::from(u), f64::from(v)])
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    #[test]
    fn boards_are_read() {
        assert_eq!("chessboard".parse::<Board>().unwrap(), Board::Chessboard);
        let charuco = "charuco:7x5:DICT_4X4_50:0.7".parse::<Board>().unwrap();
        let wanted = Board::Charuco { columns: 7, rows: 5, dictionary: "DICT_4X4_50".into(), marker: 0.7 };
        assert_eq!(charuco, wanted);
        for bad in ["", "chess", "charuco:7x5", "charuco:7:DICT_4X4_50:0.7", "charuco:1x5:D:0.7", "charuco:7x5:D:1.2"] {
            let error = bad.parse::<Board>().unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains("charuco:7x5"), "{bad}: {error}");
        }
    }

    #[test]
    fn views_that_differ_are_chosen() {
        let view = |x: f64| BoardView { points: vec![[x, 10.0, 0.0, 0.0], [x + 20.0, 30.0, 1.0, 1.0]] };
        let many = (0..100).map(|k| (k, view(if k < 98 { 50.0 } else { 9.0 * k as f64 }))).collect();
        let chosen: Vec<u64> = most_different(many, [1000.0, 100.0]).into_iter().map(|v| v.0).collect();
        assert!(chosen.len() == MOST_VIEWS && chosen.ends_with(&[98, 99]) && chosen.is_sorted(), "{chosen:?}");
        assert_eq!(within(&[0.1, 0.12, 0.11, 0.5]), [true, true, true, false]);
    }

    #[test]
    #[cfg(not(feature = "board"))]
    fn a_build_without_it_says_so() {
        let mut source = crate::open("scene:drift?duration=1").unwrap();
        let error = camera_of(&mut *source, &Board::Chessboard).unwrap_err();
        assert!(error.to_string().contains("--features board"), "{error}");
    }
}
