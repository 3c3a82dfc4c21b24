//! Arrays of numpy as frames, in place where their layout allows.

use crate::errors::{InputError, of_imaging, of_run, usage};
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pursuit::Frame;
use pursuit::imaging::{Image, Pixels, Rgb8, SharedImage};
use pyo3::prelude::*;
use pyo3::types::PyString;
use std::path::PathBuf;

/// Pixels of an array of numpy, which lives as long as this does.
struct Borrowed<P> {
    first: *const P,
    len: usize,
    _array: Py<PyAny>,
}

// SAFETY: the array is kept alive by `_array`, whose reference count pyo3 guards wherever it is dropped; its memory does not
// move while it is referenced. Nothing is written through `first`.
#[allow(unsafe_code, reason = "memory of numpy is reached by its address")]
unsafe impl<P: Sync> Send for Borrowed<P> {}
// SAFETY: as above; all access through it is shared.
#[allow(unsafe_code, reason = "memory of numpy is reached by its address")]
unsafe impl<P: Sync> Sync for Borrowed<P> {}

impl<P> AsRef<[P]> for Borrowed<P> {
    #[allow(unsafe_code, reason = "memory of numpy is reached by its address")]
    fn as_ref(&self) -> &[P] {
        // SAFETY: `shared` has seen that `len` pixels from `first` on lie within the array, aligned for `P`. Whoever writes
        // into an array while a tracker looks at it changes what is seen, as with every library on numpy.
        unsafe { std::slice::from_raw_parts(self.first, self.len) }
    }
}

/// How the bytes of an array are laid out: rows, columns, and bytes from one row to the next.
struct Layout {
    height: usize,
    width: usize,
    row_bytes: usize,
}

/// The layout of an array whose pixels of `pixel_bytes` follow each other without gaps and whose rows ascend; none of others.
fn layout(array: &Bound<'_, PyUntypedArray>, channels: usize, channel_bytes: usize) -> Option<Layout> {
    let (shape, strides) = (array.shape(), array.strides());
    let (height, width) = (*shape.first()?, *shape.get(1)?);
    let pixel_bytes = channels * channel_bytes;
    let row_bytes = usize::try_from(*strides.first()?).ok()?;
    let dense = strides.get(1).is_some_and(|s| *s == pixel_bytes as isize || width == 1)
        && strides.get(2).is_none_or(|s| *s == channel_bytes as isize || channels == 1);
    (dense && row_bytes % pixel_bytes == 0 && row_bytes >= width * pixel_bytes).then_some(Layout {
        height,
        width,
        row_bytes,
    })
}

/// An image over the memory of `array`, of `P` pixels of `channels` values of type `E`.
fn shared<E: numpy::Element + Copy, P: Copy + Send + Sync + 'static>(
    array: &Bound<'_, PyArrayDyn<E>>,
    channels: usize,
    copied: impl FnOnce(&[E], usize, usize) -> pursuit::imaging::Result<Image<P>>,
) -> PyResult<SharedImage<P>> {
    let (height, width) = (array.shape()[0], array.shape()[1]);
    if height == 0 || width == 0 {
        return Err(InputError::new_err(format!("the frame has shape {:?}, it is empty", array.shape())));
    }
    if let Some(layout) = layout(array.as_untyped(), channels, size_of::<E>())
        && (array.data() as usize).is_multiple_of(align_of::<P>())
    {
        let stride = layout.row_bytes / size_of::<P>();
        let len = (layout.height - 1) * stride + layout.width;
        let buffer = Borrowed { first: array.data() as *const P, len, _array: array.clone().into_any().unbind() };
        return SharedImage::from_buffer(buffer, layout.width, layout.height, stride).map_err(|e| of_imaging(&e));
    }
    let values = array.try_readonly().map_err(|e| usage(format!("the frame is being written: {e}")))?;
    let values: Vec<E> = values.as_array().iter().copied().collect();
    Ok(copied(&values, width, height).map_err(|e| of_imaging(&e))?.into())
}

/// Triples in the order `R, G, B`.
fn triples(values: &[u8], swap: bool) -> Vec<Rgb8> {
    let (triples, _) = values.as_chunks::<3>();
    if swap { triples.iter().map(|[b, g, r]| [*r, *g, *b]).collect() } else { triples.to_vec() }
}

/// The array as pixels. `channels` says in which order colours come: `rgb` or `bgr`.
fn pixels(array: &Bound<'_, PyAny>, channels: &str) -> PyResult<Pixels> {
    let swap = match channels {
        "rgb" => false,
        "bgr" => true,
        other => return Err(usage(format!("channels `{other}`: give \"rgb\" or \"bgr\""))),
    };
    if let Ok(array) = array.cast::<PyArrayDyn<u8>>() {
        match *array.shape() {
            [_, _] | [_, _, 1] => return Ok(shared(array, 1, |v, w, h| Image::from_vec(v.to_vec(), w, h))?.into()),
            [_, _, 3] if !swap => {
                return Ok(shared(array, 3, |v, w, h| Image::from_vec(triples(v, false), w, h))?.into());
            }
            [height, width, 3] => return bgr(array, width, height),
            _ => {}
        }
    } else if let Ok(array) = array.cast::<PyArrayDyn<u16>>()
        && let [_, _] | [_, _, 1] = *array.shape()
    {
        return Ok(shared(array, 1, |v, w, h| Image::from_vec(v.to_vec(), w, h))?.into());
    }
    Err(InputError::new_err(format!(
        "a frame is an array of uint8, (height, width) or (height, width, 3), or of uint16, (height, width), not {}",
        describe(array)
    )))
}

/// Colours in the other order are copied.
fn bgr(array: &Bound<'_, PyArrayDyn<u8>>, width: usize, height: usize) -> PyResult<Pixels> {
    let readonly = array.try_readonly().map_err(|e| usage(format!("the frame is being written: {e}")))?;
    let colors = match readonly.as_slice() {
        Ok(values) => triples(values, true),
        Err(_) => triples(&readonly.as_array().iter().copied().collect::<Vec<_>>(), true),
    };
    Ok(Image::from_vec(colors, width, height).map_err(|e| of_imaging(&e))?.into())
}

/// What an object is, for messages.
pub fn describe(object: &Bound<'_, PyAny>) -> String {
    match object.cast::<PyUntypedArray>() {
        Ok(array) => format!("of {} with shape {:?}", array.dtype(), array.shape()),
        Err(_) => object.get_type().name().map_or_else(|_| "this".to_owned(), |name| format!("{name}")),
    }
}

/// The pixels of a file, as the command reads them.
fn read(path: PathBuf) -> PyResult<Pixels> {
    let missing = || InputError::new_err(format!("{} holds no picture", path.display()));
    let mut source = pursuit::open(path.as_os_str().to_owned()).map_err(|e| of_run(&e))?;
    let frame = source.next_frame().map_err(|e| of_run(&e.into()))?.ok_or_else(missing)?;
    Ok(frame.pixels().clone())
}

/// A frame of the array, or of a picture's path, and of depth in millimetres where there is some.
pub fn frame(
    index: u64,
    time_s: f64,
    array: &Bound<'_, PyAny>,
    depth_mm: Option<&Bound<'_, PyAny>>,
    channels: &str,
) -> PyResult<Frame> {
    if !time_s.is_finite() {
        return Err(usage(format!("time_s is {time_s}; give seconds, or leave it out")));
    }
    let pixels = match array.cast::<PyUntypedArray>() {
        Err(_) if array.is_instance_of::<PyString>() || array.hasattr("__fspath__")? => read(array.extract()?)?,
        _ => pixels(array, channels)?,
    };
    let frame = Frame::new(index, time_s, pixels);
    let Some(depth) = depth_mm else { return Ok(frame) };
    let depth = match depth.cast::<PyArrayDyn<u16>>() {
        Ok(depth) if depth.ndim() == 2 => depth,
        _ => {
            return Err(InputError::new_err(format!(
                "depth is an array of uint16, (height, width), in millimetres, 0 where there is none, not {}",
                describe(depth)
            )));
        }
    };
    let depth = shared(depth, 1, |v, w, h| Image::from_vec(v.to_vec(), w, h))?;
    frame.with_depth(depth).map_err(|e| of_imaging(&e))
}
