//! VOT's masks (from 2020 on): `m` and left, top, width, height of a rectangle, then the lengths of its runs, row by row.

use super::{Mask, MaskError, runs};

impl Mask {
    /// As VOT's result files have it: `m` and left, top, width and height of the rectangle about it, then lengths alternately of unset
    /// and set pixels, row by row, parted by commas. An empty one is an unset pixel.
    pub fn to_vot(&self) -> String {
        let Some([left, top, right, bottom]) = self.window() else { return "m0,0,1,1,1".to_owned() };
        let place = [left, top, right - left, bottom - top].map(u64::from);
        let lengths = runs::lengths(&self.spans, [left, top, right, bottom]);
        let numbers: Vec<String> = place.into_iter().chain(lengths).map(|n| n.to_string()).collect();
        format!("m{}", numbers.join(","))
    }

    /// The mask of such a text. Pixels left of or above the image are left out.
    ///
    /// # Errors
    /// [`MaskError`] for a rectangle that is too large or too far off and text that is damaged.
    pub fn from_vot(text: &str) -> Result<Self, MaskError> {
        let fail = |problem: String| MaskError::text("VOT", text, problem);
        let numbers = text.trim().strip_prefix('m').ok_or_else(|| fail("it does not begin with `m`".to_owned()))?;
        let mut numbers = numbers.split(',').map(|n| {
            let n = n.trim();
            n.parse::<i64>().map_err(|_| format!("`{n}` is no whole number"))
        });
        let mut place = [0_i64; 4];
        for value in &mut place {
            *value = numbers.next().ok_or_else(|| fail("it has no rectangle".to_owned()))?.map_err(fail)?;
        }
        let [left, top, width, height] = place;
        let size = |side: i64| u64::try_from(side).map_err(|_| fail("its rectangle has a side below 0".to_owned()));
        let (width, height) = (size(width)?, size(height)?);
        if [left, top].iter().any(|v| v.unsigned_abs() > Self::MOST_SIDE as u64) {
            return Err(fail("its rectangle is too far off".to_owned()));
        }
        let lengths = numbers.map(|n| n.and_then(|n| u64::try_from(n).map_err(|_| format!("the run {n} is below 0"))));
        let spans = runs::spans([left, top], [width, height], lengths).map_err(fail)?;
        Ok(Self { spans })
    }
}
