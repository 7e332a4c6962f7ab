//! Every crate and runner, beside the matrix: in one program, so that what they share is compiled once.

mod circle;
mod circle_degrees;
mod circle_properties;
mod circle_walks;
mod coverage;
mod cube;
mod cube_degrees;
mod embedded;
mod kit;
mod long;
mod pairs_theory;
mod rayon;
mod room;
mod room_degrees;
mod room_factors;
mod room_rates;
mod room_rays;
mod room_scene;
mod room_seen;
mod room_tables;
mod setup;
mod template;
mod toy;
mod variance;
mod variance_quantities;
mod work;
