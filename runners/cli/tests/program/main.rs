//! The program, as a person or a script runs it.

mod adjoint;
mod bands;
mod choice;
mod colours;
mod commands;
mod common;
mod cube;
mod decks;
mod diagnose;
mod domains;
mod drawings;
mod export;
mod heat;
mod hostile;
mod interruption;
mod joint;
mod manual;
mod parts;
mod photometry;
mod rates;

mod refusals;
mod render;
mod room;
mod scene;
mod scene_factors;
mod schema;
mod sequences;
mod solve;
mod sphere;
mod split;
mod systems;
mod terminal;
mod theory;
mod verify;
mod whole;
