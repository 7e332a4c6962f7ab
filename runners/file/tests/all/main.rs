//! Tests of files, in one program; what counts allocations is another.

mod bad_buildings;
mod bad_meshes;
mod files;
mod hostile_rooms;
mod parts;
mod systems;
