//! Tests of files, in one program; what counts allocations is another.

mod bad_buildings;
mod bad_meshes;
mod files;
mod hostile_rooms;
mod parts;
mod systems;

/// Whether `FREDHOLM_LONG` asks for all that there is, and not for a day's share of it.
fn is_long() -> bool {
    std::env::var_os("FREDHOLM_LONG").is_some()
}
