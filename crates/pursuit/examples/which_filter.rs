//! Prints the tables of `docs/guide/which-filter.md`: filters against motions.

fn main() -> Result<(), pursuit::RunError> {
    print!("{}", pursuit::reproduce::which_filter(500)?);
    Ok(())
}
