//! Credentials of an input that are kept elsewhere.

use crate::args::Credentials;
use pursuit::RunError;
use pursuit::media::Locator;

/// The input with the credentials that are kept elsewhere.
///
/// # Errors
/// [`RunError::Usage`] where there are none in the place that is named.
#[allow(clippy::disallowed_methods, reason = "the variable that the user names")]
pub fn with_credentials(input: Locator, kept: &Credentials) -> Result<Locator, RunError> {
    let (text, place) = match (&kept.credentials_env, &kept.credentials_file) {
        (Some(name), _) => (std::env::var(name).map_err(|e| e.to_string()), format!("the variable {name}")),
        (None, Some(path)) => {
            (std::fs::read_to_string(path).map_err(|e| e.to_string()), format!("the file {}", path.display()))
        }
        (None, None) => return Ok(input),
    };
    let text =
        text.map_err(|e| RunError::usage(format!("no credentials in {place}: {e}; it should hold USER:PASSWORD")))?;
    match text.lines().next().and_then(|line| line.trim_end().split_once(':')) {
        Some((user, password)) => Ok(input.with_credentials(user, password)),
        None => Err(RunError::usage(format!("no credentials in {place}: its first line is not USER:PASSWORD"))),
    }
}
