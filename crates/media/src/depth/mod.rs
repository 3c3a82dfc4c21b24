//! Depth images beside the picture: how their numbers are to be read, which belongs to which frame, and how they are moved
//! into the picture of another camera.

mod alignment;
mod coding;
mod pairing;
mod registration;
mod with_folder;

pub use coding::DepthCoding;
pub use pairing::{Pairing, PairingFacts};
pub use registration::Registration;
pub use with_folder::WithDepthFolder;

pub(crate) use pairing::pair;

use crate::input::fault::Fault;
use crate::input::image::read_image;
use crate::{MediaError, Result};
use alignment::Alignment;
use pursuit_geometry::Size;
use pursuit_imaging::{CameraPose, Frame, Image, Lens, Pixels};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How depth images are to be read; what is absent is found out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DepthOptions {
    /// What the numbers mean; found out from the first images unless given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coding: Option<DepthCoding>,
    /// Of the picture's camera: focal lengths and principal point, `[fx, fy, cx, cy]` in pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intrinsics: Option<[f64; 4]>,
    /// Of the depth camera, where depth has to be moved into the picture (registered); needs `intrinsics`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_intrinsics: Option<[f64; 4]>,
    /// Where the picture's camera has what the depth camera has at its origin, `[x, y, z]` in millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset_mm: Option<[f64; 3]>,
    /// Depth lies on the picture: it is not looked at whether it does. Without this and without intrinsics of the depth
    /// camera, folders of images of one size are looked at, and what evidently lies elsewhere is moved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub registered: Option<bool>,
}

/// What was found out about a source's depth, for the record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DepthFacts {
    /// What the numbers mean.
    pub coding: DepthCoding,
    /// Whether that was found out from the images, not said.
    pub coding_detected: bool,
    /// Which depth image belongs to which frame.
    #[serde(flatten)]
    pub pairing: PairingFacts,
    /// Whether depth is moved into the picture.
    pub registered: bool,
    /// Whether that, and how, was found out from the images, not said.
    pub registration_detected: bool,
    /// Focal lengths and principal point of the picture's camera, in pixels, where they are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intrinsics: Option<[f64; 4]>,
}

/// Reads depth images as options say.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DepthReader {
    coding: DepthCoding,
    registration: Option<Registration>,
    /// Whether the registration was found out.
    found: bool,
    lens: Option<Lens>,
}

/// The lens that four numbers are; the error names the option.
fn lens(option: &str, numbers: [f64; 4]) -> Result<Lens> {
    let [fx, fy, cx, cy] = numbers;
    Lens::intrinsics(fx, fy, cx, cy).map_err(|e| MediaError::unreadable(option, e.to_string()))
}

/// Whether the depth image lies as in the TUM RGB-D benchmark and what follows it (ICL-NUIM, Bonn): in a folder beside the
/// lists `depth.txt` and `rgb.txt`.
fn lies_as_tum(image: &Path) -> bool {
    let sequence = image.parent().and_then(Path::parent);
    sequence.is_some_and(|folder| folder.join("depth.txt").is_file() && folder.join("rgb.txt").is_file())
}

impl DepthReader {
    /// A reader for the depth images `files`; the first few tell their coding, unless it is said.
    ///
    /// # Errors
    /// Intrinsics that no lens has.
    pub(crate) fn new<'a>(options: &DepthOptions, mut files: impl Iterator<Item = &'a Path>) -> Result<Self> {
        let own = options.intrinsics.map(|n| lens("the intrinsics of the picture's camera", n)).transpose()?;
        let depths = options.depth_intrinsics.map(|n| lens("the intrinsics of the depth camera", n)).transpose()?;
        let registration = match (depths, own) {
            (Some(from), Some(to)) => Some(Registration::new(from, to, options.offset_mm.unwrap_or_default())?),
            (Some(_), None) => {
                let reason = "say also those of the picture's camera, into which depth is to be moved";
                return Err(MediaError::unreadable("the intrinsics of the depth camera", reason));
            }
            (None, _) => None,
        };
        let coding = match options.coding {
            Some(coding) => coding,
            None => {
                let mut first = files.by_ref().take(8).peekable();
                // Distances in a room are plausible in millimetres and in fifths of one: the lists beside the folder tell.
                let by_layout = first.peek().is_some_and(|path| lies_as_tum(path));
                // An image without data tells nothing, and one that cannot be read breaks off at its own frame.
                let looked = || first.filter_map(|path| read_raw(path).ok());
                let found = match by_layout {
                    true => Some(DepthCoding::FifthMillimetres),
                    false => looked().find_map(|image| DepthCoding::detect(image.as_slice())),
                };
                found.unwrap_or(DepthCoding::Millimetres)
            }
        };
        Ok(Self { coding, registration, found: false, lens: own })
    }

    /// Looks at some of the pictures and depth images `rows` whether depth lies on the picture, unless that is said, and moves it
    /// if it evidently does not. What cannot be read breaks off at its own frame.
    pub(crate) fn align(mut self, options: &DepthOptions, rows: &[(&Path, &Path)], size: Size) -> Result<Self> {
        if options.registered == Some(true) || self.registers() {
            return Ok(self);
        }
        let apart = rows.len().div_ceil(alignment::PAIRS).max(1);
        let images: Vec<(Frame, Image<u16>)> = rows
            .iter()
            .step_by(apart)
            .filter_map(|(picture, depth)| {
                let frame = Frame::new(0, 0.0, read_image(picture).ok()?);
                let depth = self.coding.decode(read_raw(depth).ok()?);
                (frame.size() == size && depth.size() == size).then_some((frame, depth))
            })
            .collect();
        if let Some(found) = Alignment::find(images.iter().map(|(frame, depth)| (frame.gray(), depth.view()))) {
            tracing::info!("depth does not lie on the picture; it is moved: {found:?}");
            (self.registration, self.found) = (Some(found.registration(size)?), true);
        }
        Ok(self)
    }

    /// Whether depth is moved into the picture, so that its images may have another size.
    pub(crate) const fn registers(&self) -> bool {
        self.registration.is_some()
    }

    /// The facts, with those of the pairing.
    pub(crate) fn facts(&self, options: &DepthOptions, pairing: PairingFacts) -> DepthFacts {
        DepthFacts {
            coding: self.coding,
            coding_detected: options.coding.is_none(),
            pairing,
            registered: self.registers(),
            registration_detected: self.found,
            intrinsics: options.intrinsics,
        }
    }

    /// `frame` with the depth image `path`, in millimetres, and its camera's lens.
    pub(crate) fn add(&self, frame: Frame, path: Option<&Path>) -> std::result::Result<Frame, Fault> {
        let frame = match self.lens.map(|lens| CameraPose::new(frame.time_s(), 0.0, 0.0, lens)) {
            Some(Ok(pose)) if frame.camera().is_none() => frame.with_camera(pose),
            _ => frame,
        };
        let Some(path) = path else { return Ok(frame) };
        let raw = self.coding.decode(read_raw(path)?);
        let (size, own) = (raw.size(), frame.size());
        let depth = match &self.registration {
            Some(registration) => registration.apply(raw.view(), own)?,
            None => raw,
        };
        frame.with_depth(depth).map_err(|_| {
            Fault::malformed(format!(
                "the depth image is {size} pixels, its frame {own}; say the intrinsics of both cameras, so that depth is \
                 moved into the picture"
            ))
        })
    }
}

/// A 16-bit grey image as it is stored.
fn read_raw(path: &Path) -> std::result::Result<Image<u16>, Fault> {
    match read_image(path)? {
        Pixels::Gray16(image) => Ok(image.to_image()),
        _ => Err(Fault::malformed("a depth image must be a 16-bit grey PNG; this one has 8 bits or colour")),
    }
}
