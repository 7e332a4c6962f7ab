//! Radiosity along all surfaces, with its error band.

use fredholm::Partitioned;
use fredholm::numbers::short;
use fredholm::room::{Beside, FieldRequest, RoomModel};
use fredholm_plot::{Piece, ProfilePlot};

use super::output::{number_or_nothing, root_mean_square};
use super::room::{field, stretches};
use super::{Content, Cut, Drawn, Format, Picturing};
use crate::failure::Failure;
use crate::table;

/// About so many points in all.
const POINTS: f64 = 600.0;
/// Walks for a point where nothing else is asked.
const WALKS: u64 = 1000;

/// The figure or its table, and what is said of it.
pub(crate) fn content(
    picturing: &Picturing<'_>,
    room: &RoomModel,
    cells: &dyn Partitioned<'_>,
) -> Result<Content, Cut> {
    let args = picturing.args;
    let (surfaces, scene) = (room.surfaces(), room.scene());
    let geometry = scene.geometry();
    let walls = geometry.walls();
    let total: f64 = walls.iter().map(|wall| wall.length).sum();
    let of = |(wall, length): (usize, f64)| {
        let count = (POINTS * length / total).round().max(3.0) as u32;
        (0..count).map(move |k| Piece {
            wall,
            from: f64::from(k) / f64::from(count),
            to: f64::from(k + 1) / f64::from(count),
            pixels: 1,
        })
    };
    let lengths = walls.iter().map(|wall| wall.length).enumerate();
    let pieces: Vec<Piece> = lengths.flat_map(of).collect();
    let walk = picturing.walk(WALKS);
    let progress = picturing.progress(&walk, pieces.len() as u64);
    let request = FieldRequest {
        positions: &[],
        stretches: &stretches(&pieces),
        walk: &walk,
        beside: Beside::Nothing,
    };
    let (field, _) = field(picturing, room, &request, &progress)?;

    let mut along = ProfilePlot {
        title: "radiosity along the surfaces".to_owned(),
        label: if surfaces.heat { "u in W/m²" } else { "u" }.to_owned(),
        pieces: vec![Vec::new(); walls.len()],
        surfaces: Vec::new(),
        length: total,
    };
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(["surface", "s", "x", "y", "u", "std_error"])
        .map_err(Failure::run)?;
    let (mut before, mut last) = (0.0, None);
    for (number, wall) in walls.iter().enumerate() {
        let surface = scene.place(number).map(|place| place.surface);
        let name = surface.and_then(|surface| surfaces.names.get(surface));
        if let Some(name) = name.filter(|_| surface != last) {
            along.surfaces.push((name.clone(), before));
        }
        last = surface;
        let own = pieces.iter().zip(&field.walls);
        for (piece, spot) in own.filter(|(piece, _)| piece.wall == number) {
            let fraction = piece.middle();
            let s = before + fraction * wall.length;
            let [a, b] = wall.ends;
            let [x, y] = [0, 1].map(|k| a[k] + fraction * (b[k] - a[k]));
            along.pieces[number].push((s, spot.value, spot.error));
            let numbers = [s, x, y, spot.value, spot.error].map(number_or_nothing);
            let name = name.cloned().unwrap_or_default();
            let record = [name].into_iter().chain(numbers);
            csv.write_record(record).map_err(Failure::run)?;
        }
        before += wall.length;
    }
    let noise = root_mean_square(&field.walls);
    let text = if args.common.json {
        table::json(&serde_json::json!({
            "points": pieces.len(), "cells": cells.unknowns(), "walks": walk.walks,
            "std_error": noise, "seconds": field.seconds,
        }))?
    } else {
        format!(
            "{} points on {} surfaces; {} walks {}, RMS standard error {}, {:.1} s\n",
            pieces.len(),
            surfaces.names.len(),
            walk.walks,
            if args.global {
                "for all of them"
            } else {
                "a point"
            },
            noise.map_or("unknown".to_owned(), short),
            field.seconds
        )
    };
    let drawn = match picturing.format {
        Format::Csv => Drawn::Table(csv.into_inner().map_err(Failure::run)?),
        _ => Drawn::Figure(Box::new(along.draw().map_err(Failure::run)?)),
    };
    Ok(Content {
        drawn,
        errors: None,
        text,
    })
}
