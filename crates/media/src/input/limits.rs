use super::fault::Fault;
use pursuit_containers::limits;
use pursuit_geometry::Size;
use pursuit_imaging::Image;

pub use pursuit_containers::limits::MAX_PIXELS;
pub(crate) use pursuit_containers::limits::MAX_SAMPLE_BYTES;

// What the containers let through fits into an image.
const _: () = assert!(limits::MAX_SIDE == Image::<u8>::MAX_SIDE);

/// Refuses sizes from a header that nobody could mean, before anything is allocated for them.
pub(crate) fn check_size(width: u64, height: u64) -> Result<Size, Fault> {
    let limits::Extent { width, height } = limits::check_size(width, height)?;
    Ok(Size::new(width, height))
}
