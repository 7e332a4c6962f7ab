//! Tests of models of scenes, in one program.

mod coverage;
mod roads;

/// Whether `FREDHOLM_LONG` asks for all that there is, and not for a day's share of it.
fn is_long() -> bool {
    std::env::var_os("FREDHOLM_LONG").is_some()
}
