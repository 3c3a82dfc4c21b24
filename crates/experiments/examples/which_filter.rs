//! Prints the tables of `docs/guide/which-filter.md`: filters against motions.

fn main() -> Result<(), pursuit_experiments::ExperimentError> {
    print!("{}", pursuit_experiments::which_filter(500)?);
    Ok(())
}
