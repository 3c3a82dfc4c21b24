use clap::Args;
use pursuit::{Resize, RunError};

/// Which part of the picture is looked at, and at what size.
#[derive(Debug, Args)]
pub struct View {
    /// Look at this part of the picture alone; boxes and points given and written stay those of the whole picture
    #[arg(long, value_name = "L,T,W,H")]
    region: Option<String>,
    /// Bring pictures to this size before they are looked at: WIDTHxHEIGHT or a factor; boxes and points stay those of the input
    #[arg(long, value_name = "SIZE", allow_negative_numbers = true)]
    resize: Option<String>,
}

impl View {
    /// Left, top, width and height of the part.
    pub fn region(&self) -> Result<Option<[f64; 4]>, RunError> {
        self.region.as_deref().map(|text| numbers(text, "--region")).transpose()
    }

    /// The size.
    pub fn resize(&self) -> Result<Option<Resize>, RunError> {
        self.resize.as_deref().map(str::parse).transpose()
    }
}

/// `N` numbers between commas.
pub fn numbers<const N: usize>(text: &str, what: &str) -> Result<[f64; N], RunError> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|n| n.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    numbers
        .and_then(|n| n.try_into().ok())
        .ok_or_else(|| RunError::usage(format!("{what} `{text}` is not {N} finite numbers between commas")))
}
